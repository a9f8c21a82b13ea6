"""Numbers with their exact value and a bound of their rounding error, on which formulas run as they are written.

``lfssao.core.numbers`` says what formulas are. Here they run in Python, so that one text makes the bits, the exact
value and the bound (running error analysis).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import reduce
from math import ceil, expm1, floor, inf, isfinite, isqrt, log, log1p, log2, trunc
from operator import and_, or_
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from lfssao.bench.stability import exact_functions as functions

_PLAIN = int, float, np.number  # types of plain numbers
_NORMAL = Fraction(1, 2**1022)  # the smallest
_SAFETY = 1.0 + 2.0**-40  # more than the dozen float64 operations of a bound can have rounded away


@dataclass(frozen=True)
class Arithmetic:
    """Operations rounded to nearest."""

    unit: float = 0.0  # unit roundoff, half an ulp of 1; 0 for exact arithmetic
    tiny: float = 0.0  # half the smallest subnormal number
    largest: float = inf  # largest finite number; the error beyond it is unbounded
    probe: float = 0.0  # relative error of inputs

    @classmethod
    def of(cls, dtype: DTypeLike) -> "Arithmetic":
        """Return the arithmetic of float32 or float64."""
        info = np.finfo(dtype)
        return cls(float(info.epsneg), float(info.smallest_subnormal) / 2, float(info.max))

    def number(self, value: Any, error: float = 0.0) -> "Tracked":
        """Return a value off by at most ``error``, rounded to the format; without error it stays so if that holds it.

        Infinities and NaN have an unbounded error.
        """
        if not isinstance(value, Fraction):
            if not isfinite(value):
                return Tracked(Fraction(0), inf, self)
            value = Fraction(float(value))
        rounded = Tracked(functions.shortened(value), error, self)
        if not rounded.size + error < self.largest:
            rounded.error = inf
        elif error or not self._holds(value, rounded.size):
            rounded.error = (error + self.unit * (rounded.size + error) + self.tiny) * _SAFETY
        return rounded

    def given(self, number: Any) -> "Tracked":
        """Return an input, rounded to the format."""
        return self.number(number, abs(float(number)) * self.probe)

    def rounded(self, number: "Tracked") -> "Tracked":
        """Return a number of another arithmetic, converted to this one."""
        return self.number(number.value, number.error)

    def _holds(self, value: Fraction, size: float) -> bool:
        """Whether a number fits the format's digits and is of normal size."""
        if not value or self.unit == 0:
            return True
        odd = value.numerator >> ((value.numerator & -value.numerator).bit_length() - 1)
        is_binary = value.denominator & (value.denominator - 1) == 0
        fits = odd.bit_length() <= round(-log2(self.unit))
        return is_binary and fits and self.tiny / self.unit <= size < self.largest


