"""Diffuse colour at each hit: material factor x vertex colour x texture, linear RGB."""

from math import floor
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from lfssao.core.jit import kernel


class Material(NamedTuple):
    """A mesh's materials as arrays, all textures in one."""

    factors: Any  # (M, 3) float32: factor of each material
    of_face: Any  # (F,) int32: the material of each face
    vertex_colors: Any  # (V, 3) float32: linear RGB at the vertices; (0, 3) where there is none
    uv: Any  # (V, 2) float64: texture coordinates; (0, 2) where there are none
    textures: Any  # (M, 3) int64: first texel, width and height of each material's texture; width 0 where it has none
    texels: Any  # (T, 3) float32: all textures, one behind the other, row by row


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
def write_albedo(triangle, weights, faces, material, nearest, rgb):
    """Write the diffuse colour of every texel, (H, W, 3) float32 linear RGB; 0 where there is no surface.

    triangle, weights: (H, W) int32 and (H, W, 2) float64, as of ``points_on_triangles``. faces: (F, 3) int32. nearest:
    textures are read at the nearest texel and not between four.
    """
    colors, uv, texels = material.vertex_colors, material.uv, material.texels
    for j in prange(triangle.shape[0]):
        for i in range(triangle.shape[1]):
            face = triangle[j, i]
            if face < 0:
                rgb[j, i, 0], rgb[j, i, 1], rgb[j, i, 2] = 0, 0, 0
                continue
            b, c, number = weights[j, i, 0], weights[j, i, 1], material.of_face[face]
            first, wide, high = material.textures[number, 0], material.textures[number, 1], material.textures[number, 2]
            for channel in range(3):
                value = np.float64(material.factors[number, channel])
                if colors.shape[0] > 0:
                    value *= interpolate(colors, faces, face, b, c, channel)
                if wide > 0:
                    u, v = interpolate(uv, faces, face, b, c, 0), interpolate(uv, faces, face, b, c, 1)
                    if nearest:
                        value *= nearest_sample(texels, first, wide, high, u, v, channel)
                    else:
                        value *= sample_texture(texels, first, wide, high, u, v, channel)
                rgb[j, i, channel] = value
