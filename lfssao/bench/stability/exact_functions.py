"""Functions of fractions, exact or to many digits."""

from decimal import Decimal, localcontext
from fractions import Fraction
from math import floor, isqrt

_BITS = 2048  # of a denominator; a value of more is off by up to 2^-1100 of itself, which no bound counts
_KEPT = 1101
ROOT = 300  # bits of a root's value


def shortened(value: Fraction) -> Fraction:
    """A value of at most so many bits."""
    n, d = value.numerator, value.denominator
    if d.bit_length() <= _BITS:
        return value
    k = max(0, _KEPT + d.bit_length() - n.bit_length())
    return Fraction((n << k) // d, 1 << k)


def arc_cosine(x: Fraction) -> Fraction:
    """The angle of a cosine, which is held between -1 and 1, to 2^-200 of itself.

    It is 2^14 times the one whose sine's square is left after the angle has been halved 14 times.
    """
    one = 1 << 2 * ROOT
    q = floor((1 - max(Fraction(-1), min(Fraction(1), x))) / 2 * one)
    for _ in range(13):
        q = (one - isqrt((one - q) * one)) // 2
    term = total = isqrt(q * one)
    for n in range(1, 24, 1):
        term = term * q // one * (2 * n - 1) ** 2 // (2 * n * (2 * n - 1))
        total += term // (2 * n + 1)
    return Fraction(total << 14, one)


def power_of(x: Fraction, k: float) -> Fraction:
    """A power of a number from 0 on, to 60 digits."""
    if k == 0:
        return Fraction(1)
    with localcontext(prec=64):
        return Fraction((Decimal(x.numerator) / Decimal(x.denominator)) ** Decimal(k))


def exponential_of(x: Fraction) -> Fraction:
    """E to the power of a number, to 60 digits."""
    with localcontext(prec=64):
        return Fraction((Decimal(x.numerator) / Decimal(x.denominator)).exp())
