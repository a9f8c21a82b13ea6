"""Positions rebuilt from depth (SAO section 2.3, equation 3), for cameras and modules.

The points that land on image point (u, v) are a straight ray in cast space, (x(z), y(z), z). Its numbers:

SEPARABLE   x = (a + b U) + z (c + d U) with U = u - u_c: five numbers, u_c, a, b, c, d, then as many for y and v.
            Cameras, whose a = b = 0 (perspective, equation 3) or c = d = 0 (orthographic), and flat displays with the
            linear diffuser, where both parts are needed.
TABLE       four numbers a texel, a, b, c, d: x = a + b z, y = c + d z, NaN where it has no ray. Any display.

Equation 3 in these letters: (1 - P_02) / P_00 - 2 (x' + 1/2) / (w P_00) is -(c + d U), as the paper's z is negative.
Its y term has one minus too many; ours is that for which projecting the point gives the texel back.
"""

from typing import NamedTuple

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import affine_row

SEPARABLE = 0
TABLE = 1


class TexelRays(NamedTuple):
    """The rays of a view's texels in cast space, arrays of the arithmetic's dtype.

    kind: SEPARABLE or TABLE. numbers: (10,) of a SEPARABLE view. table: (4, H * W) of a TABLE, else (4, 0). world:
    (12,), rows of four of the affine map cast space -> world. units: (3,) float64, world length of a unit along each
    axis of cast space. origin: z of cast space from which distances from the viewer are counted, 0 for a camera, the
    observers' z for a module.
    """

    kind: int
    numbers: np.ndarray
    table: np.ndarray
    world: np.ndarray
    units: np.ndarray
    origin: float


@kernel(inline=True)
def line_point(m, k, u, z):
    """One coordinate of a SEPARABLE ray's point at z, numbers from m[k] on: (a + b U) + z (c + d U), U = u - u_c."""
    at = u - m[k]
    return (m[k + 1] + m[k + 2] * at) + z * (m[k + 3] + m[k + 4] * at)


@kernel(inline=True)
def ray_point(m, i, j, z):
    """X and y of texel (i, j)'s SEPARABLE ray at z, m its ten numbers."""
    half = type(z)(0.5)
    return line_point(m, 0, type(z)(i) + half, z), line_point(m, 5, type(z)(j) + half, z)


@kernel(inline=True)
def table_point(table, texel, z):
    """X and y of a texel's ray in a TABLE at z."""
    return table[0, texel] + z * table[1, texel], table[2, texel] + z * table[3, texel]


@kernel(parallel=True)
def rebuild_positions(z, rays, positions):
    """Equation 3: world positions of all texels, (H, W, 3), out, of z, (H, W); +infinity where there is no surface."""
    height, width = z.shape
    m, nothing = rays.world, z.dtype.type(np.inf)
    depths, out = z.reshape(-1), positions.reshape(-1)
    for j in prange(height):
        x, y = np.empty(width, z.dtype), np.empty(width, z.dtype)
        for i in range(width):
            texel = np.uint64(j * width + i)
            if rays.kind == SEPARABLE:
                x[i], y[i] = ray_point(rays.numbers, np.int32(i), np.int32(j), depths[texel])
            else:
                x[i], y[i] = table_point(rays.table, texel, depths[texel])
        for i in range(width):
            depth = depths[np.uint64(j * width + i)]
            there, place = depth < np.inf, np.uint64(3 * (j * width + i))
            for k in range(3):
                out[place + np.uint64(k)] = affine_row(m, k, x[i], y[i], depth) if there else nothing


@kernel(parallel=True)
def linear_depth(depth, perspective, c_0, c_1, c_2, z):
    """Distances of all texels from the eye's plane (SAO section 2.2, equation 2).

    SAO's z is negative, ours grows away from the viewer: z = -z_SAO, with near and far plane at n and f. Equation 2
    with c = (n, -1, 1) for f = infinity and (n f, n - f, f) otherwise gives it as printed. An orthographic camera's
    depth is linear already, c_0 + d c_1 with c = (n, f - n); the paper has none.
    depth, (H, W): 0 at the near plane and 1 at the far plane, +infinity where there is no surface. z, (H, W): out,
    +infinity there and where equation 2 puts the point at infinity or behind the eye.
    """
    height, width = depth.shape
    nothing = depth.dtype.type(np.inf)
    for j in prange(height):
        for i in range(width):
            d = depth[j, i]
            below = d * c_1 + c_2
            seen = (c_0 / below if below > 0 else nothing) if perspective else c_0 + d * c_1
            z[j, i] = seen if d < np.inf else nothing
