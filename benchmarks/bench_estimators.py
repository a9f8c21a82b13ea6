"""The estimators side by side, and against C: ``python benchmarks/bench_estimators.py``, JSON beside the table.

One run, 1024x768, float32, 2 threads, every kernel and its peer in turn: the median of milliseconds per megapixel, and
of the turns' ratios C / lfssao with their quartiles. The settings are the papers'. Peers are the loops of
estimators.c, by gcc -O3 -march=native; a second build with -ffp-contract=off must give lfssao's bits. Viewing
directions, tables and pyramids are made once before: what is timed is the kernel. An estimator is added as a
function of a ``Case`` to ``ENTRIES``: it gives our run, and the C function's name and arguments, or None without one.
"""

import argparse
import ctypes
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba
import numpy as np

from lfssao import Buffers, builtin_scene, find_display, module_views
from lfssao.estimators.surroundings import Surroundings, ball_mirrors, disk_turns
from lfssao.estimators.volumetric import _disk, _normalised
from lfssao.kernels.elementary import sincospi
from lfssao.kernels.horizon import horizon_occlusion
from lfssao.kernels.volumetric_lines import line_occlusion
from lfssao.kernels.volumetric_points import point_occlusion
from lfssao.manifest import describe_machine
from lfssao.raycast import RayCaster
from lfssao.rendering import diagonal
from lfssao.samples import repulsion_table

SOURCE = Path(__file__).with_name("estimators.c")
FLOAT = np.dtype(np.float32)


@dataclass
class Case:
    """Textures of one module, a radius in world units, and room for the results."""

    near: Surroundings
    radius: float

    def __post_init__(self) -> None:
        self.occlusion = np.empty_like(self.near.depth)
        self.outside = np.empty(len(self.near.depth), np.int64)


Peer = tuple[str, list[Any]]
Entry = Callable[[Case], tuple[Callable[[], None], Peer | None]]


def gallery() -> Case:
    """The default scene in the default display; a fiftieth of its diagonal as the radius."""
    mesh = builtin_scene()
    view = module_views(mesh, find_display("virtual"))[0]
    gbuffer = RayCaster(mesh, view.cast_from_world).gbuffer(view, normals="geometric")
    return Case(Surroundings.of(Buffers.of(gbuffer, view)), 0.02 * diagonal(mesh))


def relief() -> Case:
    """A wavy sheet that fills the texture, so that no texel can be skipped."""
    view = find_display("virtual").view(0, np.diag([1.0, 1.0, -1.0, 0.0])[:3])
    j, i = np.mgrid[0:768, 0:1024]
    x, y = (i + 0.5 - 512) / 1024, (384 - j - 0.5) / 1024
    z = 0.05 * np.sin(40 * x) * np.sin(30 * y)
    positions = np.stack([x * (0.7 + z) / 0.7, y * (2.0 - z) / 2.0, z], axis=-1).astype(FLOAT)
    slopes = np.stack([-2 * np.cos(40 * x) * np.sin(30 * y), -1.5 * np.sin(40 * x) * np.cos(30 * y), 1 + 0 * x], -1)
    normals = (slopes / np.linalg.norm(slopes, axis=-1, keepdims=True)).astype(FLOAT)
    return Case(Surroundings.of(Buffers(view, (-z).astype(FLOAT), positions, normals)), 0.02)


def first_arguments(case: Case) -> list[Any]:
    near = case.near
    arrays = [near.depth, near.positions, near.directions, near.normals, near.rows, near.lens, near.right]
    return [near.depth.shape[1], near.depth.shape[0], *arrays, FLOAT.type(case.radius)]


def lines(n: int) -> Entry:
    def entry(case: Case) -> tuple[Callable[[], None], Peer]:
        near, table = case.near, repulsion_table("disk", n)
        disk, half, _, hidden = (a.astype(FLOAT) for a in _disk(table.points, table.weights, False))
        turns = disk_turns(True, 0, FLOAT)

        def run() -> None:
            line_occlusion(
                near.depth, near.positions, near.directions, near.normals, False, near.kind, near.rows, near.lens,
                near.right, FLOAT.type(case.radius), turns, disk, half, hidden, FLOAT.type(np.inf), case.occlusion,
                case.outside,
            )  # fmt: skip

        return run, ("vo_lines", [*first_arguments(case), turns, n, disk, half, hidden])

    return entry


def points(n: int) -> Entry:
    def entry(case: Case) -> tuple[Callable[[], None], Peer]:
        near, table = case.near, repulsion_table("ball", n)
        ball, weights = table.points.astype(FLOAT), _normalised(table.weights).astype(FLOAT)
        mirrors = ball_mirrors(True, 0, FLOAT)

        def run() -> None:
            point_occlusion(
                near.depth, near.positions, near.directions, near.normals, False, near.kind, near.rows, near.lens,
                FLOAT.type(case.radius), mirrors, ball, weights, FLOAT.type(np.inf), case.occlusion, case.outside,
            )  # fmt: skip

        return run, ("vo_points", [*first_arguments(case), mirrors, n, ball, weights])

    return entry


