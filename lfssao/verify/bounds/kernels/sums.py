"""The least and the largest sum of each texel's samples, for any estimator (``lfssao.ao.formulas``), by balls.

The image point of a sample is a box [u - e_u, u + e_u] x [v - e_v, v + e_v]. A renderer reads one of the texels that
the box touches, or none; the sample's term lies between the least and the largest that these give.
"""

import numpy as np

from lfssao.ao.kernels.float_view import shown
from lfssao.core.balls import SAFETY, UNKNOWN
from lfssao.core.doubts import doubt_of
from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import number, unless_none, where_none, within
from lfssao.verify.bounds.kernels.ball_view import answering, cell_seen, image_at
from lfssao.verify.bounds.kernels.images import Projected, widen
from lfssao.verify.bounds.kernels.seen import looked_up_box, looked_up_texel, texel_of

NO_STORY = -1, np.empty((0, 6))  # the last arguments of ``bound_sums`` where no texel's story is told
LIMITLESS = 1e300  # a term without an upper bound
OPEN = 2.0**-10  # a term whose interval is wider than this part of it counts as undecided


@formula
def readings(view, box):
    """How many readings a look-up is bounded by: of each texel of a box, or the one of filtered textures."""
    return where_none(view.moments_of, box.texels, min(box.texels, 1))


@formula
def looked_up(view, box, image, k, size):
    """Return what formulas are given of texel or cell k of a box."""
    row, column = texel_of(box, k)
    texel = looked_up_texel(view.look, box, k, size)
    return unless_none(view.look.linear, texel, cell_seen, (view, image, column, row, size))


@formula
def reading(view, box, image, k, size):
    """Return what formulas are given of reading k: a texel, or the image point in the texture."""
    height, width = size
    point = within(image.u, 0.0, np.float64(width)), within(image.v, 0.0, np.float64(height))
    return where_none(view.moments_of, looked_up(view, box, image, k, size), point)


@kernel
def _bound_texel(view, seen, estimator, largest, jumps, forks, texel, story):
    """The least and the largest sum of a texel's terms, its terms in doubt, and those that may not be 0.

    story: (n, 6), or (0, 6) if none is asked for, out: of each sample the image point u, v with its errors, -infinity
    where there is none, and the least and the largest term, where these exceed what is there.
    """
    low, high, doubt, added, asked = 0.0, 0.0, 0.0, 0.0, view.asked
    here = estimator.start(view, texel)
    counts, forked = doubt_of(estimator.counts(view, here)), asked[0]
    for s in range(estimator.points.shape[0] if counts.may else 0):
        lower, upper, one_texel = np.inf, 0.0, True
        for answer in range(where_none(forks, 1, 2)):
            if forks is not None:
                if answer == 1 and asked[0] == 0.0:
                    break
                asked[0], asked[1] = 0.0, answer
            place = estimator.place(view, here, s)
            z = view.depth_at(place)
            u, v, valid = image_at(view, place, z)
            image = widen(Projected(u, v, number(0, u), valid.may, valid.must), view.by)
            box = looked_up_box(view.look, seen, image)
            least, most = largest * box.least, largest * box.most
            for k in range(readings(view, box)):
                other = reading(view, box, image, k, seen.depth.shape)
                term = number(estimator.background(), z)
                if shown(view, other):
                    term = estimator.term(view, here, s, z, texel, other)
                error = term.error * SAFETY
                if error < UNKNOWN:
                    least, most = min(least, max(term.value - error, 0.0)), max(most, term.value + error)
                else:
                    least, most, one_texel = 0.0, largest, False
            lower, upper, one_texel = min(lower, least), max(upper, most), one_texel and box.sure and answer == 0
            if s < story.shape[0]:
                story[s, 0], story[s, 1], story[s, 2], story[s, 3] = u.value, u.error, v.value, v.error
                story[s, 1] = story[s, 1] if image.may else -np.inf
                story[s, 4], story[s, 5] = min(story[s, 4], lower), max(story[s, 5], upper)
        lower = lower if counts.must else 0.0
        low, high = low + lower, high + upper
        sure = upper - lower <= OPEN * upper if jumps else one_texel and counts.must
        doubt += 0.0 if sure else 1.0
        added += 1.0 if upper > 0.0 else 0.0
    asked[0] = forked
    return low, high, doubt, added


@kernel(rows="seen.depth")
def bound_sums(begin, stop, seen, view, estimator, largest, jumps, forks, sums, told, story):
    """Write the least and the largest sum of every texel's terms, its terms in doubt, and those not 0, (4, H, W).

    view: ``BallView``. largest: no term is larger, as far as is known. jumps: whether a term may jump where its texel
    is sure, so that an interval's width says what is in doubt, and not the texel. forks: not None if places may be in
    doubt themselves. told: a texel, -1 for none, of which the story is told, (n, 6) as of ``_bound_texel``.
    """
    width, asked = seen.depth.shape[1], np.zeros(2)
    own = answering(view, asked)
    for j in range(begin, stop):
        for i in range(width):
            texel = j * width + i
            if not view.depth[texel] < np.inf:
                continue
            asked[:] = 0.0
            of = story[: story.shape[0] if texel == told else 0]
            low, high, doubt, added = _bound_texel(own, seen, estimator, largest, jumps, forks, texel, of)
            if asked[0] > 0.0:
                asked[1] = 1.0
                least, most, more, others = _bound_texel(own, seen, estimator, largest, jumps, forks, texel, of)
                low, high, doubt, added = min(low, least), max(high, most), max(doubt, more), max(added, others)
            sums[0, j, i], sums[1, j, i], sums[2, j, i], sums[3, j, i] = low, high, doubt, added


@kernel(rows="sums.T")
def end_sums(begin, stop, view, estimator, sums):
    """Make the first two of sums (4, N) the least and the largest occlusion of them, of terms added in any order.

    A sum of k terms that are not 0, none negative, rounds each of them k - 1 times at most.
    """
    for k in range(begin, stop):
        relative = max(sums[3, k] - 1.0, 0.0) * view.by.operation
        relative *= (1.0 + relative) * SAFETY
        least = estimator.end(view.ball(sums[0, k] * (1.0 - relative), 0.0))
        most = estimator.end(view.ball(sums[1, k] * (1.0 + relative), 0.0))
        if most.value < least.value:  # it falls with the sum
            least, most = most, least
        sums[0, k], sums[1, k] = least.value - least.error * SAFETY, most.value + most.error * SAFETY
