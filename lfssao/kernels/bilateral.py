"""SAO's two reconstruction passes: Gaussian taps, each weighted by how near its depth is (section 2.4)."""

import numpy as np
from numba import prange

from lfssao.kernels.jit import kernel


@kernel(inline=True)
def tap_weight(gauss, key, centre, sharpness):
    """Gauss max(0, 1 - sharpness |key - centre|); 0 where one of the two has no surface (+infinity)."""
    zero = type(gauss)(0)
    near = type(gauss)(1) - sharpness * abs(key - centre)
    return gauss * (near if near > zero else zero)  # NaN is not above 0


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
    taps = weights.shape[0]
    for j in prange(height):
        total, weight = np.zeros(width, keys.dtype), np.zeros(width, keys.dtype)
        for k in range(taps):
            shift = (k - taps // 2) * stride
            gauss = weights[k]
            for i in range(max(0, -shift), min(width, width - shift)):
                w = tap_weight(gauss, keys[j, i + shift], keys[j, i], sharpness)
                total[i] += w * values[j, i + shift]
                weight[i] += w
        for i in range(width):
            target[j, i] = total[i] / weight[i] if weight[i] > 0 else keys.dtype.type(1)


@kernel(parallel=True)
def bilateral_vertical(values, keys, weights, stride, sharpness, target):
    """The pass along the columns; as bilateral_horizontal."""
    height, width = keys.shape
    taps = weights.shape[0]
    for j in prange(height):
        total, weight = np.zeros(width, keys.dtype), np.zeros(width, keys.dtype)
        for k in range(taps):
            row = j + (k - taps // 2) * stride
            gauss = weights[k]
            if 0 <= row < height:
                for i in range(width):
                    w = tap_weight(gauss, keys[row, i], keys[j, i], sharpness)
                    total[i] += w * values[row, i]
                    weight[i] += w
        for i in range(width):
            target[j, i] = total[i] / weight[i] if weight[i] > 0 else keys.dtype.type(1)
