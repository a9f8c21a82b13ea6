"""Balls: numbers that say how far a renderer's may be off (running error analysis).

A *ball* (Arb's word) stands for any number of [value - error, value + error]. Each operation adds to what the operands'
errors make of the exact result its own rounding, at most r times the size of what is rounded, and ``FLUSHED`` for
numbers that may be flushed to zero. Errors are computed in float64, whose own rounding is 2^-29 of float32's;
``SAFETY`` times an error, applied once where the error is used, outweighs the rounding of a thousand such operations. A
plain number beside a ball is exact, rounded to float32, and so is a result that is 0 for sure. No error is infinite or
NaN: one of ``UNKNOWN`` and more says that nothing is known. A comparison of balls gives a *doubt*: whether it may hold,
and whether it must.
"""

import math
import operator

import numpy as np
from numba.extending import overload

from lfssao.core.ball_type import (
    FLUSHED,
    LARGE,
    SAFETY,
    TINY,
    UNKNOWN,
    Ball,
    ball,
    ball_between,
    ball_of,
    exact,
    flushed,
    rule,
)
from lfssao.core.doubts import Doubt, doubt
from lfssao.core.elementary import log2 as float_log2
from lfssao.core.elementary import power as float_power
from lfssao.core.jit import INLINED, formula
from lfssao.core.numbers import (
    alternatives,
    by_squaring,
    double,
    is_finite,
    is_number,
    is_plain,
    known,
    larger,
    least,
    line,
    log2,
    middle_of,
    most,
    number,
    power,
    rounded,
    select,
    smaller,
    smoothstep,
    spread_of,
    twice,
    within,
)

# Names of ``ball_type`` that others read here, so that the rules are always known.
__all__ = ["FLUSHED", "SAFETY", "TINY", "UNKNOWN", "Ball", "ball", "ball_between", "ball_of"]


@rule(operator.add)
def _add(x, y):
    """(x + e) + (y + f) = (x + y) + (e + f)."""
    s, e = x.value + y.value, x.error + y.error
    size = abs(s) + e
    return Ball(s, e + x.operation * size + flushed(FLUSHED, size), x)


@rule(operator.sub)
def _sub(x, y):
    """(x + e) - (y + f) = (x - y) + (e - f)."""
    s, e = x.value - y.value, x.error + y.error
    size = abs(s) + e
    return Ball(s, e + x.operation * size + flushed(FLUSHED, size), x)


@rule(operator.mul)
def _mul(x, y):
    """(x + e)(y + f) = x y + (x f + y e + e f)."""
    p, a, b = x.value * y.value, abs(x.value), abs(y.value)
    e = ((a + TINY) * y.error + (b + TINY) * x.error) + x.error * y.error
    size = abs(p) + e
    return Ball(p, min(UNKNOWN, e + x.operation * size + flushed(FLUSHED * (1.0 + a + b), size)), x)


@rule(operator.truediv)
def _div(x, y):
    """(x + e) / (y + f) = x / y + (e - (x / y) f) / (y + f); unknown where y may be 0."""
    room = abs(y.value) - y.error
    if not room > FLUSHED:
        return Ball(0.0, UNKNOWN, x)
    q = x.value / y.value
    e = (x.error + abs(q) * y.error) / room
    size = abs(q) + e
    return Ball(q, min(UNKNOWN, e + x.quotient * size + flushed(FLUSHED * (1.0 + 1.0 / room), size)), x)


@rule(np.sqrt)
def _sqrt(x):
    """sqrt(x + e) = sqrt(x) + e / (sqrt(x + e) + sqrt(x)), e with a flushed x; unknown where x may be negative."""
    if not x.value - x.error >= 0.0:
        return Ball(0.0, UNKNOWN, x)
    s, off = np.sqrt(x.value), x.error + FLUSHED
    e = off / (np.sqrt(max(x.value - off, 0.0)) + s) if s > 0.0 else 0.0
    return Ball(s, e + x.root * (s + e), x)


@rule(operator.neg)
def _neg(x):
    """No sign is rounded."""
    return Ball(-x.value, x.error, x)


@rule(abs)
def _abs(x):
    """|x + e| lies between max(|x| - e, 0) and |x| + e."""
    return ball_between(max(abs(x.value) - x.error, 0.0), abs(x.value) + x.error, x)


@rule(larger)
def _larger(x, y):
    """It grows with both, so its ends are those of their ends."""
    least = max(x.value - x.error * SAFETY, y.value - y.error * SAFETY)
    return ball_between(least, max(x.value + x.error * SAFETY, y.value + y.error * SAFETY), x)


