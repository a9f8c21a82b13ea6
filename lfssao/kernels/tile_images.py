"""Where all of a tile's points appear, of modules of any display: around where the tile's middle does.

``lfssao.tile_slopes`` bounds how far the computed image of one point of a tile and a sample lies from that of another:
by L . D + e texels, D being how far the two are apart along x, y and a ray. Here C is in the middle of the tile's
points, with the sample's offset added. As rounding keeps order, and the image of P is itself a number of the
arithmetic, the rounded sum of C's image and what the others are off by at most is a bound of all of them.
"""

import numpy as np

from lfssao.kernels.display import physical_to_image
from lfssao.kernels.intrinsics import scratch
from lfssao.kernels.jit import kernel

BLOCK = 2  # tiles on a side of what slopes are bounded for at once
SLOPES = 10  # numbers of each: L along x, y and the ray, and e, of u; the same of v; x and y of the ray, z being 1


@kernel
def bounds_of(n, a, b, c):
    """Least and largest of each of n points' numbers, NaN left out."""
    far = type(a[0])(np.inf)
    a0, a1, b0, b1, c0, c1 = far, -far, far, -far, far, -far
    for i in range(n):
        x, y, z = a[i], b[i], c[i]
        a0, a1 = x if x < a0 else a0, x if x > a1 else a1
        b0, b1 = y if y < b0 else b0, y if y > b1 else b1
        c0, c1 = z if z < c0 else c0, z if z > c1 else c1
    return a0, a1, b0, b1, c0, c1


@kernel(inline=True)
def _farther(x, low, high):
    """How far the farther end of a range is from x."""
    return x - low if x - low > high - x else high - x


@kernel(inline=True)
def _middle(low, high, back, least, most):
    """The middle of a range, so far back, held between two others: it may not be if a point has NaN and numbers."""
    x = (type(low)(0.5) * low + type(low)(0.5) * high) - back
    x = x if x > least else least
    return x if x < most else most


@kernel(inline=True)
def _off(slopes, k, x, y, z):
    """L . (x, y, z) + e of the four numbers from number k on."""
    along = (slopes[k] * x + slopes[k + np.uint64(1)] * y) + slopes[k + np.uint64(2)] * z
    return along + slopes[k + np.uint64(3)]


@kernel
def middle_of(n, a, b, c, box, slopes, block):
    """A point in the middle of a tile's, and how far in texels u and v of the others lie from that one's.

    Parameters
    ----------
    n : int
        How many points; n <= CHUNK.
    a, b, c : (>= n,) arrays
        Their coordinates, metres; NaN is left out.
    box : tuple of six numbers
        ``bounds_of`` them.
    slopes : (SLOPES * blocks,) array
        Of blocks of tiles; NaN where nothing is known.
    block : int
        Number of the tile's.
    """
    first = np.uint64(SLOPES * block)
    way_x, way_y = slopes[first + np.uint64(8)], slopes[first + np.uint64(9)]
    x, y = scratch(slopes.dtype), scratch(slopes.dtype)
    for i in range(n):
        x[i], y[i] = a[i] - way_x * c[i], b[i] - way_y * c[i]
    x0, x1, y0, y1, z0, z1 = bounds_of(n, x, y, c)
    z = _middle(z0, z1, type(z0)(0), z0, z1)
    p, q = _middle(x0, x1, -way_x * z, box[0], box[1]), _middle(y0, y1, -way_y * z, box[2], box[3])
    off_x, off_y, off_z = _farther(p - way_x * z, x0, x1), _farther(q - way_y * z, y0, y1), _farther(z, z0, z1)
    of_v = first + np.uint64(4)
    return p, q, z, _off(slopes, first, off_x, off_y, off_z), _off(slopes, of_v, off_x, off_y, off_z)


@kernel(inline=True)
def image_of_display(d, box, middle, a, b, c):
    """Bounds of u, v and z of the sample (a, b, c) over a box; u, v are NaN where nothing is known.

    Parameters
    ----------
    d : (32,) array
        The module's numbers.
    box, middle : tuples of six and of five numbers
        The tile's points, and ``middle_of`` them.
    a, b, c : scalars
        The sample behind the mapping's linear part.
    """
    x, y, z, of_u, of_v = middle
    u, v, _ = physical_to_image(d, x + a, y + b, z + c)  # VALID where slopes are known, of which of_u and of_v are
    return u - of_u, u + of_u, v - of_v, v + of_v, box[4] + c, box[5] + c
