"""World -> image of any mapping, of balls, and the image z of cameras' windows."""

from typing import Any, NamedTuple

import numpy as np

from lfssao.core.balls import SAFETY, Ball, ball_of
from lfssao.core.intrinsics import memory_of
from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import number
from lfssao.core.places import point_spot, row_of_spot
from lfssao.core.vectors import Vector
from lfssao.optics.kernels.projection import MATRIX, image_of


class Errors(NamedTuple):
    """Errors of a model: relative ones of + - *, quotients, roots and offsets R s, of look-ups, texels, and of sines.

    model: (5,) float64, those of balls: of + - *, quotients, roots, and of exp(x), and times abs(x).
    """

    operation: float
    quotient: float
    root: float
    offset: float
    coordinate: float
    angle: float
    model: np.ndarray


@formula
def bare_errors(by):
    """Errors whose model is bare memory."""
    return Errors(by.operation, by.quotient, by.root, by.offset, by.coordinate, by.angle, memory_of(by.model))


class Projected(NamedTuple):
    """An image point of balls, and whether it may lie, and lies for sure, in the mapping's domain."""

    u: Any
    v: Any
    z: Any
    may: bool
    must: bool


@formula
def certain(x, by):
    """A number that every renderer has, a ball of the model ``by``, which may be a ball."""
    return ball_of(np.float64(x), 0.0, by.model)


@formula
def certain_vector(v, by):
    """A vector that every renderer has."""
    return Vector(certain(v[0], by), certain(v[1], by), certain(v[2], by))


@formula
def project(kind, numbers, place):
    """The image point of a place; numbers: the mapping's, rounded, (16,) or (44,)."""
    a, b, c = row_of_spot(numbers, 0, place), row_of_spot(numbers, 1, place), row_of_spot(numbers, 2, place)
    q = row_of_spot(numbers, 3, place) if kind == MATRIX else number(1, a)
    u, v, valid = image_of(kind, numbers[12:], a, b, q, c)
    return Projected(u, v, c / q if kind == MATRIX else c, valid.may, valid.must)


@formula
def widen(image, by):
    """An image point with its errors as they count: a look-up's miss added, float64's own rounding outweighed."""
    u, v, z = image.u, image.v, image.z
    u = Ball(u.value, u.error * SAFETY + by.coordinate, u)
    v = Ball(v.value, v.error * SAFETY + by.coordinate, v)
    return Projected(u, v, Ball(z.value, z.error * SAFETY, z), image.may, image.must)


@formula
def linear_room(m, z, q, depth, by):
    """By how much a window depth d may seem off where a perspective camera's renderer makes a distance of it first.

    d = a - b / z, so a renderer may divide by D = s (a - d) in float32 and compare z of sample and surface. As z grows
    with d, errors of D / s count as those of d: r abs(2 d - 1) for 2 d - 1 and its product (r abs(d) without it),
    r a / 2 for the first sum of far + near - (2 d - 1) (far - near) in any order, and (r + 2 q) (a - d) for the last
    sum, the quotient, and another by far. Constants are the same for both depths, and keep their order. a follows from
    the rows of ``m`` that begin at z and q, those of d and its divisor. Infinite where D may be 0; 0 of an orthographic
    camera, and of image z that is made of distances.
    """
    size = (m[q] * m[q] + m[q + 1] * m[q + 1]) + m[q + 2] * m[q + 2]
    if size == 0.0 or (m[z] == 0.0 and m[z + 1] == 0.0 and m[z + 2] == 0.0):
        return 0.0
    a = ((m[z] * m[q] + m[z + 1] * m[q + 1]) + m[z + 2] * m[q + 2]) / size
    d, e, r = depth.value, depth.error, by.operation
    room = r * (max(abs(d), abs(2.0 * d - 1.0)) + 2.0 * e + 0.5 * abs(a)) + (r + 2.0 * by.quotient) * (abs(a - d) + e)
    room *= 1.0 + 2.0**-16  # a of rounded numbers, and rooms that grow with the distance
    return room if e + room < abs(a - d) else np.inf


@kernel(rows="positions", few=50_000)
def map_positions(begin, stop, positions, allowance, kind, numbers, by, image, error, sure):
    """Write image points of positions off by ``allowance``, their errors, u's -infinity for none, and what is sure."""
    like = certain(0.0, by)
    for k in range(begin, stop):
        (x, y, z), (a, b, c) = positions[k], allowance[k]
        found = project(kind, numbers, point_spot(Vector(Ball(x, a, like), Ball(y, b, like), Ball(z, c, like))))
        image[k, 0], error[k, 0] = found.u.value, found.u.error
        image[k, 1], error[k, 1] = found.v.value, found.v.error
        image[k, 2], error[k, 2] = found.z.value, found.z.error
        sure[k] = found.must
        if not found.may:
            error[k, 0] = -np.inf
