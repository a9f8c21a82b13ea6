"""SAO's passes after the taps: 2x2 average, A and z in three bytes a texel (2.3), bilateral reconstruction (2.4).

(R, G, B) = (A, fix(256 key) / 256, fract(256 key)) with key = z / z_min. Reading: a byte holds k / 255. Then a G of
k / 256 would be the byte of k - 0.5 or so, and 128 and 129 would share one; here byte G is fix(256 key) itself, as
k / 255, and byte B is fract(256 key) rounded to 255ths. The key is within 1 / (2 * 255 * 256) of what was packed.
G = B = 255 is kept for texels without a surface, so that the three bytes are all that the next pass reads.
"""

import numpy as np

from lfssao.core.elementary import power
from lfssao.core.jit import formula, kernel


@formula
def blend(a, b, z_a, z_b, edge):
    """(a + b) / 2 for both where the depths differ by less than ``edge``; no surface, +infinity, never does."""
    mean = (a + b) * type(a)(0.5)
    near = abs(z_a - z_b) < edge
    return (mean if near else a), (mean if near else b)


@kernel(rows="z")
def average_quads(begin, stop, visibility, z, edge, target):
    """Average A over quads of 2x2 texels, first each row's two, then each column's two.

    The paper prints neither the threshold nor the order; on a GPU it is two screen-space derivatives, one after the
    other, so that a depth edge in one direction leaves the other's average. A texel without a partner, at the end of an
    odd row or column, stays. visibility, z (+infinity where there is no surface) and target, out: (H, W); edge:
    difference of depth from which on two texels are not averaged.
    """
    height, width = z.shape
    for j in range(begin, stop, 2):  # bands begin at even rows
        last = min(j + 1, height - 1)
        for row in range(j, last + 1):
            for pair in range(width // 2):
                i = 2 * pair
                target[row, i], target[row, i + 1] = blend(
                    visibility[row, i], visibility[row, i + 1], z[row, i], z[row, i + 1], edge
                )
            if width & 1:
                target[row, width - 1] = visibility[row, width - 1]
        if last > j:
            for i in range(width):
                target[j, i], target[last, i] = blend(target[j, i], target[last, i], z[j, i], z[last, i], edge)


@kernel(rows="keys")
def through_bytes(begin, stop, visibility, keys, values, depths):
    """A and key as three bytes hold them: A = R / 255, key = (G + B / 255) / 256; +infinity for G = B = 255.

    visibility in [0, 1] and keys as of ``keys_of``, (H, W); values, depths: out.
    """
    dtype = keys.dtype.type
    half, whole, steps, zero, most = dtype(0.5), dtype(256), dtype(255), dtype(0), np.int32(255)
    for j in range(begin, stop):
        for i in range(keys.shape[1]):
            key = keys[j, i]
            there = key < np.inf
            scaled = (key if there else zero) * whole
            high = min(most, np.int32(scaled))
            last = np.int32(254) if high == most else most  # 255, 255 is no surface
            low = min(last, np.int32((scaled - dtype(high)) * steps + half))
            values[j, i] = dtype(np.int32(visibility[j, i] * steps + half)) / steps
            depths[j, i] = (dtype(high) + dtype(low) / steps) * dtype(1 / 256) if there else dtype(np.inf)


@formula
def tap_weight(gauss, key, centre, sharpness):
    """Gauss max(0, 1 - sharpness |key - centre|); 0 where one of the two has no surface (+infinity)."""
    zero = type(gauss)(0)
    near = type(gauss)(1) - sharpness * abs(key - centre)
    return gauss * (near if near > zero else zero)  # NaN is not above 0


@kernel(rows="keys")
def bilateral(begin, stop, values, keys, weights, step, sharpness, target):
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
    for j in range(begin, stop):
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


@kernel(rows="z")
def occlusion_of(begin, stop, visibility, z, k, occlusion):
    """1 - A^k, A^k in float64 (lfssao.core.elementary) rounded once; 0 where there is no surface. (H, W), k float64."""
    width = z.shape[1]
    for j in range(begin, stop):
        one, zero = z.dtype.type(1), z.dtype.type(0)
        if k == 1.0:  # as power has it, but in vectors
            for i in range(width):
                a = one - visibility[j, i]
                occlusion[j, i] = a if z[j, i] < np.inf else zero
        else:
            for i in range(width):
                a = z.dtype.type(power(np.float64(visibility[j, i]), k))
                occlusion[j, i] = one - a if z[j, i] < np.inf else zero
