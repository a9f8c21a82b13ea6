"""Positions rebuilt from depth, and face normals from positions (SAO section 2.3, equations 3 and 4).

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

from lfssao.core.jit import kernel
from lfssao.core.vectors import unit
from lfssao.optics.kernels.projection import affine_row, linear_row

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


@kernel(rows="z")
def rebuild_positions(begin, stop, z, rays, positions):
    """Equation 3: world positions of all texels, (H, W, 3), out, of z, (H, W); +infinity where there is no surface."""
    width = z.shape[1]
    m, nothing = rays.world, z.dtype.type(np.inf)
    depths, out = z.reshape(-1), positions.reshape(-1)
    for j in range(begin, stop):
        for i in range(width):
            texel = np.uint64(j * width + i)
            depth, place = depths[texel], np.uint64(3) * texel
            if rays.kind == SEPARABLE:
                x, y = ray_point(rays.numbers, np.int32(i), np.int32(j), depth)
            else:
                x, y = table_point(rays.table, texel, depth)
            for k in range(3):
                out[place + np.uint64(k)] = affine_row(m, k, x, y, depth) if depth < np.inf else nothing


@kernel(rows="depth")
def linear_depth(begin, stop, depth, perspective, c_0, c_1, c_2, z):
    """Distances of all texels from the eye's plane (SAO section 2.2, equation 2).

    SAO's z is negative, ours grows away from the viewer: z = -z_SAO, with near and far plane at n and f. Equation 2
    with c = (n, -1, 1) for f = infinity and (n f, n - f, f) otherwise gives it as printed. An orthographic camera's
    depth is linear already, c_0 + d c_1 with c = (n, f - n); the paper has none.
    depth, (H, W): 0 at the near plane and 1 at the far plane, +infinity where there is no surface. z, (H, W): out,
    +infinity there and where equation 2 puts the point at infinity or behind the eye.
    """
    width = depth.shape[1]
    nothing = depth.dtype.type(np.inf)
    for j in range(begin, stop):
        for i in range(width):
            d = depth[j, i]
            below = d * c_1 + c_2
            seen = (c_0 / below if below > 0 else nothing) if perspective else c_0 + d * c_1
            z[j, i] = seen if d < np.inf else nothing


@kernel(inline=True)
def texel_direction(rays, i, j, width):
    """Direction in which texel (i, j) looks, world space, of any length."""
    m, numbers, one, half = rays.world, rays.numbers, rays.world.dtype.type(1), rays.world.dtype.type(0.5)
    if rays.kind == SEPARABLE:
        x = numbers[3] + numbers[4] * ((m.dtype.type(i) + half) - numbers[0])
        y = numbers[8] + numbers[9] * ((m.dtype.type(j) + half) - numbers[5])
    else:
        x, y = rays.table[1, j * width + i], rays.table[3, j * width + i]
    return linear_row(m, 0, x, y, one), linear_row(m, 1, x, y, one), linear_row(m, 2, x, y, one)


@kernel(inline=True)
def partner(depths, texel, step, odd, before, after):
    """Texel number for the difference along an axis: the pair's other one, else that on the other side, else ``texel``.

    step: between neighbours along the axis; odd: whether this is the pair's second; before, after: whether there are
    neighbours in the texture.
    """
    before = before and depths[np.uint64(texel - step if before else texel)] < np.inf
    after = after and depths[np.uint64(texel + step if after else texel)] < np.inf
    if odd:
        return texel - step if before else texel + step if after else texel
    return texel + step if after else texel - step if before else texel


@kernel(inline=True)
def difference(places, one, other):
    """Position of texel ``one`` less that of texel ``other``."""
    a, b = np.uint64(3 * one), np.uint64(3 * other)
    u, v = np.uint64(1), np.uint64(2)
    return places[a] - places[b], places[a + u] - places[b + u], places[a + v] - places[b + v]


@kernel(rows="z")
def face_normals(begin, stop, z, positions, rays, normals):
    """Equation 4: unit normals from the differences of neighbouring positions, towards the viewer.

    A gradient is that of GPUs, within quads of 2x2 texels whose first corner is even: both texels of a pair share one
    difference. Readings: where the pair's other texel is outside or sees no surface, the difference is to the other
    side; where there is neither, or the differences are parallel, the normal is the direction towards the viewer.
    The product's sign is that with which the normal points against the texel's ray.

    z: (H, W), +infinity where there is no surface; positions, normals: (H, W, 3), world space; normals, out, are 0
    where there is no surface.
    """
    height, width = z.shape
    depths, places, out = z.reshape(-1), positions.reshape(-1), normals.reshape(-1)
    for j in range(begin, stop):
        zero = z.dtype.type(0)
        for i in range(width):
            texel = j * width + i
            nx, ny, nz = zero, zero, zero
            if depths[np.uint64(texel)] < np.inf:
                across = partner(depths, texel, 1, i & 1, i > 0, i + 1 < width)
                down = partner(depths, texel, width, j & 1, j > 0, j + 1 < height)
                ax, ay, az = difference(places, across, texel)
                bx, by, bz = difference(places, down, texel)
                nx, ny, nz = unit(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
                dx, dy, dz = texel_direction(rays, np.int32(i), np.int32(j), width)
                away = (nx * dx + ny * dy) + nz * dz
                if away > zero:
                    nx, ny, nz = -nx, -ny, -nz
                elif not away < zero:
                    nx, ny, nz = unit(-dx, -dy, -dz)
            place = np.uint64(3 * texel)
            out[place], out[place + np.uint64(1)], out[place + np.uint64(2)] = nx, ny, nz