@rule(smaller)
def _smaller(x, y):
    """It grows with both, so its ends are those of their ends."""
    least = min(x.value - x.error * SAFETY, y.value - y.error * SAFETY)
    return ball_between(least, min(x.value + x.error * SAFETY, y.value + y.error * SAFETY), x)


@rule(np.floor)
def _floor(x):
    """It grows with x, and is exact."""
    return ball_between(np.floor(x.value - x.error * SAFETY), np.floor(x.value + x.error * SAFETY), x)


@rule(np.trunc)
def _trunc(x):
    """It grows with x, and is exact."""
    return ball_between(np.trunc(x.value - x.error * SAFETY), np.trunc(x.value + x.error * SAFETY), x)


@rule(smoothstep)
def _smoothstep(x):
    """It grows with x. x^2 is at most the result, of which up to 17 are rounded, none of x = 1."""
    e = x.error * SAFETY
    low, high = min(max(x.value - e, 0.0), 1.0), min(max(x.value + e, 0.0), 1.0)
    if low == 1.0:
        return Ball(1.0, 0.0, x)
    off = 20.0 * x.operation
    least, most = (low * low) * (3.0 - 2.0 * low), (high * high) * (3.0 - 2.0 * high)
    flushed = FLUSHED if high > 0.0 else 0.0
    return ball_between(max(least * (1.0 - off) - flushed, 0.0), most * (1.0 + off) + flushed, x)


@overload(power, jit_options=INLINED)
def _power(x, k):
    """It grows with x: both ends by exp2(k log2 x), log2 off by 2^-21, below 1/2 by 3 ulp (Vulkan)."""
    if x != ball:
        return None

    def ends(x, k):
        if k == 1.0:
            return x
        low, high = max(x.value - x.error * SAFETY, 0.0), max(x.value + x.error * SAFETY, 0.0)
        least = float_power(min(low, 1.0), k) * (1.0 - _power_error(low, k, x))
        most = float_power(min(high, 1.0), k) * (1.0 + _power_error(high, k, x))
        return ball_between(max(least, 0.0), most, x)

    return ends


@overload(by_squaring, jit_options=INLINED)
def _by_squaring(x, times):
    """By squarings, three or more, or by exp2(k log2 x), k = 2^times, log2 off by 2^-21, below 1/2 by 3 ulp (Vulkan).

    That is off by most, relatively, where x is least. Below 2^-16 x^k is at most 2^-128, and 2^-100 outweighs it.
    """
    if x != ball:
        return None

    def powers(x, times):
        if not abs(x.value) + x.error < 2.0**40:
            return Ball(0.0, UNKNOWN, x)
        power, k = x, 1.0
        for _ in range(times):
            power, k = power * power, 2.0 * k
        least, size = max(x.value - x.error * SAFETY, 2.0**-16), abs(power.value) + power.error
        _, exponent = math.frexp(least)
        _, high = math.frexp(abs(x.value) + x.error * SAFETY)
        steps = k * max(1.0 - exponent, np.float64(high))
        off = x.constant + k * 2.0**-21 + steps * (x.slope + 5.0 * 2.0**-23)
        return Ball(power.value, power.error + off * size + 2.0**-100, x)

    return powers


@formula
def _power_error(x, k, like):
    """Relative error of x^k; x exceeds 1 by rounding alone."""
    if k == 0.0 or x == 0.0:
        return 0.0
    _, exponent = math.frexp(x)
    steps = k * (1 - exponent)  # k |log2 x| at most
    return like.constant + k * 2.0**-21 + steps * (like.slope + 5.0 * 2.0**-23) + 2.0 * k * max(x - 1.0, 0.0)


@rule(twice)
def _twice(x):
    """2 (x + e) = 2 x + 2 e."""
    return Ball(2.0 * x.value, 2.0 * x.error, x)


@rule(double)
def _double(x):
    """A renderer may compute in float32 all the way."""
    return x


@rule(is_number)
def _is_number(x):
    """A ball stands for numbers."""
    return Doubt(True, True)


@rule(log2)
def _log2(x):
    """It grows with x: both ends, log2 off by 2^-21, and by 3 ulp more (Vulkan). From 2^-1000 to 2^1000."""
    low, high = max(x.value - x.error * SAFETY, 2.0**-1000), max(x.value + x.error * SAFETY, 2.0**-1000)
    least, most = float_log2(low), float_log2(min(high, 2.0**1000))
    off = 2.0**-21 + 3.0 * 2.0**-23 * max(abs(least), abs(most))
    return ball_between(least - off, most + off, x)


