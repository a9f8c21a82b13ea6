"""Running error analysis of float32 renderers: numbers as pairs of an exact value and a bound on its error.

A ``Pair`` stands for any number of [value - error, value + error]. Each operation on pairs adds to what the operands'
errors make of the exact result its own rounding, at most r times the size of what is rounded, and ``FLUSHED`` for
numbers that may be flushed to zero:

    (x + e)(y + f) = x y + (x f + y e + e f)
    (x + e) / (y + f) = x / y + (e - (x / y) f) / (y + f)
    sqrt(x + e) = sqrt(x) + e / (sqrt(x + e) + sqrt(x))

Errors are computed in float64, whose own rounding is 2^-29 of float32's. ``SAFETY`` times an error, applied once where
the error is used, outweighs the rounding of a thousand such operations.
"""

from typing import NamedTuple

import numpy as np

from lfssao.core.jit import kernel

FLUSHED = 2.0**-124  # four flushed numbers: an operation's operands and its result, and one to spare
SAFETY = 1.0 + 2.0**-20


class Pair(NamedTuple):
    """A number in exact arithmetic, and how far a renderer's may be off."""

    value: float
    error: float


class Errors(NamedTuple):
    """Errors of + - *, quotients, roots and offsets, relative; of look-ups, in texels; of sines of turns."""

    operation: float
    quotient: float
    root: float
    offset: float
    coordinate: float
    angle: float
    constant: float = 0.0  # of exp(x), relative, and times abs(x)
    slope: float = 0.0


@kernel(inline=True)
def exact(x):
    """A number that every renderer has."""
    return Pair(x, 0.0)


@kernel(inline=True)
def triple(x):
    """Three numbers as exact pairs."""
    return exact(np.float64(x[0])), exact(np.float64(x[1])), exact(np.float64(x[2]))


@kernel(inline=True)
def add(x, y, by):
    """Sum x + y."""
    s = x.value + y.value
    e = x.error + y.error
    return Pair(s, e + by.operation * (abs(s) + e) + FLUSHED)


@kernel(inline=True)
def sub(x, y, by):
    """Difference x - y."""
    return add(x, Pair(-y.value, y.error), by)


@kernel(inline=True)
def mul(x, y, by):
    """Product x y."""
    p = x.value * y.value
    e = (abs(x.value) * y.error + abs(y.value) * x.error) + x.error * y.error
    return Pair(p, e + by.operation * (abs(p) + e) + FLUSHED * (1.0 + abs(x.value) + abs(y.value)))


@kernel(inline=True)
def div(x, y, by):
    """Quotient x / y; its error is infinite where y may be 0."""
    q = x.value / y.value
    room = abs(y.value) - y.error
    if not room > FLUSHED:
        return Pair(q, np.inf)
    e = (x.error + abs(q) * y.error) / room
    return Pair(q, e + by.quotient * (abs(q) + e) + FLUSHED * (1.0 + 1.0 / room))


@kernel(inline=True)
def root(x, by):
    """Square root of x; its error is infinite where x may be negative."""
    if not x.value - x.error >= 0.0:
        return Pair(0.0, np.inf)
    s = np.sqrt(x.value)
    e = x.error / (np.sqrt(x.value - x.error) + s) if s > 0.0 else np.sqrt(x.error)
    return Pair(s, e + by.root * (s + e) + FLUSHED)


@kernel(inline=True)
def dot(x, y, by):
    """Dot product of two triples of pairs, added in any order: three roundings of each term. Zero terms stay exact."""
    value = (x[0].value * y[0].value + x[1].value * y[1].value) + x[2].value * y[2].value
    own, size, flushed = 0.0, 0.0, 3.0
    for k in range(3):
        a, b = abs(x[k].value), abs(y[k].value)
        own += (a * y[k].error + b * x[k].error) + x[k].error * y[k].error
        size += (a + x[k].error) * (b + y[k].error)
        flushed += a + b
    if size == 0.0:
        return exact(value)
    r = by.operation
    return Pair(value, own + 3.0 * (1.0 + 3.0 * r) * r * size + FLUSHED * flushed)


@kernel(inline=True)
def apart(a, b, by):
    """Difference a - b of two triples."""
    return sub(a[0], b[0], by), sub(a[1], b[1], by), sub(a[2], b[2], by)


@kernel(inline=True)
def plus(a, b, by):
    """Sum a + b of two triples."""
    return add(a[0], b[0], by), add(a[1], b[1], by), add(a[2], b[2], by)


@kernel(inline=True)
def times(a, x, by):
    """Triple a times x."""
    return mul(a[0], x, by), mul(a[1], x, by), mul(a[2], x, by)


@kernel(inline=True)
def cross(a, b, by):
    """Cross product of two triples."""
    return (
        sub(mul(a[1], b[2], by), mul(a[2], b[1], by), by),
        sub(mul(a[2], b[0], by), mul(a[0], b[2], by), by),
        sub(mul(a[0], b[1], by), mul(a[1], b[0], by), by),
    )


@kernel(inline=True)
def ramp(x):
    """The larger of x and 0."""
    least, largest = max(x.value - x.error * SAFETY, 0.0), max(x.value + x.error * SAFETY, 0.0)
    return Pair(0.5 * (least + largest), 0.5 * (largest - least))


@kernel(inline=True)
def positive(x):
    """Whether x may be above 0, and whether it is for sure."""
    room = x.error * SAFETY
    return not x.value <= -room, x.value > room
