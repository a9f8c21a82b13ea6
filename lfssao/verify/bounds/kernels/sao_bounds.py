"""The sampling pass of ``sao`` and ``sao-equation-1`` on pairs, from linear z to the sums of its terms.

A tap may read any texel that it may land in, at any level that its distance may have: a term is one of those, and 0
where it may lie outside. A camera's z has ends of its own, and so have the points and face normals made of it. Shaders
may make these in eye space, where coordinates are of other sizes, and so are their roundings: vectors between a
camera's points are off by as much in all directions (``vector_to``).
"""

from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.sao.kernels.reconstruct import SEPARABLE, partner
from lfssao.ao.estimators.sao.kernels.scalable import landed, mip_level
from lfssao.core.jit import kernel
from lfssao.samples.kernels.spiral import summed_angle, unit_of
from lfssao.verify.bounds.kernels import pairs
from lfssao.verify.bounds.kernels.disk_bounds import LIMITLESS, term_of
from lfssao.verify.bounds.kernels.pairs import SAFETY, Pair, add, div, dot, exact, mul, positive, sub, times, triple
from lfssao.verify.bounds.kernels.projection_bounds import Projected, at_point, row_of, widen
from lfssao.verify.bounds.kernels.seen import box_of, texel_of, turn_of

_FAR = 2.0**20  # texels to which a radius is held
_NEAR = 2.0**-6  # radians up to which two sums are one with an error; it is twice a tap's own error


class Pass(NamedTuple):
    """The inputs of the sampling pass; numbers are float32 ones, held as float64, but z, which has ends."""

    kind: int  # of the rays, with their ``numbers``, ``table`` and ``world``, as of ``reconstruct.TexelRays``
    numbers: Any
    table: Any
    world: Any
    origin: float
    z_low: Any  # the levels of z one after the other, (N,)
    z_high: Any
    first: Any  # place of each level's first texel
    log_q: int
    taps: Any  # (n, 3): unit vector and distance of each
    reach_u: float  # these numbers are those of ``scalable.Falloff``
    reach_v: float
    inverse: float
    cubed: float
    bias: float
    depth_bias: float
    epsilon: float
    angles: Any = np.empty((0, 2))  # (n, 2): least and largest angle of each tap that a renderer's hash is added to


@kernel(inline=True)
def line_of(m, k, at, by):
    """Start and slope of a SEPARABLE ray's coordinate, numbers from m[k] on: products may be multiplied out."""
    off, size, r = at - m[k], at + abs(m[k]), 6.0 * by.operation
    start = Pair(m[k + 1] + m[k + 2] * off, r * (abs(m[k + 1]) + abs(m[k + 2]) * size))
    return start, Pair(m[k + 3] + m[k + 4] * off, r * (abs(m[k + 3]) + abs(m[k + 4]) * size))


