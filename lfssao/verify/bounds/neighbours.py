"""Bounds of ``lf-neighbours``: a sample is occluded if every module that sees it hides it.

Each module's texture gives the outcomes that a look-up may have there (``kernels.point_bounds``). Outcomes in two
modules are independent of each other.
"""

import numpy as np

from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.bounds.kernels.point_bounds import CERTAIN, HIDDEN, OPEN, Points, add_view
from lfssao.verify.bounds.kernels.seen import IMAGE
from lfssao.verify.bounds.problem import Problem
from lfssao.verify.bounds.ssao import fraction_bounds, rounded_to_single, sample_points, with_depth_ends

_BATCH = 16  # samples whose bits are in memory together


def neighbours(problem: Problem, radius: float) -> Bounds:
    """Bounds of ``lf-neighbours``; without neighbours they are those of ``lf`` by Algorithm 2."""
    model = problem.model
    points = sample_points(problem.points, radius)
    surface = problem.surface(radius, directions=False, kind=IMAGE)
    n = len(problem.points)
    views = [surface]
    for mapping, depth in problem.buffers.neighbours:
        numbers = rounded_to_single(mapping.numbers)
        other = surface._replace(kind=mapping.kind, numbers=numbers, depth=np.ascontiguousarray(depth), room=0.0)
        views.append(with_depth_ends(other, model))
    fewest, most = (np.zeros(surface.depth.shape, np.int32) for _ in range(2))
    for start in range(0, n, _BATCH):
        batch = Points(*(array[start : start + _BATCH] for array in points))
        found = np.zeros((*surface.depth.shape, len(batch.offsets)), np.uint8)
        for view in views:
            add_view(surface.depth, view, batch, model.errors, found)
        hidden = found & CERTAIN * HIDDEN > 0
        clear = found & CERTAIN * OPEN > 0
        fewest += np.count_nonzero(hidden & (found & OPEN == 0), axis=-1).astype(np.int32)
        most += np.count_nonzero((found & HIDDEN > 0) & ~clear, axis=-1).astype(np.int32)
    low, high = fraction_bounds(n, model)
    return Bounds(low[fewest], high[most], most - fewest)
