"""The least and the largest sum of each texel's steps, for any estimator that takes them, by balls.

The image of a step is a box, as in ``sums``, and the state has *ends* (``core.sectors``). A step adds what the surface
of any texel of the box adds to any state so far, and the states after it are those after all of these. The texel may be
none: then nothing is added, and the state stays.
"""

import numpy as np

from lfssao.core.balls import UNKNOWN, Ball
from lfssao.core.doubts import doubt_of
from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import number
from lfssao.core.sectors import any_ends, ends_of, join_ends, no_ends, state_between
from lfssao.verify.bounds.kernels.ball_view import answering, image_at
from lfssao.verify.bounds.kernels.images import Projected, widen
from lfssao.verify.bounds.kernels.seen import looked_up_box
from lfssao.verify.bounds.kernels.sums import LIMITLESS, looked_up


@formula
def _part(view, estimator, texel, k):
    """The part of the way at which a step lies; a renderer may add up steps, whose errors are as a quotient's of 1."""
    part = number(estimator.part(view, texel, view.ball(k, 0.0)), view.ball(k, 0.0))
    return Ball(part.value, max(part.error, view.by.quotient), part)


@formula
def _march(view, seen, estimator, here, texel, s, ends, most_added):
    """The least and the largest sum of direction s, its steps that may be read in several texels, and those not 0.

    And the ends of the state after it; ends: those before it.
    """
    place = estimator.place(view, here, s)
    u, v, valid = image_at(view, place, view.depth_at(place))
    column, row = texel % view.width + 0.5, texel // view.width + 0.5
    across, down, state, least, most, doubt, added_to = u - column, v - row, ends, 0.0, 0.0, 0, 0
    if s % estimator.sides == 0:
        state = ends_of(estimator.begin(view, here, s))
    for k in range(1, estimator.steps + 1):
        part = _part(view, estimator, texel, k)
        u, v = part * across + column, part * down + row
        image = widen(Projected(u, v, number(0, u), valid.may, valid.must), view.by)
        box = looked_up_box(view.look, seen, image)
        # Before the texels of the box are looked at: none of them, or any, or so many that all may be.
        rises, ends, any_state = (0.0, most_added * box.most), state, state_between(state, part)
        if box.most > 0.0:
            ends = any_ends(state)
        if box.least > 0.0:
            rises, ends = (np.inf, 0.0), no_ends(state)
        for n in range(box.texels):
            other, added, after = looked_up(view, box, image, n, seen.depth.shape), (0.0, 0.0), state
            if view.shows(other):
                rise, raised = estimator.step(view, here, s, view.ball(k, 0.0), any_state, texel, other)
                added, after = ends_of(number(rise, part)), ends_of(raised)
                if not added[1] < UNKNOWN:
                    added = 0.0, most_added
            rises = min(rises[0], max(added[0], 0.0)), max(rises[1], added[1])
            ends = join_ends(ends, after)
        least, most, doubt, state = least + rises[0], most + rises[1], doubt + int(not box.sure), ends
        added_to += int(rises[1] > 0.0)
    if (s + 1) % estimator.sides == 0:
        left = ends_of(number(estimator.leave(view, here, s, state_between(state, u)), u))
        if not left[1] < UNKNOWN:
            left = 0.0, LIMITLESS
        least, most, added_to = least + left[0], most + left[1], added_to + int(left[1] > 0.0)
    return least, most, doubt, added_to, state


@kernel
def _bound_texel(view, seen, estimator, most_added, texel):
    """The least and the largest sum of a texel's steps, its steps in doubt, and those that may not add 0."""
    low, high, doubt, added = 0.0, 0.0, 0.0, 0.0
    here = estimator.start(view, texel)
    counts, ends = doubt_of(estimator.counts(view, here)), ends_of(estimator.begin(view, here, 0))
    for s in range(estimator.points.shape[0] if counts.may else 0):
        least, most, more, others, ends = _march(view, seen, estimator, here, texel, s, ends, most_added)
        low, high, doubt, added = low + (least if counts.must else 0.0), high + most, doubt + more, added + others
    return low, high, doubt, added


@kernel(rows="seen.depth")
def bound_folds(begin, stop, seen, view, estimator, most_added, sums):
    """Write the least and the largest sum of every texel's steps, its steps in doubt, and those not 0, (4, H, W).

    view: ``BallView``. most_added: no step adds more, as far as is known.
    """
    asked = np.zeros(2)
    own = answering(view, asked)
    for j in range(begin, stop):
        for i in range(view.width):
            texel = j * view.width + i
            if not view.depth[texel] < np.inf:
                continue
            asked[:] = 0.0
            low, high, doubt, added = _bound_texel(own, seen, estimator, most_added, texel)
            if asked[0] > 0.0:
                asked[1] = 1.0
                least, most, more, others = _bound_texel(own, seen, estimator, most_added, texel)
                low, high, doubt, added = min(low, least), max(high, most), max(doubt, more), max(added, others)
            sums[0, j, i], sums[1, j, i], sums[2, j, i], sums[3, j, i] = low, high, doubt, added
