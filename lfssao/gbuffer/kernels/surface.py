"""Depth, positions, normals and diffuse colour of the visible triangles: in float64, rounded once to float32.

Normals are the triangle's, or interpolated from the vertices, in world space, of unit length. Colour is material factor
x vertex colour x texture, linear RGB.
"""

from math import floor
from typing import Any, NamedTuple

import numpy as np

from lfssao.core.jit import kernel
from lfssao.core.vectors import unit
from lfssao.gbuffer.kernels.triangle import point_on_triangle, triangle_at
from lfssao.optics.kernels.projection import affine_row, linear_row
from lfssao.optics.kernels.rays import image_depth, texel_ray


@kernel(rows="triangle")
def write_surface(begin, stop, rays, world_from_cast, triangle, z, depth, positions, top=0):
    """Write depth, (H, W) float32, and world positions, (H, W, 3) float32; +infinity where there is no surface.

    triangle: (H, W) int32, -1 where there is no surface. z: (H, W) float64, cast space, of the hit. positions may be of
    shape (0, 0, 3), and is then left out. top: the view's row that row 0 is.
    """
    placed = positions.shape[0] > 0
    for j in range(begin, stop):
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


@kernel(rows="triangle")
def points_on_triangles(begin, stop, rays, tree, triangle, z, weights, top=0):
    """Write z, (H, W) float64, and weights of corners b and c, (H, W, 2), of each texel that sees a triangle."""
    for j in range(begin, stop):
        for i in range(triangle.shape[1]):
            if triangle[j, i] >= 0:
                ox, oy, _, dx, dy, _, _, _ = texel_ray(rays, i + 0.5, (top + j) + 0.5)
                t = triangle_at(tree.corners, tree.place_of[triangle[j, i]])
                z[j, i], weights[j, i, 0], weights[j, i, 1] = point_on_triangle(ox, oy, dx, dy, t)


class Surface(NamedTuple):
    """A mesh in world space as arrays."""

    vertices: Any  # (V, 3) float64
    faces: Any  # (F, 3) int32
    normals: Any  # (V, 3) float64: at the vertices; (0, 3) where there are none


@kernel
def interpolate(values, faces, face, weight_b, weight_c, k):
    """Column k of per-vertex values at a place on a face: (a w_a + b w_b) + c w_c, w_a = (1 - w_b) - w_c, float64."""
    a = np.float64(values[faces[face, 0], k])
    b = np.float64(values[faces[face, 1], k])
    c = np.float64(values[faces[face, 2], k])
    return (a * ((1.0 - weight_b) - weight_c) + b * weight_b) + c * weight_c


@kernel(rows="triangle")
def write_normals(begin, stop, rays, world_from_cast, triangle, weights, mesh, normals, top=0):
    """Write unit normals in world space towards the viewer, (H, W, 3) float32; 0 where there is no surface.

    triangle, weights: (H, W) int32 and (H, W, 2) float64, as of ``points_on_triangles``. Smooth normals are (a w_a +
    b w_b) + c w_c of the vertices' normals, w_a = (1 - w_b) - w_c; geometric ones, for weights of shape (0, 0, 2), are
    (b - a) x (c - a). top: the view's row that row 0 is.
    """
    m, vertices, smooth = world_from_cast, mesh.vertices, weights.shape[0] > 0
    for row in range(begin, stop):
        for column in range(triangle.shape[1]):
            face = triangle[row, column]
            if face < 0:
                normals[row, column, 0], normals[row, column, 1], normals[row, column, 2] = 0, 0, 0
                continue
            if smooth:
                b, c = weights[row, column, 0], weights[row, column, 1]
                x = interpolate(mesh.normals, mesh.faces, face, b, c, 0)
                y = interpolate(mesh.normals, mesh.faces, face, b, c, 1)
                z = interpolate(mesh.normals, mesh.faces, face, b, c, 2)
            else:
                i, j, k = mesh.faces[face, 0], mesh.faces[face, 1], mesh.faces[face, 2]
                e0, e1 = vertices[j, 0] - vertices[i, 0], vertices[j, 1] - vertices[i, 1]
                e2, f0 = vertices[j, 2] - vertices[i, 2], vertices[k, 0] - vertices[i, 0]
                f1, f2 = vertices[k, 1] - vertices[i, 1], vertices[k, 2] - vertices[i, 2]
                x, y, z = e1 * f2 - e2 * f1, e2 * f0 - e0 * f2, e0 * f1 - e1 * f0
            x, y, z = unit(x, y, z)
            _, _, _, dx, dy, _, _, _ = texel_ray(rays, column + 0.5, (top + row) + 0.5)
            # The ray's direction in world space; a normal along it shows the surface's back.
            wx, wy, wz = linear_row(m, 0, dx, dy, 1.0), linear_row(m, 1, dx, dy, 1.0), linear_row(m, 2, dx, dy, 1.0)
            sign = -1.0 if (x * wx + y * wy) + z * wz > 0.0 else 1.0
            normals[row, column, 0], normals[row, column, 1], normals[row, column, 2] = sign * x, sign * y, sign * z