class Tracked:
    """A number of a computation; operators give the result of the same rounded operation.

    The other operand, a plain number, is rounded to the format. Comparisons give a bool where errors cannot change it,
    else a ``Doubt``. ``numpy.where`` of a doubt gives what either number may be.
    """

    def __init__(self, value: Fraction, error: float, arithmetic: Arithmetic) -> None:
        self.value = value  # its value without any rounding
        self.size = abs(float(value))
        self.error = error  # largest distance of the computed number from it; infinity if unbounded
        self.arithmetic = arithmetic  # how results are rounded

    def __repr__(self) -> str:
        return f"{float(self.value)} +- {self.error}"

    def _of(self, x: Any) -> Any:
        """Return the other operand as a tracked number; None if it is no number."""
        if isinstance(x, Tracked):
            return x
        return self.arithmetic.number(x) if isinstance(x, _PLAIN) else None

    def __add__(self, other: Any) -> Any:
        if (b := self._of(other)) is None:
            return NotImplemented
        if _is_zero(self):  # 0 + b is b
            return b
        if _is_zero(b):
            return self
        return self.arithmetic.number(self.value + b.value, self.error + b.error)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        return NotImplemented if (b := self._of(other)) is None else self + -b

    def __rsub__(self, other: Any) -> Any:
        return -self + other

    def __mul__(self, other: Any) -> Any:
        if (b := self._of(other)) is None:
            return NotImplemented
        for one, x in ((self, b), (b, self)):  # no sign is rounded
            if one.error == 0 and one.size == 1 and one.value in (1, -1):
                return x if one.value == 1 else -x
        if (_is_zero(self) and b.error < inf) or (_is_zero(b) and self.error < inf):
            return self.arithmetic.number(Fraction(0))
        if inf in (self.error, b.error):
            return Tracked(functions.shortened(self.value * b.value), inf, self.arithmetic)
        error = self.size * b.error + b.size * self.error + self.error * b.error
        return self.arithmetic.number(self.value * b.value, error)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        """Return the quotient; its error is unbounded where the divisor may be 0."""
        if (b := self._of(other)) is None:
            return NotImplemented
        quotient = self.value / b.value if b.value else Fraction(0)
        if not b.value or not b.size > b.error:
            return Tracked(functions.shortened(quotient), inf, self.arithmetic)
        return self.arithmetic.number(quotient, (self.error + abs(float(quotient)) * b.error) / (b.size - b.error))

    def __rtruediv__(self, other: Any) -> Any:
        return self._of(other) / self

    def __neg__(self) -> "Tracked":
        return Tracked(-self.value, self.error, self.arithmetic)

    def __abs__(self) -> "Tracked":
        return Tracked(abs(self.value), self.error, self.arithmetic)

    def __pow__(self, k: float) -> "Tracked":
        """A number from 0 on to a power k >= 0 in float64, rounded once, its value to 60 digits; it grows with x."""
        if k == 1:
            return self
        value = functions.power_of(self.value, k)
        ends = max(self.size - self.error, 0.0) ** k, (self.size + self.error) ** k
        off = max(abs(end - float(value)) for end in ends) if self.error or self.arithmetic.unit else 0.0
        return self.arithmetic.number(value, off + 2.0**-50 * float(value) * (self.arithmetic.unit > 0))

    def exponential(self) -> "Tracked":
        """E to its power, in float64, rounded once, its value to 60 digits; it grows with x."""
        value = functions.exponential_of(self.value)
        off = float(value) * expm1(self.error) if self.error < 1 else inf
        return self.arithmetic.number(value, off + 2.0**-50 * float(value) * (self.arithmetic.unit > 0))

    def sqrt(self) -> "Tracked":
        """The square root, its value to 2^-300 of itself; its error is unbounded where the operand may be below 0."""
        if _is_zero(self):
            return self
        if not self.value > 0:
            return Tracked(Fraction(0), inf, self.arithmetic)
        n, d = self.value.as_integer_ratio()
        k = functions.ROOT + max(0, d.bit_length() - n.bit_length())
        value = Fraction(isqrt((n << 2 * k) // d), 1 << k)
        within = self.size > self.error
        return self.arithmetic.number(value, self.error / float(value) if within else inf)

    def arc_cosine(self) -> "Tracked":
        """Return the angle of a cosine that is held between -1 and 1, in float64, rounded once; it falls with x."""
        off = functions.change(functions.arc_cosine, self.value, min(self.error, 2.0))
        return self.arithmetic.number(functions.arc_cosine(self.value), off + 2.0**-50 * (self.arithmetic.unit > 0))

    def cosine_and_sine(self) -> tuple["Tracked", "Tracked"]:
        """Cosine and sine of an angle, in float64, rounded once: each is off by the angle's error at most."""
        off = self.error + 2.0**-48 * max(self.size, 1.0) * (self.arithmetic.unit > 0)
        cosine, sine = functions.cosine_and_sine(self.value)
        return self.arithmetic.number(cosine, off), self.arithmetic.number(sine, off)

    def crude_root(self) -> "Tracked":
        """Return the square root by half of a float32's bits."""
        return self.arithmetic.number(*functions.crude_root(self.value, self.error, self.arithmetic.unit > 0))

    def no_sectors(self) -> "Sectors":
        """Return sectors, none set."""
        return Sectors(0, 0, 0, self.arithmetic)

    def sectors_to(self, last: "Tracked") -> "Sectors":
        """Return sectors from this number to before another, whole numbers from 0 to 32."""
        (least, most), (low, high) = ((x.value - _reach(x), x.value + _reach(x)) for x in (self, last))
        ends = (int(self.value), int(last.value)), (floor(most), ceil(low)), (ceil(least), floor(high))
        exact, must, may = (_bits_between(*each) for each in ends)
        return Sectors(exact, must, may, self.arithmetic)

    def number(self, x: Any) -> Any:
        """Return a number of another arithmetic in this one's; plain ones stay (``lfssao.core.numbers.number``)."""
        same = not isinstance(x, Tracked) or x.arithmetic == self.arithmetic
        return x if same else self.arithmetic.rounded(x)

    def double(self) -> "Tracked":
        """Return the same in float64; exact arithmetic stays."""
        return DOUBLE.rounded(self) if self.arithmetic.unit > DOUBLE.unit else self

    def is_number(self) -> Any:
        """Whether it is none that may be NaN."""
        return np.True_ if self.error < inf else Doubt(True, self.arithmetic)

    def log2(self) -> "Tracked":
        """Return the binary logarithm, rounded once, its value to 60 digits; -1022 below the normal numbers."""
        if not self.value >= _NORMAL:
            return Tracked(Fraction(-1022), inf if self.error else 0.0, self.arithmetic)
        with localcontext(prec=64):
            value = Fraction((Decimal(self.value.numerator) / Decimal(self.value.denominator)).ln() / Decimal(2).ln())
        if not self.error < self.size:
            return Tracked(value, inf, self.arithmetic)
        off = -log1p(-self.error / self.size) / log(2) * _SAFETY
        return self.arithmetic.number(value, off + 2.0**-50 * max(abs(float(value)), 1.0) * (self.arithmetic.unit > 0))

    def __floor__(self) -> "Tracked":
        return self._whole(floor)

    def __trunc__(self) -> "Tracked":
        return self._whole(trunc)

    def _whole(self, cut: Callable[[Fraction], int]) -> "Tracked":
        """Return a whole number made of it by a function that grows with it."""
        value = cut(self.value)
        error = self.error
        if error < inf:
            ends = (cut(self.value + sign * Fraction(error)) for sign in (-1, 1))
            error = float(max(abs(end - value) for end in ends))
        return self.arithmetic.number(Fraction(value), error)

    def __lt__(self, other: Any) -> Any:
        """Whether it is less than another."""
        return self._less(other, 1)

    def __gt__(self, other: Any) -> Any:
        return self._less(other, -1)

    def __le__(self, other: Any) -> Any:
        return ~(self > other)

    def __ge__(self, other: Any) -> Any:
        return ~(self < other)

    def __eq__(self, other: Any) -> Any:
        """Whether it is another; its hash is that of the object."""
        b = self._of(other)
        return _fact(self.value == b.value, abs(b.value - self.value), self.error + b.error, self.arithmetic)

    def __ne__(self, other: Any) -> Any:
        return ~(self == other)

    __hash__ = object.__hash__

    def _less(self, other: Any, sign: int) -> Any:
        """Whether it is less (sign 1), or more (-1), than another; every number of bounded error is finite."""
        if not isinstance(other, Tracked) and not isfinite(other):
            return np.bool_(other * sign > 0) if self.error < inf else Doubt(other * sign > 0, self.arithmetic)
        b = self._of(other)
        difference = sign * (b.value - self.value)
        return _fact(difference > 0, abs(difference), self.error + b.error, self.arithmetic)

    def __getitem__(self, _all: tuple[()]) -> "Tracked":
        return self

    def __array_function__(self, function: Any, _types: Any, given: Any, _named: Any) -> Any:
        return _where(self.arithmetic, *given) if function is np.where else NotImplemented


@dataclass(frozen=True)
class Sectors:
    """Sectors that are set without rounding, those that are for sure, and those that may be (``core.sectors``)."""

    exact: int
    must: int
    may: int
    arithmetic: Arithmetic

    def __or__(self, other: "Sectors") -> "Sectors":
        return Sectors(self.exact | other.exact, self.must | other.must, self.may | other.may, self.arithmetic)

    def sector_count(self) -> Tracked:
        """Return the number of sectors that are set."""
        exact, must, may = (each.bit_count() for each in (self.exact, self.must, self.may))
        return Tracked(Fraction(exact), float(max(exact - must, may - exact)), self.arithmetic)

    def hull(self, others: "Sequence[Sectors]") -> "Sectors":
        """Sectors that rounding may exchange for others."""
        every = self, *others
        return Sectors(
            self.exact,
            reduce(and_, (each.must for each in every)),
            reduce(or_, (each.may for each in every)),
            self.arithmetic,
        )

    def __getitem__(self, _all: tuple[()]) -> "Sectors":
        return self

    def __array_function__(self, function: Any, _types: Any, given: Any, _named: Any) -> Any:
        return _where(self.arithmetic, *given) if function is np.where else NotImplemented


@dataclass(frozen=True)
class Doubt:
    """A condition that rounding may change: whether it holds without, and the arithmetic of its numbers."""

    holds: bool
    arithmetic: Arithmetic

    def __bool__(self) -> bool:
        """Return the branch without rounding, for inputs that are off a little; kernels might take the other one."""
        if self.arithmetic.unit:
            raise TypeError("a formula branches on a condition that rounding may change")
        return self.holds

    def __invert__(self) -> "Doubt":
        return Doubt(not self.holds, self.arithmetic)

    def __and__(self, other: Any) -> Any:
        """With one that does not hold for sure, it does not."""
        return Doubt(self.holds and holds(other), self.arithmetic) if in_doubt(other) or other else np.False_

    def __or__(self, other: Any) -> Any:
        """With one that holds for sure, it does."""
        return ~(~self & ~(other if in_doubt(other) else np.bool_(other)))

    __array_ufunc__ = None  # operators of NumPy's bools leave it to these
    __rand__ = __and__
    __ror__ = __or__

    def __array_function__(self, function: Any, _types: Any, given: Any, _named: Any) -> Any:
        return _where(self.arithmetic, *given) if function is np.where else NotImplemented


DOUBLE = Arithmetic.of("float64")
# For condition numbers: inputs are off by so little that products of their errors do not count.
PROBED = Arithmetic(probe=2.0**-200)


def holds(condition: Any) -> bool:
    """Whether a condition holds without rounding."""
    return condition.holds if isinstance(condition, Doubt) else bool(condition)


def in_doubt(condition: Any) -> bool:
    """Whether rounding may change a condition."""
    return isinstance(condition, Doubt)


def hull(exact: Any, others: Sequence[Any]) -> Any:
    """Return a number, or sectors, that rounding may exchange for others."""
    if isinstance(exact, Sectors):
        return exact.hull(others)
    away = (float(abs(x.value - exact.value)) * _SAFETY + x.error for x in others)
    return Tracked(exact.value, max((exact.error, *away)), exact.arithmetic)


def unknown(exact: Any) -> Any:
    """Return the same number, or sectors, with an unbounded error."""
    if isinstance(exact, Sectors):
        return Sectors(exact.exact, 0, 2**32 - 1, exact.arithmetic)
    return Tracked(exact.value, inf, exact.arithmetic)


def _where(work: Arithmetic, condition: Any, x: Any, y: Any) -> Any:
    """``numpy.where``; an infinity that is chosen for sure stays plain."""
    exact, other = (x, y) if holds(condition) else (y, x)
    if isinstance(exact, Sectors):
        return hull(exact, [other]) if in_doubt(condition) else exact
    if not in_doubt(condition) and not isinstance(exact, Tracked) and not isfinite(exact):
        return np.float64(exact)
    exact, other = (each if isinstance(each, Tracked) else work.number(each) for each in (exact, other))
    return hull(exact, [other]) if in_doubt(condition) else exact


def _fact(true: bool, difference: Fraction, error: float, arithmetic: Arithmetic) -> Any:
    """Return a comparison of numbers by their exact difference, whose rounding error is up to ``error``."""
    return Doubt(true, arithmetic) if 0 < error >= float(difference) else np.bool_(true)


def _is_zero(x: Tracked) -> bool:
    return x.error == 0 and not x.value


def _reach(x: Tracked) -> Fraction:
    return Fraction(min(x.error, 64.0))


def _bits_between(first: int, last: int) -> int:
    """Return bits from one number to before another, held between 0 and 32."""
    first, last = (min(max(each, 0), 32) for each in (first, last))
    return ((1 << last) - 1) & ~((1 << first) - 1)
