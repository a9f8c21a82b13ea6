"""The rows of a mapping, applied to a point and to what is added to it: the half of a mapping that is affine.

A formula writes a place as P + x A + y B, P the image of a point and A and B those of directions, by the words ``at``
and ``along`` of a view. As floats all are rows of the mapping, four numbers, and the written order makes the bits. As
balls they are vectors of world space still, as a renderer may apply a row to each or to their sum.
"""

import operator
from typing import Any

import numpy as np
from numba.extending import overload

from lfssao.core.balls import FLUSHED, TINY, UNKNOWN, Ball, ball
from lfssao.core.doubts import Doubt
from lfssao.core.jit import INLINED, formula
from lfssao.core.numbers import bare, is_plain, number, struct
from lfssao.core.vectors import Vector, VectorType


class Rows:
    """Rows u, v, divisor and cast z of a mapping, with the operators of vectors."""

    def __init__(self, u, v, q, z):
        self.u, self.v, self.q, self.z = u, v, q, z

    def __add__(self, other):
        return Rows(self.u + other.u, self.v + other.v, self.q + other.q, self.z + other.z)

    def __sub__(self, other):
        return Rows(self.u - other.u, self.v - other.v, self.q - other.q, self.z - other.z)

    def __rmul__(self, factor):
        return Rows(factor * self.u, factor * self.v, factor * self.q, factor * self.z)


RowsType = struct(Rows, "u", "v", "q", "z")


@formula
def linear_rows(m, vector):
    """Four rows of M (x, y, z, 0), each (m0 x + m1 y) + m2 z; m: (16,)."""
    x, y, z = vector.x, vector.y, vector.z
    return Rows(
        (m[0] * x + m[1] * y) + m[2] * z,
        (m[4] * x + m[5] * y) + m[6] * z,
        (m[8] * x + m[9] * y) + m[10] * z,
        (m[12] * x + m[13] * y) + m[14] * z,
    )


@formula
def affine_rows(m, point):
    """Four rows of M (x, y, z, 1), each ((m0 x + m1 y) + m2 z) + m3; m: (16,)."""
    a = linear_rows(m, point)
    return Rows(a.u + m[3], a.v + m[7], a.q + m[11], a.z + m[15])


@formula
def image_place(u: Any, v: Any) -> Any:
    """The place of an image point, which a camera's mapping leaves as it is: of quotient 1."""
    return Rows(u, v, number(1, u), number(0, u))


def affine(m, row, point):
    """A row of M (x, y, z, 1), M an array of rows of four, of a point."""
    k = 4 * row
    return ((m[k] * point.x + m[k + 1] * point.y) + m[k + 2] * point.z) + m[k + 3]


@overload(affine, jit_options=INLINED)
def _affine(m, row, point):
    if point == VectorType(ball, ball, ball):
        return lambda m, row, point: row_of_spot(m, row, point_spot(point))
    return bare(affine)


def Spot(point, offset, sizes, points, later, sums, products):  # noqa: N802 - it reads as a type
    """A point and an offset, balls; sizes of the offset's terms; how often one of them is added, and multiplied.

    The offset's own errors are those of its terms; their roundings are counted by ``row_of_spot``, which has the sizes.
    points: 1 if there is a point, else 0. later: how often something was added to it.
    """


SpotType = struct(Spot, "point", "offset", "sizes", "points", "later", "sums", "products")


@formula
def point_spot(p):
    """The place of a point, a vector of balls."""
    nothing = Ball(0.0, 0.0, p.x)
    return Spot(p, Vector(nothing, nothing, nothing), (0.0, 0.0, 0.0), 1.0, 0.0, 0.0, 0.0)


@formula
def offset_spot(o):
    """An offset, a vector of balls, to be added to a place."""
    nothing = Ball(0.0, 0.0, o.x)
    sizes = abs(o.x.value) + o.x.error, abs(o.y.value) + o.y.error, abs(o.z.value) + o.z.error
    return Spot(Vector(nothing, nothing, nothing), o, sizes, 0.0, 0.0, 0.0, 0.0)


@formula
def _product(k, x):
    """A product that is not rounded, but may be flushed."""
    p, q = abs(k.value), abs(x.value)
    e = ((p + TINY) * x.error + (q + TINY) * k.error) + k.error * x.error + FLUSHED * (1.0 + p + q)
    return Ball(k.value * x.value, min(UNKNOWN, e), x)


@formula
def _sum(a, sign, b):
    """A sum or a difference that is not rounded."""
    return Vector(
        Ball(a.x.value + sign * b.x.value, a.x.error + b.x.error, a.x),
        Ball(a.y.value + sign * b.y.value, a.y.error + b.y.error, a.x),
        Ball(a.z.value + sign * b.z.value, a.z.error + b.z.error, a.x),
    )


