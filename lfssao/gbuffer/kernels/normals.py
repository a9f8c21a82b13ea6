"""Normals at the hits: of the triangle, or interpolated from the vertices; world space, unit length."""

from math import sqrt
from typing import Any, NamedTuple

from numba import prange

from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import linear_row
from lfssao.optics.kernels.rays import texel_ray


class Surface(NamedTuple):
    """A mesh in world space as arrays."""

    vertices: Any  # (V, 3) float64
    faces: Any  # (F, 3) int32
    normals: Any  # (V, 3) float64: at the vertices; (0, 3) where there are none


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
def write_normals(rays, world_from_cast, triangle, weights, mesh, normals, top=0):
    """Write unit normals in world space towards the viewer, (H, W, 3) float32; 0 where there is no surface.

    triangle, weights: (H, W) int32 and (H, W, 2) float64, as of ``points_on_triangles``. Smooth normals are (a w_a +
    b w_b) + c w_c of the vertices' normals, w_a = (1 - w_b) - w_c; geometric ones, for weights of shape (0, 0, 2), are
    (b - a) x (c - a). top: the view's row that row 0 is.
    """
    m, vertices, smooth, at_vertices = world_from_cast, mesh.vertices, weights.shape[0] > 0, mesh.normals
    for row in prange(triangle.shape[0]):
        for column in range(triangle.shape[1]):
            face = triangle[row, column]
            if face < 0:
                normals[row, column, 0], normals[row, column, 1], normals[row, column, 2] = 0, 0, 0
                continue
            i, j, k = mesh.faces[face, 0], mesh.faces[face, 1], mesh.faces[face, 2]
            if smooth:
                b, c = weights[row, column, 0], weights[row, column, 1]
                a = (1.0 - b) - c
                x = (at_vertices[i, 0] * a + at_vertices[j, 0] * b) + at_vertices[k, 0] * c
                y = (at_vertices[i, 1] * a + at_vertices[j, 1] * b) + at_vertices[k, 1] * c
                z = (at_vertices[i, 2] * a + at_vertices[j, 2] * b) + at_vertices[k, 2] * c
            else:
                e0, e1 = vertices[j, 0] - vertices[i, 0], vertices[j, 1] - vertices[i, 1]
                e2, f0 = vertices[j, 2] - vertices[i, 2], vertices[k, 0] - vertices[i, 0]
                f1, f2 = vertices[k, 1] - vertices[i, 1], vertices[k, 2] - vertices[i, 2]
                x, y, z = e1 * f2 - e2 * f1, e2 * f0 - e0 * f2, e0 * f1 - e1 * f0
            x, y, z = _unit(x, y, z)
            _, _, _, dx, dy, _, _, _ = texel_ray(rays, column + 0.5, (top + row) + 0.5)
            # The ray's direction in world space; a normal along it shows the surface's back.
            away = (x * linear_row(m, 0, dx, dy, 1.0) + y * linear_row(m, 1, dx, dy, 1.0)) + z * linear_row(
                m, 2, dx, dy, 1.0
            )
            sign = -1.0 if away > 0.0 else 1.0
            normals[row, column, 0] = sign * x
            normals[row, column, 1] = sign * y
            normals[row, column, 2] = sign * z
