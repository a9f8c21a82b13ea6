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


@kernel(parallel=True)
def bilateral(values, keys, weights, step, sharpness, target):
    """One pass: sum w_k values[texel + k' step] / sum w_k, k' = k - taps // 2, first tap to last.

    The paper's weight is Gaussian 'modulated by linear depth difference scaled by a constant'; read as the Gaussian
    weight times max(0, 1 - constant |difference|). Taps beyond the border and texels without a surface do not
    contribute.

    keys: (H, W), depths between 0 and 1, +infinity where there is no surface. weights: Gaussian, an odd number.
    step: columns and rows between taps, one of them 0. target: out, 1 where there is no surface.
    """
    height, width = keys.shape
    a, z, out = values.reshape(-1), keys.reshape(-1), target.reshape(-1)
    taps = weights.shape[0]
    for row in prange(height):
        j = np.int64(row)
        zero, one = keys.dtype.type(0), keys.dtype.type(1)
        total, weight = np.zeros(width, keys.dtype), np.zeros(width, keys.dtype)
        for k in range(taps):
            right, down = (k - taps // 2) * step[0], (k - taps // 2) * step[1]
            if not 0 <= j + down < height:
                continue
            start, n = max(0, -right), width - abs(right)
            centre = j * width + start
            other = centre + down * width + right
            for i in range(n):  # unsigned numbers: numba need not ask whether they count from the end
                tapped, place = np.uint64(other + i), np.uint64(start + i)
                w = tap_weight(weights[k], z[tapped], z[np.uint64(centre + i)], sharpness)
                total[place] += w * a[tapped]
                weight[place] += w
        for i in range(width):
            quotient = total[i] / weight[i]
            out[np.uint64(j * width + i)] = quotient if weight[i] > zero else one
