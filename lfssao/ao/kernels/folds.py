"""The sum of each texel's steps along directions, for any estimator (``lfssao.ao.formulas.Folded``), as floats.

Texels are computed in chunks of a row, their numbers in slots, so that the loops over texels become vectors: one of the
ends of a direction, and for each of its steps one of the texels where they land and one of the surfaces there.
"""

import numpy as np

from lfssao.ao.kernels.float_view import adds, bare_view, texel_of_look
from lfssao.ao.kernels.look_up import linear_of, look_up, seen_at
from lfssao.ao.kernels.spans import CHUNK, next_span
from lfssao.ao.kernels.sums import finish_texels
from lfssao.core.intrinsics import get, put, scratch, texel_slots
from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import as_float, number, plain, select
from lfssao.core.sectors import kept_as
from lfssao.optics.kernels.projection import (
    CROSSED_SLITS,
    DISPLAY,
    MATRIX,
    hold_inside,
    image_of,
    last_below,
)

_slots = texel_slots(48)


@formula
def _begin_direction(kind, view, estimator, s, column, row, n, like, ways, states, slots):
    """States before direction s of n texels, and ways from their centres to the images of its ends, NaN for none.

    The second direction of a pair keeps the states.
    """
    (across, down), dtype = ways, ways[0].dtype.type
    half, nothing, anew = dtype(0.5), dtype(np.nan), s % estimator.sides == 0
    for i in range(n):
        here = get(slots, i, like)
        place = estimator.place(view, here, s)
        u, v, valid = image_of(kind, view.lens, place.u, place.v, place.q, place.z)
        begun = plain(estimator.begin(view, here, s))
        states[i] = begun if anew else states[i]
        across[i] = plain(u) - (dtype(column + i) + half) if valid else nothing
        down[i] = plain(v) - (dtype(row) + half)


@formula
def _land(view, estimator, size, step, column, row, first, n, ways, ends, texels, inside, missed):
    """The texels at a step of the ways of n texels, and 1 where they add something, else 0.

    ends: their image points, out, where a linear look reads between texels.
    """
    (across, down), dtype = ways, ways[0].dtype.type
    half, right_edge, bottom_edge = dtype(0.5), last_below(dtype(size[1])), last_below(dtype(size[0]))
    for i in range(n):
        part = plain(estimator.part(view, np.uint32(first + i), as_float(dtype(step))))
        u = (dtype(column + i) + half) + part * across[i]
        v = (dtype(row) + half) + part * down[i]
        column_at, row_at = hold_inside(u, right_edge), hold_inside(v, bottom_edge)
        sought = look_up(view.look, u, v, size)
        there = adds(view, (column_at == u) & (row_at == v), sought)
        texels[i] = texel_of_look(view, column_at, row_at, sought, size[1])
        _keep(linear_of(view.look), ends, i, u, v)
        inside[i] = np.int32(there)
        missed[i] += np.int32(not there)


@formula
def _keep(linear, ends, i, u, v):
    """Keep an image point for ``seen_at``."""
    if linear is not None:
        ends[0][i], ends[1][i] = u, v


@formula
def _take_step(view, estimator, s, step, first, n, size, like, ends, texels, inside, states, totals, slots):
    """Add what the surfaces of n texels' steps add, and raise the states."""
    dtype = totals.dtype.type
    zero, k = dtype(0), as_float(dtype(step))
    for i in range(n):
        state, there = as_float(states[i]), inside[i] != 0
        seen = seen_at(view.look, ends[0][i], ends[1][i], texels[i], size)
        added, after = estimator.step(view, get(slots, i, like), s, k, state, np.uint32(first + i), seen)
        totals[i] += plain(added) if there else zero
        states[i] = plain(select(there, after, state))


@formula
def _leave_direction(view, estimator, s, n, like, states, totals, slots):
    """Add what the states of n texels add after direction s."""
    for i in range(n):
        added = estimator.leave(view, get(slots, i, like), s, as_float(states[i]))
        totals[i] += plain(number(added, as_float(totals[i])))


@kernel(rows="occlusion")
def fold_steps(begin, stop, view, estimator, occlusion, outside):
    """Occlusion of every texel by the steps along its directions, (H, W); view: ``FloatView``.

    It is 0 where there is no surface, and where the texel does not count. outside: (H,), out: steps of each row outside
    the texture, or of a direction whose end has no image; they add nothing.
    """
    view = bare_view(view)
    size, fractions, count = occlusion.shape, occlusion.reshape(-1), estimator.points.shape[0]
    width, dtype = size[1], occlusion.dtype
    slots, missed, totals = _slots(dtype), scratch(np.int32), scratch(dtype)
    ways, ends = (scratch(dtype), scratch(dtype)), (scratch(dtype), scratch(dtype))
    texels, inside = scratch(np.uint32), scratch(np.int32)
    like, zero = estimator.start(view, 0), dtype.type(0)
    states = scratch(kept_as(estimator.begin(view, like, 0), dtype))
    for j in range(begin, stop):
        outside[j] = 0
        at, end = j * width, (j + 1) * width
        while at < end:
            first, n = next_span(view.depth, at, end, CHUNK)
            for texel in range(at, first):
                fractions[texel] = zero
            column = first - j * width
            for i in range(n):
                put(slots, i, estimator.start(view, first + i))
                totals[i], missed[i] = zero, 0
            for s in range(count):
                if view.kind == CROSSED_SLITS:
                    _begin_direction(CROSSED_SLITS, view, estimator, s, column, j, n, like, ways, states, slots)
                elif view.kind == MATRIX:
                    _begin_direction(MATRIX, view, estimator, s, column, j, n, like, ways, states, slots)
                else:
                    _begin_direction(DISPLAY, view, estimator, s, column, j, n, like, ways, states, slots)
                for step in range(1, estimator.steps + 1):
                    _land(view, estimator, size, step, column, j, first, n, ways, ends, texels, inside, missed)
                    _take_step(
                        view, estimator, s, step, first, n, size, like, ends, texels, inside, states, totals, slots
                    )
                if (s + 1) % estimator.sides == 0:
                    _leave_direction(view, estimator, s, n, like, states, totals, slots)
            outside[j] += finish_texels(view, estimator, first, n, like, totals, missed, slots, fractions)
            at = first + n
