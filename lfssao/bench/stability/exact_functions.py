"""Functions of fractions, exact or to many digits."""

from collections.abc import Callable
from decimal import Decimal, localcontext
from fractions import Fraction
from math import floor, inf, isqrt

_BITS = 2048  # of a denominator; a value of more is off by up to 2^-1100 of itself, which no bound counts
_KEPT = 1101
ROOT = 300  # bits of a root's value


def shortened(value: Fraction) -> Fraction:
    """Return a value cut to the bits that are kept."""
    n = value.numerator
    d = value.denominator
    if d.bit_length() <= _BITS:
        return value
    k = max(0, _KEPT + d.bit_length() - n.bit_length())
    return Fraction((n << k) // d, 1 << k)


def change(function: Callable[[Fraction], Fraction], x: Fraction, error: float) -> float:
    """By how much a function that grows or falls changes at most where a number is off by an error."""
    if not error:
        return 0.0
    ends = (function(x + sign * Fraction(error)) for sign in (-1, 1))
    return max(abs(float(end - function(x))) for end in ends) * (1.0 + 2.0**-40)


def arc_cosine(x: Fraction) -> Fraction:
    """Return the angle of a cosine, which is held between -1 and 1, to 2^-200 of itself.

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


def cosine_and_sine(x: Fraction) -> tuple[Fraction, Fraction]:
    """Cosine and sine of an angle of a few turns, to 2^-200: of its 64th part by Taylor's series, doubled six times."""
    one = 1 << ROOT
    angle = floor(x * one) >> 6
    square = angle * angle // one
    cosine = 0
    sine = 0
    term = one
    for n in range(0, 48, 2):
        cosine = cosine + term
        sine = sine + term * angle // one // (n + 1)
        term = -term * square // one // ((n + 1) * (n + 2))
    for _ in range(6):
        cosine, sine = (cosine * cosine - sine * sine) // one, 2 * sine * cosine // one
    return Fraction(cosine, one), Fraction(sine, one)


def root_of_bits(x: Fraction) -> Fraction:
    """Return the line that ``lfssao.core.elementary.root_of_bits`` rounds, of a number from 0 on."""
    if x < Fraction(1, 2**126):
        return Fraction(0)
    exponent = x.numerator.bit_length() - x.denominator.bit_length()
    exponent -= x < Fraction(2) ** exponent
    bits = Fraction(0x1FBD1DF5, 2**23) + (exponent + 126 + x / Fraction(2) ** exponent) / 2
    whole = floor(bits)
    return Fraction(2) ** (whole - 127) * (1 + bits - whole)


def crude_root(x: Fraction, error: float, is_rounded: bool) -> tuple[Fraction, float]:
    """The root by half of a float32's bits of a number that is off by an error, and how far it is off: both ends."""
    far = error + abs(float(x)) * is_rounded * 2.0**-23
    off = change(root_of_bits, x, far) if error < inf else inf
    return root_of_bits(x), off + 2.0**-22 * float(root_of_bits(x)) * is_rounded


def power_of(x: Fraction, k: float) -> Fraction:
    """Return a power of a number from 0 on, to 60 digits."""
    if k == 0:
        return Fraction(1)
    with localcontext(prec=64):
        return Fraction((Decimal(x.numerator) / Decimal(x.denominator)) ** Decimal(k))


def exponential_of(x: Fraction) -> Fraction:
    """E to the power of a number, to 60 digits."""
    with localcontext(prec=64):
        return Fraction((Decimal(x.numerator) / Decimal(x.denominator)).exp())
