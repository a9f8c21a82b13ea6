"""Point sets on the square [-1, 1]^2 (LF section 6), with a third number for the radius of Algorithm 4.

Every function fills out, (n, 2) or (n, 3) float64: xi_1, xi_2 and, in a third column, a number t uniform on (0, 1).
Streams of the generator are independent.
"""

import numpy as np

from lfssao.core.jit import kernel
from lfssao.core.philox import random_below, random_signed, random_unit, random_word

XI1, XI2, RADIUS, SHUFFLE = 0, 1, 2, 3

# The golden ratio minus 1, and for d = 2 and 3 the powers -1 to -d of the root above 1 of x^(d + 1) = x + 1, times
# 2**64, cut.
GOLDEN = np.uint64(0x9E3779B97F4A7C15)
R2_1, R2_2 = np.uint64(0xC13FA9A902A6328F), np.uint64(0x91E10DA5C79E7B1C)
R3_1, R3_2, R3_3 = np.uint64(0xD1B54A32D192ED03), np.uint64(0xABC98388FB8FAC02), np.uint64(0x8CB92BA72F3D8DD7)


@kernel(inline=True)
def in_cell(cell, cells, place):
    """A coordinate of [-1, 1]: the place, 0 to 1, inside one of equal cells."""
    return 2.0 * ((cell + place) / cells) - 1.0


@kernel(inline=True)
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
    column_of_row = np.empty(n, np.int64)
    for k in range(n):
        column_of_row[k] = k
    for k in range(n - 1, 0, -1):
        other = random_below(seed, SHUFFLE, k, k + 1)
        column_of_row[k], column_of_row[other] = column_of_row[other], column_of_row[k]
    for k in range(n):
        out[k, 0] = in_cell(column_of_row[k], n, random_unit(seed, XI1, k))
        out[k, 1] = in_cell(k, n, random_unit(seed, XI2, k))
    random_radii(seed, out)


@kernel(inline=True)
def long_word(seed, stream, index):
    """64 random bits: numbers 2 index (high) and 2 index + 1 of a stream."""
    return (random_word(seed, stream, 2 * index) << np.uint64(32)) | random_word(seed, stream, 2 * index + 1)


@kernel
def fibonacci(seed, out):
    """Rows of equal height, and in each a point the golden ratio of a turn after the last; both shifted at random."""
    n = out.shape[0]
    place, turn = unit(long_word(seed, XI1, 0)), long_word(seed, XI2, 0)
    for k in range(n):
        out[k, 0] = in_cell(k, n, place)
        out[k, 1] = 2.0 * unit(turn) - 1.0
        turn += GOLDEN
    random_radii(seed, out)


@kernel
def roberts(seed, out):
    """Roberts's R_d sequence, d = 2 or 3 columns: multiples of d constants modulo 1, shifted at random."""
    a, b, c = long_word(seed, XI1, 0), long_word(seed, XI2, 0), long_word(seed, RADIUS, 0)
    for k in range(out.shape[0]):
        out[k, 0] = 2.0 * unit(a) - 1.0
        out[k, 1] = 2.0 * unit(b) - 1.0
        if out.shape[1] == 3:
            out[k, 2] = unit(c)
            a, b, c = a + R3_1, b + R3_2, c + R3_3
        else:
            a, b = a + R2_1, b + R2_2
