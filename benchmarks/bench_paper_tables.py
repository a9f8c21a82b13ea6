"""Tables of the papers beside ours: ``python benchmarks/bench_paper_tables.py``, JSON beside the printed tables.

LF table 1    Whether the time of SSAO depends on the number of faces. A shader runs at every texel; lfssao leaves out
              texels without a surface. So the models are measured as large as they are shown by default, and all so far
              away that they cover as much of the picture as the one that covers least. Mean of a number of frames.
VO table 1    Times of line and point samples and of horizons.
SAO table 2   Times of SAO's passes and of AlchemyAO's.

Graphics cards of 2008 to 2017 and one processor have no milliseconds in common. The order of the rows and their ratios
can be compared, so each row has its ratio to the table's first one.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numpy as np

from lfssao import (
    Buffers,
    Camera,
    Mesh,
    RayCaster,
    Settings,
    View,
    builtin_scene,
    default_radii,
    estimate,
    find_display,
)
from lfssao.ao.estimators.sao import estimator as scalable
from lfssao.ao.estimators.sao.kernels.bilateral import bilateral
from lfssao.ao.estimators.sao.texel_rays import linear_z, texel_rays
from lfssao.ao.kernels.post import gaussian_weights
from lfssao.bench.times import Milliseconds, turns
from lfssao.rendering.manifest import describe_machine
from lfssao.rendering.passes import render_view
from lfssao.rendering.settings import diagonal
from lfssao.rendering.views import module_views
from lfssao.samples import sample_set

MODELS = ("statue", "ammonite", "armadillo")

# LF table 1, milliseconds of each model without and with SSAO; their difference is SSAO's.
LF_MILLISECONDS = {"statue": (0.79, 7.25), "ammonite": (1.62, 8.05), "armadillo": (2.48, 8.96)}
SSAO = ("ao", "merge", "blur", "shade")

# VO table 1, mean of its four scenes in milliseconds: columns as the means say that they belong.
VO_MILLISECONDS = {"lines, 5": 0.64, "lines, 9": 0.91, "points, 12": 1.15, "points, 33": 2.87, "horizons": 39.56}

# SAO table 2, milliseconds.
SAO_MILLISECONDS = {
    "Alchemy, sampling": 13.53, "Alchemy, bilateral": 2.57, "Alchemy, total": 16.10, "SAO, level 0": 0.09,
    "SAO, levels": 0.18, "SAO, sampling": 1.33, "SAO, bilateral": 0.66, "SAO, total": 2.26,
}  # fmt: skip

# Shares of the scene's diagonal. VO prints no radius in texels; SAO's is 1 m in a hall of about 30 m.
VO_RADIUS, SAO_RADIUS = 0.02, 0.04


# LF table 1


@dataclass(frozen=True, eq=False)
class Model:
    """A model in one view; cover: the share of texels with a surface."""

    mesh: Mesh
    view: View
    caster: RayCaster
    settings: Settings
    cover: float


def face_counts(frames: int, threads: int) -> dict[str, Any]:
    """Milliseconds of a frame with and without SSAO, 1024x768, the models in turn, after one that may compile."""
    shown = [model(builtin_scene(name), 1.0, threads) for name in MODELS]
    least = min(each.cover for each in shown)
    away = [covering(each, least, threads) for each in shown]
    theirs = [after - before for before, after in LF_MILLISECONDS.values()]
    return {
        "frames": frames,
        "as shown": measured(shown, frames),
        "at equal cover": measured(away, frames),
        "lf_ms": LF_MILLISECONDS,
        "lf_spread_per_cent": spread_per_cent(theirs),
    }


def spread_per_cent(values: list[float]) -> float:
    """Greatest less least, of their mean."""
    return 100 * (max(values) - min(values)) * len(values) / sum(values)


def model(mesh: Mesh, scale: float, threads: int) -> Model:
    """A model whose box, enlarged by a scale, is fitted into the display."""
    middle = mesh.bounds.mean(axis=0)
    view = module_views(mesh, find_display("virtual"), bounds=middle + scale * (mesh.bounds - middle))[0]
    caster, settings = RayCaster(mesh, view.cast_from_world, threads), Settings(default_radii(mesh))
    triangle = render_view(caster, view, settings).gbuffer.triangle
    return Model(mesh, view, caster, settings, float(np.mean(triangle >= 0)))


def covering(seen: Model, cover: float, threads: int) -> Model:
    """The same model, its box enlarged until it covers that share, within one in a hundred of it."""
    scale = 1.0
    for _ in range(8):
        if abs(seen.cover / cover - 1) <= 0.01:
            break
        scale *= (seen.cover / cover) ** 0.5
        seen = model(seen.mesh, scale, threads)
    return seen


def measured(models: list[Model], frames: int) -> dict[str, Any]:
    without, ssao = np.empty((len(models), frames)), np.empty((len(models), frames))
    for frame in range(frames):
        for k, each in enumerate(models):
            start = time.perf_counter()
            seconds = render_view(each.caster, each.view, each.settings).seconds
            whole = time.perf_counter() - start
            ssao[k, frame] = 1e3 * sum(seconds[name] for name in SSAO)
            without[k, frame] = 1e3 * whole - ssao[k, frame]
    texels = models[0].view.width * models[0].view.height
    rows: list[dict[str, Any]] = []
    for name, each, a, b in zip(MODELS, models, without, ssao, strict=True):
        mean = float(b.mean())
        rows.append({
            "model": name, "faces": len(each.mesh.faces), "cover": each.cover, "without_ms": float(a.mean()),
            "ssao_ms": mean, "with_ms": float(a.mean()) + mean, "ssao_median_ms": float(np.median(b)),
            "ns_per_covered_texel": 1e6 * mean / (each.cover * texels),
        })  # fmt: skip
    keys = ("ssao_ms", "ssao_median_ms", "ns_per_covered_texel")
    return {"rows": rows, "spread_per_cent": {key: spread_per_cent([row[key] for row in rows]) for key in keys}}


def print_face_counts(table: dict[str, Any]) -> None:
    print(f"LF table 1: 1024x768, mean of {table['frames']} frames, milliseconds; LF's are of a graphics card.")
    for which in ("as shown", "at equal cover"):
        print(
            f"{which:>14s}    faces  cover  without   with   SSAO  median  ns a covered texel  LF without   with   SSAO"
        )
        for row in table[which]["rows"]:
            before, after = table["lf_ms"][row["model"]]
            print(f"{row['model']:>14s} {row['faces']:8d} {row['cover']:6.1%} {row['without_ms']:8.2f} "
                  f"{row['with_ms']:6.2f} {row['ssao_ms']:6.2f} {row['ssao_median_ms']:7.2f} "
                  f"{row['ns_per_covered_texel']:20.0f} {before:11.2f} {after:6.2f} {after - before:6.2f}")  # fmt: skip
        print(f"        spread {table[which]['spread_per_cent']['ssao_median_ms']:.1f} % of the medians; "
              f"LF's {table['lf_spread_per_cent']:.1f} %")  # fmt: skip


# VO table 1 and SAO table 2


def buffers_of(width: int, height: int, guard: int, threads: int) -> tuple[Buffers, float]:
    """The default scene before an ordinary camera, and its diagonal."""
    mesh = builtin_scene()
    view = Camera.looking_at(mesh.bounds).view(width, height, guard)
    gbuffer = RayCaster(mesh, view.cast_from_world, threads).gbuffer(view, normals="geometric")
    return Buffers.of(gbuffer, view), diagonal(mesh)


def vo_table(repeats: int, threads: int) -> dict[str, Any]:
    buffers, unit = buffers_of(1024, 1024, 0, threads)
    runs: dict[str, Callable[[], object]] = {}
    for name, domain, n in (("lines", "disk", 5), ("lines", "disk", 9), ("points", "ball", 12), ("points", "ball", 33)):
        made = sample_set(domain, "repulsion", n)
        runs[f"{name}, {n}"] = partial(estimate, f"vo-{name}", buffers, VO_RADIUS * unit, made.points, made.weights)
    runs["horizons"] = partial(estimate, "hbao", buffers, VO_RADIUS * unit)
    return beside({name: warm for name, (_, warm) in turns(runs, repeats).items()}, VO_MILLISECONDS)


def sao_table(repeats: int, threads: int) -> dict[str, Any]:
    buffers, unit = buffers_of(1920, 1080, 190, threads)
    buffers = buffers.turned("sao-hash")
    radius, z = SAO_RADIUS * unit, linear_z(buffers)
    lines = texel_rays(buffers.view, z.dtype)
    keys = scalable.keys_of(z, lines.origin, 0.0)

    def sampling() -> np.ndarray:
        return scalable.sample(buffers, z, lines, radius, scalable.AppendixOptions())[0]

    visibility = sampling()
    runs: dict[str, Callable[[], object]] = {
        "Alchemy, sampling": partial(estimate, "alchemy", buffers, radius),
        "Alchemy, bilateral": partial(wide_bilateral, visibility, keys),
        "SAO, level 0": partial(linear_z, buffers),
        "SAO, levels": partial(scalable.z_hierarchy, z, "rotated", 5, lines.origin),
        "SAO, sampling": sampling,
        "SAO, bilateral": partial(scalable.reconstruct, visibility, keys, 3.0, 2048.0, True),
    }
    warm = {name: times for name, (_, times) in turns(runs, repeats).items()}
    warm["SAO, sampling"] -= warm["SAO, levels"]  # ours makes the levels in it
    for whole in ("Alchemy", "SAO"):
        warm[f"{whole}, total"] = np.sum([times for name, times in warm.items() if name.startswith(whole)], axis=0)
    return beside(warm, SAO_MILLISECONDS)


def wide_bilateral(visibility: np.ndarray, keys: np.ndarray) -> np.ndarray:
    """Two passes of 13 neighbouring taps, AlchemyAO's by SAO's figure 2."""
    weights = np.empty(13)
    gaussian_weights(6.0, 6, weights)
    weights = weights.astype(visibility.dtype)
    for step in ((1, 0), (0, 1)):
        target = np.empty_like(visibility)
        bilateral(visibility, keys, weights, step, visibility.dtype.type(2048), target)
        visibility = target
    return visibility


def beside(warm: Mapping[str, Milliseconds], paper: Mapping[str, float]) -> dict[str, Any]:
    """Rows with both times and their ratios to the first row, and the rows in both orders."""
    ours = {name: float(np.median(warm[name])) for name in paper}
    first = next(iter(paper))
    rows = [
        {
            "name": name, "ms": ours[name], "paper_ms": paper[name], "ratio": ours[name] / ours[first],
            "paper_ratio": paper[name] / paper[first],
        }
        for name in paper
    ]  # fmt: skip
    return {"rows": rows, "orders": [sorted(paper, key=times.__getitem__) for times in (ours, paper)]}


def print_beside(title: str, table: dict[str, Any]) -> None:
    print(f"{title:20s}      ms  to the first   paper's ms  to the first")
    for row in table["rows"]:
        print(f"  {row['name']:18s} {row['ms']:7.2f} {row['ratio']:13.2f} {row['paper_ms']:12.2f} "
              f"{row['paper_ratio']:13.2f}")  # fmt: skip
    ours, theirs = table["orders"]
    print("  " + ("The order is the paper's." if ours == theirs else f"Order: {' < '.join(ours)}."))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=200, help="frames of each model in LF's table")
    parser.add_argument("--repeats", type=int, default=20, help="turns of the other tables")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "paper_tables.json")
    options = parser.parse_args()
    numba.set_num_threads(options.threads)
    result: dict[str, Any] = {"machine": describe_machine(options.threads, sys.argv)}
    result["LF table 1"] = face_counts(options.frames, options.threads)
    print_face_counts(result["LF table 1"])
    for title, measure in (("VO table 1", vo_table), ("SAO table 2", sao_table)):
        result[title] = measure(options.repeats, options.threads)
        print_beside(title, result[title])
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
