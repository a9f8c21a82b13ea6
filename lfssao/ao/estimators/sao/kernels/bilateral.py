"""SAO's two reconstruction passes: Gaussian taps, each weighted by how near its depth is (section 2.4)."""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel


@kernel(inline=True)
def tap_weight(gauss, key, centre, sharpness):
    """Gauss max(0, 1 - sharpness |key - centre|); 0 where one of the two has no surface (+infinity)."""
    zero = type(gauss)(0)
    near = type(gauss)(1) - sharpness * abs(key - centre)
    return gauss * (near if near > zero else zero)  # NaN is not above 0


@kernel(inline=True)
def add_tap(a, z, gauss, sharpness, centre, other, first, n, total, weight):
    """One tap of n neighbouring texels; centre and other: numbers of the first one's texel and of its tap's.

    Numbers are unsigned, so that numba need not ask whether they count from the end and LLVM makes vectors.
    """
    for i in range(n):
        tapped = np.uint64(other + i)
        w = tap_weight(gauss, z[tapped], z[np.uint64(centre + i)], sharpness)
        place = np.uint64(first + i)
        total[place] += w * a[tapped]
        weight[place] += w


@kernel(inline=True)
def finish_row(start, width, total, weight, out):
    """The quotients of a row, 1 where no tap had weight."""
    one, zero = out.dtype.type(1), out.dtype.type(0)
    for i in range(width):
        quotient = total[i] / weight[i]
        out[np.uint64(start + i)] = quotient if weight[i] > zero else one


@kernel(parallel=True)
def bilateral_horizontal(values, keys, weights, stride, sharpness, target):
    """One pass along the rows: sum w_k values[j, i + k'] / sum w_k, k' = (k - taps // 2) stride, first tap to last.

    The paper's weight is Gaussian 'modulated by linear depth difference scaled by a constant'; read as the Gaussian
    weight times max(0, 1 - constant |difference|). Taps beyond the border and texels without a surface do not
    contribute.

    Parameters
    ----------
    values : (H, W) float32 or float64
        What is filtered.
    keys : (H, W), same dtype
        Depths between 0 and 1, +infinity where there is no surface.
    weights : (taps,), same dtype
        Gaussian weights, an odd number, the middle one positive.
    stride : int
        Distance between taps, texels.
    sharpness : scalar of the same dtype
        The constant.
    target : (H, W), same dtype
        Out; 1 where there is no surface.
    """
    height, width = keys.shape
    a, z, out = values.reshape(-1), keys.reshape(-1), target.reshape(-1)
    taps = weights.shape[0]
    for j in prange(height):
        total, weight = np.zeros(width, keys.dtype), np.zeros(width, keys.dtype)
        for k in range(taps):
            shift = (k - taps // 2) * stride
            start = max(0, -shift)
            add_tap(
                a, z, weights[k], sharpness, j * width + start, j * width + start + shift,
                start, min(width, width - shift) - start, total, weight,
            )  # fmt: skip
        finish_row(j * width, width, total, weight, out)


@kernel(parallel=True)
def bilateral_vertical(values, keys, weights, stride, sharpness, target):
    """The pass along the columns; as bilateral_horizontal."""
    height, width = keys.shape
    a, z, out = values.reshape(-1), keys.reshape(-1), target.reshape(-1)
    taps = weights.shape[0]
    for j in prange(height):
        total, weight = np.zeros(width, keys.dtype), np.zeros(width, keys.dtype)
        for k in range(taps):
            row = np.int64(j) + (k - taps // 2) * stride
            if 0 <= row < height:
                add_tap(a, z, weights[k], sharpness, j * width, row * width, 0, width, total, weight)
        finish_row(j * width, width, total, weight, out)
