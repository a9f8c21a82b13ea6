"""A and z in three bytes a texel (SAO section 2.3), and the key that z becomes.

(R, G, B) = (A, fix(256 key) / 256, fract(256 key)) with key = z / z_min. Reading: a byte holds k / 255. Then a G of
k / 256 would be the byte of k - 0.5 or so, and 128 and 129 would share one; here byte G is fix(256 key) itself, as
k / 255, and byte B is fract(256 key) rounded to 255ths. The key is within 1 / (2 * 255 * 256) of what was packed.
G = B = 255 is kept for texels without a surface, so that the three bytes are all that the next pass reads.
"""

import numpy as np
from numba import prange

from lfssao.kernels.jit import kernel


@kernel(parallel=True)
def depth_keys(z, origin, scale, keys):
    """(z - origin) scale, held in [0, 1]; +infinity where there is no surface. All (H, W), or scalars of that dtype."""
    height, width = z.shape
    zero, one = z.dtype.type(0), z.dtype.type(1)
    for j in prange(height):
        for i in range(width):
            key = (z[j, i] - origin) * scale
            key = key if key > zero else zero
            key = key if key < one else one
            keys[j, i] = key if z[j, i] < np.inf else z.dtype.type(np.inf)


@kernel(parallel=True)
def pack(visibility, keys, rgb):
    """Bytes of A and the key; visibility in [0, 1] and keys as of depth_keys, (H, W); rgb: (H, W, 3) uint8, out."""
    height, width = keys.shape
    dtype = keys.dtype.type
    half, whole, steps = dtype(0.5), dtype(256), dtype(255)
    for j in prange(height):
        for i in range(width):
            key = keys[j, i]
            there = key < np.inf
            scaled = (key if there else dtype(0)) * whole
            high = min(np.int32(scaled), np.int32(255))
            fraction = scaled - dtype(high)
            low = min(np.int32(fraction * steps + half), np.int32(255))
            low = min(low, np.int32(254)) if high == 255 else low  # 255, 255 is no surface
            rgb[j, i, 0] = np.uint8(np.int32(visibility[j, i] * steps + half))
            rgb[j, i, 1] = np.uint8(high) if there else np.uint8(255)
            rgb[j, i, 2] = np.uint8(low) if there else np.uint8(255)


@kernel(parallel=True)
def unpack(rgb, visibility, keys):
    """A = R / 255 and key = (G + B / 255) / 256; key +infinity for G = B = 255. Shapes as in pack; both out."""
    height, width = keys.shape
    dtype = keys.dtype.type
    whole, steps = dtype(1 / 256), dtype(255)
    for j in prange(height):
        for i in range(width):
            high, low = rgb[j, i, 1], rgb[j, i, 2]
            key = (dtype(high) + dtype(low) / steps) * whole
            visibility[j, i] = dtype(rgb[j, i, 0]) / steps
            keys[j, i] = dtype(np.inf) if (high == 255) & (low == 255) else key
