"""LF's Algorithms 1 and 2 by balls: which samples are hidden for sure, and which may be.

A sample's depth is a range, and so may be that of a surface. If all texels that it may be looked up in give the same
decision for all depths, it is hidden or clear; else it is undecided. A camera's renderer may compare window depths, or
distances made of them (``linear_room``).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from lfssao.core.balls import Ball
from lfssao.core.jit import formula, kernel
from lfssao.core.places import offset_spot, point_spot
from lfssao.core.vectors import Vector
from lfssao.optics.kernels.projection import MATRIX
from lfssao.verify.bounds.kernels.images import Projected, certain, linear_room
from lfssao.verify.bounds.kernels.seen import box_of, look, texel_of, texel_point, turn_of

CLEAR, OCCLUDED, UNDECIDED = 0, 1, 2

# Bits of what a look-up may find: a surface before the sample, one that is not, nothing as it lies in no texel.
HIDDEN, OPEN, OUTSIDE = 1, 2, 4
CERTAIN = 4


class Points(NamedTuple):
    """Samples around each point."""

    offsets: Any  # (n, 3) float64: exact offsets, world units
    is_exact: Any  # (n,) bool: whether every renderer has this very offset


@formula
def sample_offset(seen, points, s, j, i, by):
    """The offset of a sample of a texel, turned: c (x, y, 0) + s (-y, x, 0) + (0, 0, z)."""
    (x, y, z), (c, d), off, nothing = points.offsets[s], turn_of(seen, j, i), by.offset, certain(0.0, by)
    a, b, e = Ball(x, off * abs(x), nothing), Ball(y, off * abs(y), nothing), Ball(z, off * abs(z), nothing)
    if seen.turns.shape[1] == 0:
        return offset_spot(Vector(a, b, e))
    turned = c * offset_spot(Vector(a, b, nothing)) + d * offset_spot(Vector(-b, a, nothing))
    return turned + offset_spot(Vector(nothing, nothing, e))


@formula
def look_up(seen, image):
    """Bits of all that a look-up of a sample at an image point may find."""
    box = box_of(seen, image)
    found = (HIDDEN | OPEN if box.most > 0.0 else 0) | (0 if box.least > 0.0 else OUTSIDE)
    z_low, z_high = image.z.value - image.z.error, image.z.value + image.z.error
    for k in range(box.texels):
        j, i = texel_of(box, k)
        found |= (HIDDEN if seen.low[j, i] < z_high else 0) | (0 if seen.high[j, i] < z_low else OPEN)
    return found


@formula
def fits(size, x):
    """Whether float32 holds every sum of multiples of x whose sizes add up to at most size: it has 24 bits."""
    mantissa, exponent = math.frexp(size)
    parts = x / math.ldexp(1.0, max(exponent - (25 if mantissa == 0.5 else 24), -126))
    return parts == np.floor(parts)


@kernel
def depth_is_exact(m, point, offset):
    """Whether row 2 of M (p + o, 1) comes out exactly in every order: all its terms are multiples of one power of two.

    Products of two float32 are exact in float64. If the sizes of all terms sum to at most 2^24 g, g a power of two, and
    all are multiples of g, then so are all partial sums, and float32 holds each of them: no operation rounds. Likewise
    p + o. For g no less than 2^-126 nothing is flushed.
    """
    size, good = abs(m[11]), True
    for k in range(3):
        a, p, o = m[8 + k], np.float64(point[k]), offset[k]
        size += abs(a * p) + abs(a * o)
        good &= a == 0.0 or (fits(abs(p) + abs(o), p) and fits(abs(p) + abs(o), o))
    for k in range(3):
        good &= fits(size, m[8 + k] * np.float64(point[k])) and fits(size, m[8 + k] * offset[k])
    return good and fits(size, m[11]) and size < np.inf


@formula
def trace_sample(seen, points, here, s, j, i, by):
    """Image point, errors included, of sample s of a texel at a point, and bits of what a look-up there may find."""
    m = seen.numbers
    image, _, _ = look(seen, point_spot(here) + sample_offset(seen, points, s, j, i, by), by)
    if seen.kind == MATRIX:  # the sample's room and the surface's, which differ where they decide by little
        z = Ball(image.z.value, image.z.error + 2.0 * linear_room(m, 8, 12, image.z, by), image.z)
        image = Projected(image.u, image.v, z, image.may, image.must)
    found = look_up(seen, image)
    doubtful = found & HIDDEN != 0 and found != HIDDEN
    if doubtful and seen.kind != MATRIX and seen.back.shape[0] == 0 and points.is_exact[s]:
        still = seen.turns.shape[1] == 0 or (m[8] == 0.0 and m[9] == 0.0)  # no turn changes z
        if still and depth_is_exact(m, seen.positions[j, i], points.offsets[s]):
            image = Projected(image.u, image.v, certain(image.z.value, by), image.may, image.must)
            found = look_up(seen, image)
    return image, found


@kernel(rows="seen.depth")
def count_hidden(begin, stop, seen, points, by, fewest, most):
    """Write the fewest and the most samples of every texel that a renderer may count as hidden, (H, W) int32."""
    for j in range(begin, stop):
        for i in range(seen.depth.shape[1]):
            fewest[j, i], most[j, i] = 0, 0
            if seen.depth[j, i] < np.inf:
                here = texel_point(seen, j, i, by)
                for s in range(points.offsets.shape[0]):
                    _, found = trace_sample(seen, points, here, s, j, i, by)
                    fewest[j, i] += np.int32(found == HIDDEN)
                    most[j, i] += np.int32(found & HIDDEN != 0)


@kernel
def trace_samples(seen, points, j, i, by, found):
    """Write u, error, v, error, z, error, may and must lie in the domain, outcome, (n, 9), of one texel's samples."""
    for s in range(points.offsets.shape[0]):
        image, bits = trace_sample(seen, points, texel_point(seen, j, i, by), s, j, i, by)
        found[s, 0], found[s, 1] = image.u.value, image.u.error
        found[s, 2], found[s, 3] = image.v.value, image.v.error
        found[s, 4], found[s, 5] = image.z.value, image.z.error
        found[s, 6], found[s, 7] = image.may, image.must
        found[s, 8] = OCCLUDED if bits == HIDDEN else UNDECIDED if bits & HIDDEN else CLEAR


@kernel(rows="depth")
def add_view(begin, stop, depth, seen, points, by, known):
    """Add what a view's depth texture may show of every texel's samples to what is known of them, (H, W, n) uint8.

    depth: that of the texels' own view, (H, W). seen: positions of the texels, and depth and mapping of the view.
    Bits: ``HIDDEN`` and ``OPEN`` of any view, and both ``CERTAIN`` times of a view that shows nothing else.
    """
    for j in range(begin, stop):
        for i in range(depth.shape[1]):
            if depth[j, i] < np.inf:
                here = texel_point(seen, j, i, by)
                for s in range(points.offsets.shape[0]):
                    _, found = trace_sample(seen, points, here, s, j, i, by)
                    sure = CERTAIN * found if found in (HIDDEN, OPEN) else 0
                    known[j, i, s] |= np.uint8(found & (HIDDEN | OPEN) | sure)
