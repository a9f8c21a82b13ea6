"""Numbers between two: what is known of a number that is not one number but any of many.

``Range`` is the set that exact arithmetic gives; ``Rounded`` knows besides how far computed numbers are off. Both are
arrays, one entry a part of what is looked at, and are themselves computed in float64: whoever uses them allows for its
rounding.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
Flags = NDArray[np.bool_]

_HUGE = 2.0**80  # far less than where float32 overflows: how far results are scaled, and some sums, are left aside
FLUSHED = 2.0**-100  # far more than what an operation's operands and result lose where float32 flushes them to zero
SAFETY = 1.0 + 2.0**-20  # outweighs the rounding of the bounds themselves
_MORE = 1.0 + 2.0**-40  # outweighs that of an error, which is sums and products of numbers that are not negative

# By how much ends of ranges are moved outwards: an operation's rounding, and that of a constant or a reciprocal.
_OUTWARD = 2.0**-51


class Range(NamedTuple):
    """Numbers between two, (n,) float64 each; NaN where nothing is known."""

    low: Numbers
    high: Numbers

    @classmethod
    def constant(cls, value: float, like: "Range") -> "Range":
        """One number, of as many parts as another range is of."""
        return cls(np.full_like(like.low, value), np.full_like(like.low, value))

    @property
    def size(self) -> Numbers:
        """The largest absolute value."""
        return np.maximum(np.abs(self.low), np.abs(self.high))

    def also(self, other: "Range") -> "Range":
        """The numbers of both ranges, where the other is known."""
        return Range(np.fmax(self.low, other.low), np.fmin(self.high, other.high))

    def plus(self, other: "Range | float") -> "Range":
        """The sums with a number or with numbers of another range."""
        low, high = other if isinstance(other, Range) else (other, other)
        return _outward(self.low + low, self.high + high)

    def minus(self, other: "Range") -> "Range":
        """The differences."""
        return _outward(self.low - other.high, self.high - other.low)

    def times(self, other: "Range | float") -> "Range":
        """The products."""
        if not isinstance(other, Range):
            a, b = self.low * other, self.high * other
            return _outward(np.minimum(a, b), np.maximum(a, b))
        a, b, c, d = self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high
        return _outward(
            np.minimum(np.minimum(a, b), np.minimum(c, d)),
            np.maximum(np.maximum(a, b), np.maximum(c, d)),
        )

    def over(self, other: "Range") -> "Range":
        """The quotients by positive numbers; unknown where a divisor may not be positive."""
        positive = other.low > 0.0
        safe = Range(np.where(positive, 1.0 / other.high, np.nan), np.where(positive, 1.0 / other.low, np.nan))
        return self.times(safe)

    def squared(self) -> "Range":
        """The squares."""
        ends = self.low * self.low, self.high * self.high
        through = (self.low < 0.0) & (self.high > 0.0)
        return _outward(np.where(through, 0.0, np.minimum(*ends)), np.maximum(*ends))

    def root(self) -> "Range":
        """The square roots of those that are not negative; unknown where all are."""
        return _outward(np.sqrt(np.maximum(self.low, 0.0)), np.sqrt(self.high))


def _outward(low: Numbers, high: Numbers) -> Range:
    """The range between computed numbers, and by their rounding more."""
    return Range(low - _OUTWARD * np.abs(low), high + _OUTWARD * np.abs(high))


class Rounded:
    """What a kernel makes of the numbers of a range: exact results, and how far the rounded ones are off them.

    An object stands for a number of a kernel's code, so that the code itself can be run on it. Each operation gives
    the range of exact results, and bounds what the operands' errors make of it plus its own rounding:

        (x + e)(y + f) = x y + (x f + y e + e f)
        (x + e) / (y + f) = x / y + (e - (x / y) f) / (y + f)
        sqrt(x + e) = sqrt(x) + e / (sqrt(x + e) + sqrt(x))

    A comparison is of the computed numbers and has one answer, that of most parts. Parts for all of whose numbers it is
    not the answer are doubted: what is computed of them behind it may mean nothing. So are parts with a product or a
    quotient that float32 may not hold.

    Parameters
    ----------
    exact : Range or float
        The exact numbers, or one for all parts.
    error : (n,) float64 or float
        By how much the computed ones are off at most.
    unit : float
        What an operation rounds by, relative to its result: 2^-24 in float32, 2^-53 in float64.
    doubt : (n,) bool, optional
        In and out: the parts that are doubted, one array for all numbers of a computation; without it an exact number.
    """

    __hash__ = None  # type: ignore[assignment]

    def __init__(
        self, exact: Range | float, error: Numbers | float = 0.0, unit: float = 0.0, doubt: Flags | None = None
    ) -> None:
        self.exact = exact if isinstance(exact, Range) else Range(*np.full((2, 1), float(exact)))
        self.size = self.exact.size
        self.error, self.unit, self.doubt = error, unit, doubt

    @classmethod
    def constant(cls, value: float, unit: float, doubt: Flags) -> "Rounded":
        """A number given in float64 and rounded once."""
        return cls(value, unit * abs(value) + FLUSHED if value else 0.0, unit, doubt)

    def __neg__(self) -> "Rounded":
        return Rounded(Range(-self.exact.high, -self.exact.low), self.error, self.unit, self.doubt)

    def __add__(self, other: "Rounded") -> "Rounded":
        return self._with(other, self.exact.plus(other.exact), self.error + other.error)

    def __sub__(self, other: "Rounded") -> "Rounded":
        return self._with(other, self.exact.minus(other.exact), self.error + other.error)

    def __mul__(self, other: "Rounded") -> "Rounded":
        x, y, e, f = self.size, other.size, self.error, other.error
        exact = self.exact.squared() if other is self else self.exact.times(other.exact)
        return self._with(other, exact, (x * f + y * e) + e * f, 1.0 + x + y)._held()

    def __truediv__(self, other: "Rounded") -> "Rounded":
        sign = np.where(other.exact.high < 0.0, -1.0, 1.0)
        divisor = other.exact.times(Range(sign, sign))
        exact, room = self.exact.times(Range(sign, sign)).over(divisor), divisor.low - other.error * _MORE
        room = np.where(room > FLUSHED, room, np.nan)
        return self._with(other, exact, (self.error + exact.size * other.error) / room, 1.0 + 1.0 / room)._held()

    def sqrt(self) -> "Rounded":
        """The square root, which numpy.sqrt asks an object for."""
        exact, least = self.exact.root(), self.exact.low - self.error * _MORE
        below = np.sqrt(np.where(least > 0.0, least, np.nan))
        return self._with(self, exact, self.error / (exact.low + below))

    def __lt__(self, other: "Rounded | float") -> bool:
        return (_number(other) - self)._positive()

    def __gt__(self, other: "Rounded | float") -> bool:
        return (self - _number(other))._positive()

    def __eq__(self, other: object) -> bool:
        """Whether both are one number for sure; kernels compare so to leave out what would change nothing."""
        if not isinstance(other, Rounded | float):
            return NotImplemented
        number = _number(other)
        certain = (self.exact.minus(number.exact).size == 0.0) & (self.error == 0.0) & (number.error == 0.0)
        return bool(certain.all())

    def _with(
        self, other: "Rounded", exact: Range, error: Numbers | float, flushed: Numbers | float = 1.0
    ) -> "Rounded":
        """The result of an operation, with what its own rounding adds to its error."""
        unit, doubt = max(self.unit, other.unit), other.doubt if self.doubt is None else self.doubt
        made = Rounded(exact, 0.0, unit, doubt)
        made.error = (1.0 + unit) * error + (unit * made.size + FLUSHED * flushed)
        return made

    def _held(self) -> "Rounded":
        """The number, doubted where float32 may overflow."""
        if self.doubt is not None:
            self.doubt |= ~(self.size + self.error < _HUGE)
        return self

    def _positive(self) -> bool:
        """Whether it is positive, of differences of computed numbers."""
        room = self.error * SAFETY
        yes, no = self.exact.low > room, self.exact.high < -room
        answer = bool(yes.sum() >= no.sum())
        if self.doubt is not None:
            self.doubt |= ~(yes if answer else no)
        return answer


def _number(value: Rounded | float) -> Rounded:
    return value if isinstance(value, Rounded) else Rounded(value)
