"""The direction in which each texel looks, in world space."""

from math import sqrt

from numba import prange

from lfssao.kernels.jit import kernel
from lfssao.kernels.rays import texel_ray


@kernel(parallel=True)
def write_directions(kind, lens, m, directions):
    """Unit directions of all texel rays, away from the viewer.

    Parameters
    ----------
    kind, lens : int, float64 array
        The kind of ray and its numbers, cast space.
    m : (12,) float64
        Rows of four of the affine map cast space -> world; its linear part is used.
    directions : (H, W, 3) float32 or float64
        Out: computed in float64, rounded once. A texel without a ray (NaN) has (0, 0, 0).
    """
    height, width = directions.shape[0], directions.shape[1]
    for j in prange(height):
        for i in range(width):
            _, _, _, dx, dy, dz, _, _ = texel_ray(kind, lens, i + 0.5, j + 0.5)
            x = (m[0] * dx + m[1] * dy) + m[2] * dz
            y = (m[4] * dx + m[5] * dy) + m[6] * dz
            z = (m[8] * dx + m[9] * dy) + m[10] * dz
            length = sqrt((x * x + y * y) + z * z)
            there = length > 0.0  # false for NaN
            directions[j, i, 0] = x / length if there else 0.0
            directions[j, i, 1] = y / length if there else 0.0
            directions[j, i, 2] = z / length if there else 0.0
