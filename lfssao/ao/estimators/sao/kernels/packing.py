"""A and z in three bytes a texel (SAO section 2.3), and the key that z becomes.

(R, G, B) = (A, fix(256 key) / 256, fract(256 key)) with key = z / z_min. Reading: a byte holds k / 255. Then a G of
k / 256 would be the byte of k - 0.5 or so, and 128 and 129 would share one; here byte G is fix(256 key) itself, as
k / 255, and byte B is fract(256 key) rounded to 255ths. The key is within 1 / (2 * 255 * 256) of what was packed.
G = B = 255 is kept for texels without a surface, so that the three bytes are all that the next pass reads.
"""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel


@kernel(parallel=True)
def depth_keys(z, origin, scale, keys):
    """(z - origin) scale, held in [0, 1]; +infinity where there is no surface. All (H, W), or scalars of that dtype."""
    height, width = z.shape
    for j in prange(height):
        zero, one = z.dtype.type(0), z.dtype.type(1)
        for i in range(width):
            key = min(one, max(zero, (z[j, i] - origin) * scale))  # of NaN the constant, as GPUs have it
            keys[j, i] = key if z[j, i] < np.inf else z.dtype.type(np.inf)


@kernel(parallel=True)
def pack(visibility, keys, rgb):
    """Bytes of A and the key; visibility in [0, 1] and keys as of depth_keys, (H, W); rgb: (H, W, 3) uint8, out."""
    height, width = keys.shape
    dtype = keys.dtype.type
    half, whole, steps, zero = dtype(0.5), dtype(256), dtype(255), dtype(0)
    values, depths, out = visibility.reshape(-1), keys.reshape(-1), rgb.reshape(-1)
    most = np.int32(255)
    for j in prange(height):
        red, green, blue = np.empty(width, np.uint8), np.empty(width, np.uint8), np.empty(width, np.uint8)
        for i in range(width):
            texel = np.uint64(j * width + i)
            key = depths[texel]
            there = key < np.inf
            scaled = (key if there else zero) * whole
            high = np.int32(scaled)
            high = high if high < most else most
            low = np.int32((scaled - dtype(high)) * steps + half)
            last = np.int32(254) if high == most else most  # 255, 255 is no surface
            low = low if low < last else last
            red[i] = np.uint8(np.int32(values[texel] * steps + half))
            green[i], blue[i] = np.uint8(high if there else most), np.uint8(low if there else most)
        for i in range(width):
            place = np.uint64(3 * (j * width + i))
            out[place], out[place + np.uint64(1)], out[place + np.uint64(2)] = red[i], green[i], blue[i]


@kernel(parallel=True)
def unpack(rgb, visibility, keys):
    """A = R / 255 and key = (G + B / 255) / 256; key +infinity for G = B = 255. Shapes as in pack; both out."""
    height, width = keys.shape
    dtype = keys.dtype.type
    whole, steps, nothing = dtype(1 / 256), dtype(255), dtype(np.inf)
    packed, values, depths = rgb.reshape(-1), visibility.reshape(-1), keys.reshape(-1)
    for j in prange(height):
        red, green, blue = np.empty(width, np.uint8), np.empty(width, np.uint8), np.empty(width, np.uint8)
        for i in range(width):
            place = np.uint64(3 * (j * width + i))
            red[i], green[i], blue[i] = packed[place], packed[place + np.uint64(1)], packed[place + np.uint64(2)]
        for i in range(width):
            high, low = np.int32(green[i]), np.int32(blue[i])
            key = (dtype(high) + dtype(low) / steps) * whole
            texel = np.uint64(j * width + i)
            values[texel] = dtype(np.int32(red[i])) / steps
            depths[texel] = nothing if high + low == np.int32(510) else key
