"""The z hierarchy: each level has half the texels of the last, by one of five filters (SAO section 2.2, table 1).

Readings. The paper's levels halve powers of two; ours round up, (n + 1) // 2 texels, so that texel (x, y) of level 0
has (x >> m, y >> m) in level m for any size; beyond the border a filter reads the border's texel. The paper's
z is negative: its 'min', conservative visibility, keeps the farthest of four, its 'max', conservative occlusion, the
nearest; z here grows away from the viewer, and the names mean what the paper's do. No surface is z = +infinity, and
the farthest. The harmonic mean as printed gives z / 16 for constant z; it is read as the inverse of the mean inverse.
It is one of distances from the viewer: z less ``origin``, 0 for a camera and the observers' z for a module, whose z is
0 in the screen plane. It is the arithmetic mean where one of the four is not in front of that.
"""

import numpy as np

from lfssao.core.jit import formula, kernel

ROTATED, ARITHMETIC, HARMONIC, MIN, MAX = 0, 1, 2, 3, 4


@formula
def arithmetic_mean(a, b, c, d):
    """(((a + b) + c) + d) / 4."""
    return (((a + b) + c) + d) * type(a)(0.25)


@formula
def harmonic_mean(a, b, c, d, origin):
    """4 / (((1/a + 1/b) + 1/c) + 1/d) of distances from ``origin``, taken back to z."""
    e, f, g, h = a - origin, b - origin, c - origin, d - origin
    zero, one = type(a)(0), type(a)(1)
    mean = one / ((((one / e + one / f) + one / g) + one / h) * type(a)(0.25)) + origin
    return mean if (e > zero) & (f > zero) & (g > zero) & (h > zero) else arithmetic_mean(a, b, c, d)


@formula
def filtered(how, odd_row, odd_column, a, b, c, d, origin):
    """One texel from the four texels 00, 10, 01, 11 of ``next_level``."""
    if how == ROTATED:
        upper, lower = a if odd_row else b, c if odd_row else d
        return upper if odd_column else lower
    if how == ARITHMETIC:
        return arithmetic_mean(a, b, c, d)
    if how == HARMONIC:
        return harmonic_mean(a, b, c, d, origin)
    if how == MIN:
        return max(a, b, c, d)
    return min(a, b, c, d)


@kernel(rows="target")
def next_level(begin, stop, source, how, origin, target):
    """One level, ((h + 1) // 2, (w + 1) // 2), out, from the one before, (h, w).

    how: ROTATED: texel (2x' + (y' & 1 ^ 1), 2y' + (x' & 1 ^ 1)), & before ^ as in C; ARITHMETIC, HARMONIC, MIN, MAX: of
    the four texels (2x' + i, 2y' + j), in the order 00, 10, 01, 11. origin: where distances are counted from.
    """
    height, width = source.shape
    z, out, wide = source.reshape(-1), target.reshape(-1), target.shape[1]
    for y in range(begin, stop):
        top, bottom, odd = 2 * y * width, min(2 * y + 1, height - 1) * width, (y & 1) == 1
        for x in range(width // 2):  # texels away from the border
            upper, lower = np.uint64(top + 2 * x), np.uint64(bottom + 2 * x)
            a, b, c, d = z[upper], z[upper + np.uint64(1)], z[lower], z[lower + np.uint64(1)]
            out[np.uint64(y * wide + x)] = filtered(how, odd, (np.int32(x) & 1) == 1, a, b, c, d, origin)
        if width & 1:
            x = wide - 1
            upper, lower = z[top + width - 1], z[bottom + width - 1]
            out[y * wide + x] = filtered(how, odd, (x & 1) == 1, upper, upper, lower, lower, origin)
