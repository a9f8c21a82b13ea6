"""Several occlusions of a texel as one: the largest (LF section 6, after Hoang and Low), or what a product leaves."""

from numba import prange

from lfssao.kernels.jit import kernel, wide_vectors


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


@kernel(parallel=True)
def merge_product(first, second, merged):
    """1 - (1 - a)(1 - b), what a product of two open shares leaves hidden (VO section 6), as a + b (1 - a); (H, W)."""
    for j in prange(merged.shape[0]):
        wide_vectors()
        one = merged.dtype.type(1)
        for i in range(merged.shape[1]):
            merged[j, i] = first[j, i] + second[j, i] * (one - first[j, i])
