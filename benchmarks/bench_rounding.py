"""Bounds held from outside: ``python benchmarks/bench_rounding.py`` runs the C baselines with random rounding.

Each texel and each sample begins with a direction of rounding drawn anew, to nearest, up, down or towards zero; all of
them are within the error model ``shader``. None of the runs may be outside the intervals. The table has how wide the
intervals are over how far the runs spread, where these differ.
"""

import argparse
import ctypes
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from c_baselines import compile_baselines
from kernel_baselines import BASELINES
from settings import RADIUS, Views, relief
from stages import Arrays, Call, in_c, recorded

from lfssao import RayCaster, builtin_scene, find_display, module_views
from lfssao.ao.estimators.registry import estimate, find_estimator
from lfssao.ao.textures import Buffers
from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.bounds.points import point_bounds
from lfssao.verify.bounds.ssao import ao_bounds

NAMES = (
    "lf", "point", "hemisphere", "oriented-hemisphere", "alchemy", "vo-points", "vo-points-normal", "vo-lines",
    "vo-lines-normal", "vo-area", "hbao", "gtao",
)  # fmt: skip
TURNED = "oriented-hemisphere", "alchemy"  # whose baselines read turns of every texel
SIZE = 64, 48
LARGE = 320, 240  # of estimators that decide of each sample: rounding decides of few
DECIDING = "lf", "point", "hemisphere", "oriented-hemisphere"
OPTIONS = "-ffp-contract=off", "-frounding-math", "-fno-tree-vectorize", "-DROUNDING"
WIDE = 2.0**-16  # more than the last quotient's rounding
_GOLDEN = 0x9E3779B97F4A7C15  # seeds that differ in many bits


@dataclass(frozen=True)
class Spread:
    """Runs of an estimator on a view, against its intervals.

    Attributes
    ----------
    name, view : str
        The estimator, and the textures.
    outside : int
        Texels of all runs that lie outside the intervals.
    apart : int
        Texels whose runs differ.
    ratio : float
        Median of the interval's width over the runs' spread, of these texels; NaN if there are none.
    equal : int
        Texels whose interval is wider than ``WIDE`` and whose runs are equal.
    """

    name: str
    view: str
    outside: int
    apart: int
    ratio: float
    equal: int


def textures(size: tuple[int, int]) -> Iterator[tuple[str, Buffers, float]]:
    """Yield a name, textures of one module, and a radius: a wavy sheet, and the default scene."""
    waves: Views = relief(*size)
    yield "relief", waves.module, RADIUS * waves.size
    mesh = builtin_scene()
    view = module_views(mesh, find_display("virtual").with_resolution(*size))[0]
    gbuffer = RayCaster(mesh, view.cast_from_world).gbuffer(view, None, "geometric")
    low, high = mesh.bounds
    yield "statue", Buffers.of(gbuffer, view), RADIUS * float(np.sqrt(((high - low) ** 2).sum()))


def intervals(name: str, buffers: Buffers, radius: float) -> Bounds:
    """Return the bounds of an estimator with its default samples and options."""
    estimator = find_estimator(name)
    points, weights = estimator.default_samples(estimator.count)
    if name == "lf":
        return ao_bounds(buffers.depth, buffers.positions, buffers.view.world_to_image, points, radius)
    found = point_bounds(name, buffers, radius, points, weights, estimator.parameters)
    assert found is not None
    return found


def last_call(name: str, buffers: Buffers, radius: float) -> Call:
    """Return the recorded call of the kernel that makes an estimator's occlusion."""
    with recorded(BASELINES) as calls:
        estimate(name, buffers, radius)
    return calls[-1]


def spread(name: str, view: str, buffers: Buffers, radius: float, library: ctypes.CDLL, runs: int) -> Spread:
    """Run an estimator's baseline with random rounding, and hold each run against the intervals."""
    turned = buffers.turned("sao-hash") if name in TURNED else buffers
    bounds = intervals(name, turned, radius)
    call = last_call(name, turned, radius)
    arrays = Arrays([call])
    run = in_c([call], arrays, library)
    made: Any = arrays.of(call)[call.baseline.outputs[0]].reshape(bounds.lower.shape)
    least = np.full(made.shape, np.inf, np.float32)
    most = np.full(made.shape, -np.inf, np.float32)
    outside = 0
    for seed in range(1, runs + 1):
        library.set_rounding(ctypes.c_uint64(seed * _GOLDEN % 2**64))
        run()
        library.set_rounding(ctypes.c_uint64(0))
        outside += int(np.count_nonzero((made < bounds.lower) | (made > bounds.upper)))
        least = np.minimum(least, made)
        most = np.maximum(most, made)
    width = bounds.upper.astype(np.float64) - bounds.lower
    apart = most > least
    ratios = width[apart] / (most.astype(np.float64) - least)[apart]
    ratio = float(np.median(ratios)) if ratios.size else float("nan")
    return Spread(name, view, outside, int(apart.sum()), ratio, int(((width > WIDE) & ~apart).sum()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        library = compile_baselines(Path(folder), 1, *OPTIONS)
        for name in NAMES:
            for given in textures(LARGE if name in DECIDING else SIZE):
                row = spread(name, *given, library, options.runs)
                rows.append(row)
                print(f"{row.name:20} {row.view:8} outside {row.outside}, apart {row.apart}, ratio {row.ratio:.3g}, "
                      f"wide but equal {row.equal}", flush=True)  # fmt: skip
    raise SystemExit(any(row.outside for row in rows))


if __name__ == "__main__":
    main()
