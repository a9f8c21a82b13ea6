"""Times of an estimator's settings, put together from the times of their passes in the same turn.

A setting is a set of samples, a set of radii, a blur and an arithmetic. Settings share passes: the same radius, the
same blur. Each pass is run once a turn, and a setting's time in that turn is the sum over its passes.
"""

from collections.abc import Callable, Hashable, Mapping
from functools import partial

import numpy as np

from lfssao.ao import passes
from lfssao.ao.estimators.estimator import Estimator, Value
from lfssao.bench.times import Times, turns
from lfssao.bench.work_precision.scene import BenchScene, Samples
from lfssao.bench.work_precision.settings import Grid

# Arithmetic, sample set, radii, blur.
Setting = tuple[str, str, tuple[float, ...], float]


def setting_times(
    scene: BenchScene, estimator: Estimator, grid: Grid, sets: Mapping[str, tuple[Samples, dict[str, Value]]]
) -> dict[Setting, Times]:
    """Times of all arithmetics, radii and blurs of a grid, by sample sets and parameters of any names.

    Parameters
    ----------
    scene : BenchScene
        The view.
    estimator : Estimator
        One of the registry.
    grid : Grid
        Sizes.
    sets : mapping
        Samples and parameters by name.
    """
    measured = turns(_passes(scene, estimator, grid, sets), grid.repeats)
    out = {}
    for dtype in grid.dtypes:
        for name in sets:
            for radii in grid.radii:
                for blur in grid.blurs:
                    keys = [("ao", dtype, name, share) for share in radii]
                    taken = [measured[key] for key in (*keys, ("merge", dtype, radii), ("blur", dtype, blur))]
                    first = sum(first for first, _ in taken)
                    out[dtype, name, radii, blur] = Times.of(np.sum([warm for _, warm in taken], axis=0), first)
    return out


def _passes(
    scene: BenchScene, estimator: Estimator, grid: Grid, sets: Mapping[str, tuple[Samples, dict[str, Value]]]
) -> dict[Hashable, Callable[[], object]]:
    """Every pass that a setting needs, once."""
    out: dict[Hashable, Callable[[], object]] = {}
    for dtype in grid.dtypes:
        for name, (samples, parameters) in sets.items():
            for share in grid.shares:
                out["ao", dtype, name, share] = partial(scene.occlusion, estimator, dtype, share, samples, parameters)
        texture = scene.buffers[dtype].depth.clip(0, 1)  # any: its numbers do not change the time
        for radii in grid.radii:
            out["merge", dtype, radii] = partial(passes.merge, [texture] * len(radii))
        for blur in grid.blurs:
            out["blur", dtype, blur] = partial(passes.blur, texture, blur)
    return out
