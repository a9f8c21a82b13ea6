"""Multi-resolution merge (LF section 6, after Hoang and Low): the largest occlusion over the radii."""

from numba import prange

from lfssao.kernels.jit import kernel


@kernel(parallel=True)
def merge_maximum(layers, merged):
    """Maximum over axis 0 of layers, (K, H, W), K >= 1, into merged, (H, W); the order does not matter."""
    for j in prange(merged.shape[0]):
        for i in range(merged.shape[1]):
            merged[j, i] = layers[0, j, i]
        for k in range(1, layers.shape[0]):
            for i in range(merged.shape[1]):
                value = layers[k, j, i]
                merged[j, i] = value if value > merged[j, i] else merged[j, i]
