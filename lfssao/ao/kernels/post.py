"""Gaussian blur (passes 4 and 5 of LF section 7) and shading."""

import numpy as np

from lfssao.core.jit import kernel


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
