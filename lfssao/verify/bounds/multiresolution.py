"""Bounds of ``multiresolution``: of each level's occlusion, and of the occlusion that coarser levels pass on.

A coarse texel represents one texel of the finer level, which a comparison of depths selects without rounding. Terms
and weights are the kernels' formulas, evaluated with balls. They are continuous at their decisions, so intervals stay
narrow.
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
from lfssao.verify.bounds.ssao import rounded_to_single

_SQUARE_RANGE = 2.0**-126, 2.0**126  # a renderer's R^2 has full precision in this range
_LONGEST_NORMAL = 2.0  # limit of a normal's coordinates: powers of larger products may be infinite


def multiresolution(problem: Problem, radius: float) -> Bounds | None:
    """Bounds of ``multiresolution``; None if R squared may be flushed or infinite. Long normals allow any occlusion."""
    options = find_estimator("multiresolution").options(**problem.options)
    model = problem.model
    assert isinstance(options, MultiresolutionOptions)
    with np.errstate(over="ignore"):
        squared = float(rounded_to_single(float(radius) * float(radius)))
    has_surface = problem.buffers.depth < np.inf
    zeros = np.zeros(has_surface.shape, np.float32)
    if radius == 0:
        return Bounds(zeros, zeros, zeros.astype(np.int32))
    if not _SQUARE_RANGE[0] <= squared < _SQUARE_RANGE[1]:
        return None
    assert problem.buffers.normals is not None  # ``point_bounds`` checks it
    if not np.abs(problem.buffers.normals[has_surface]).max(initial=0) < _LONGEST_NORMAL:
        return Bounds(zeros, has_surface.astype(np.float32), has_surface.astype(np.int32))
    positions, normals = (
        rounded_to_single(texture).reshape(-1, 3) for texture in (problem.buffers.positions, problem.buffers.normals)
    )
    levels = level_pyramid(problem.buffers.depth, options.levels)
    single_radius = float(rounded_to_single(radius))
    taps = (2 * options.kernel + 1) ** 2 - 1
    relative_error = _sum_error(taps, model) + model.quotient * SAFETY
    occlusion = np.empty((2, 2, 0, 0))
    for k in reversed(range(options.levels)):
        coarser = occlusion
        level = levels[k]
        sums = np.empty((2, *level.shape))
        bound_level(level, positions, normals, options.kernel, single_radius, squared, model.errors, sums)
        sums[0] *= (1 - relative_error) / taps
        sums[1] *= (1 + relative_error) / taps
        occlusion = np.stack([sums, sums])
        undecided = np.zeros(level.shape, np.int32)
        if k + 1 < options.levels:
            bound_refined(
                level, levels[k + 1], positions, normals, single_radius, model.errors, coarser, occlusion, undecided
            )
    maximum, sums_of_levels = occlusion
    rounding = model.quotient * SAFETY
    mean = np.stack([sums_of_levels[0] * (1 - rounding), sums_of_levels[1] * (1 + rounding)]) / options.levels
    combined = {"maximum": maximum, "average": mean}.get(options.combine)
    if combined is None:
        combined = union_ends(maximum, mean, model)
    low, high = np.clip(combined, 0, 1)
    return Bounds(up_to_single(low), down_to_single(high), undecided)


def _sum_error(n: int, model: ErrorModel) -> float:
    """Largest relative error of a sum of n terms, none negative, added in any order."""
    return (n - 1) * model.operation * (1 + (n - 1) * model.operation) * SAFETY
