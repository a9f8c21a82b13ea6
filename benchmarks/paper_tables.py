"""SAO's table 2 and VO's table 1: times of passes and of sample sets, ours beside the papers'.

Graphics cards of 2008 to 2012 and one processor have no milliseconds in common. What can be compared is the order of
the rows and their ratios, so each row has its ratio to the table's first one.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from lfssao.bench.times import Milliseconds, turns
from lfssao.camera import Camera
from lfssao.estimators.buffers import Buffers, Texture
from lfssao.estimators.registry import estimate
from lfssao.kernels import bilateral
from lfssao.kernels.blur import gaussian_weights
from lfssao.raycast import RayCaster
from lfssao.rendering import diagonal
from lfssao.samples.registry import sample_set
from lfssao.scene.builtin import builtin_scene

Tick = Callable[[str], None]

PAPER_TABLE_STEPS = 2

# VO table 1, mean of its four scenes in milliseconds: columns as the means say that they belong.
VO_MILLISECONDS = {"lines, 5": 0.64, "lines, 9": 0.91, "points, 12": 1.15, "points, 33": 2.87, "horizons": 39.56}

# SAO table 2, milliseconds.
SAO_MILLISECONDS = {
    "Alchemy, sampling": 13.53, "Alchemy, bilateral": 2.57, "Alchemy, total": 16.10, "SAO, level 0": 0.09,
    "SAO, levels": 0.18, "SAO, sampling": 1.33, "SAO, bilateral": 0.66, "SAO, total": 2.26,
}  # fmt: skip

# Shares of the scene's diagonal. VO prints no radius in texels; SAO's is 1 m in a hall of about 30 m.
_VO_RADIUS, _SAO_RADIUS = 0.02, 0.04


def measure_paper_tables(scale: int, repeats: int, threads: int, tick: Tick) -> dict[str, Any]:
    """Both tables, their sizes divided by ``scale``, on the default scene from an ordinary camera."""
    tick("VO table 1")
    vo = _vo_table(1024 // scale, repeats, threads)
    tick("SAO table 2")
    return {"vo": vo, "sao": _sao_table(1920 // scale, 1080 // scale, 190 // scale, repeats, threads)}


def _buffers(width: int, height: int, guard: int, threads: int) -> tuple[Buffers, float]:
    """The default scene, and its diagonal."""
    mesh = builtin_scene()
    view = Camera.looking_at(mesh.bounds).view(width, height, guard)
    gbuffer = RayCaster(mesh, view.cast_from_world, threads).gbuffer(view, normals="geometric")
    return Buffers.of(gbuffer, view), diagonal(mesh)


def _vo_table(size: int, repeats: int, threads: int) -> dict[str, Any]:
    buffers, unit = _buffers(size, size, 0, threads)
    runs: dict[str, Callable[[], object]] = {}
    for name, domain, n in (("lines", "disk", 5), ("lines", "disk", 9), ("points", "ball", 12), ("points", "ball", 33)):
        made = sample_set(domain, "repulsion", n)
        runs[f"{name}, {n}"] = partial(estimate, f"vo-{name}", buffers, _VO_RADIUS * unit, made.points, made.weights)
    runs["horizons"] = partial(estimate, "hbao", buffers, _VO_RADIUS * unit)
    return _table(buffers, {name: warm for name, (_, warm) in turns(runs, repeats).items()}, VO_MILLISECONDS)


def _sao_table(width: int, height: int, guard: int, repeats: int, threads: int) -> dict[str, Any]:
    from lfssao.estimators import scalable  # late: compiles
    from lfssao.estimators.texel_lines import linear_z, texel_lines

    buffers, unit = _buffers(width, height, guard, threads)
    radius, z = _SAO_RADIUS * unit, linear_z(buffers)
    lines = texel_lines(buffers.view, z.dtype)
    keys, taps = scalable.keys_of(z, lines.origin, 0.0), 9

    def sampling() -> Texture:
        return scalable.sample(
            buffers, z, lines, radius, (0.01, 0.0), 5 / taps, True, taps, 7, "paper", "rotated", 3, 5, 0.01
        )[0]

    visibility = sampling()
    runs: dict[str, Callable[[], object]] = {
        "Alchemy, sampling": partial(estimate, "alchemy", buffers, radius),
        "Alchemy, bilateral": partial(_wide_bilateral, visibility, keys),
        "SAO, level 0": partial(linear_z, buffers),
        "SAO, levels": partial(scalable.z_hierarchy, z, "rotated", 5, lines.origin),
        "SAO, sampling": sampling,
        "SAO, bilateral": partial(scalable.reconstruct, visibility, keys, 3.0, 2048.0, True),
    }
    warm = {name: times for name, (_, times) in turns(runs, repeats).items()}
    warm["SAO, sampling"] -= warm["SAO, levels"]  # ours makes the levels in it
    for whole in ("Alchemy", "SAO"):
        warm[f"{whole}, total"] = np.sum([times for name, times in warm.items() if name.startswith(whole)], axis=0)
    return _table(buffers, {name: warm[name] for name in SAO_MILLISECONDS}, SAO_MILLISECONDS)


def _wide_bilateral(visibility: Texture, keys: Texture) -> Texture:
    """Two passes of 13 neighbouring taps, AlchemyAO's by SAO's figure 2."""
    weights = np.empty(13)
    gaussian_weights(6.0, 6, weights)
    weights = weights.astype(visibility.dtype)
    for one_pass in (bilateral.bilateral_horizontal, bilateral.bilateral_vertical):
        target = np.empty_like(visibility)
        one_pass(visibility, keys, weights, 1, visibility.dtype.type(2048), target)
        visibility = target
    return visibility


def _table(buffers: Buffers, warm: Mapping[str, Milliseconds], paper: Mapping[str, float]) -> dict[str, Any]:
    """Rows with both times and their ratios to the first row, and whether rows are in the same order."""
    ours = {name: float(np.median(times)) for name, times in warm.items()}
    first = next(iter(paper))
    rows = [
        {
            "name": name, "ms": ours[name], "paper_ms": paper[name], "ratio": ours[name] / ours[first],
            "paper_ratio": paper[name] / paper[first],
        }
        for name in paper
    ]  # fmt: skip
    height, width = buffers.depth.shape
    orders = (sorted(paper, key=times.__getitem__) for times in (ours, paper))
    return {"width": width, "height": height, "rows": rows, "orders": [list(order) for order in orders]}