class Material(NamedTuple):
    """A mesh's materials as arrays, all textures in one."""

    factors: Any  # (M, 3) float32: factor of each material
    of_face: Any  # (F,) int32: the material of each face
    vertex_colors: Any  # (V, 3) float32: linear RGB at the vertices; (0, 3) where there is none
    uv: Any  # (V, 2) float64: texture coordinates; (0, 2) where there are none
    # (M, 6) int64 of each material's texture: first texel, width, height, how it goes on along u and v, 1 for the
    # nearest texel; width 0 where it has none
    textures: Any
    texels: Any  # (T, 3) float32: all textures, one behind the other, row by row


# How a texture goes on outside of [0, 1), an axis at a time.
REPEAT, MIRROR, CLAMP = 0, 1, 2


@kernel
def into_period(t, wrap):
    """A texture coordinate moved to where the texture has the same value: to [0, 1), [0, 2) or [0, 1]."""
    if wrap == REPEAT:
        return t - floor(t)
    if wrap == MIRROR:
        return t - 2.0 * floor(0.5 * t)
    return min(max(t, 0.0), 1.0)


@kernel
def texel_of(number, size, wrap):
    """The texel, 0 to size - 1, that stands at a number along an axis, which may lie outside."""
    if wrap == REPEAT:
        return number % size
    if wrap == MIRROR:
        place = number % (2 * size)
        return min(place, 2 * size - 1 - place)
    return min(max(number, 0), size - 1)


@kernel
def sample_texture(texels, first, wide, high, u, v, channel, wrap_u=REPEAT, wrap_v=REPEAT):
    """One channel of a texture at (u, v), bilinear between texel centres.

    texels: (n, 3) float32, the texture's ``high`` rows from number ``first`` on, row 0 at v = 1. wrap_u, wrap_v: how
    it goes on outside. Order: along u in the upper row, in the lower row, then along v; each a + (b - a) f, in float64.
    """
    x = into_period(u, wrap_u) * wide - 0.5
    y = (1.0 - into_period(v, wrap_v)) * high - 0.5
    column, row = floor(x), floor(y)
    fx, fy = x - column, y - row
    left, right = texel_of(column, wide, wrap_u), texel_of(column + 1, wide, wrap_u)
    top, bottom = first + texel_of(row, high, wrap_v) * wide, first + texel_of(row + 1, high, wrap_v) * wide
    a, b = np.float64(texels[top + left, channel]), np.float64(texels[top + right, channel])
    c, d = np.float64(texels[bottom + left, channel]), np.float64(texels[bottom + right, channel])
    upper = a + (b - a) * fx
    lower = c + (d - c) * fx
    return upper + (lower - upper) * fy


@kernel
def nearest_sample(texels, first, wide, high, u, v, channel, wrap_u=REPEAT, wrap_v=REPEAT):
    """One channel of a texture at (u, v): the texel that it lies in; arguments of sample_texture."""
    x, y = into_period(u, wrap_u) * wide, (1.0 - into_period(v, wrap_v)) * high
    column = min(floor(x), wide - 1) if wrap_u == REPEAT else texel_of(floor(x), wide, wrap_u)
    row = min(floor(y), high - 1) if wrap_v == REPEAT else texel_of(floor(y), high, wrap_v)
    return np.float64(texels[first + row * wide + column, channel])


@kernel(rows="triangle")
def write_albedo(begin, stop, triangle, weights, faces, material, nearest, rgb):
    """Write the diffuse colour of every texel, (H, W, 3) float32 linear RGB; 0 where there is no surface.

    triangle, weights: (H, W) int32 and (H, W, 2) float64, as of ``points_on_triangles``. faces: (F, 3) int32. nearest:
    all textures are read at the nearest texel, not only those that ask for it.
    """
    colors, uv, textures, texels = material.vertex_colors, material.uv, material.textures, material.texels
    for j in range(begin, stop):
        for i in range(triangle.shape[1]):
            face = triangle[j, i]
            if face < 0:
                rgb[j, i, 0], rgb[j, i, 1], rgb[j, i, 2] = 0, 0, 0
                continue
            b, c, number = weights[j, i, 0], weights[j, i, 1], material.of_face[face]
            first, wide, high = textures[number, 0], textures[number, 1], textures[number, 2]
            wrap_u, wrap_v, close = textures[number, 3], textures[number, 4], nearest or textures[number, 5] != 0
            u, v = 0.0, 0.0
            if wide > 0:
                u, v = interpolate(uv, faces, face, b, c, 0), interpolate(uv, faces, face, b, c, 1)
            for channel in range(3):
                value = np.float64(material.factors[number, channel])
                if colors.shape[0] > 0:
                    value *= interpolate(colors, faces, face, b, c, channel)
                if wide > 0 and close:
                    value *= nearest_sample(texels, first, wide, high, u, v, channel, wrap_u, wrap_v)
                elif wide > 0:
                    value *= sample_texture(texels, first, wide, high, u, v, channel, wrap_u, wrap_v)
                rgb[j, i, channel] = value
