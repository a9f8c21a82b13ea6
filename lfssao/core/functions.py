"""The exponential, sine and cosine, the angle of a cosine and a crude root, of floats, balls and Python's numbers."""

from typing import Any

import numpy as np
from numba.extending import overload

from lfssao.core.balls import FLUSHED, SAFETY, UNKNOWN, Ball, ball, ball_between
from lfssao.core.elementary import PI, acos, exp, root_of_bits, sincospi
from lfssao.core.jit import INLINED, formula
from lfssao.core.numbers import FloatType, as_float, number, plain


def exponential(x: Any) -> Any:
    """Return e^x, x at most 88: in float64, rounded once."""
    return x.exponential() if hasattr(x, "exponential") else number(exp(np.float64(x)), x)


@overload(exponential, jit_options=INLINED)
def _exponential(x):
    """It grows with x: both ends of a ball, each off by a part that grows with the exponent; tiny ones are flushed."""
    if isinstance(x, FloatType):
        return lambda x: number(exp(np.float64(plain(x))), x)
    if x != ball:
        return None

    def ends(x):
        low, high = x.value - x.error * SAFETY, x.value + x.error * SAFETY
        if not high <= 88.0:
            return Ball(0.0, UNKNOWN, x)
        least = exp(low) * (1.0 - (x.constant + x.slope * abs(low)))
        most = exp(high) * (1.0 + (x.constant + x.slope * abs(high)))
        return ball_between(least if least > FLUSHED else 0.0, max(most, FLUSHED), x)

    return ends


def arc_cosine(x: Any) -> Any:
    """Return the angle, 0 to pi, of a cosine that is held between -1 and 1: in float64, rounded once."""
    return x.arc_cosine() if hasattr(x, "arc_cosine") else number(acos(np.float64(x)), x)


@overload(arc_cosine, jit_options=INLINED)
def _arc_cosine(x):
    if not isinstance(x, FloatType):
        return None
    return lambda x: number(as_float(acos(np.float64(plain(x)))), x)


@formula
def arc_cosine_of_ball(x, relative):
    """The same of a ball, off by a part of itself: it falls with x, so its ends are those of x's ends.

    A renderer may take atan2(sqrt(1 - x x), x) (Vulkan), whose product is that of an x that is off by a rounding.
    """
    off = x.error * SAFETY + x.operation
    least, most = acos(max(-1.0, min(1.0, x.value + off))), acos(max(-1.0, min(1.0, x.value - off)))
    return ball_between(least * (1.0 - relative), most * (1.0 + relative), x)


def cosine_and_sine(x: Any) -> Any:
    """Return cosine and sine of an angle, radians, of a few turns at most: in float64, rounded once."""
    if hasattr(x, "cosine_and_sine"):
        return x.cosine_and_sine()
    sine, cosine = sincospi(np.float64(x) / PI)
    return number(cosine, x), number(sine, x)


@overload(cosine_and_sine, jit_options=INLINED)
def _cosine_and_sine(x):
    if not isinstance(x, FloatType):
        return None

    def both(x):
        sine, cosine = sincospi(np.float64(plain(x)) / PI)
        return number(as_float(cosine), x), number(as_float(sine), x)

    return both


@formula
def cosine_and_sine_of_ball(x, absolute):
    """The same of a ball, each off by as much as the angle, and by a renderer's error."""
    sine, cosine = sincospi(x.value / PI)
    off = min(2.0, x.error * SAFETY + absolute)
    return Ball(cosine, off, x), Ball(sine, off, x)


def crude_root(x: Any) -> Any:
    """Return the square root of x >= 0 by half of the bits of its float32 (``elementary.root_of_bits``)."""
    return x.crude_root() if hasattr(x, "crude_root") else number(root_of_bits(np.float64(x)), x)


@overload(crude_root, jit_options=INLINED)
def _crude_root(x):
    """It grows with x: of a ball both ends, where a tiny number may be flushed."""
    if isinstance(x, FloatType):
        return lambda x: number(as_float(root_of_bits(np.float64(plain(x)))), x)
    if x != ball:
        return None

    def ends(x):
        low, high = x.value - x.error * SAFETY, x.value + x.error * SAFETY
        if not high < UNKNOWN:
            return Ball(0.0, UNKNOWN, x)
        return ball_between(root_of_bits(low if low > FLUSHED else 0.0), root_of_bits(max(high, FLUSHED)), x)

    return ends
