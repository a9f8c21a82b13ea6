"""The sampling pass of ``sao`` and ``sao-equation-1`` by balls, from linear z to the sums of its terms.

A tap may read any texel that it may land in, at any level that its distance may have: a term is one of those, and 0
where it may lie outside. A camera's z has ends of its own, and so have the points and face normals made of it. Shaders
may make these in eye space, where coordinates are of other sizes, and so are their roundings: vectors between a
camera's points are off by as much in all directions (``vector_to``).
"""

from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.sao.kernels.reconstruct import SEPARABLE, partner
from lfssao.ao.estimators.sao.kernels.scalable import landed, mip_level
from lfssao.core.balls import SAFETY, UNKNOWN, Ball, ball_between
from lfssao.core.jit import kernel
from lfssao.core.numbers import is_finite, larger, number, rounded
from lfssao.core.places import point_spot, row_of_spot
from lfssao.core.vectors import Vector, cross, dot
from lfssao.samples.kernels.spiral import summed_angle, unit_of
from lfssao.verify.bounds.kernels.images import Projected, certain, certain_vector, widen
from lfssao.verify.bounds.kernels.seen import box_of, texel_of, turn_of

LIMITLESS = 1e300  # a term without an upper bound
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
def line_of(m, k, at, like):
    """Start and slope of a SEPARABLE ray's coordinate, numbers from m[k] on: products may be multiplied out."""
    off, size, r = at - m[k], at + abs(m[k]), 6.0 * like.operation
    start = Ball(m[k + 1] + m[k + 2] * off, r * (abs(m[k + 1]) + abs(m[k + 2]) * size), like)
    return start, Ball(m[k + 3] + m[k + 4] * off, r * (abs(m[k + 3]) + abs(m[k + 4]) * size), like)


