"""Background: one value over the parts of a texture in which nothing is seen."""

import numpy as np

from lfssao.kernels.intrinsics import LINE, bytes_into_line, stream
from lfssao.kernels.jit import kernel


@kernel(inline=True)
def fill(texture, first, end, value):
    """Write a value into elements ``first`` to before ``end`` of a flat array, past the caches where lines are whole.

    The textures of two views are more than caches hold, and background is read much later if at all: stores that fetch
    what they overwrite take twice as long.
    """
    lanes = np.uint64(LINE // texture.itemsize)
    while first < end and bytes_into_line(texture, first) != 0:
        texture[first] = value
        first += np.uint64(1)
    while first + lanes <= end:
        stream(texture, first, value)
        first += lanes
    while first < end:
        texture[first] = value
        first += np.uint64(1)
