"""Running error analysis: each quantity of a computation as its exact value and a bound of what rounding does to it."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf, isqrt, log2

from numpy import finfo
from numpy.typing import DTypeLike


@dataclass(frozen=True)
class Tracked:
    """A quantity.

    Attributes
    ----------
    value : Fraction
        What it would be without rounding.
    error : float
        How far from it the computed number can be; infinity where nothing is known.
    """

    value: Fraction
    error: float = 0.0

    def surely(self, other: "Tracked") -> bool | None:
        """Whether it is less than another, None where rounding may decide."""
        error = self.error + other.error
        if error > 0 and error >= _size(self.value - other.value):
            return None
        return self.value < other.value


@dataclass(frozen=True)
class Arithmetic:
    """Operations rounded to nearest, and the bounds of their results.

    Attributes
    ----------
    unit : float
        Unit roundoff, half an ulp of 1.
    tiny : float
        Half the smallest subnormal number.
    largest : float
        Largest finite number; nothing is known of what is beyond it.
    """

    unit: float = 0.0
    tiny: float = 0.0
    largest: float = inf

    @classmethod
    def of(cls, dtype: DTypeLike) -> "Arithmetic":
        """The arithmetic of float32 or float64."""
        info = finfo(dtype)
        return cls(float(info.epsneg), float(info.smallest_subnormal) / 2, float(info.max))

    def rounded(self, a: Tracked) -> Tracked:
        """A quantity as one number; without error where it was exact and is a number of the format."""
        if a.error == 0 and self._holds(a.value):
            return a
        a = _shortened(a)
        if a.error == inf or not _size(a.value) + a.error < self.largest:
            return Tracked(a.value, inf)
        return Tracked(a.value, _up(a.error + self.unit * (_size(a.value) + a.error) + self.tiny))

    def _holds(self, value: Fraction) -> bool:
        """Whether a number needs no more digits than there are, and is of normal size."""
        if not value or self.unit == 0:
            return True
        odd = value.numerator >> ((value.numerator & -value.numerator).bit_length() - 1)
        is_binary = value.denominator & (value.denominator - 1) == 0
        fits = odd.bit_length() <= round(-log2(self.unit))
        return is_binary and fits and self.tiny / self.unit <= _size(value) < self.largest

    def add(self, a: Tracked, b: Tracked) -> Tracked:
        """The sum; of nothing and a number it is that number."""
        if not a.value and a.error == 0:
            return b
        if not b.value and b.error == 0:
            return a
        return self.rounded(Tracked(a.value + b.value, a.error + b.error))

    def subtract(self, a: Tracked, b: Tracked) -> Tracked:
        """The difference."""
        return self.rounded(Tracked(a.value - b.value, a.error + b.error))

    def multiply(self, a: Tracked, b: Tracked) -> Tracked:
        """The product."""
        error = _size(a.value) * b.error + _size(b.value) * a.error + a.error * b.error
        return self.rounded(Tracked(a.value * b.value, error))

    def divide(self, a: Tracked, b: Tracked) -> Tracked:
        """The quotient; of unbounded error where the divisor may be 0."""
        least = _size(b.value) - b.error
        if not b.value or not least > 0:
            return Tracked(Fraction(0), inf)
        quotient = a.value / b.value
        return self.rounded(Tracked(quotient, (a.error + _size(quotient) * b.error) / least))

    def linear(self, row: Sequence[Tracked], p: Sequence[Tracked]) -> Tracked:
        """(row_0 x + row_1 y) + row_2 z of p = (x, y, z): what a matrix does to a direction."""
        x, y, z = (self.multiply(entry, coordinate) for entry, coordinate in zip(row, p, strict=False))
        return self.add(self.add(x, y), z)

    def affine(self, row: Sequence[Tracked], p: Sequence[Tracked]) -> Tracked:
        """The same + row_3: what a matrix does to a point."""
        return self.add(self.linear(row, p), row[3])

    def root(self, a: Tracked) -> Tracked:
        """The square root, its value to 2^-300; of unbounded error where its operand may be 0."""
        if not float(a.value) > a.error:
            return Tracked(Fraction(0), inf)
        value = Fraction(isqrt((a.value.numerator << 600) // a.value.denominator), 1 << 300)
        return self.rounded(Tracked(value, a.error / float(value)))


DOUBLE = Arithmetic.of("float64")
EXACT = Arithmetic()

# For condition numbers: a relative error of the inputs so small that its products do not count.
PROBE = 2.0**-200


def all_of(*facts: bool | None) -> bool | None:
    """Whether all are true; None where one is not known and none is false."""
    if False in facts:
        return False
    return None if None in facts else True


def _shortened(a: Tracked) -> Tracked:
    """A quantity, its value of many digits cut to 2^-400 of it: fractions grow with each step."""
    top, bottom = a.value.numerator.bit_length(), a.value.denominator.bit_length()
    if top + bottom < 1200 or a.error == inf:
        return a
    shift = 400 - top + bottom
    digits = round(a.value * 2**shift) if shift >= 0 else round(a.value / 2**-shift)
    value = Fraction(digits, 2**shift) if shift >= 0 else Fraction(digits * 2**-shift)
    return Tracked(value, a.error + _size(value) * 2.0**-398)


def _size(value: Fraction) -> float:
    return abs(float(value))


def _up(error: float) -> float:
    """More than what the bound's own arithmetic, a dozen float64 operations, can have rounded away."""
    return error * (1.0 + 2.0**-40)
