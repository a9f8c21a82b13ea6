"""First and second moments of depth over areas of the texture: a prefiltered pyramid (VO section 4.2).

Level l holds, for each square of 2^l x 2^l texels, the fraction of them that sees a surface and the means over all of
them of z and z^2, counted 0 where there is none, so that all three can be filtered. Means over the fraction give M1 =
E[z] and M2 = E[z^2] of the surface. All in float64: M2 - M1^2 cancels all but the last digits.

Levels stand one after the other in one array (N, 3), each with a border of zeros, one texel left and above and two
right and below, so that no filter and no look-up has to ask where the texture ends: beyond it there is no surface.
Level l has ceil(W / 2^l) x ceil(H / 2^l) texels.
"""

from typing import Any, NamedTuple

import numpy as np

from lfssao.core.jit import formula, kernel

BEFORE, BORDER = 1, 3


class Pyramid(NamedTuple):
    """Levels one after the other.

    numbers: (3 N,) float64, fraction of texels with a surface and means of z and z^2, a texel after the other. starts,
    pitches: (levels,) int64, where each level's array starts, border included, and how long its rows are.
    """

    numbers: np.ndarray
    starts: np.ndarray
    pitches: np.ndarray


@kernel(rows="depth")
def write_moments(begin, stop, depth, numbers):
    """Moments of each texel, (H, W, 3), out: (1, z, z^2), or (0, 0, 0) where depth is infinite."""
    for j in range(begin, stop):
        for i in range(depth.shape[1]):
            z = np.float64(depth[j, i])  # float() of a float32 stays one in numba
            there = z < np.inf
            numbers[j, i, 0] = 1.0 if there else 0.0
            numbers[j, i, 1] = z if there else 0.0
            numbers[j, i, 2] = z * z if there else 0.0


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


@formula
def look_up(pyramid, level, u, v):
    """Fraction and moments of a level at image point (u, v), linearly between four texels: columns first, then rows."""
    numbers, starts, pitches = pyramid.numbers, pyramid.starts, pyramid.pitches
    scale = np.int64((np.int64(1023) - level) << np.int64(52)).view(np.float64)  # 2^-level
    x, y = np.float64(u) * scale + 0.5, np.float64(v) * scale + 0.5  # of texel centres, border included
    i, j = np.int64(x), np.int64(y)
    f, g = x - np.float64(i), y - np.float64(j)
    at = np.uint64(level)
    upper = np.uint64(3 * (starts[at] + j * pitches[at] + i))
    lower = upper + np.uint64(3 * pitches[at])
    one, two, three, four, five = np.uint64(1), np.uint64(2), np.uint64(3), np.uint64(4), np.uint64(5)
    a0 = numbers[upper] + f * (numbers[upper + three] - numbers[upper])
    a1 = numbers[upper + one] + f * (numbers[upper + four] - numbers[upper + one])
    a2 = numbers[upper + two] + f * (numbers[upper + five] - numbers[upper + two])
    b0 = numbers[lower] + f * (numbers[lower + three] - numbers[lower])
    b1 = numbers[lower + one] + f * (numbers[lower + four] - numbers[lower + one])
    b2 = numbers[lower + two] + f * (numbers[lower + five] - numbers[lower + two])
    return a0 + g * (b0 - a0), a1 + g * (b1 - a1), a2 + g * (b2 - a2)


@formula
def filtered_moments(pyramid: Any, level: Any, u: Any, v: Any) -> Any:
    """Return the fraction that sees a surface and its moments, float64, at a level and image point.

    The level is held between 0 and the coarsest; between two levels fine + part (coarse - fine).
    """
    last = np.int64(pyramid.starts.shape[0] - 1)
    coarsest = np.float64(last)
    level = min(coarsest, max(0.0, level))
    fine = np.int64(level)
    part = level - np.float64(fine)
    seeing, first, second = look_up(pyramid, fine, u, v)
    a, b, c = look_up(pyramid, fine + np.int64(1) if fine < last else last, u, v)
    between = part > 0.0
    seeing = seeing + part * (a - seeing) if between else seeing
    first = first + part * (b - first) if between else first
    second = second + part * (c - second) if between else second
    return seeing, first, second
