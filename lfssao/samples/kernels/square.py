"""Point sets on the square [-1, 1]^2 (LF section 6), with a third number for the radius of Algorithm 4.

Every function fills out, (n, 2) or (n, 3) float64: xi_1, xi_2 and, in a third column, a number t uniform on (0, 1).
Streams of the generator are independent. The digits of Halton's and Sobol's sequences are scrambled at random, so that
every point is uniform (Owen 1995).
"""

import numpy as np

from lfssao.core.jit import formula, kernel
from lfssao.core.philox import random_below, random_signed, random_unit, random_word

XI1, XI2, RADIUS, SHUFFLE = 0, 1, 2, 3

# The golden ratio minus 1, and for d = 2 and 3 the powers -1 to -d of the root above 1 of x^(d + 1) = x + 1, times
# 2**64, cut.
GOLDEN = np.uint64(0x9E3779B97F4A7C15)
R2 = np.array([0xC13FA9A902A6328F, 0x91E10DA5C79E7B1C], np.uint64)
R3 = np.array([0xD1B54A32D192ED03, 0xABC98388FB8FAC02, 0x8CB92BA72F3D8DD7], np.uint64)


@formula
def in_cell(cell, cells, place):
    """A coordinate of [-1, 1]: the place, 0 to 1, inside one of equal cells."""
    return 2.0 * ((cell + place) / cells) - 1.0


@formula
def unit(word):
    """A 64-bit fraction of 1 as float64 in (0, 1): its first 52 bits and a half, exact, never an end."""
    return (np.float64(word >> np.uint64(12)) + 0.5) * 2.0**-52


@kernel
def random_radii(seed, out):
    """Fill the third column, if there is one, with independent numbers."""
    if out.shape[1] == 3:
        for k in range(out.shape[0]):
            out[k, 2] = random_unit(seed, RADIUS, k)


@kernel
def random(seed, out):
    """Independent uniform points."""
    for k in range(out.shape[0]):
        out[k, 0] = random_signed(seed, XI1, k)
        out[k, 1] = random_signed(seed, XI2, k)
    random_radii(seed, out)


@kernel
def jittered(seed, columns, out):
    """One uniform point in each cell of a grid of columns x (n / columns)."""
    n = out.shape[0]
    for k in range(n):
        out[k, 0] = in_cell(k % columns, columns, random_unit(seed, XI1, k))
        out[k, 1] = in_cell(k // columns, n // columns, random_unit(seed, XI2, k))
    random_radii(seed, out)


@kernel
def latin(seed, out):
    """One uniform point in each row and each column of an n x n grid, by Fisher and Yates's shuffle."""
    n = out.shape[0]
    column_of_row = np.arange(n)
    for k in range(n - 1, 0, -1):
        other = random_below(seed, SHUFFLE, k, k + 1)
        column_of_row[k], column_of_row[other] = column_of_row[other], column_of_row[k]
    for k in range(n):
        out[k, 0] = in_cell(column_of_row[k], n, random_unit(seed, XI1, k))
        out[k, 1] = in_cell(k, n, random_unit(seed, XI2, k))
    random_radii(seed, out)


@formula
def long_word(seed, stream):
    """64 random bits: numbers 0 (high) and 1 of a stream."""
    return (random_word(seed, stream, 0) << np.uint64(32)) | random_word(seed, stream, 1)


@kernel
def fibonacci(seed, out):
    """Rows of equal height, and in each a point the golden ratio of a turn after the last; both shifted at random."""
    n = out.shape[0]
    place, turn = unit(long_word(seed, XI1)), long_word(seed, XI2)
    for k in range(n):
        out[k, 0] = in_cell(k, n, place)
        out[k, 1] = 2.0 * unit(turn) - 1.0
        turn += GOLDEN
    random_radii(seed, out)


@kernel
def stretch(out):
    """Move the first two columns from (0, 1) to (-1, 1)."""
    for k in range(out.shape[0]):
        out[k, 0], out[k, 1] = 2.0 * out[k, 0] - 1.0, 2.0 * out[k, 1] - 1.0


@kernel
def roberts(seed, out):
    """Roberts's R_d sequence, d = 2 or 3 columns: multiples of d constants modulo 1, shifted at random by column."""
    n, columns = out.shape
    for a in range(columns):
        place = long_word(seed, a)
        for k in range(n):
            out[k, a] = unit(place)
            place += R2[a] if columns == 2 else R3[a]
    stretch(out)


# Halton's bases, and the digits kept in each: as many as a counter of 32 bits can tell apart.
_BASES, _DIGITS = np.array([2, 3, 5]), np.array([32, 20, 13])


@kernel
def radical_inverse(index, base, digits, seed, stream):
    """The digits of a whole number mirrored at the point and scrambled: float64 in (0, 1), inside its last digit.

    A digit is moved alike in all points with the same digits before it, which, with a 1 in front, are the counter of
    the generator. In base 2 this is all of Owen's scrambling; in others it shifts digits where Owen permutes them, and
    keeps just as much: any base^m numbers in a row have one in each of as many equal cells, and each is uniform.
    """
    value, before, whole = np.int64(0), np.int64(1), np.int64(1)
    for _ in range(digits):
        digit = index % base
        index = index // base
        shift = np.int64((random_word(seed, stream, before) * np.uint64(base)) >> np.uint64(32))
        value = value * base + (digit + shift) % base
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
def halton_points(seed, out):
    """Bases 2 and 3 on [-1, 1]^2 and, in a third column, base 5 on (0, 1); column a is scrambled by stream a."""
    for a in range(out.shape[1]):
        for k in range(out.shape[0]):
            out[k, a] = radical_inverse(k, _BASES[a], _DIGITS[a], seed, a)
    stretch(out)


@kernel
def sobol_points(seed, out):
    """Dimensions 0 and 1 on [-1, 1]^2 and, in a third column, dimension 2 on (0, 1); column a by stream a."""
    for a in range(out.shape[1]):
        for k in range(out.shape[0]):
            word, backwards = sobol_word(k, a), np.int64(0)
            for bit in range(32):
                backwards |= ((word >> bit) & 1) << (31 - bit)
            out[k, a] = radical_inverse(backwards, 2, 32, seed, a)
    stretch(out)
