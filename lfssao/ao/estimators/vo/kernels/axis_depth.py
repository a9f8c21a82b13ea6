"""Depth along a view's axis from its positions texture, for cameras, whose depth texture is not linear in z."""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel


@kernel(parallel=True)
def write_axis_depth(depth, positions, axis, linear):
    """Cast z of every texel's position, (H, W), out; +infinity where the depth texture is.

    axis: (4,), the row of cast space's z in the affine map world -> cast space.
    """
    height, width = depth.shape
    depths, places, out = depth.reshape(-1), positions.reshape(-1), linear.reshape(-1)
    a, b, c, d = axis[0], axis[1], axis[2], axis[3]
    for j in prange(height):
        for i in range(width):
            texel = np.uint64(j * width + i)
            t = np.uint64(3) * texel
            z = ((a * places[t] + b * places[t + np.uint64(1)]) + c * places[t + np.uint64(2)]) + d
            out[texel] = z if depths[texel] < np.inf else depths[texel]
