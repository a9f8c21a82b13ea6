"""Viewing directions: the direction of each texel's ray in world space."""

from math import sqrt

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import DISPLAY
from lfssao.optics.kernels.rays import texel_ray

_ROWS_A_BLOCK = 16


@kernel(parallel=True)
def write_directions(rays, m, directions):
    """Write unit directions of all texel rays in world space, away from the viewer; (0, 0, 0) where there is no ray.

    m, (12,) float64, has rows of four of the affine map cast space -> world; directions, (H, W, 3) float32 or float64,
    are computed in float64 and rounded once.
    """
    height, width = directions.shape[0], directions.shape[1]
    out = directions.reshape(-1)
    m0, m1, m2, m4, m5, m6, m8, m9, m10 = m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]
    for block in prange((height + _ROWS_A_BLOCK - 1) // _ROWS_A_BLOCK):
        dx, dy = np.empty(width), np.empty(width)
        unit = np.empty(3 * width, directions.dtype)
        top = np.int64(block) * _ROWS_A_BLOCK
        for j in range(top, min(height, top + _ROWS_A_BLOCK)):
            if rays.kind == DISPLAY or j == top:
                for i in range(width):
                    _, _, _, dx[i], dy[i], _, _, _ = texel_ray(rays, i + 0.5, j + 0.5)
            else:  # for all other kinds dx depends on the column alone, and dy on the row
                _, _, _, _, down, _, _, _ = texel_ray(rays, 0.5, j + 0.5)
                for i in range(width):
                    dy[i] = down
            for i in range(width):
                x = (m0 * dx[i] + m1 * dy[i]) + m2
                y = (m4 * dx[i] + m5 * dy[i]) + m6
                z = (m8 * dx[i] + m9 * dy[i]) + m10
                length = sqrt((x * x + y * y) + z * z)
                has_ray = length > 0.0  # False for NaN
                k = np.uint64(i)
                unit[k] = x / length if has_ray else 0.0
                unit[k + np.uint64(width)] = y / length if has_ray else 0.0
                unit[k + np.uint64(2 * width)] = z / length if has_ray else 0.0
            for i in range(width):
                k, t = np.uint64(i), np.uint64(3) * np.uint64(j * width + i)
                out[t], out[t + np.uint64(1)] = unit[k], unit[k + np.uint64(width)]
                out[t + np.uint64(2)] = unit[k + np.uint64(2 * width)]
