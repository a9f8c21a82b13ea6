"""The least and the largest colour that a light makes, by balls and the kernel's formulas (``ao.kernels.post``)."""

import numpy as np

from lfssao.ao.kernels.post import faced_share, lit_by
from lfssao.core.balls import SAFETY, ball_between
from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import most, rounded, spread_of
from lfssao.core.vectors import Vector
from lfssao.verify.bounds.kernels.images import certain, certain_vector

# No term of the product multiplied out, c (A + f - A f) (1 - ao), has more roundings in any order: A is rounded, and
# three products and five sums follow. AO on the ambient term has fewer.
_ROUNDINGS = 9
_MADE = 8  # sums and products of a component of l that a renderer normalises itself, but for its quotient


@formula
def _between(low, high, k, like):
    return ball_between(np.float64(low[k]), np.float64(high[k]), like)


@kernel(rows="low")
def bound_lit(begin, stop, image, occlusion, normals, light, everything, by, low, high):
    """Write the least and the largest lit colour, low and high, (H, W, 3) float64.

    image, occlusion, normals: both ends, or one where they are equal, (2 or 1, H, W, ...) float32; light: l and
    ambient, (4,) float32. The colour is linear in image and in AO, and its error convex in each, so that both ends of
    each are enough.
    """
    like, ambient = certain(0.0, by), certain(light[3], by)
    towards = rounded(1.0, _MADE, like, 1) * certain_vector(light, by)
    for j in range(begin, stop):
        for i in range(low.shape[1]):
            a, b = normals[0, j, i], normals[-1, j, i]
            n = Vector(_between(a, b, 0, like), _between(a, b, 1, like), _between(a, b, 2, like))
            faced = faced_share(n, towards)
            for c in range(3):
                least, largest = np.inf, -np.inf
                for k in range(len(image)):
                    color = certain(image[k, j, i, c], by)
                    for m in range(len(occlusion)):
                        ao = certain(occlusion[m, j, i], by)
                        size = most(abs(color) * ((1 + abs(ao)) * (ambient + (1 + ambient) * faced)))
                        made = color * lit_by(faced, ao, ambient, everything)
                        made = made + spread_of(rounded(size, _ROUNDINGS, like))
                        error = made.error * SAFETY if color.value != 0.0 else 0.0
                        least, largest = min(least, made.value - error), max(largest, made.value + error)
                low[j, i, c], high[j, i, c] = least, largest
