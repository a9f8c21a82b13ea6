"""Diffuse colour at each hit: material factor x vertex colour x texture, linear RGB."""

from math import floor

import numpy as np
from numba import prange

from lfssao.core.jit import kernel


@kernel
def wrap(index, size):
    """Index modulo size, 0 <= result < size: textures repeat."""
    return index - (index // size) * size


@kernel
def sample_texture(texels, first, wide, high, u, v, channel):
    """One channel of a texture at (u, v), bilinear between texel centres, repeated outside [0, 1).

    texels: (n, 3) float32, the texture's ``high`` rows from number ``first`` on, row 0 at v = 1. Order: along u in
    the upper row, in the lower row, then along v; each a + (b - a) f, in float64.
    """
    x = (u - floor(u)) * wide - 0.5
    y = (1.0 - (v - floor(v))) * high - 0.5
    column, row = floor(x), floor(y)
    fx, fy = x - column, y - row
    left, right = wrap(column, wide), wrap(column + 1, wide)
    top, bottom = first + wrap(row, high) * wide, first + wrap(row + 1, high) * wide
    a, b = np.float64(texels[top + left, channel]), np.float64(texels[top + right, channel])
    c, d = np.float64(texels[bottom + left, channel]), np.float64(texels[bottom + right, channel])
    upper = a + (b - a) * fx
    lower = c + (d - c) * fx
    return upper + (lower - upper) * fy


@kernel
def nearest_sample(texels, first, wide, high, u, v, channel):
    """One channel of a texture at (u, v): the texel that it lies in; arguments of sample_texture."""
    column = min(int((u - floor(u)) * wide), wide - 1)
    row = min(int((1.0 - (v - floor(v))) * high), high - 1)
    return np.float64(texels[first + row * wide + column, channel])


@kernel
def interpolate(values, faces, face, weight_b, weight_c, k):
    """Column k of per-vertex values at a place on a face: (a w_a + b w_b) + c w_c, w_a = (1 - w_b) - w_c, float64."""
    a = np.float64(values[faces[face, 0], k])
    b = np.float64(values[faces[face, 1], k])
    c = np.float64(values[faces[face, 2], k])
    return (a * ((1.0 - weight_b) - weight_c) + b * weight_b) + c * weight_c


@kernel(parallel=True)
def paint_hits(
    triangle, weights, faces, factors, face_material, vertex_colors, uv, texture_table, texels, rgb, nearest=False
):
    """Diffuse colour of every texel that sees a surface, 0 elsewhere.

    Parameters
    ----------
    triangle, weights : (n,) int32, (n, 2) float64
        What first_hits found; triangle -1 where there is no surface.
    faces : (F, 3) int32
        The mesh's faces.
    factors : (M, 3) float32
        Factor of each material.
    face_material : (F,) int32
        The material of each face.
    vertex_colors : (V, 3) or (0, 3) float32
        Linear RGB at the vertices; empty where there is none.
    uv : (V, 2) or (0, 2) float64
        Texture coordinates; empty where there are none.
    texture_table : (M, 3) int64
        First texel, width and height of each material's texture; width 0 where it has none.
    texels : (T, 3) float32
        All textures, one behind the other, row by row.
    rgb : (n, 3) float32
        Out: linear RGB.
    nearest : bool
        Whether textures are read at the nearest texel instead of between four.
    """
    for k in prange(triangle.shape[0]):
        face = triangle[k]
        if face < 0:
            for channel in range(3):
                rgb[k, channel] = 0
            continue
        weight_b, weight_c = weights[k, 0], weights[k, 1]
        material = face_material[face]
        first, wide, high = texture_table[material, 0], texture_table[material, 1], texture_table[material, 2]
        for channel in range(3):
            value = np.float64(factors[material, channel])
            if vertex_colors.shape[0] > 0:
                value *= interpolate(vertex_colors, faces, face, weight_b, weight_c, channel)
            if wide > 0:
                u = interpolate(uv, faces, face, weight_b, weight_c, 0)
                v = interpolate(uv, faces, face, weight_b, weight_c, 1)
                if nearest:
                    value *= nearest_sample(texels, first, wide, high, u, v, channel)
                else:
                    value *= sample_texture(texels, first, wide, high, u, v, channel)
            rgb[k, channel] = np.float32(value)
