"""Several occlusions of a texel as one: the largest (LF section 6, after Hoang and Low), or by a product."""

from numba import prange

from lfssao.core.jit import kernel


@kernel(parallel=True)
def merge_maximum(layer, merged):
    """Raise merged to layer wherever layer is larger, which a NaN never is; (H, W)."""
    for j in prange(merged.shape[0]):
        for i in range(merged.shape[1]):
            merged[j, i] = layer[j, i] if layer[j, i] > merged[j, i] else merged[j, i]


@kernel(parallel=True)
def merge_product(first, second, merged):
    """1 - (1 - a)(1 - b), from the product of two open fractions (VO section 6), as a + b (1 - a); (H, W)."""
    for j in prange(merged.shape[0]):
        one = merged.dtype.type(1)
        for i in range(merged.shape[1]):
            merged[j, i] = first[j, i] + second[j, i] * (one - first[j, i])
