"""Which texels of a small block a triangle may cover, by the sides of its edges in the image.

X and Y are a corner's place from a texel's centre, in units. hit_triangle misses where two of the edge functions
p_b q_c - q_b p_c differ in sign, and p = s_x X^ with s_x > 0 the corner's slope along columns and X^ its X up to
rounding, q = s_y Y^ likewise (or both signs of q turned, which turns all three). A place is off by at most 2 units
(``lfssao.kernels.footprints``), so X^ is from X, and Y^ from Y.

Divided by the slopes s_y of b and s_x of c, an edge function is kappa X^_b Y^_c - Y^_b X^_c. kappa is 1 in cameras. On
a flat screen the slopes are 1 - z / m_z and 1 - z / z_o over constants, which differ from corner to corner, and two
corners' kappa lies between e^-s and e^s, where s is the difference of their z times the steepest that
log((1 - z / m_z) / (1 - z / z_o)) rises. So with |X| <= W - 2 and |Y| <= H - 2 for the texels between the corners, and
delta >= e^s - 1,

    | (kappa X^_b Y^_c - Y^_b X^_c) - (X_b Y_c - Y_b X_c) |  <=  4 (W - 2) + 4 (H - 2) + 8 + delta W H,

and an edge function of whole numbers that is farther from 0 than the margin 4 (W + H) + delta W H has the sign of
hit_triangle's. The three add up to twice the triangle's area, whatever the texel. With corners in the order that makes
this positive, and at least the margin, one below minus the margin leaves more than twice the margin to the other two:
one of them is above it, and hit_triangle misses.
"""

import numpy as np

from lfssao.kernels.intrinsics import HIGH, WIDE, negative_somewhere
from lfssao.kernels.jit import kernel

ANYWHERE = np.int32(-(2**31))  # the place along columns of a corner that may appear anywhere
ALL = -1  # of a triangle that reaches over more: any texel

UNITS = 1024  # of places to a texel, 2**10

# With which edge functions fit 32 bits: units between two corners, and delta.
_WIDEST, _HIGHEST = np.int32((WIDE + 1) * UNITS), np.int32((HIGH + 1) * UNITS)
_LARGEST_DELTA = np.float32(0.0625)

_UNITS = np.int32(UNITS)
_COLUMN = np.int32(0x01010101)  # the bits of a block's first column


@kernel(inline=True)
def block_bits(columns, rows):
    """The bits of so many columns and rows of a block, each at least 1."""
    across = np.int32(_COLUMN * np.int32((np.int32(1) << np.int32(columns)) - np.int32(1)))
    return np.int32(across & np.int32(np.uint32(0xFFFFFFFF) >> np.uint32(32 - 8 * rows)))


@kernel(inline=True)
def _edge(xb, yb, xc, yc):
    """X_b Y_c - Y_b X_c in int32."""
    return np.int32(np.int32(xb * yc) - np.int32(yb * xc))


@kernel(inline=True)
def covered_texels(ua, ub, uc, va, vb, vc, i0, i1, j0, j1, delta):
    """Which texels between the bounds of a triangle it may cover, int32: bit i + 8 j is texel (i0 + i, j0 + j).

    Parameters
    ----------
    ua, ub, uc, va, vb, vc : int32
        Places of the corners along columns and rows.
    i0, i1, j0, j1 : int32
        First and last column and row whose centres lie between the corners' places (``centres_between``).
    delta : float32
        Upper bound of e^s - 1.

    Returns
    -------
    int32
        ALL where the bounds are more than a block's.
    """
    wide, high = np.int32(max(ua, ub, uc) - min(ua, ub, uc)), np.int32(max(va, vb, vc) - min(va, vb, vc))
    small = (i1 - i0 < WIDE) & (j1 - j0 < HIGH) & (wide <= _WIDEST) & (high <= _HIGHEST) & (delta <= _LARGEST_DELTA)
    small &= min(ua, ub, uc) != ANYWHERE  # of which the difference to another place is no number of 32 bits
    xs, ys = np.int32(i0 * _UNITS), np.int32(j0 * _UNITS)
    xa, xb, xc = np.int32(ua - xs), np.int32(ub - xs), np.int32(uc - xs)
    ya, yb, yc = np.int32(va - ys), np.int32(vb - ys), np.int32(vc - ys)
    w, h = np.int32(wide + np.int32(4)), np.int32(high + np.int32(4))
    margin = np.int32(np.int32(4) * np.int32(w + h) + np.int32((delta * np.float32(w)) * np.float32(h)))
    area = _edge(np.int32(xb - xa), np.int32(yb - ya), np.int32(xc - xa), np.int32(yc - ya))
    turned = area < 0
    xb, xc = xc if turned else xb, xb if turned else xc
    yb, yc = yc if turned else yb, yb if turned else yc
    edges = (
        np.int32(_edge(xb, yb, xc, yc) + margin),
        np.int32(_edge(xc, yc, xa, ya) + margin),
        np.int32(_edge(xa, ya, xb, yb) + margin),
    )
    right = np.int32(_UNITS * (yb - yc)), np.int32(_UNITS * (yc - ya)), np.int32(_UNITS * (ya - yb))
    down = np.int32(_UNITS * (xc - xb)), np.int32(_UNITS * (xa - xc)), np.int32(_UNITS * (xb - xa))
    missed = negative_somewhere(edges, right, down)
    bits = block_bits(i1 - i0 + 1, j1 - j0 + 1)
    bits = np.int32(bits & ~missed) if abs(area) >= margin else bits
    return bits if small else np.int32(ALL)
