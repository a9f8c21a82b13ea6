"""Bounds of ``multiresolution``: of each level's own occlusion, and of what is carried from level to level.

Which texel a coarse one stands for is decided by comparing depths, which rounds nothing. Terms and weights are the
kernels' own formulas, of balls. All are continuous where they are decided, so that intervals stay narrow.
"""

import numpy as np

from lfssao.ao.estimators.multiresolution import MultiresolutionOptions, level_pyramid
from lfssao.ao.estimators.registry import find_estimator
from lfssao.core.balls import SAFETY
from lfssao.verify.bounds.bounds import Bounds, down_to_single, up_to_single
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.kernels.multiresolution_bounds import bound_level, bound_refined
from lfssao.verify.bounds.post import union_ends
from lfssao.verify.bounds.problem import Problem
from lfssao.verify.bounds.ssao import single

_SQUARES = 2.0**-126, 2.0**126  # between which a renderer's R^2 is a number of full precision
_LONG = 2.0  # coordinates of normals that are no unit vectors: powers of their products may be infinite


def multiresolution(given: Problem, radius: float) -> Bounds | None:
    """Bounds of ``multiresolution``; None if R squared may be flushed or infinite. With long normals any is right."""
    options, model = find_estimator("multiresolution").options(**given.options), given.model
    assert isinstance(options, MultiresolutionOptions)
    with np.errstate(over="ignore"):
        squared = float(single(float(radius) * float(radius)))
    there = given.seen.depth < np.inf
    nothing = np.zeros(there.shape, np.float32)
    if radius == 0:
        return Bounds(nothing, nothing, nothing.astype(np.int32))
    if not _SQUARES[0] <= squared < _SQUARES[1]:
        return None
    assert given.seen.normals is not None  # ``point_bounds`` has seen to it
    if not np.abs(given.seen.normals[there]).max(initial=0) < _LONG:
        return Bounds(nothing, there.astype(np.float32), there.astype(np.int32))
    places, facing = (single(texture).reshape(-1, 3) for texture in (given.seen.positions, given.seen.normals))
    levels, reach = level_pyramid(given.seen.depth, options.levels), float(single(radius))
    taps = (2 * options.kernel + 1) ** 2 - 1
    relative = _summing_error(taps, model) + model.quotient * SAFETY
    carried = np.empty((2, 2, 0, 0))
    for k in reversed(range(options.levels)):
        coarser, level = carried, levels[k]
        sums = np.empty((2, *level.shape))
        bound_level(level, places, facing, options.kernel, reach, squared, model.errors, sums)
        sums[0] *= (1 - relative) / taps
        sums[1] *= (1 + relative) / taps
        carried, undecided = np.stack([sums, sums]), np.zeros(level.shape, np.int32)
        if k + 1 < options.levels:
            bound_refined(level, levels[k + 1], places, facing, reach, model.errors, coarser, carried, undecided)
    most, total = carried
    off = model.quotient * SAFETY
    mean = np.stack([total[0] * (1 - off), total[1] * (1 + off)]) / options.levels
    made = {"maximum": most, "average": mean}.get(options.combine)
    if made is None:
        made = union_ends(most, mean, model)
    low, high = np.clip(made, 0, 1)
    return Bounds(up_to_single(low), down_to_single(high), undecided)


def _summing_error(n: int, model: ErrorModel) -> float:
    """Relative error of a sum of n terms, none negative, added in any order."""
    return (n - 1) * model.operation * (1 + (n - 1) * model.operation) * SAFETY
