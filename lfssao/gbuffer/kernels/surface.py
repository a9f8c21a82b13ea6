"""Depth and positions textures from what the rays hit: computed in float64, rounded once to float32."""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.optics.kernels.rays import image_depth, texel_ray


@kernel(parallel=True)
def write_surface(kind, lens, world_from_cast, width, triangle, z, depth, positions, top=0):
    """Depth and world position of every texel.

    Parameters
    ----------
    kind, lens : int, float64 array
        The kind of ray and its numbers.
    world_from_cast : (12,) float64
        Cast space -> world, rows of four.
    width : int
        Width of the texture.
    triangle, z : (n,) int32, (n,) float64
        What first_hits found: the triangle or -1, and z of the hit in cast space.
    depth : (n,) float32
        Out: image z; +infinity where there is no surface.
    positions : (n, 3) or (0, 3) float32
        Out, if it has room: world coordinates of the ray's point at z, M (x, y, z, 1) as ((m0 x + m1 y) + m2 z) + m3;
        +infinity where there is no surface.
    top : int
        The row of the view that row 0 here is.
    """
    m, placed = world_from_cast, positions.shape[0] > 0
    for texel in prange(triangle.shape[0]):
        if triangle[texel] < 0:
            depth[texel] = np.inf
            if placed:
                positions[texel, 0], positions[texel, 1], positions[texel, 2] = np.inf, np.inf, np.inf
            continue
        j = texel // width
        ox, oy, _, dx, dy, _, _, _ = texel_ray(kind, lens, (texel - j * width) + 0.5, (top + j) + 0.5)
        x, y = ox + z[texel] * dx, oy + z[texel] * dy
        depth[texel] = np.float32(image_depth(kind, lens, z[texel]))
        for row in range(3 if placed else 0):
            k = 4 * row
            positions[texel, row] = np.float32(((m[k] * x + m[k + 1] * y) + m[k + 2] * z[texel]) + m[k + 3])
