"""Post pass (LF sections 4 and 7): the image multiplied by 1 - ao."""

import numpy as np
from numba import prange

from lfssao.kernels.jit import kernel


@kernel(parallel=True)
def apply_occlusion(rgb, occlusion, window, shaded):
    """Shaded = rgb (1 - occlusion) in a window, (4,) int64: left, top, right, bottom; elsewhere shaded is left alone.

    rgb, shaded: (H, W, 3); occlusion: (H, W), same dtype.
    """
    one, left, top, right = occlusion.dtype.type(1), window[0], window[1], window[2]
    for j in prange(window[3] - top):
        image, hidden, row = rgb[top + j, left:right], occlusion[top + j, left:right], shaded[top + j, left:right]
        for i in range(hidden.shape[0]):
            visibility = one - hidden[i]
            for c in range(3):
                row[i, c] = image[i, c] * visibility


@kernel(parallel=True)
def apply_to_white(depth, occlusion, window, shaded):
    """The same of an image that is white where there is a surface, depth < infinity, and black elsewhere."""
    zero, one, left, top, right = occlusion.dtype.type(0), occlusion.dtype.type(1), window[0], window[1], window[2]
    for j in prange(window[3] - top):
        far, hidden, row = depth[top + j, left:right], occlusion[top + j, left:right], shaded[top + j, left:right]
        for i in range(hidden.shape[0]):
            white = one if far[i] < np.inf else zero
            value = white * (one - hidden[i])
            for c in range(3):
                row[i, c] = value