@formula
def _sum_of_spots(a, sign, b):
    """A place or an offset and another, added or subtracted."""
    (x, y, z), (u, v, w) = a.sizes, b.sizes
    points, later = a.points + b.points, a.later + b.later
    point, offset = _sum(a.point, sign, b.point), _sum(a.offset, sign, b.offset)
    sums, products = a.sums + b.sums + 1.0, max(a.products, b.products)
    return Spot(point, offset, (x + u, y + v, z + w), points, later + points, sums, products)


@overload(operator.add, jit_options=INLINED)
def _add(a, b):
    if isinstance(a, RowsType) and isinstance(b, RowsType):
        return lambda a, b: Rows(a.u + b.u, a.v + b.v, a.q + b.q, a.z + b.z)
    both = isinstance(a, SpotType) and isinstance(b, SpotType)
    return (lambda a, b: _sum_of_spots(a, 1.0, b)) if both else None


@overload(operator.sub, jit_options=INLINED)
def _subtract(a, b):
    if isinstance(a, RowsType) and isinstance(b, RowsType):
        return lambda a, b: Rows(a.u - b.u, a.v - b.v, a.q - b.q, a.z - b.z)
    both = isinstance(a, SpotType) and isinstance(b, SpotType)
    return (lambda a, b: _sum_of_spots(a, -1.0, b)) if both else None


@overload(operator.mul, jit_options=INLINED)
def _scale(a, b):
    if isinstance(b, RowsType):
        return lambda a, b: Rows(a * b.u, a * b.v, a * b.q, a * b.z)
    if isinstance(b, SpotType) and is_plain(a):
        return lambda a, b: Ball(np.float64(a), 0.0, b.point.x) * b
    if not (isinstance(b, SpotType) and a == ball):
        return None

    def scale(a, b):
        o, (x, y, z), k = b.offset, b.sizes, abs(a.value) + a.error
        moved = Vector(_product(a, o.x), _product(a, o.y), _product(a, o.z))
        return Spot(b.point, moved, (k * x, k * y, k * z), b.points, b.later, b.sums, b.products + 1.0)

    return scale


@formula
def row_of_spot(m, row, spot):
    """A row of M (P + o, 1), M of numbers that all renderers have.

    The row has n coefficients and a constant or none, c = 1 or 0. Applied to the point and to the offset, in any order,
    or to their sum, it rounds each of its terms once as a product and 2 n + c - 1 times on its way through the sums at
    most. Each vector more that is added to an offset adds one sum, and each factor of an offset before one rounding.
    Several vectors count for the point, too, each that is added to it, the first one to spare, for sums with 0
    where coefficients are 0. So a term t is off by T r (1 + T r) abs(t), of T roundings, if T r < 2^-10.
    """
    k = 4 * row
    p, o, r, (size_x, size_y, size_z) = spot.point, spot.offset, spot.point.x.operation, spot.sizes
    own, flushed = 0.0, 4.0  # flushed may be operands, products and the sums
    size, moved, value = abs(m[k + 3]), 0.0, 0.0
    terms = 1.0 if m[k + 3] != 0.0 else 0.0
    for c, x, y, s in ((0, p.x, o.x, size_x), (1, p.y, o.y, size_y), (2, p.z, o.z, size_z)):
        a = abs(m[k + c])
        terms += 2.0 if a != 0.0 else 0.0
        size += a * (abs(x.value) + x.error)
        moved += a * s
        own += a * (x.error + y.error)
        flushed += 8.0 * a + abs(x.value) + s if a != 0.0 else 0.0
        value += m[k + c] * (x.value + y.value)
    more = terms + max(spot.sums - 1.0, 0.0) + spot.products
    terms += spot.later if spot.sums > 1.0 else 0.0
    rounded = terms * (1.0 + terms * r) * r * size + more * (1.0 + more * r) * r * moved
    return Ball(value + m[k + 3], min(UNKNOWN, rounded + own + FLUSHED * flushed), p.x)


def row_of(m, row, place):
    """A row of M of a place of balls; of ``image_place`` its own."""


@overload(row_of, jit_options=INLINED)
def _row_of(m, row, place):
    if isinstance(place, SpotType):
        return lambda m, row, place: row_of_spot(m, row, place)  # noqa: PLW0108 - its parameters count
    if not isinstance(place, RowsType):
        return None
    return lambda m, row, place: place.u if row == 0 else place.v if row == 1 else place.q if row == 2 else place.z


def image_or(place, image):
    """The image point of a place of balls: of ``image_place`` its own, which nobody divides."""


@overload(image_or, jit_options=INLINED)
def _image_or(place, image):
    if isinstance(place, RowsType):
        return lambda place, image: (place.u, place.v, Doubt(True, True))
    return (lambda place, image: image) if isinstance(place, SpotType) else None
