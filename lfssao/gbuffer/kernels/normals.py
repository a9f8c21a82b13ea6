"""Normals at the hits: of the triangle, or interpolated from the vertices; world space, unit length."""

from math import sqrt

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.optics.kernels.rays import texel_ray


@kernel(inline=True)
def _unit(x, y, z):
    """A vector over its length, sqrt((x^2 + y^2) + z^2), after a division by its largest component; (0, 0, 0) as is."""
    size = max(abs(x), abs(y), abs(z))
    if size == 0.0:
        return x, y, z
    x, y, z = x / size, y / size, z / size
    length = sqrt((x * x + y * y) + z * z)
    return x / length, y / length, z / length


@kernel(parallel=True)
def write_normals(
    kind, lens, world_from_cast, width, triangle, weights, vertices, faces, vertex_normals, normals, top=0
):
    """Unit normals of every texel that sees a surface, turned towards the viewer; 0 elsewhere.

    Parameters
    ----------
    kind, lens : int, float64 array
        The kind of ray and its numbers.
    world_from_cast : (12,) float64
        Cast space -> world, rows of four.
    width : int
        Width of the texture.
    triangle, weights : (n,) int32, (n, 2) float64
        What first_hits found; triangle -1 where there is no surface.
    vertices : (V, 3) float64
        The mesh in world space.
    faces : (F, 3) int32
        Its faces.
    vertex_normals : (V, 3) or (0, 3) float64
        World-space normals at the vertices, for smooth normals: (a w_a + b w_b) + c w_c, w_a = (1 - w_b) - w_c. Empty
        for geometric ones: (b - a) x (c - a).
    normals : (n, 3) float32
        Out.
    top : int
        The row of the view that row 0 here is.
    """
    m = world_from_cast
    for texel in prange(triangle.shape[0]):
        face = triangle[texel]
        if face < 0:
            normals[texel, 0], normals[texel, 1], normals[texel, 2] = 0, 0, 0
            continue
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        if vertex_normals.shape[0] > 0:
            b, c = weights[texel, 0], weights[texel, 1]
            a = (1.0 - b) - c
            x = (vertex_normals[i, 0] * a + vertex_normals[j, 0] * b) + vertex_normals[k, 0] * c
            y = (vertex_normals[i, 1] * a + vertex_normals[j, 1] * b) + vertex_normals[k, 1] * c
            z = (vertex_normals[i, 2] * a + vertex_normals[j, 2] * b) + vertex_normals[k, 2] * c
        else:
            e0, e1 = vertices[j, 0] - vertices[i, 0], vertices[j, 1] - vertices[i, 1]
            e2, f0 = vertices[j, 2] - vertices[i, 2], vertices[k, 0] - vertices[i, 0]
            f1, f2 = vertices[k, 1] - vertices[i, 1], vertices[k, 2] - vertices[i, 2]
            x, y, z = e1 * f2 - e2 * f1, e2 * f0 - e0 * f2, e0 * f1 - e1 * f0
        x, y, z = _unit(x, y, z)
        row = texel // width
        _, _, _, dx, dy, _, _, _ = texel_ray(kind, lens, (texel - row * width) + 0.5, (top + row) + 0.5)
        # The ray's direction in world space; a normal along it shows the surface's back.
        away = (
            x * ((m[0] * dx + m[1] * dy) + m[2])
            + y * ((m[4] * dx + m[5] * dy) + m[6])
            + z * ((m[8] * dx + m[9] * dy) + m[10])
        )
        sign = -1.0 if away > 0.0 else 1.0
        normals[texel, 0] = np.float32(sign * x)
        normals[texel, 1] = np.float32(sign * y)
        normals[texel, 2] = np.float32(sign * z)