def horizons(case: Case) -> tuple[Callable[[], None], Peer]:
    near, n, steps = case.near, 8, 8
    around = np.array([sincospi((2 * k + 1) / n)[::-1] for k in range(n)]).astype(FLOAT)
    turns, (zero, one) = disk_turns(True, 0, FLOAT), FLOAT.type([0, 1])

    def run() -> None:
        horizon_occlusion(
            near.depth, near.positions, near.directions, near.normals, near.kind, near.rows, near.lens, near.right,
            FLOAT.type(case.radius), turns, around, steps, zero, one, zero, one, case.occlusion, case.outside,
        )  # fmt: skip

    return run, ("hbao", [*first_arguments(case), turns, n, around, steps])


ENTRIES: dict[str, Entry] = {
    "vo-lines, 5": lines(5),
    "vo-lines, 9": lines(9),
    "vo-points, 12": points(12),
    "vo-points, 33": points(33),
    "hbao, 8 x 8": horizons,
}


def compile_peers(folder: Path, *options: str) -> ctypes.CDLL:
    library = folder / f"peers{len(options)}.so"
    command = ["gcc", "-O3", "-march=native", "-fopenmp", "-shared", "-fPIC", *options]
    subprocess.run([*command, "-o", str(library), str(SOURCE), "-lm"], check=True)
    return ctypes.CDLL(str(library))


def peer_run(library: ctypes.CDLL, peer: Peer, ao: np.ndarray) -> Callable[[], None]:
    name, arguments = peer
    kinds = {np.ndarray: lambda a: a.ctypes.data_as(ctypes.c_void_p), int: ctypes.c_int, np.float32: ctypes.c_float}
    converted = [kinds[type(a)](a) for a in [*arguments, ao]]
    function = getattr(library, name)
    return lambda: function(*converted)


def measure(name: str, case: Case, libraries: tuple[ctypes.CDLL, ctypes.CDLL]):
    """Our run and, where it has one, its peer; the peer's exact build is held to our bits."""
    run, peer = ENTRIES[name](case)
    start = time.perf_counter()
    run()
    runs = {name: run}
    print(f"  {name}: first call {time.perf_counter() - start:.1f} s", flush=True)
    if peer is not None:
        ao = np.empty_like(case.occlusion)
        peer_run(libraries[1], peer, ao)()
        if not np.array_equal(ao.view(np.int32), case.occlusion.view(np.int32)):
            raise SystemExit(f"{name}: C without contraction does not give lfssao's bits: not the same algorithm")
        runs[f"{name}, C"] = peer_run(libraries[0], peer, ao)
    return runs


def bench(case: Case, folder: Path, repeats: int) -> dict[str, dict[str, float | None]]:
    megapixels = case.near.depth.size / 1e6
    libraries = compile_peers(folder), compile_peers(folder, "-ffp-contract=off")
    runs = {key: run for name in ENTRIES for key, run in measure(name, case, libraries).items()}
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repeats):
        for name, run in runs.items():
            start = time.perf_counter()
            run()
            times[name].append(1e3 * (time.perf_counter() - start) / megapixels)
    rows = {}
    for name in ENTRIES:
        low, middle, high = np.percentile(times[name], [25, 50, 75]).tolist()
        row = {"ms_per_megapixel": middle, "ms_25": low, "ms_75": high, "c_ratio": None}
        text = f"  {name:16s} {middle:7.2f} ms / Mpixel  [{low:.2f}, {high:.2f}]"
        if f"{name}, C" in times:
            ratios = np.array(times[f"{name}, C"]) / np.array(times[name])
            a, b, c = np.percentile(ratios, [25, 50, 75]).tolist()
            row |= {"c_ratio": b, "c_ratio_25": a, "c_ratio_75": c}
            text += f"   C takes {b:.2f} [{a:.2f}, {c:.2f}] times as long"
        print(text)
        rows[name] = row
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=40)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "estimators.json")
    options = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = str(options.threads)
    numba.set_num_threads(options.threads)
    result: dict[str, object] = {"machine": describe_machine(options.threads, sys.argv)}
    result["load_average"] = os.getloadavg()
    with tempfile.TemporaryDirectory() as folder:
        for name, case in (("gallery", gallery()), ("relief", relief())):
            print(f"{name}: {np.isfinite(case.near.depth).mean():.0%} of the texels see a surface")
            result[name] = bench(case, Path(folder), options.repeats)
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
