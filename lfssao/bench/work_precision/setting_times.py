"""Times of an estimator's settings, put together from the times of their passes in the same turn.

A setting is an arithmetic, a set of radii and a blur. Settings share passes: the same radius, the same blur. Each pass
is run once a turn, and a setting's time in that turn is the sum over its passes.
"""

from collections.abc import Callable, Hashable, Mapping
from functools import partial
from itertools import product

import numpy as np

from lfssao.ao import post
from lfssao.ao.estimators.estimator import Estimator
from lfssao.bench.times import Times, turns
from lfssao.bench.work_precision.scene import BenchScene, Inputs
from lfssao.bench.work_precision.settings import Grid

# Arithmetic, radii, blur.
Setting = tuple[str, tuple[float, ...], float]


def setting_times(
    scene: BenchScene, estimator: Estimator, grid: Grid, inputs: Mapping[str, Inputs]
) -> dict[str, dict[Setting, Times]]:
    """Return the times of all settings of a grid, for each of some named inputs of the estimator."""
    measured = turns(_passes(scene, estimator, grid, inputs), grid.repeats)
    out: dict[str, dict[Setting, Times]] = {name: {} for name in inputs}
    for name, dtype, radii, blur in product(inputs, grid.dtypes, grid.radii, grid.blurs):
        keys = [*(("ao", dtype, name, radius) for radius in radii), ("merge", dtype, radii), ("blur", dtype, blur)]
        first, warm = zip(*(measured[key] for key in keys), strict=True)
        out[name][dtype, radii, blur] = Times.of(np.sum(warm, axis=0), sum(first))
    return out


def _passes(
    scene: BenchScene, estimator: Estimator, grid: Grid, inputs: Mapping[str, Inputs]
) -> dict[Hashable, Callable[[], object]]:
    """Every pass that a setting needs, once."""
    out: dict[Hashable, Callable[[], object]] = {}
    for dtype in grid.dtypes:
        for name, radius in product(inputs, grid.each_radius):
            out["ao", dtype, name, radius] = partial(scene.occlusion, estimator, dtype, radius, inputs[name])
        texture = scene.buffers[dtype].depth.clip(0, 1)  # any: its numbers do not change the time
        for radii in grid.radii:
            out["merge", dtype, radii] = partial(post.merge, [texture] * len(radii))
        for blur in grid.blurs:
            out["blur", dtype, blur] = partial(post.blur, texture, blur)
    return out
