"""The exponential, of floats, balls and Python's numbers."""

from typing import Any

import numpy as np
from numba.extending import overload

from lfssao.core.balls import FLUSHED, SAFETY, UNKNOWN, Ball, ball, ball_between
from lfssao.core.elementary import exp
from lfssao.core.numbers import INLINED, FloatType, number, plain


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
