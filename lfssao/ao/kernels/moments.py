"""First and second moments of depth over areas of the texture: a prefiltered pyramid (VO section 4.2).

Level l holds, for each square of 2^l x 2^l texels, the fraction of them that sees a surface and the means over all of
them of z and z^2, counted 0 where there is none, so that all three can be filtered. Means over the fraction give M1 =
E[z] and M2 = E[z^2] of the surface. All in float64: M2 - M1^2 cancels all but the last digits.

Levels stand one after the other in one array (N, 3), each with a border of zeros, one texel left and above and two
right and below, so that no filter and no look-up has to ask where the texture ends: beyond it there is no surface.
Level l has ceil(W / 2^l) x ceil(H / 2^l) texels.
"""

from typing import NamedTuple

import numpy as np

from lfssao.core.jit import kernel

BEFORE, BORDER = 1, 3


class Pyramid(NamedTuple):
    """Levels one after the other.

    moments: (3 N,) float64, fraction of texels with a surface and means of z and z^2, a texel after the other. starts,
    pitches: (levels,) int64, where each level's array starts, border included, and how long its rows are.
    """

    moments: np.ndarray
    starts: np.ndarray
    pitches: np.ndarray


@kernel(rows="depth")
def write_base(begin, stop, depth, moments):
    """Level 0, at the array's start: (1, z, z^2), or (0, 0, 0) where depth is infinite."""
    width = depth.shape[1]
    surface, numbers = depth.reshape(-1), moments.reshape(-1)
    for j in range(begin, stop):
        first = 3 * ((j + BEFORE) * (width + BORDER) + BEFORE)
        for i in range(width):
            z = np.float64(surface[np.uint64(j * width + i)])  # float() of a float32 stays one in numba
            k = np.uint64(first + 3 * i)
            there = z < np.inf
            numbers[k] = 1.0 if there else 0.0
            numbers[k + np.uint64(1)] = z if there else 0.0
            numbers[k + np.uint64(2)] = z * z if there else 0.0


@kernel(rows="high")
def write_half(begin, stop, moments, source, width, high, target, outer, inner):
    """The next level: along both axes taps (outer, inner, inner, outer) around the middle of two texels.

    Rows first: ((outer a + inner b) + inner c) + outer d, then the same of four such sums. source, target: places in
    ``moments`` where the level, of a width, and the next one, ``high`` rows, start. Taps of 0 and 1/2 average, 1/8 and
    3/8 blur by [1 2 1] / 4 before.
    """
    pitch, wide = width + BORDER, (width + 1) // 2
    n, numbers = 3 * wide, moments.reshape(-1)
    for j in range(begin, stop):
        sums = np.empty((4, n))
        for k in range(4):
            start = 3 * (source + (2 * j + k) * pitch)
            for i in range(n):
                t = np.uint64(start + i + 3 * (i // 3))
                total = outer * numbers[t] + inner * numbers[t + np.uint64(3)]
                sums[k, i] = (total + inner * numbers[t + np.uint64(6)]) + outer * numbers[t + np.uint64(9)]
        place = 3 * (target + (j + BEFORE) * (wide + BORDER) + BEFORE)
        for i in range(n):
            total = (0.0 + outer * sums[0, i]) + inner * sums[1, i]
            numbers[np.uint64(place + i)] = (total + inner * sums[2, i]) + outer * sums[3, i]