@kernel(inline=True)
def ray_of(given, width, texel, by):
    """Starts and slopes of x and y along a texel's ray."""
    if given.kind == SEPARABLE:
        a, c = line_of(given.numbers, 0, texel % width + 0.5, by)
        b, d = line_of(given.numbers, 5, texel // width + 0.5, by)
        return a, b, c, d
    t = given.table
    return exact(t[0, texel]), exact(t[2, texel]), exact(t[1, texel]), exact(t[3, texel])


@kernel
def point_of(given, width, texel, place, by):
    """World coordinates of the point of a texel's ray at the hierarchy's z of a place."""
    z = Pair(0.5 * (given.z_low[place] + given.z_high[place]), 0.5 * (given.z_high[place] - given.z_low[place]))
    a, b, c, d = ray_of(given, width, texel, by)
    at, r = at_point((add(a, mul(z, c, by), by), add(b, mul(z, d, by), by), z)), by.operation
    return row_of(given.world, 0, at, r), row_of(given.world, 1, at, r), row_of(given.world, 2, at, r)


@kernel
def surface_of(seen, given, texel, by):
    """World coordinates of a texel's surface: a module's positions texture; a camera's are not given, and made of z."""
    width = seen.depth.shape[1]
    if seen.positions.shape[0] == 0:
        return point_of(given, width, texel, texel, by)
    return triple(seen.positions[texel // width, texel % width])


@kernel(inline=True)
def vector_to(seen, there, here, by):
    """Vector between two points, and of a camera its error in any axes: roundings of dot products are part of it."""
    v = pairs.apart(there, here, by)
    if seen.positions.shape[0] != 0:
        return v
    size, own = abs(v[0].value) + abs(v[1].value) + abs(v[2].value), v[0].error + v[1].error + v[2].error
    e = own + 4.0 * by.operation * (size + own)
    return Pair(v[0].value, e), Pair(v[1].value, e), Pair(v[2].value, e)


@kernel(inline=True)
def to_world(m, v, by):
    """World coordinates of a vector of cast space."""
    return dot(triple(m[:3]), v, by), dot(triple(m[4:7]), v, by), dot(triple(m[8:11]), v, by)


@kernel
def normal_of(seen, given, row, column, here, by):
    """A texel's normal, and whether its neighbours and its side are sure."""
    if seen.normals.shape[0] != 0:
        return triple(seen.normals[row, column]), True
    (height, width), texel = seen.depth.shape, row * seen.depth.shape[1] + column
    across = partner(given.z_high, texel, 1, column & 1, column > 0, column + 1 < width)
    down = partner(given.z_high, texel, width, row & 1, row > 0, row + 1 < height)
    sure = across == partner(given.z_low, texel, 1, column & 1, column > 0, column + 1 < width)
    sure &= down == partner(given.z_low, texel, width, row & 1, row > 0, row + 1 < height)
    _, _, c, d = ray_of(given, width, texel, by)
    way = to_world(given.world, (c, d, exact(1.0)), by)
    normal = way
    if texel not in (across, down):
        a = vector_to(seen, surface_of(seen, given, across, by), here, by)
        normal = pairs.cross(a, vector_to(seen, surface_of(seen, given, down, by), here, by), by)
    scale = div(exact(1.0), pairs.root(dot(normal, normal, by), by), by)
    # It may be divided by its largest coordinate before it is divided by its length.
    normal = times(normal, Pair(scale.value, scale.error + 3.0 * by.quotient * scale.value), by)
    may, away = positive(dot(normal, way, by))
    sure &= (away or not may) and normal[0].error + normal[1].error + normal[2].error < np.inf
    return times(normal, exact(-1.0 if away else 1.0), by), sure


@kernel(inline=True)
def texels_of(given, reach, k, one, other, z, by):
    """Texels in a radius, across (k 0) or down (5), with three more roundings; other: the next texel's number."""
    m = given.numbers
    if given.kind == SEPARABLE:
        length = add(exact(m[k + 2]), mul(z, exact(m[k + 4]), by), by)
    else:
        (a, b, c, d), (p, q, r, s) = ray_of(given, 1, one, by), ray_of(given, 1, other, by)
        x = add(sub(p, a, by), mul(z, sub(r, c, by), by), by)
        y = add(sub(q, b, by), mul(z, sub(s, d, by), by), by)
        v = to_world(given.world, (x, y, exact(0.0)), by)
        length = pairs.root(dot(v, v, by), by)
    texels = div(Pair(reach, 3.0 * by.operation * reach), Pair(abs(length.value), length.error), by)
    return exact(_FAR) if texels.value - texels.error >= _FAR else texels


@kernel(inline=True)
def reaches_of(given, shape, row, column, z, by):
    """Texels in a radius across and down."""
    (height, width), one = shape, row * shape[1] + column
    right = one + 1 if column + 1 < width else one - min(column, 1)
    below = one + width if row + 1 < height else one - width * min(row, 1)
    return texels_of(given, given.reach_u, 0, one, right, z, by), texels_of(given, given.reach_v, 5, one, below, z, by)


@kernel(inline=True)
def tap_coordinate(at, off, landing, by):
    """A tap's coordinate from its texel's and its offset; of offsets that become whole numbers, the texel's middle."""
    if landing is None:
        return add(exact(float(at)), off, by)
    error = off.error * SAFETY + by.operation
    low, high = landed(off.value - error, landing), landed(off.value + error, landing)
    return Pair(at + 0.5 * (low + high) + 0.5, 0.5 * (high - low))


@kernel
def term_range(seen, given, landing, texel, far, unit, reach, here, normal, less, by):
    """As ``tap_range``, of a tap at a part of the radius in a direction, whose numbers are off by its third."""
    (row, column), (c, d, off), shape = texel, unit, seen.depth.shape
    alpha = Pair(far, by.quotient * far)
    across, down = mul(reach[0], alpha, by), mul(reach[1], alpha, by)
    u = tap_coordinate(column, mul(across, Pair(c, off), by), landing, by)
    v = tap_coordinate(row, mul(down, Pair(d, off), by), landing, by)
    box = box_of(seen, widen(Projected(u, v, exact(0.0), True, True), by))
    bits, top = np.int32(given.log_q), np.int32(given.first.shape[0] - 1)
    near = max(across.value - across.error * SAFETY, down.value - down.error * SAFETY, 0.0)
    far = min(max(across.value + across.error * SAFETY, down.value + down.error * SAFETY), 2.0 * _FAR)
    low, high = mip_level(near, bits, top), mip_level(far, bits, top)
    inverse = Pair(given.inverse, 2.0 * by.quotient * given.inverse)
    least, most, epsilon = LIMITLESS * box.least, LIMITLESS * box.most, exact(given.epsilon)
    for level in range(low, high + 1):
        span = (shape[1] + (1 << level) - 1) >> level
        for k in range(box.texels):
            (j, i), a, b = texel_of(box, k), 0.0, 0.0
            place = given.first[level] + (j >> level) * span + (i >> level)
            if given.z_low[place] < np.inf and not (j == row and i == column):
                b = LIMITLESS
                if given.z_high[place] < np.inf:
                    v = vector_to(seen, point_of(given, shape[1], j * shape[1] + i, place, by), here, by)
                    a, b = term_of(times(v, inverse, by), normal, less, epsilon, given.cubed != 0.0, by)
            least, most = min(least, a), max(most, b)
    return least, most, box.sure and (box.texels == 0 or low == high)


@kernel
def tap_range(seen, given, landing, texel, s, reach, here, normal, less, by):
    """The least and largest term of a tap, and whether it lies in one texel of one level, or in none, for sure.

    A sum in float32 is that of the nearest number: of both, where the tap's angle may be either side of their middle.
    """
    (row, column), (x, y, far) = texel, given.taps[s]
    c, d = turn_of(seen, row, column)
    if given.angles.shape[0] == 0:
        unit = x * c - y * d, x * d + y * c, 3.0 * (by.operation + by.angle)
        return term_range(seen, given, landing, texel, far, unit, reach, here, normal, less, by)
    low, high = summed_angle(column, row, given.angles[s, 0]), summed_angle(column, row, given.angles[s, 1])
    error, two = by.operation + by.angle, high - low > _NEAR
    (sine, cosine), own = unit_of(low), error if two else error + (high - low)
    least, most, sure = term_range(seen, given, landing, texel, far, (cosine, sine, own), reach, here, normal, less, by)
    if two:
        sine, cosine = unit_of(high)
        unit = cosine, sine, error
        a, b, _ = term_range(seen, given, landing, texel, far, unit, reach, here, normal, less, by)
        least, most, sure = min(least, a), max(most, b), False
    return least, most, sure


@kernel(rows="seen.depth")
def sum_taps(begin, stop, seen, given, landing, by, sums):
    """Write the least and largest sum of texels' terms, and taps in doubt, all where a normal is, (3, H, W) float64."""
    height, width = seen.depth.shape
    for j in range(begin, stop):
        for i in range(width):
            texel, n = j * width + i, given.taps.shape[0]
            low, high = given.z_low[texel], given.z_high[texel]
            sums[1, j, i], sums[2, j, i] = LIMITLESS if low < np.inf else 0.0, n
            if not high < np.inf:
                continue
            z, here = Pair(0.5 * (low + high), 0.5 * (high - low)), surface_of(seen, given, texel, by)
            normal, known = normal_of(seen, given, j, i, here, by)
            slope = Pair(given.depth_bias, 3.0 * by.operation * given.depth_bias)
            less = add(exact(given.bias), mul(slope, sub(z, exact(given.origin), by), by), by)
            reach = reaches_of(given, (height, width), j, i, z, by)
            if known:
                sums[1, j, i], sums[2, j, i] = 0.0, 0.0
                for s in range(n):
                    a, b, sure = tap_range(seen, given, landing, (j, i), s, reach, here, normal, less, by)
                    sums[0, j, i], sums[1, j, i] = sums[0, j, i] + a, sums[1, j, i] + b
                    sums[2, j, i] += 0.0 if sure else 1.0
