"""LF's Algorithms 1 and 2, ``point`` and ``hemisphere`` by balls: which samples are hidden for sure, and which may be.

A sample's depth is a range, and so may be that of a surface. If all texels that it may be looked up in give the same
decision for all depths, it is hidden or clear; else it is undecided. A camera's renderer may compare window depths, or
distances made of them (``linear_room``). Further decisions of ``point`` and ``hemisphere``:

- The range check, distance^2 <= R^2, or distance <= R: both are admitted.
- The half ball's turn, offset . normal < 0. If rounding may change the sign, both sides are taken.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from lfssao.core.balls import Ball
from lfssao.core.jit import kernel
from lfssao.core.places import offset_spot, point_spot
from lfssao.core.vectors import Vector, dot
from lfssao.optics.kernels.projection import MATRIX
from lfssao.verify.bounds.kernels.images import Projected, certain, certain_vector, linear_room
from lfssao.verify.bounds.kernels.seen import box_of, look, texel_of, texel_point, turn_of

CLEAR, OCCLUDED, UNDECIDED = 0, 1, 2
SINGLE = 2.0**-24  # relative error of a number rounded to the nearest float32


class Points(NamedTuple):
    """Samples around each point."""

    offsets: Any  # (n, 3) float64: exact offsets, world units
    is_exact: Any  # (n,) bool: whether every renderer has this very offset
    half: bool  # whether samples below the surface are taken to the other side
    reach: float  # R of the range check, infinite without one


@kernel(inline=True)
def sample_offset(seen, points, s, j, i, by):
    """The offset of a sample of a texel, turned: c (x, y, 0) + s (-y, x, 0) + (0, 0, z)."""
    (x, y, z), (c, d), off, nothing = points.offsets[s], turn_of(seen, j, i), by.offset, certain(0.0, by)
    a, b, e = Ball(x, off * abs(x), nothing), Ball(y, off * abs(y), nothing), Ball(z, off * abs(z), nothing)
    if seen.turns.shape[1] == 0:
        return offset_spot(Vector(a, b, e))
    turned = c * offset_spot(Vector(a, b, nothing)) + d * offset_spot(Vector(-b, a, nothing))
    return turned + offset_spot(Vector(nothing, nothing, e))


@kernel(inline=True)
def is_below(offset, normal):
    """Whether an offset may and does for sure point below the surface of a normal."""
    o, (a, b, c) = offset.offset, offset.sizes
    r = (offset.sums + offset.products) * o.x.operation
    made = Vector(Ball(o.x.value, o.x.error + r * a, o.x), Ball(o.y.value, o.y.error + r * b, o.x),
                  Ball(o.z.value, o.z.error + r * c, o.x))  # fmt: skip
    return dot(normal, made) < 0


@kernel(inline=True)
def in_range(here, there, radius, by):
    """Whether a place, a vector, may be and is for sure within R of another, by distances or by their squares."""
    away, reach = there - here, certain(radius, by)
    square, reach = dot(away, away), Ball(radius, radius * SINGLE, reach)
    rounded = square.error + 2.0 * by.root * (square.value + square.error)
    return reach * reach > Ball(square.value, rounded, square)


@kernel(inline=True)
def is_hidden(seen, image, here, reach, by):
    """Whether a sample at an image point may be and is for sure behind a surface, and in range of its texel's point."""
    box = box_of(seen, image)
    may, must = box.most > 0.0, box.least > 0.0
    z_low, z_high = image.z.value - image.z.error, image.z.value + image.z.error
    for k in range(box.texels):
        j, i = texel_of(box, k)
        behind, surely = seen.low[j, i] < z_high, seen.high[j, i] < z_low
        if behind and reach < np.inf:
            near = in_range(here, certain_vector(seen.positions[j, i], by), reach, by)
            behind, surely = near.may, surely & near.must
        may, must = may | behind, must & surely
    return may, must


@kernel(inline=True)
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


@kernel(inline=True)
def trace_sample(seen, points, here, s, j, i, by):
    """Image point, errors included, of sample s of a texel at a point, and whether it may and must be hidden."""
    offset, m, nothing = sample_offset(seen, points, s, j, i, by), seen.numbers, certain(0.0, by)
    point, below, surely = point_spot(here), False, False
    if points.half:
        side = is_below(offset, certain_vector(seen.normals[j, i], by))
        below, surely = side.may, side.must
    image, may, must = Projected(nothing, nothing, nothing, False, False), False, True
    for side in (1.0, -1.0):
        if below if side < 0.0 else not surely:
            image, _, _ = look(seen, point + offset if side > 0.0 else point - offset, by)
            if seen.kind == MATRIX:  # the sample's room and the surface's, which differ where they decide by little
                z = Ball(image.z.value, image.z.error + 2.0 * linear_room(m, image.z, by), nothing)
                image = Projected(image.u, image.v, z, image.may, image.must)
            hidden = is_hidden(seen, image, here, points.reach, by)
            may, must = may | hidden[0], must & hidden[1]
    if may and not must and seen.kind != MATRIX and seen.back.shape[0] == 0 and points.is_exact[s] and not below:
        still = seen.turns.shape[1] == 0 or (m[8] == 0.0 and m[9] == 0.0)  # no turn changes z
        if still and depth_is_exact(m, seen.positions[j, i], points.offsets[s]):
            image = Projected(image.u, image.v, certain(image.z.value, by), image.may, image.must)
            may, must = is_hidden(seen, image, here, points.reach, by)
    return image, may, must


@kernel(rows="seen.depth")
def count_hidden(begin, stop, seen, points, by, fewest, most):
    """Write the fewest and the most samples of every texel that a renderer may count as hidden, (H, W) int32."""
    for j in range(begin, stop):
        for i in range(seen.depth.shape[1]):
            fewest[j, i], most[j, i] = 0, 0
            if seen.depth[j, i] < np.inf:
                here = texel_point(seen, j, i, by)
                for s in range(points.offsets.shape[0]):
                    _, may, must = trace_sample(seen, points, here, s, j, i, by)
                    fewest[j, i] += np.int32(must)
                    most[j, i] += np.int32(may)


@kernel
def trace_samples(seen, points, j, i, by, found):
    """Write u, error, v, error, z, error, may and must lie in the domain, outcome, (n, 9), of one texel's samples."""
    for s in range(points.offsets.shape[0]):
        image, may, must = trace_sample(seen, points, texel_point(seen, j, i, by), s, j, i, by)
        found[s, 0], found[s, 1] = image.u.value, image.u.error
        found[s, 2], found[s, 3] = image.v.value, image.v.error
        found[s, 4], found[s, 5] = image.z.value, image.z.error
        found[s, 6], found[s, 7] = image.may, image.must
        found[s, 8] = OCCLUDED if must else UNDECIDED if may else CLEAR
