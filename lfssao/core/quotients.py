"""Quotients over one divisor, whose sums of balls know that it is one: its error counts once, and may cancel."""

import operator
from typing import Any

from numba.extending import overload

from lfssao.core.balls import FLUSHED, UNKNOWN, Ball, ball
from lfssao.core.jit import INLINED
from lfssao.core.numbers import is_plain, of_floats, rounded, struct


def over(x: Any, divisor: Any) -> Any:
    """Return x / divisor, to be multiplied by numbers and added to others over that very divisor, and ``divided``.

    The divisor is one and the same number in all of them, of balls, too.
    """
    return x / divisor


def divided(x: Any) -> Any:
    """Return a sum of multiples of quotients that ``over`` has made, as a number."""
    return x


def Quotient(numerator, divisor, flushed):  # noqa: N802
    """A sum of quotients over one divisor, balls, that are rounded but not divided; how many may be flushed."""


QuotientType = struct(Quotient, "numerator", "divisor", "flushed")
of_floats(over)
of_floats(divided)


@overload(over, jit_options=INLINED)
def _over(x, divisor):
    """A quotient x / t is rounded by as much of itself as x is here of itself."""
    if not x == divisor == ball:
        return None
    return lambda x, divisor: Quotient(rounded(x, 0, x, 1), divisor, 1.0)


@overload(operator.mul, jit_options=INLINED)
def _scale_quotient(x, y):
    if not (is_plain(x) and isinstance(y, QuotientType)):
        return None
    return lambda x, y: Quotient(x * y.numerator, y.divisor, abs(x) * (y.flushed + 1.0) + 1.0)


@overload(operator.add, jit_options=INLINED)
def _add_quotients(x, y):
    if not (isinstance(x, QuotientType) and isinstance(y, QuotientType)):
        return None

    def add(x, y):
        s, t, u = x.numerator + y.numerator, x.divisor, y.divisor
        one = t.value == u.value and t.error == u.error
        return Quotient(Ball(s.value, s.error if one else UNKNOWN, s), t, x.flushed + y.flushed + 1.0)

    return add


@overload(divided, jit_options=INLINED)
def _divided(x):
    """(n + e) / (t + f) = n / t + (e - (n / t) f) / (t + f); unknown where t may be 0."""
    if not isinstance(x, QuotientType):
        return None

    def divide(x):
        n, t = x.numerator, x.divisor
        room = abs(t.value) - t.error
        if not room > FLUSHED:
            return Ball(0.0, UNKNOWN, n)
        q = n.value / t.value
        e = (n.error + abs(q) * t.error) / room + FLUSHED * x.flushed * (1.0 + 1.0 / room)
        return Ball(q, min(UNKNOWN, e), n)

    return divide
