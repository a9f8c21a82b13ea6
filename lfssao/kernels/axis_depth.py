"""Depth along a view's axis from its positions texture, for cameras, whose depth texture is not linear in z."""

import numpy as np
from numba import prange

from lfssao.kernels.jit import kernel
from lfssao.kernels.mapping import affine_row


@kernel(parallel=True)
def write_axis_depth(depth, positions, axis, linear):
    """Cast z of every texel's position; +infinity where there is no surface.

    Parameters
    ----------
    depth : (H, W) float32 or float64
        The depth texture, read for where it is infinite.
    positions : (H, W, 3), same dtype
        World coordinates.
    axis : (4,) same dtype
        The row of cast space's z in the affine map world -> cast space.
    linear : (H, W), same dtype
        Out.
    """
    height, width = depth.shape
    for j in prange(height):
        for i in range(width):
            z = affine_row(axis, 0, positions[j, i, 0], positions[j, i, 1], positions[j, i, 2])
            linear[j, i] = z if depth[j, i] < np.inf else depth[j, i]
