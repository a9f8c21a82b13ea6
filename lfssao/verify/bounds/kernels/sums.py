"""The least and the largest sum of each texel's samples, for any estimator (``lfssao.ao.formulas``), by balls.

The image point of a sample is a box [u - e_u, u + e_u] x [v - e_v, v + e_v]. A renderer reads one of the texels that
the box touches, or none; the sample's term lies between the least and the largest that these give.
"""

import numpy as np

from lfssao.ao.kernels.float_view import shown
from lfssao.core.balls import SAFETY, UNKNOWN
from lfssao.core.doubts import doubt_of
from lfssao.core.jit import kernel
from lfssao.core.numbers import number, where_none, within
from lfssao.verify.bounds.kernels.ball_view import answering, image_at
from lfssao.verify.bounds.kernels.images import Projected, widen
from lfssao.verify.bounds.kernels.seen import box_of, texel_of

_OPEN = 2.0**-10  # a term whose interval is wider than this part of it counts as undecided


@kernel(inline=True)
def readings(view, box):
    """How many readings a look-up is bounded by: of each texel of a box, or the one of filtered textures."""
    return where_none(view.moments_of, box.texels, min(box.texels, 1))


@kernel(inline=True)
def reading(view, box, image, k):
    """Return what formulas are given of reading k: a texel, or the image point in the texture."""
    (row, column), height = texel_of(box, k), np.float64(view.low.shape[0] // view.width)
    point = within(image.u, 0.0, np.float64(view.width)), within(image.v, 0.0, height)
    return where_none(view.moments_of, row * view.width + column, point)


@kernel
def _bound_texel(view, seen, estimator, largest, jumps, texel):
    """The least and the largest sum of a texel's terms, and its terms in doubt."""
    low, high, doubt = 0.0, 0.0, 0.0
    here = estimator.start(view, texel)
    counts = doubt_of(estimator.counts(view, here))
    for s in range(estimator.points.shape[0] if counts.may else 0):
        place = estimator.place(view, here, s)
        z = view.depth_at(place)
        u, v, valid = image_at(view, place, z)
        image = widen(Projected(u, v, number(0, u), valid.may, valid.must), view.by)
        box = box_of(seen, image)
        least, most = largest * box.least, largest * box.most
        for k in range(readings(view, box)):
            other = reading(view, box, image, k)
            term = number(estimator.background(), z)
            if shown(view, other):
                term = estimator.term(view, here, s, z, texel, other)
            error = term.error * SAFETY
            if error < UNKNOWN:
                least, most = min(least, max(term.value - error, 0.0)), max(most, term.value + error)
            else:
                least, most = 0.0, largest
        least = least if counts.must else 0.0
        low, high = low + least, high + most
        sure = most - least <= _OPEN * most if jumps else box.sure and counts.must
        doubt += 0.0 if sure else 1.0
    return low, high, doubt


@kernel(rows="seen.depth")
def bound_sums(begin, stop, seen, view, estimator, largest, jumps, sums):
    """Write the least and the largest sum of every texel's terms, and its terms in doubt, (3, H, W) float64.

    view: ``BallView``. largest: no term is larger, as far as is known. jumps: whether a term may jump where its texel
    is sure, so that an interval's width says what is in doubt, and not the texel.
    """
    width, asked = seen.depth.shape[1], np.zeros(1)
    one, other = answering(view, 0, asked), answering(view, 1, asked)
    for j in range(begin, stop):
        for i in range(width):
            texel = j * width + i
            if not view.shows(texel):
                continue
            asked[0] = 0.0
            low, high, doubt = _bound_texel(one, seen, estimator, largest, jumps, texel)
            if asked[0] > 0.0:
                least, most, more = _bound_texel(other, seen, estimator, largest, jumps, texel)
                low, high, doubt = min(low, least), max(high, most), max(doubt, more)
            sums[0, j, i], sums[1, j, i], sums[2, j, i] = low, high, doubt


@kernel(rows="sums.T")
def end_sums(begin, stop, view, estimator, relative, sums):
    """Make sums (2, N) the least and the largest occlusion of them; relative: error of a sum by its order."""
    for k in range(begin, stop):
        least = estimator.end(view.ball(sums[0, k] * (1.0 - relative), 0.0))
        most = estimator.end(view.ball(sums[1, k] * (1.0 + relative), 0.0))
        sums[0, k], sums[1, k] = least.value - least.error * SAFETY, most.value + most.error * SAFETY
