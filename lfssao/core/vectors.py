"""Vectors of formulas; right-angled axes around a direction, and directions of length 1."""

import operator
from math import sqrt
from typing import Any

import numpy as np
from numba.extending import overload

from lfssao.core.balls import FLUSHED, TINY, UNKNOWN, Ball, ball
from lfssao.core.jit import INLINED, formula
from lfssao.core.numbers import as_float, bare, number, plain, rounded, select, struct


@formula
def unit(x, y, z):
    """A vector over its length, after a division by its largest component; (0, 0, 0) stays."""
    zero = type(x)(0)
    size = max(abs(x), abs(y), abs(z))
    there = size > zero
    x, y, z = x / size, y / size, z / size
    length = type(x)(sqrt((x * x + y * y) + z * z))
    return x / length if there else zero, y / length if there else zero, z / length if there else zero


class Vector:
    """Three numbers of a kind, x, y and z, with the operators of vectors."""

    def __init__(self, x: Any, y: Any, z: Any) -> None:
        self.x, self.y, self.z = x, y, z

    def __add__(self, other: Any) -> Any:
        return Vector(self.x + other.x, self.y + other.y, self.z + other.z)

    def __sub__(self, other: Any) -> Any:
        return Vector(self.x - other.x, self.y - other.y, self.z - other.z)

    def __rmul__(self, factor: Any) -> Any:
        return Vector(factor * self.x, factor * self.y, factor * self.z)


VectorType = struct(Vector, "x", "y", "z")


@overload(operator.add, jit_options=INLINED)
def _add(a, b):
    both = isinstance(a, VectorType) and isinstance(b, VectorType)
    return (lambda a, b: Vector(a.x + b.x, a.y + b.y, a.z + b.z)) if both else None


@overload(operator.sub, jit_options=INLINED)
def _sub(a, b):
    both = isinstance(a, VectorType) and isinstance(b, VectorType)
    return (lambda a, b: Vector(a.x - b.x, a.y - b.y, a.z - b.z)) if both else None


@overload(operator.mul, jit_options=INLINED)
def _scale(a, b):
    return (lambda a, b: Vector(a * b.x, a * b.y, a * b.z)) if isinstance(b, VectorType) else None


def dot(a: Any, b: Any) -> Any:
    """Return (a.x b.x + a.y b.y) + a.z b.z; of balls added in any order."""
    return (a.x * b.x + a.y * b.y) + a.z * b.z


@overload(dot, jit_options=INLINED)
def _dot(a, b):
    return _dot_of_balls if a == b == VectorType(ball, ball, ball) else bare(dot)


def _dot_of_balls(a, b):
    """Each of the three terms is rounded as a product, and twice on its way, whatever the order."""
    value, own, size, flushed, r = 0.0, 0.0, 0.0, 3.0, a.x.operation
    for x, y in ((a.x, b.x), (a.y, b.y), (a.z, b.z)):
        p, q = abs(x.value), abs(y.value)
        value += x.value * y.value
        own += ((p + TINY) * y.error + (q + TINY) * x.error) + x.error * y.error
        size += (p + x.error) * (q + y.error)
        flushed += p + q
    return Ball(value, min(UNKNOWN, own + 3.0 * (1.0 + 3.0 * r) * r * size + min(FLUSHED * flushed, 4.0 * size)), a.x)


@formula
def cross(a: Any, b: Any) -> Any:
    """Return the cross product."""
    return Vector(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


def unit_vector(v: Any) -> Any:
    """Return a vector over its length, 0 of 0; of balls divided by its largest coordinate before, or not."""
    return Vector(*unit(v.x, v.y, v.z))


@overload(unit_vector, jit_options=INLINED)
def _unit_vector(v):
    if v == VectorType(ball, ball, ball):
        return _unit_vector_of_balls

    def floats(v):
        x, y, z = unit(plain(v.x), plain(v.y), plain(v.z))
        return Vector(as_float(x), as_float(y), as_float(z))

    return floats


def _unit_vector_of_balls(v):
    """A quotient by the largest coordinate, and its square root: three quotients more."""
    scale = 1 / np.sqrt(dot(v, v))
    return rounded(scale, 0, scale, 3) * v


@formula
def disk_axes(w: Any, towards: Any) -> Any:
    """Return two unit vectors at right angles to the unit vector w and to each other (Duff et al. 2017).

    towards: whether w.z >= 0.
    """
    sign = select(towards, number(1, w.z), -1)
    a = -1 / (sign + w.z)
    b = w.x * w.y * a
    return Vector(1 + sign * w.x * w.x * a, sign * b, -sign * w.x), Vector(b, sign + w.y * w.y * a, -w.y)
