"""Running error analysis: numbers with their exact value and a bound of their rounding error."""

from dataclasses import dataclass
from fractions import Fraction
from math import inf, isqrt, log2

from numpy import finfo
from numpy.typing import DTypeLike


@dataclass(frozen=True)
class Arithmetic:
    """Operations rounded to nearest."""

    unit: float = 0.0  # unit roundoff, half an ulp of 1; 0 for exact arithmetic
    tiny: float = 0.0  # half the smallest subnormal number
    largest: float = inf  # largest finite number; the error beyond it is unbounded
    probe: float = 0.0  # relative error of inputs

    @classmethod
    def of(cls, dtype: DTypeLike) -> "Arithmetic":
        """The arithmetic of float32 or float64."""
        info = finfo(dtype)
        return cls(float(info.epsneg), float(info.smallest_subnormal) / 2, float(info.max))

    def number(self, value: Fraction | float, error: float = 0.0) -> "Tracked":
        """A value off by at most ``error``, rounded to the format; without error it stays so if that holds it."""
        value = Fraction(value)
        if error == 0 and self._holds(value):
            return Tracked(value, 0.0, self)
        if error == inf or not _size(value) + error < self.largest:
            return Tracked(value, inf, self)
        bound = error + self.unit * (_size(value) + error) + self.tiny
        # The factor is more than the bound's own dozen float64 operations can have rounded away.
        return Tracked(value, bound * (1.0 + 2.0**-40), self)

    def given(self, number: Fraction | float) -> "Tracked":
        """An input, rounded to the format."""
        return self.number(number, abs(float(number)) * self.probe)

    def rounded(self, number: "Tracked") -> "Tracked":
        """A number of another arithmetic, converted to this one."""
        return self.number(number.value, number.error)

    def _holds(self, value: Fraction) -> bool:
        """Whether a number fits the format's digits and is of normal size."""
        if not value or self.unit == 0:
            return True
        odd = value.numerator >> ((value.numerator & -value.numerator).bit_length() - 1)
        is_binary = value.denominator & (value.denominator - 1) == 0
        fits = odd.bit_length() <= round(-log2(self.unit))
        return is_binary and fits and self.tiny / self.unit <= _size(value) < self.largest


@dataclass(frozen=True)
class Tracked:
    """A number of a computation; + - * / and ``root`` give the result of the same rounded operation."""

    value: Fraction  # its value without any rounding
    error: float  # largest distance of the computed number from it; infinity if unbounded
    arithmetic: Arithmetic  # how results are rounded

    def __add__(self, b: "Tracked") -> "Tracked":
        if not self.value and self.error == 0:  # 0 + b is b
            return b
        if not b.value and b.error == 0:
            return self
        return self.arithmetic.number(self.value + b.value, self.error + b.error)

    def __sub__(self, b: "Tracked") -> "Tracked":
        return self.arithmetic.number(self.value - b.value, self.error + b.error)

    def __mul__(self, b: "Tracked") -> "Tracked":
        error = _size(self.value) * b.error + _size(b.value) * self.error + self.error * b.error
        return self.arithmetic.number(self.value * b.value, error)

    def __truediv__(self, b: "Tracked") -> "Tracked":
        """The quotient; its error is unbounded where the divisor may be 0."""
        least = _size(b.value) - b.error
        if not b.value or not least > 0:
            return Tracked(Fraction(0), inf, self.arithmetic)
        quotient = self.value / b.value
        return self.arithmetic.number(quotient, (self.error + _size(quotient) * b.error) / least)

    def __neg__(self) -> "Tracked":
        return Tracked(-self.value, self.error, self.arithmetic)

    def root(self) -> "Tracked":
        """The square root, its value to 2^-200; its error is unbounded where the operand may be 0."""
        if not float(self.value) > self.error:
            return Tracked(Fraction(0), inf, self.arithmetic)
        value = Fraction(isqrt((self.value.numerator << 400) // self.value.denominator), 1 << 200)
        return self.arithmetic.number(value, self.error / float(value))

    def is_less(self, other: "Tracked") -> bool | None:
        """Whether it is less than another; None where rounding may decide."""
        return Tracked(other.value - self.value, self.error + other.error, self.arithmetic).is_positive()

    def is_positive(self) -> bool | None:
        """Whether it is above 0; None where rounding may decide."""
        return None if 0 < self.error >= _size(self.value) else self.value > 0


DOUBLE = Arithmetic.of("float64")
EXACT = Arithmetic()
# For condition numbers: inputs are off by so little that products of their errors do not count.
PROBED = Arithmetic(probe=2.0**-200)


def all_of(*facts: bool | None) -> bool | None:
    """Whether all are true; None where one is not known and none is false."""
    if False in facts:
        return False
    return None if None in facts else True


def _size(value: Fraction) -> float:
    return abs(float(value))
