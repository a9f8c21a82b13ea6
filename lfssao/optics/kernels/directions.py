"""Viewing directions: the direction of each texel's ray in world space."""

from math import sqrt

from numba import prange

from lfssao.core.jit import kernel
from lfssao.optics.kernels.rays import texel_ray


@kernel(parallel=True)
def write_directions(rays, m, directions):
    """Write unit directions of texels' rays in world space, (H, W, 3), m the map cast -> world, (12,); 0 for no ray."""
    for j in prange(directions.shape[0]):
        for i in range(directions.shape[1]):
            _, _, _, dx, dy, _, _, _ = texel_ray(rays, i + 0.5, j + 0.5)
            x = (m[0] * dx + m[1] * dy) + m[2]
            y = (m[4] * dx + m[5] * dy) + m[6]
            z = (m[8] * dx + m[9] * dy) + m[10]
            length = sqrt((x * x + y * y) + z * z)
            has_ray = length > 0.0  # False for NaN
            directions[j, i, 0] = x / length if has_ray else 0.0
            directions[j, i, 1] = y / length if has_ray else 0.0
            directions[j, i, 2] = z / length if has_ray else 0.0
