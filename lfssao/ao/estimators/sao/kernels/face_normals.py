"""Face normals rebuilt from positions (SAO section 2.3, equation 4), for cameras and modules."""

from math import sqrt

import numpy as np
from numba import prange

from lfssao.ao.estimators.sao.kernels.reconstruct import SEPARABLE
from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import linear_row


@kernel(inline=True)
def unit(x, y, z):
    """A vector over its length, after a division by its largest component; (0, 0, 0) stays."""
    zero = type(x)(0)
    size = max(abs(x), abs(y), abs(z))
    there = size > zero
    x, y, z = x / size, y / size, z / size
    length = type(x)(sqrt((x * x + y * y) + z * z))
    return x / length if there else zero, y / length if there else zero, z / length if there else zero


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


@kernel(parallel=True)
def face_normals(z, positions, rays, normals):
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
    for row in prange(height):
        j, zero = np.int64(row), z.dtype.type(0)
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
