"""The depth stage with errors: which depths a texel may have if its surface is looked at a little off its centre.

Rays are cast through nine points of the box around the centre. A renderer may see any triangle that one of them
hits; its depths there are those of its plane over the box, held between its corners.
"""

import numpy as np

from lfssao.core.jit import formula, kernel
from lfssao.optics.kernels.rays import image_depth, texel_ray


@formula
def _range_over_box(rays, u, v, reach, a, b, c):
    """Least and largest z of a triangle's plane over the box around an image point, between the corners' z."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    least, most = min(a[2], b[2], c[2]), max(a[2], b[2], c[2])
    low, high, positive = np.inf, -np.inf, 0
    for corner in range(4):
        x = u + (reach if corner % 2 == 0 else -reach)
        y = v + (reach if corner // 2 == 0 else -reach)
        ox, oy, _, dx, dy, _, _, _ = texel_ray(rays, x, y)
        divisor = (nx * dx + ny * dy) + nz
        z = ((nx * (a[0] - ox) + ny * (a[1] - oy)) + nz * a[2]) / divisor
        low, high = min(low, z), max(high, z)
        positive += np.int64(divisor > 0.0)
    if not (low <= high and (positive in (0, 4))):  # seen edge on somewhere in the box
        return least, most
    return min(max(low, least), most), max(min(high, most), least)


@kernel(rows="triangles.T")
def depth_ranges(begin, stop, rays, width, reach, vertices, faces, triangles, lower, upper):
    """Write the range of depths of each ray through each texel's box, (9, n) float64, +infinity for nothing.

    ``reach`` is half the box's edge, texels; vertices and faces are the mesh in cast space; ``triangles``, (9, n)
    int32, holds the triangle that each ray hits, -1 for none.
    """
    for texel in range(begin, stop):
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
            a, b, c = vertices[faces[t, 0]], vertices[faces[t, 1]], vertices[faces[t, 2]]
            low, high = _range_over_box(rays, u, v, reach, a, b, c)
            lower[k, texel], upper[k, texel] = image_depth(rays, low), image_depth(rays, high)
