"""Positions rebuilt from depth (SAO section 2.3, equation 3), for cameras and modules.

The points that land on image point (u, v) are a straight line in cast space, (x(z), y(z), z). Its numbers:

SEPARABLE   x = (a + b U) + z (c + d U) with U = u - u_c: five numbers, u_c, a, b, c, d, then as many for y and v.
            Cameras, whose a = b = 0 (perspective, equation 3) or c = d = 0 (orthographic), and flat displays with the
            linear diffuser, where both parts are needed.
TABLE       four numbers a texel, a, b, c, d: x = a + b z, y = c + d z, NaN where it has no line. Any display.

Equation 3 in these letters: (1 - P_02) / P_00 - 2 (x' + 1/2) / (w P_00) is -(c + d U), as the paper's z is negative.
Its y term has one minus too many; ours is that for which projecting the point gives the texel back.
"""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel

SEPARABLE = 0
TABLE = 1


@kernel(inline=True)
def line_point(u_c, a, b, c, d, u, z):
    """One coordinate of a SEPARABLE line's point at z: (a + b U) + z (c + d U), U = u - u_c."""
    at = u - u_c
    return (a + b * at) + z * (c + d * at)


@kernel(parallel=True)
def rebuild_positions(z, kind, lines, table, m, positions):
    """Equation 3: world positions of all texels.

    Parameters
    ----------
    z : (H, W) float32 or float64
        z of cast space, +infinity where there is no surface.
    kind, lines, table : int, (10,) and (4, H * W or 0), same dtype
        The texels' lines: SEPARABLE and its numbers, or TABLE and its columns.
    m : (12,), same dtype
        Rows of four of the affine map cast space -> world.
    positions : (H, W, 3), same dtype
        Out: ((m_0 x + m_1 y) + m_2 z) + m_3 and so on; +infinity where there is no surface.
    """
    height, width = z.shape
    half, nothing = m.dtype.type(0.5), m.dtype.type(np.inf)
    depths, out = z.reshape(-1), positions.reshape(-1)
    u_c, u_a, u_b, u_d, u_e = lines[0], lines[1], lines[2], lines[3], lines[4]
    m0, m1, m2, m3, m4, m5 = m[0], m[1], m[2], m[3], m[4], m[5]
    m6, m7, m8, m9, m10, m11 = m[6], m[7], m[8], m[9], m[10], m[11]
    for j in prange(height):
        v = m.dtype.type(j) + half
        x, y = np.empty(width, m.dtype), np.empty(width, m.dtype)
        for i in range(width):
            depth = depths[np.uint64(j * width + i)]
            if kind == SEPARABLE:
                x[i] = line_point(u_c, u_a, u_b, u_d, u_e, m.dtype.type(np.int32(i)) + half, depth)
                y[i] = line_point(lines[5], lines[6], lines[7], lines[8], lines[9], v, depth)
            else:
                texel = np.uint64(j * width + i)
                x[i] = table[0, texel] + depth * table[1, texel]
                y[i] = table[2, texel] + depth * table[3, texel]
        for i in range(width):
            depth = depths[np.uint64(j * width + i)]
            there = depth < np.inf
            place = np.uint64(3 * (j * width + i))
            a = ((m0 * x[i] + m1 * y[i]) + m2 * depth) + m3
            b = ((m4 * x[i] + m5 * y[i]) + m6 * depth) + m7
            c = ((m8 * x[i] + m9 * y[i]) + m10 * depth) + m11
            out[place] = a if there else nothing
            out[place + np.uint64(1)] = b if there else nothing
            out[place + np.uint64(2)] = c if there else nothing
