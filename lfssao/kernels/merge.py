"""Several occlusions of a texel as one: the largest (LF section 6, after Hoang and Low), or what a product leaves."""

from numba import prange

from lfssao.kernels.jit import kernel

# How many textures merge_maximum takes: LF's radii.
AT_ONCE = 5


@kernel(inline=True)
def _larger(value, most):
    return value if value > most else most


@kernel(parallel=True)
def merge_maximum(first, second, third, fourth, fifth, window, merged):
    """Maximum of five textures in a window, (4,) int64: left, top, right, bottom; elsewhere merged is left alone.

    All are (H, W). A NaN behind the first is never the larger. Each texture is read where it is: to put them behind
    each other, or only their parts, takes twice as long as to compare them.
    """
    left, top, right = window[0], window[1], window[2]
    for j in prange(window[3] - top):
        a, b, c = first[top + j, left:right], second[top + j, left:right], third[top + j, left:right]
        d, e, most = fourth[top + j, left:right], fifth[top + j, left:right], merged[top + j, left:right]
        for i in range(most.shape[0]):
            most[i] = _larger(e[i], _larger(d[i], _larger(c[i], _larger(b[i], a[i]))))


@kernel(parallel=True)
def merge_product(first, second, merged):
    """1 - (1 - a)(1 - b), what a product of two open shares leaves hidden (VO section 6), as a + b (1 - a); (H, W)."""
    for j in prange(merged.shape[0]):
        one = merged.dtype.type(1)
        for i in range(merged.shape[1]):
            merged[j, i] = first[j, i] + second[j, i] * (one - first[j, i])
