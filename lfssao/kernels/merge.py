"""Several occlusions of a texel as one: the largest (LF section 6, after Hoang and Low), or what a product leaves."""

from numba import prange

from lfssao.kernels.jit import kernel, wide_vectors

# How many textures merge_maximum takes: LF's radii.
AT_ONCE = 5


@kernel(inline=True)
def _larger(value, most):
    return value if value > most else most


@kernel(parallel=True)
def merge_maximum(first, second, third, fourth, fifth, top, left, merged):
    """Maximum of five textures, (H, W) all, from row ``top`` and column ``left`` on; merged: what is wanted of it, out.

    A NaN behind the first is never the larger. Each texture is read where it is: to put them behind each other, or
    only their parts, takes twice as long as to compare them.
    """
    for j in prange(merged.shape[0]):
        wide_vectors()
        width = merged.shape[1]
        a, b, c = first[top + j, left:], second[top + j, left:], third[top + j, left:]
        d, e, most = fourth[top + j, left:], fifth[top + j, left:], merged[j]
        for i in range(width):
            most[i] = _larger(e[i], _larger(d[i], _larger(c[i], _larger(b[i], a[i]))))


@kernel(parallel=True)
def merge_product(first, second, merged):
    """1 - (1 - a)(1 - b), what a product of two open shares leaves hidden (VO section 6), as a + b (1 - a); (H, W)."""
    for j in prange(merged.shape[0]):
        wide_vectors()
        one = merged.dtype.type(1)
        for i in range(merged.shape[1]):
            merged[j, i] = first[j, i] + second[j, i] * (one - first[j, i])