@rule(is_finite)
def _is_finite(x):
    """A number from 2^126 on may be infinite in float32."""
    return Doubt(True, abs(x.value) + x.error < LARGE)


@rule(operator.gt)
def _gt(x, y):
    """It must hold if x - y exceeds both errors, and may unless y - x is as much."""
    room = (x.error + y.error) * SAFETY
    return Doubt(not x.value - y.value <= -room, x.value - y.value > room)


@rule(operator.ge)
def _ge(x, y):
    """It must hold if x - y is both errors or more."""
    room = (x.error + y.error) * SAFETY
    return Doubt(not x.value - y.value < -room, x.value - y.value >= room)


@rule(operator.lt)
def _lt(x, y):
    """Holds where y > x does."""
    return y > x


@rule(operator.le)
def _le(x, y):
    """Holds where y >= x does."""
    return y >= x


@rule(operator.eq)
def _eq(x, y):
    """It must hold of exact numbers alone."""
    room = (x.error + y.error) * SAFETY
    return Doubt(not abs(x.value - y.value) > room, x.value == y.value and room == 0.0)


@overload(number, jit_options=INLINED)
def _number(x, like):
    return exact if like == ball and is_plain(x) else None


@overload(known, jit_options=INLINED)
def _known(x, value):
    return (lambda x, value: Ball(np.float64(value), 0.0, x)) if x == ball else None


@overload(rounded, jit_options=INLINED)
def _rounded(x, times, like, quotients=0):
    if like != ball:
        return None
    if x == ball:
        return _rounded_ball

    def computed(x, times, like, quotients=0):
        """(1 + r)^n is at most 1 + n r (1 + n r), if n r < 1."""
        off = times * like.operation + quotients * like.quotient
        return Ball(exact(x, like).value, off * (1.0 + off) * abs(x) + FLUSHED, like)

    return computed


def _rounded_ball(x, times, like, quotients=0):
    """By (1 + r)^n - 1 < n r (1 + n r) of themselves more."""
    r = times * x.operation + quotients * x.quotient
    return Ball(x.value, x.error + r * (1.0 + r) * (abs(x.value) + x.error) + (times + quotients) * FLUSHED, x)


@rule(least)
def _least(x):
    """Exact, where it is finite."""
    return Ball(x.value - x.error * SAFETY, 0.0, x) if x.error < UNKNOWN else x


@rule(most)
def _most(x):
    """Exact, where it is finite."""
    return Ball(x.value + x.error * SAFETY, 0.0, x) if x.error < UNKNOWN else x


@rule(middle_of)
def _middle_of(x):
    """Exact, where it is finite."""
    return Ball(x.value, 0.0, x) if x.error < UNKNOWN else x


@rule(spread_of)
def _spread_of(x):
    """Around 0."""
    return Ball(0.0, x.error, x)


@overload(line, jit_options=INLINED)
def _line(start, slope, at, middle):
    if at != ball:
        return None

    def either(start, slope, at, middle):
        """Each of three terms is rounded as two products and in two sums at most, multiplied out or not."""
        a, m, off = abs(slope), abs(middle), at.error
        size = abs(start) + a * (abs(at.value) + off + m)
        flushed = FLUSHED * (2.0 + a + m)
        return Ball(start + slope * (at.value - middle), 6.0 * at.operation * size + a * off + flushed, at)

    return either


@overload(within, jit_options=INLINED)
def _within(x, low, high):
    if x != ball:
        return None

    def held(x, low, high):
        off = x.error * SAFETY
        if not off < UNKNOWN:
            return ball_between(low, high, x)
        return ball_between(min(max(x.value - off, low), high), max(min(x.value + off, high), low), x)

    return held


@overload(select, jit_options=INLINED)
def _select_balls(condition, x, y):
    if x == ball and is_plain(y):
        return lambda condition, x, y: select(condition, x, exact(y, x))
    if is_plain(x) and y == ball:
        return lambda condition, x, y: select(condition, exact(x, y), y)
    if not x == y == ball:
        return None
    if condition == doubt:
        return lambda condition, x, y: x if condition.must else alternatives(x, y) if condition.may else y
    return lambda condition, x, y: x if condition else y


@overload(alternatives, jit_options=INLINED)
def _alternative_doubts(x, y):
    return (lambda x, y: Doubt(x.may | y.may, x.must & y.must)) if x == y == doubt else None


@rule(alternatives)
def _alternatives(x, y):
    """All between the ends of both."""
    return ball_between(min(x.value - x.error, y.value - y.error), max(x.value + x.error, y.value + y.error), x)
