"""The depth stage with errors: which depths a texel may have if its surface is looked at a little beside its centre.

Rays are cast through nine points of the box around the centre. Each triangle that one of them hits may be what a
renderer sees; its depths there are those of its plane over the box, held between its corners.
"""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.optics.kernels.rays import image_depth, texel_ray


@kernel(inline=True)
def plane_depth(ox, oy, dx, dy, ax, ay, az, bx, by, bz, cx, cy, cz):
    """The z at which the ray x = ox + dx z, y = oy + dy z meets the plane of a triangle, and the slope's divisor."""
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    divisor = (nx * dx + ny * dy) + nz
    return ((nx * (ax - ox) + ny * (ay - oy)) + nz * az) / divisor, divisor


@kernel(inline=True)
def _range_over_box(kind, lens, u, v, reach, ax, ay, az, bx, by, bz, cx, cy, cz):
    """Least and largest z of a triangle's plane over the box around an image point, between the corners' z."""
    least, most = min(az, bz, cz), max(az, bz, cz)
    low, high, positive = np.inf, -np.inf, 0
    for corner in range(4):
        x = u + (reach if corner % 2 == 0 else -reach)
        y = v + (reach if corner // 2 == 0 else -reach)
        ox, oy, _, dx, dy, _, _, _ = texel_ray(kind, lens, x, y)
        z, divisor = plane_depth(ox, oy, dx, dy, ax, ay, az, bx, by, bz, cx, cy, cz)
        low, high = min(low, z), max(high, z)
        positive += np.int64(divisor > 0.0)
    if not (low <= high and (positive in (0, 4))):  # seen edge on somewhere in the box
        return least, most
    return min(max(low, least), most), max(min(high, most), least)


@kernel(parallel=True)
def depth_ranges(kind, lens, width, reach, vertices, faces, triangles, lower, upper):
    """The ranges of depth of every texel, one for each ray through its box.

    Parameters
    ----------
    kind, lens : int, float64 array
        The kind of ray and its numbers.
    width : int
        Width of the texture.
    reach : float
        Half the box's edge, texels.
    vertices, faces : (V, 3) float64, (F, 3) int32
        The mesh in cast space.
    triangles : (9, n) int32
        What each ray of each texel hits, -1 for nothing.
    lower, upper : (9, n) float64
        Out: depth texture's values, +infinity for nothing.
    """
    for texel in prange(triangles.shape[1]):
        j = texel // width
        u, v = (texel - j * width) + 0.5, j + 0.5
        for k in range(triangles.shape[0]):
            t = triangles[k, texel]
            if t < 0:
                lower[k, texel], upper[k, texel] = np.inf, np.inf
                continue
            if k > 0 and t == triangles[k - 1, texel]:
                lower[k, texel], upper[k, texel] = lower[k - 1, texel], upper[k - 1, texel]
                continue
            a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
            low, high = _range_over_box(
                kind, lens, u, v, reach, vertices[a, 0], vertices[a, 1], vertices[a, 2], vertices[b, 0],
                vertices[b, 1], vertices[b, 2], vertices[c, 0], vertices[c, 1], vertices[c, 2],
            )  # fmt: skip
            lower[k, texel], upper[k, texel] = image_depth(kind, lens, low), image_depth(kind, lens, high)
