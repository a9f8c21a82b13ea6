"""Bounds of bent normals: an estimator's formulas sum the components of B, and a unit vector is made of the sums."""

import numpy as np

from lfssao.ao.estimators.registry import find_estimator
from lfssao.core.balls import SAFETY
from lfssao.verify.bounds.bounds import Bounds, FloatArray, down_to_single, exact_bounds, up_to_single
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.kernels.folds import bound_folds
from lfssao.verify.bounds.kernels.sums import LIMITLESS
from lfssao.verify.bounds.points import driver_arguments
from lfssao.verify.bounds.problem import Problem

_LARGEST_TERM = 2.0  # no term of a component is larger (``Estimator.bent``)


def bent_bounds(problem: Problem, radius: float, name: str) -> Bounds | None:
    """Bounds, (H, W, 3), of an estimator's bent normals; None if it has none, or normals are missing.

    Each component of B lies between the sum of its least terms and the sum of its largest terms. Rounding in any order
    of the sum widens both ends.
    """
    estimator = find_estimator(name)
    depth = problem.buffers.depth
    if not estimator.bent or (estimator.reads_normals(problem.options) and problem.buffers.normals is None):
        return None
    if not radius > 0:
        return exact_bounds(np.zeros((*depth.shape, 3), np.float32))
    seen, view, formulas = driver_arguments(problem, radius, name)
    sums = np.zeros((3, 4, *depth.shape))
    count = len(formulas.points) // formulas.sides
    for axis in range(3):
        bound_folds(seen, view, formulas._replace(axis=axis), 0.0, sums[axis])
    rounding = (count - 1) * problem.model.operation * count * _LARGEST_TERM * SAFETY
    unknown = (sums[:, 1] >= LIMITLESS).any(axis=0)
    low = np.where(unknown, -1.0, sums[:, 0] - rounding)
    high = np.where(unknown, 1.0, sums[:, 1] + rounding)
    lower, upper = (np.where((depth < np.inf)[..., None], ends, 0.0) for ends in _unit_ends(low, high, problem.model))
    return Bounds(up_to_single(lower), down_to_single(upper), sums[0, 2].astype(np.int32))


def _unit_ends(low: FloatArray, high: FloatArray, model: ErrorModel) -> tuple[FloatArray, FloatArray]:
    """The least and the largest coordinates, (H, W, 3), of normalised vectors that lie between two, (3, H, W).

    A coordinate of the unit vector grows with the same coordinate of the vector, and shrinks with the others' sizes. A
    renderer may first divide by the largest coordinate. It scales by a quotient and a root, or by an inverse square
    root.
    """
    least_squares = np.where((low <= 0) & (high >= 0), 0.0, np.minimum(np.abs(low), np.abs(high))) ** 2
    largest_squares = np.maximum(np.abs(low), np.abs(high)) ** 2
    relative_error = (2 * model.operation + model.root + 4 * model.quotient) * SAFETY
    ends = []
    for end, sign in ((low, -1), (high, 1)):
        least_others = least_squares.sum(axis=0) - least_squares
        largest_others = largest_squares.sum(axis=0) - largest_squares
        others = np.where(sign * end > 0, least_others, largest_others)
        length = np.sqrt(end * end + np.maximum(others, 0.0))
        component = np.divide(end, length, out=np.zeros_like(end), where=length > 0)
        ends.append(np.moveaxis(component + sign * relative_error * np.abs(component), 0, -1))
    return ends[0], ends[1]
