"""All estimators and all their stages side by side, and against C: ``python benchmarks/bench_estimators.py``.

One run, 1024x768, float32, the papers' settings. A row is an estimator as ``estimate`` runs it, or one of its stages,
the kernel calls alone; beside it the same loops in C (baselines/*.c, gcc -O3 -march=native, OpenMP; a second build
with -ffp-contract=off must give lfssao's bits) on the same arrays, an estimator's on copies, and a copy of as many
bytes as the arrays have. All take turns; median and quartiles. The first calls, which compile or load, are a table of
their own: an empty NUMBA_CACHE_DIR shows what compiling takes. In C, tables and memory are ready before, and samples
outside the texture are not counted. The third table is of textures that fit a core's cache: a stage that is faster
there, against C, than in the others is bound by memory in those. ``--cpu`` takes processor time of one thread, for a
machine that others use too. JSON and a picture.
"""

import argparse
import ctypes
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numpy as np
from c_baselines import compile_baselines
from estimator_plots import plot
from kernel_baselines import BASELINES
from limits import LIMITS
from settings import RADIUS, SETTINGS, SMALL, Setting, Views, gallery, relief
from stages import Arrays, Call, bytes_moved, copying, differing, in_c, interleaved, ours, recorded

from lfssao import Occluders, builtin_scene, ray_cast_occlusion
from lfssao.ao.ground_truth import INTERSECTORS
from lfssao.rendering.manifest import describe_machine
from lfssao.rendering.settings import diagonal

FOLDER = Path(__file__).parent

Libraries = tuple[ctypes.CDLL, ctypes.CDLL]
Variants = dict[str, Callable[[], object]]


def stages_of(setting: Setting, calls: list[Call], listed: set[str]) -> dict[str, list[Call]]:
    """The calls of one setting by stage, of the stages not listed yet."""
    found: dict[str, list[Call]] = {}
    for call in calls:
        found.setdefault(call.baseline.label, []).append(call)
    new = {label: own for label, own in found.items() if label not in listed or label in setting.again}
    return {f"{label} ({setting.name})" if label in setting.again else label: own for label, own in new.items()}


def rows_of(views: Views, libraries: Libraries, first: dict[str, float]) -> tuple[dict[str, Variants], dict[str, int]]:
    """The variants of every row, and the bytes of their arrays; C is held to our bits. first: seconds, out."""
    listed: set[str] = set()
    rows: dict[str, Variants] = {}
    sizes: dict[str, int] = {}
    for setting in SETTINGS:
        with recorded(BASELINES) as calls:
            setting.run(views)
        if wrong := differing(calls, libraries[1]):
            raise SystemExit(f"{setting.name}: C without contraction does not give lfssao's bits in {', '.join(wrong)}")
        for call in calls:
            first.setdefault(call.kernel.__name__, call.seconds)
        if setting.whole:
            rows[setting.name] = {"lfssao": partial(setting.run, views), "C": in_c(calls, Arrays(calls), libraries[0])}
            sizes[setting.name] = bytes_moved(calls)
        for label, own in stages_of(setting, calls, listed).items():
            arrays = Arrays(own)  # the same for both: where memory happens to lie is up to a fifth of a short pass
            rows[label] = {"lfssao": ours(own, arrays), "C": in_c(own, arrays, libraries[0])}
            sizes[label] = bytes_moved(own)
        listed |= {call.baseline.label for call in calls}
    return rows, sizes


