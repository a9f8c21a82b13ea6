"""Depth, positions and barycentric weights of the visible triangles: computed in float64, rounded once to float32."""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.gbuffer.kernels.triangle import point_on_triangle, triangle_at
from lfssao.optics.kernels.projection import affine_row
from lfssao.optics.kernels.rays import image_depth, texel_ray


@kernel(parallel=True)
def write_surface(rays, world_from_cast, triangle, z, depth, positions, top=0):
    """Write depth, (H, W) float32, and world positions, (H, W, 3) float32; +infinity where there is no surface.

    triangle: (H, W) int32, -1 where there is no surface. z: (H, W) float64, cast space, of the hit. positions may be of
    shape (0, 0, 3), and is then left out. top: the view's row that row 0 is.
    """
    placed = positions.shape[0] > 0
    for j in prange(triangle.shape[0]):
        for i in range(triangle.shape[1]):
            if triangle[j, i] < 0:
                depth[j, i] = np.inf
                if placed:
                    positions[j, i, 0], positions[j, i, 1], positions[j, i, 2] = np.inf, np.inf, np.inf
                continue
            depth[j, i] = image_depth(rays, z[j, i])
            if placed:
                ox, oy, _, dx, dy, _, _, _ = texel_ray(rays, i + 0.5, (top + j) + 0.5)
                x, y = ox + z[j, i] * dx, oy + z[j, i] * dy
                for row in range(3):
                    positions[j, i, row] = affine_row(world_from_cast, row, x, y, z[j, i])


@kernel(parallel=True)
def points_on_triangles(rays, tree, triangle, z, weights, top=0):
    """Point of each texel's visible triangle: z, (H, W) float64, and the weights of its corners b and c, (H, W, 2).

    Texels without a surface, triangle -1, are left as they are.
    """
    for j in prange(triangle.shape[0]):
        for i in range(triangle.shape[1]):
            if triangle[j, i] >= 0:
                ox, oy, _, dx, dy, _, _, _ = texel_ray(rays, i + 0.5, (top + j) + 0.5)
                t = triangle_at(tree.corners, tree.place_of[triangle[j, i]])
                z[j, i], weights[j, i, 0], weights[j, i, 1] = point_on_triangle(ox, oy, dx, dy, t)
