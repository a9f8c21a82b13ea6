"""Gaussian blur (passes 4 and 5 of LF section 7) and shading, by AO alone or by a light (pass 6)."""

import numpy as np

from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import alternatives, as_float, larger, plain, select, within
from lfssao.core.vectors import Vector, dot


@kernel(rows="half")
def blur_horizontal(begin, stop, source, weights, half):
    """Pass 4: half[j, i] = sum over taps k, first to last, of weights[k] source[j, i + k - radius].

    A tap beyond the border reads the texel on it. source, half: (H, W); weights: (2 radius + 1,), same dtype.
    """
    width = half.shape[1]
    taps = weights.shape[0]
    radius = taps // 2
    for j in range(begin, stop):
        row, line = np.empty(width + 2 * radius, source.dtype), source[j]
        for i in range(radius):
            row[i], row[radius + width + i] = line[0], line[width - 1]
        for i in range(width):
            row[radius + i] = line[i]
        for i in range(width):
            half[j, i] = 0
        for k in range(taps):  # taps outside, texels inside: each texel adds in order, and texels make vectors
            for i in range(width):
                half[j, i] += weights[k] * row[i + k]


@kernel(rows="half")
def blur_vertical(begin, stop, half, weights, blurred):
    """Pass 5: the same down the columns."""
    height, width = half.shape
    taps = weights.shape[0]
    radius = taps // 2
    for j in range(begin, stop):
        row = blurred[j]
        for i in range(width):
            row[i] = 0
        for k in range(taps):
            line = half[min(max(j + k - radius, 0), height - 1)]
            for i in range(width):
                row[i] += weights[k] * line[i]


@kernel(rows="occlusion")
def apply_occlusion(begin, stop, rgb, occlusion, shaded):
    """Shaded = rgb (1 - occlusion); rgb, shaded: (H, W, 3); occlusion: (H, W), same dtype."""
    one = occlusion.dtype.type(1)
    for j in range(begin, stop):
        for i in range(occlusion.shape[1]):
            visibility = one - occlusion[j, i]
            for c in range(3):
                shaded[j, i, c] = rgb[j, i, c] * visibility


@formula
def faced_share(n, towards):
    """max(n . l, 0), l a unit vector towards the light; a renderer may normalise n again, if it is not 0."""
    d = dot(n, towards)
    normalised = within(dot((1 / np.sqrt(dot(n, n))) * n, towards), -2.0, 2.0)
    return larger(select(dot(n, n) > 0, alternatives(d, normalised), d), 0)


@formula
def lit_by(faced, occlusion, ambient, everything):
    """The factor of a colour (``ao.post.Light``); everything: whether AO is on all, not on the ambient term alone."""
    visible, direct = 1 - occlusion, (1 - ambient) * faced
    return select(everything, (ambient + direct) * visible, ambient * visible + direct)


@kernel(rows="occlusion")
def apply_light(begin, stop, rgb, occlusion, normals, light, everything, shaded):
    """Shaded = rgb ``lit_by``; rgb, normals, shaded: (H, W, 3); occlusion: (H, W); light: l and ambient, (4,)."""
    towards = Vector(as_float(light[0]), as_float(light[1]), as_float(light[2]))
    for j in range(begin, stop):
        for i in range(occlusion.shape[1]):
            n = normals[j, i]
            faced = faced_share(Vector(as_float(n[0]), as_float(n[1]), as_float(n[2])), towards)
            factor = plain(lit_by(faced, as_float(occlusion[j, i]), as_float(light[3]), everything))
            for c in range(3):
                shaded[j, i, c] = rgb[j, i, c] * factor
