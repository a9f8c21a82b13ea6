"""Post pass (LF sections 4 and 7): the image multiplied by 1 - ao."""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel


@kernel(parallel=True)
def apply_occlusion(rgb, occlusion, shaded):
    """Shaded = rgb (1 - occlusion); rgb, shaded: (H, W, 3); occlusion: (H, W), same dtype."""
    one = occlusion.dtype.type(1)
    for j in prange(occlusion.shape[0]):
        for i in range(occlusion.shape[1]):
            visibility = one - occlusion[j, i]
            for c in range(3):
                shaded[j, i, c] = rgb[j, i, c] * visibility


@kernel(parallel=True)
def apply_to_white(depth, occlusion, shaded):
    """The same of an image that is white where there is a surface, depth < infinity, and black elsewhere."""
    zero, one = occlusion.dtype.type(0), occlusion.dtype.type(1)
    for j in prange(occlusion.shape[0]):
        for i in range(occlusion.shape[1]):
            white = one if depth[j, i] < np.inf else zero
            for c in range(3):
                shaded[j, i, c] = white * (one - occlusion[j, i])
