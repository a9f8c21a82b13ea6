"""Bounds of ``lf-neighbours``: which samples all modules hide that see them, for sure, and which may be hidden.

Each module's texture gives what a look-up may find there (``kernels.point_bounds``). A renderer may find any of it in
one module whatever it finds in another.
"""

import numpy as np

from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.bounds.kernels.point_bounds import CERTAIN, HIDDEN, OPEN, Points, add_view
from lfssao.verify.bounds.kernels.seen import IMAGE
from lfssao.verify.bounds.problem import Problem
from lfssao.verify.bounds.ssao import fraction_bounds, sample_points, single, with_depths

_AT_ONCE = 16  # samples whose bits are in memory together


def neighbours(given: Problem, radius: float) -> Bounds:
    """Bounds of ``lf-neighbours``; with no other modules those of ``lf`` by Algorithm 2."""
    model, points = given.model, sample_points(given.points, radius)
    own, n = given.surface(radius, directions=False, kind=IMAGE), len(given.points)
    views = [own]
    for mapping, depth in given.seen.neighbours:
        other = own._replace(kind=mapping.kind, numbers=single(mapping.numbers), depth=np.ascontiguousarray(depth))
        views.append(with_depths(other._replace(room=0.0), model))
    fewest, most = (np.zeros(own.depth.shape, np.int32) for _ in range(2))
    for start in range(0, n, _AT_ONCE):
        some = Points(*(array[start : start + _AT_ONCE] for array in points))
        known = np.zeros((*own.depth.shape, len(some.offsets)), np.uint8)
        for shown in views:
            add_view(own.depth, shown, some, model.errors, known)
        hidden, clear = known & CERTAIN * HIDDEN > 0, known & CERTAIN * OPEN > 0
        fewest += np.count_nonzero(hidden & (known & OPEN == 0), axis=-1).astype(np.int32)
        most += np.count_nonzero((known & HIDDEN > 0) & ~clear, axis=-1).astype(np.int32)
    low, high = fraction_bounds(n, model)
    return Bounds(low[fewest], high[most], most - fewest)
