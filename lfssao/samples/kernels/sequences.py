"""Halton's and Sobol's sequences, their digits scrambled at random so that every point is uniform (Owen 1995)."""

import numpy as np

from lfssao.core.jit import kernel
from lfssao.core.philox import random_word

# Digits kept in base 2, 3 and 5, as many as a counter of 32 bits can tell apart.
_DIGITS_2, _DIGITS_3, _DIGITS_5 = 32, 20, 13


@kernel(inline=True)
def _scrambled(digit, base, before, seed, stream):
    """A digit moved by a random number of places, the same for all points with the same digits before it.

    before: those digits with a 1 in front of them, as a number in that base; the counter of the generator.
    """
    return (digit + np.int64((random_word(seed, stream, before) * np.uint64(base)) >> np.uint64(32))) % base


@kernel
def radical_inverse(index, base, digits, seed, stream, scrambled):
    """The digits of a whole number mirrored at the point: float64 in (0, 1), in the middle of its last digit.

    scrambled: whether the digits are moved, by a stream of the generator. In base 2 this is all of Owen's scrambling;
    in others it shifts digits where Owen permutes them, and keeps just as much: any base^m numbers in a row have one
    in each of as many equal cells, and each is uniform.
    """
    value, before, whole = np.int64(0), np.int64(1), np.int64(1)
    for _ in range(digits):
        digit = index % base
        index = index // base
        moved = _scrambled(digit, base, before, seed, stream) if scrambled else digit
        value = value * base + moved
        before = before * base + digit
        whole = whole * base
    return (value + 0.5) / whole


@kernel
def sobol_word(index, dimension):
    """Coordinate 0, 1 or 2 of a point of Sobol's sequence, in units of 2**-32, as int64 (index below 2**32).

    Dimension 0 is the radical inverse. The direction numbers of the others follow the primitive polynomials x + 1,
    m_k = 2 m_(k-1) ^ m_(k-1) from 1, and x^2 + x + 1, m_k = 2 m_(k-1) ^ 4 m_(k-2) ^ m_(k-2) from 1 and 3.
    """
    word = np.int64(0)
    m, last = np.int64(1), np.int64(1)
    for k in range(32):
        if (index >> k) & 1:
            word ^= m << (31 - k)
        if dimension == 1:
            m = (2 * m) ^ m
        elif dimension == 2:
            m, last = (np.int64(3), np.int64(1)) if k == 0 else ((2 * m) ^ (4 * last) ^ last, m)
    return word


@kernel
def sobol(index, dimension, seed, stream, scrambled):
    """Coordinate 0, 1 or 2 of a point of Sobol's sequence: float64 in (0, 1); scrambled as of ``radical_inverse``."""
    word = sobol_word(index, dimension)
    backwards = np.int64(0)
    for k in range(32):
        backwards |= ((word >> k) & 1) << (31 - k)
    return radical_inverse(backwards, 2, _DIGITS_2, seed, stream, scrambled)


@kernel
def halton_points(seed, out):
    """Bases 2 and 3 on [-1, 1]^2 and, in a third column, base 5 on (0, 1); column a is scrambled by stream a."""
    for k in range(out.shape[0]):
        out[k, 0] = 2.0 * radical_inverse(k, 2, _DIGITS_2, seed, 0, True) - 1.0
        out[k, 1] = 2.0 * radical_inverse(k, 3, _DIGITS_3, seed, 1, True) - 1.0
        if out.shape[1] == 3:
            out[k, 2] = radical_inverse(k, 5, _DIGITS_5, seed, 2, True)


@kernel
def sobol_points(seed, out):
    """Dimensions 0 and 1 on [-1, 1]^2 and, in a third column, dimension 2 on (0, 1); column a by stream a."""
    for k in range(out.shape[0]):
        out[k, 0] = 2.0 * sobol(k, 0, seed, 0, True) - 1.0
        out[k, 1] = 2.0 * sobol(k, 1, seed, 1, True) - 1.0
        if out.shape[1] == 3:
            out[k, 2] = sobol(k, 2, seed, 2, True)
