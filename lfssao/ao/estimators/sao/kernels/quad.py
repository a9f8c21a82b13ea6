"""The 2x2 average at the end of SAO's sampling pass (section 2.3)."""

from numba import prange

from lfssao.core.jit import kernel


@kernel(inline=True)
def blend(a, b, z_a, z_b, edge):
    """(a + b) / 2 for both where the depths differ by less than ``edge``; no surface, +infinity, never does."""
    mean = (a + b) * type(a)(0.5)
    near = abs(z_a - z_b) < edge
    return (mean if near else a), (mean if near else b)


@kernel(parallel=True)
def average_quads(visibility, z, edge, target):
    """Average A over quads of 2x2 texels, first each row's two, then each column's two.

    The paper prints neither the threshold nor the order; on a GPU it is two screen-space derivatives, one after the
    other, so that a depth edge in one direction leaves the other's average. A texel without a partner, at the end of an
    odd row or column, stays. visibility, z (+infinity where there is no surface) and target, out: (H, W); edge:
    difference of depth from which on two texels are not averaged.
    """
    height, width = z.shape
    for quad in prange((height + 1) // 2):
        j = 2 * quad
        last = min(j + 1, height - 1)
        for row in range(j, last + 1):
            for pair in range(width // 2):
                i = 2 * pair
                target[row, i], target[row, i + 1] = blend(
                    visibility[row, i], visibility[row, i + 1], z[row, i], z[row, i + 1], edge
                )
            if width & 1:
                target[row, width - 1] = visibility[row, width - 1]
        if last > j:
            for i in range(width):
                target[j, i], target[last, i] = blend(target[j, i], target[last, i], z[j, i], z[last, i], edge)