def bench(
    views: Views, libraries: Libraries, repeats: int, clock: Callable[[], float], first: dict[str, float]
) -> dict:
    rows, sizes = rows_of(views, libraries, first)
    runs = {(name, who): run for name, variants in rows.items() for who, run in variants.items()}
    runs |= {(name, "copy"): copying(size, libraries[0]) for name, size in sizes.items()}
    times = interleaved(runs, repeats, clock)
    megapixels = views.module.depth.size / 1e6
    table = {}
    print(f"  {'':40s} {'ms / Mpixel':>20s} {'C':>8s} {'C / lfssao':>20s} {'copy':>6s}")
    for name in rows:
        own, c, copy = (times[name, who] for who in ("lfssao", "C", "copy"))
        row = {"ms_per_megapixel": quartiles(own / megapixels), "c_ms_per_megapixel": quartiles(c / megapixels)}
        row |= {"c_ratio": quartiles(c / own), "copy_share": float(np.median(copy / own))}
        row |= {"gigabytes_per_second": 1e-6 * sizes[name] / float(np.median(own))}
        limit = next((text for start, text in LIMITS.items() if name.startswith(start)), "")
        row |= {"limit": limit if row["c_ratio"][1] < 3 else ""}
        a = row["ms_per_megapixel"]
        b = row["c_ratio"]
        print(
            f"  {name:40s} {a[1]:7.2f} [{a[0]:.2f}, {a[2]:.2f}]".ljust(64)
            + f"{row['c_ms_per_megapixel'][1]:8.2f} {b[1]:7.2f} [{b[0]:.2f}, {b[2]:.2f}]".ljust(30)
            + f"{row['copy_share']:6.0%}  {row['limit']}"
        )
        table[name] = row
    return table


def quartiles(values: np.ndarray) -> list[float]:
    return [float(q) for q in np.percentile(values, [25, 50, 75])]


def truth(repeats: int, clock: Callable[[], float]) -> dict[str, Any]:
    """How fast rays find the truth on the first scene, the same through our tree and through Embree; how far apart."""
    mesh = builtin_scene()
    cast = partial(
        ray_cast_occlusion, Occluders(mesh), gallery().module, RADIUS * diagonal(mesh), rounds=(2, 2), strata=2
    )
    runs = {name: partial(cast, intersector=name) for name in INTERSECTORS}
    tree, embree = (run() for run in runs.values())
    times = interleaved(runs, repeats, clock)
    rays = int(tree.rays.sum())
    there = tree.rays > 0
    row: dict[str, Any] = {f"{name}_ns_a_ray": quartiles(1e6 * times[name] / rays) for name in runs}
    row |= {"tree_over_embree": quartiles(times["tree"] / times["embree"])}
    apart = np.sqrt(np.mean((tree.texture - embree.texture)[there] ** 2))
    print(
        f"ray-cast truth, {rays} rays: {row['tree_ns_a_ray'][1]:.0f} ns a ray through the tree, "
        f"{row['embree_ns_a_ray'][1]:.0f} through Embree, {row['tree_over_embree'][1]:.1f} times as fast; "
        f"RMSE between them {apart:.1e}"
    )
    return row | {"rays": rays, "triangles": len(mesh.faces), "rmse": float(apart)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--cpu", action="store_true")
    parser.add_argument("--json", type=Path, default=FOLDER / "results" / "estimators.json")
    options = parser.parse_args()
    threads = 1 if options.cpu else options.threads
    clock = time.thread_time if options.cpu else time.perf_counter
    numba.set_num_threads(threads)
    machine = {"machine": describe_machine(threads, sys.argv), "load_average": os.getloadavg(), "cpu": options.cpu}
    result: dict[str, Any] = {**machine, "tables": {}}
    first: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        libraries = tuple(compile_baselines(Path(folder), threads, *more) for more in ((), ("-ffp-contract=off",)))
        scenes = {"gallery": gallery(), "relief": relief(), "relief, small": relief(*SMALL)}
        for name, views in scenes.items():
            seen = [float(np.isfinite(b.depth).mean()) for b in (views.module, views.camera)]
            print(f"{name}: {seen[0]:.0%} of the module's texels see a surface, {seen[1]:.0%} of the camera's")
            result["tables"][name] = bench(views, libraries, options.repeats, clock, first)
        result["truth"] = truth(max(options.repeats // 4, 1), clock)
    result["first_call_seconds"] = first
    print("first calls, s: " + ", ".join(f"{name} {seconds:.2f}" for name, seconds in first.items()))
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))
    plot(json.loads(options.json.read_text()), options.json.with_suffix(".png"))


if __name__ == "__main__":
    main()
