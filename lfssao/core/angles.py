"""The angle of a cosine, of floats, balls and Python's numbers."""

from typing import Any

import numpy as np
from numba.extending import overload

from lfssao.core.balls import SAFETY, ball_between
from lfssao.core.elementary import acos
from lfssao.core.numbers import INLINED, FloatType, as_float, formula, number, plain


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