@kernel(inline=True)
def ray_of(given, width, texel, like):
    """Starts and slopes of x and y along a texel's ray."""
    if given.kind == SEPARABLE:
        a, c = line_of(given.numbers, 0, texel % width + 0.5, like)
        b, d = line_of(given.numbers, 5, texel // width + 0.5, like)
        return a, b, c, d
    t = given.table
    return number(t[0, texel], like), number(t[2, texel], like), number(t[1, texel], like), number(t[3, texel], like)


@kernel
def point_of(given, width, texel, place, like):
    """World coordinates of the point of a texel's ray at the hierarchy's z of a place."""
    z = ball_between(given.z_low[place], given.z_high[place], like)
    a, b, c, d = ray_of(given, width, texel, like)
    at = point_spot(Vector(a + z * c, b + z * d, z))
    return Vector(row_of_spot(given.world, 0, at), row_of_spot(given.world, 1, at), row_of_spot(given.world, 2, at))


@kernel
def surface_of(seen, given, texel, like):
    """World coordinates of a texel's surface: a module's positions texture; a camera's are not given, and made of z."""
    width = seen.depth.shape[1]
    if seen.positions.shape[0] == 0:
        return point_of(given, width, texel, texel, like)
    return certain_vector(seen.positions[texel // width, texel % width], like)


@kernel(inline=True)
def vector_to(seen, there, here):
    """Vector between two points, and of a camera its error in any axes: roundings of dot products are part of it."""
    v = there - here
    if seen.positions.shape[0] != 0:
        return v
    size, own = abs(v.x.value) + abs(v.y.value) + abs(v.z.value), v.x.error + v.y.error + v.z.error
    e = own + 4.0 * v.x.operation * (size + own)
    return Vector(Ball(v.x.value, e, v.x), Ball(v.y.value, e, v.x), Ball(v.z.value, e, v.x))


@kernel(inline=True)
def to_world(m, v):
    """World coordinates of a vector of cast space."""
    x, y, z = certain_vector(m[:3], v.x), certain_vector(m[4:7], v.x), certain_vector(m[8:11], v.x)
    return Vector(dot(x, v), dot(y, v), dot(z, v))


@kernel
def normal_of(seen, given, row, column, here):
    """A texel's normal, and whether its neighbours and its side are sure."""
    like = here.x
    if seen.normals.shape[0] != 0:
        return certain_vector(seen.normals[row, column], like), True
    (height, width), texel = seen.depth.shape, row * seen.depth.shape[1] + column
    across = partner(given.z_high, texel, 1, column & 1, column > 0, column + 1 < width)
    down = partner(given.z_high, texel, width, row & 1, row > 0, row + 1 < height)
    sure = across == partner(given.z_low, texel, 1, column & 1, column > 0, column + 1 < width)
    sure &= down == partner(given.z_low, texel, width, row & 1, row > 0, row + 1 < height)
    _, _, c, d = ray_of(given, width, texel, like)
    way = to_world(given.world, Vector(c, d, number(1, like)))
    normal = way
    if texel not in (across, down):
        a = vector_to(seen, surface_of(seen, given, across, like), here)
        normal = cross(a, vector_to(seen, surface_of(seen, given, down, like), here))
    scale = 1 / np.sqrt(dot(normal, normal))
    # It may be divided by its largest coordinate before it is divided by its length.
    normal = Ball(scale.value, scale.error + 3.0 * like.quotient * scale.value, like) * normal
    away = dot(normal, way) > 0
    sure &= (away.must or not away.may) and normal.x.error + normal.y.error + normal.z.error < UNKNOWN
    return number(-1.0 if away.must else 1.0, like) * normal, sure


@kernel(inline=True)
def texels_of(given, reach, k, one, other, z):
    """Texels in a radius, across (k 0) or down (5), with three more roundings; other: the next texel's number."""
    m = given.numbers
    if given.kind == SEPARABLE:
        length = m[k + 2] + z * m[k + 4]
    else:
        (a, b, c, d), (p, q, r, s) = ray_of(given, 1, one, z), ray_of(given, 1, other, z)
        v = to_world(given.world, Vector((p - a) + z * (r - c), (q - b) + z * (s - d), number(0, z)))
        length = np.sqrt(dot(v, v))
    texels = rounded(reach, 3, z) / Ball(abs(length.value), length.error, z)
    return texels if texels.value - texels.error < _FAR else number(_FAR, z)


@kernel(inline=True)
def reaches_of(given, shape, row, column, z):
    """Texels in a radius across and down."""
    (height, width), one = shape, row * shape[1] + column
    right = one + 1 if column + 1 < width else one - min(column, 1)
    below = one + width if row + 1 < height else one - width * min(row, 1)
    return texels_of(given, given.reach_u, 0, one, right, z), texels_of(given, given.reach_v, 5, one, below, z)


@kernel(inline=True)
def tap_coordinate(at, off, landing):
    """A tap's coordinate from its texel's and its offset; of offsets that become whole numbers, the texel's middle."""
    if landing is None:
        return float(at) + off
    error = off.error * SAFETY + off.operation
    low, high = landed(off.value - error, landing), landed(off.value + error, landing)
    return Ball(at + 0.5 * (low + high) + 0.5, 0.5 * (high - low), off)


@kernel(inline=True)
def term_of(v, normal, less, epsilon, falls):
    """The least and largest term max(0, v . n - less) / (v . v + epsilon), times max(0, 1 - v . v)^3 if it falls."""
    square, above = dot(v, v), dot(v, normal) - less
    if not (above > 0).may:
        return 0.0, 0.0
    below = square + epsilon
    term = larger(above, 0) / below
    if falls:
        left = larger(1 - square, 0)
        term = left * left * left * term
    error = term.error * SAFETY
    if not error < UNKNOWN:
        return 0.0, LIMITLESS
    return max(term.value - error, 0.0) if is_finite(below).must else 0.0, max(term.value + error, 0.0)


@kernel
def term_range(seen, given, landing, texel, far, unit, reach, here, normal, less, by):
    """As ``tap_range``, of a tap at a part of the radius in a direction, whose numbers are off by its third."""
    (row, column), (c, d, off), shape, like = texel, unit, seen.depth.shape, less
    alpha = Ball(far, by.quotient * far, like)
    across, down = reach[0] * alpha, reach[1] * alpha
    u = tap_coordinate(column, across * Ball(c, off, like), landing)
    v = tap_coordinate(row, down * Ball(d, off, like), landing)
    box = box_of(seen, widen(Projected(u, v, number(0, like), True, True), by))
    bits, top = np.int32(given.log_q), np.int32(given.first.shape[0] - 1)
    near = max(across.value - across.error * SAFETY, down.value - down.error * SAFETY, 0.0)
    far = min(max(across.value + across.error * SAFETY, down.value + down.error * SAFETY), 2.0 * _FAR)
    low, high = mip_level(near, bits, top), mip_level(far, bits, top)
    inverse = Ball(given.inverse, 2.0 * by.quotient * given.inverse, like)
    least, most, epsilon = LIMITLESS * box.least, LIMITLESS * box.most, number(given.epsilon, like)
    for level in range(low, high + 1):
        span = (shape[1] + (1 << level) - 1) >> level
        for k in range(box.texels):
            (j, i), a, b = texel_of(box, k), 0.0, 0.0
            place = given.first[level] + (j >> level) * span + (i >> level)
            if given.z_low[place] < np.inf and not (j == row and i == column):
                b = LIMITLESS
                if given.z_high[place] < np.inf:
                    v = vector_to(seen, point_of(given, shape[1], j * shape[1] + i, place, like), here)
                    a, b = term_of(inverse * v, normal, less, epsilon, given.cubed != 0.0)
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
    (height, width), like = seen.depth.shape, certain(0.0, by)
    for j in range(begin, stop):
        for i in range(width):
            texel, n = j * width + i, given.taps.shape[0]
            low, high = given.z_low[texel], given.z_high[texel]
            sums[1, j, i], sums[2, j, i] = LIMITLESS if low < np.inf else 0.0, n
            if not high < np.inf:
                continue
            z, here = ball_between(low, high, like), surface_of(seen, given, texel, like)
            normal, known = normal_of(seen, given, j, i, here)
            less = given.bias + rounded(given.depth_bias, 3, like) * (z - given.origin)
            reach = reaches_of(given, (height, width), j, i, z)
            if known:
                sums[1, j, i], sums[2, j, i] = 0.0, 0.0
                for s in range(n):
                    a, b, sure = tap_range(seen, given, landing, (j, i), s, reach, here, normal, less, by)
                    sums[0, j, i], sums[1, j, i] = sums[0, j, i] + a, sums[1, j, i] + b
                    sums[2, j, i] += 0.0 if sure else 1.0
