"""What a ray hit, recomputed in float64 from the triangle that Embree named: depth, position, place on the triangle.

Embree's own distance and coordinates are float32 and differ between its instruction sets; here only the number of
the triangle is taken from it. (The arithmetic: DESIGN's section on equal bits.)
"""

import numpy as np
from numba import prange

from lfssao.kernels.jit import kernel
from lfssao.kernels.rays import image_depth, texel_ray


@kernel
def cross(ax, ay, az, bx, by, bz):
    """A x b, each component as the difference of two products."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@kernel
def intersect_plane(ox, oy, oz, dx, dy, dz, a, b, c):
    """Where a ray meets the plane of triangle a b c, and with which weights of its corners.

    Returns
    -------
    t : float
        n . (a - o) / n . d with n = (b - a) x (c - a), held to the t at which the triangle's corners lie (in z), so
        that a triangle seen edge on has a depth on itself.
    weight_b, weight_c : float
        Barycentric weights of b and c at that point, 0 to 1.
    """
    e1x, e1y, e1z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    e2x, e2y, e2z = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = cross(e1x, e1y, e1z, e2x, e2y, e2z)
    ax, ay, az = a[0] - ox, a[1] - oy, a[2] - oz
    t = ((nx * ax + ny * ay) + nz * az) / ((nx * dx + ny * dy) + nz * dz)
    t_a, t_b, t_c = (a[2] - oz) / dz, (b[2] - oz) / dz, (c[2] - oz) / dz
    first, last = min(t_a, t_b, t_c), max(t_a, t_b, t_c)
    t = t if t > first else first  # NaN, of an edge-on triangle, becomes the nearest corner
    t = t if t < last else last
    px, py, pz = t * dx - ax, t * dy - ay, t * dz - az
    area = (nx * nx + ny * ny) + nz * nz
    qx, qy, qz = cross(px, py, pz, e2x, e2y, e2z)
    weight_b = min(max(((nx * qx + ny * qy) + nz * qz) / area, 0.0), 1.0)
    qx, qy, qz = cross(e1x, e1y, e1z, px, py, pz)
    weight_c = min(max(((nx * qx + ny * qy) + nz * qz) / area, 0.0), 1.0)
    return t, weight_b, weight_c


@kernel(parallel=True)
def resolve_hits(kind, lens, world_from_cast, vertices, faces, width, texels, hit, depth, positions, triangle, weights):
    """Depth, position and place on the triangle of each ray that hit.

    Parameters
    ----------
    kind, lens : int, (8,) float64
        The kind of ray and its numbers.
    world_from_cast : (12,) float64
        Cast space -> world, rows of four.
    vertices, faces : (V, 3) float64, (F, 3) int32
        The mesh in cast space.
    width : int
        Width of the texture.
    texels, hit : (n,) int32
        Texel of each ray, and the triangle that it hit or -1.
    depth : (H * W,) float32
        Out: image z, rounded once.
    positions : (H * W, 3) float32
        Out: world coordinates, rounded once.
    triangle : (H * W,) int32
        Out: triangle number.
    weights : (H * W, 2) float32
        Out: barycentric weights of the triangle's second and third corner.
    """
    for k in prange(texels.shape[0]):
        face = hit[k]
        if face >= 0:
            texel = texels[k]
            j = texel // width
            ox, oy, oz, dx, dy, dz, _, _ = texel_ray(kind, lens, (texel - j * width) + 0.5, j + 0.5)
            a, b, c = vertices[faces[face, 0]], vertices[faces[face, 1]], vertices[faces[face, 2]]
            t, weight_b, weight_c = intersect_plane(ox, oy, oz, dx, dy, dz, a, b, c)
            x, y, z = ox + t * dx, oy + t * dy, oz + t * dz
            depth[texel] = np.float32(image_depth(kind, lens, z))
            for row in range(3):
                m = 4 * row
                value = ((world_from_cast[m] * x + world_from_cast[m + 1] * y) + world_from_cast[m + 2] * z) + (
                    world_from_cast[m + 3]
                )
                positions[texel, row] = np.float32(value)
            triangle[texel] = face
            weights[texel, 0] = np.float32(weight_b)
            weights[texel, 1] = np.float32(weight_c)
