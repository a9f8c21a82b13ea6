"""Background: one value over the parts of a texture in which nothing is seen."""

import numpy as np
from numba import prange

from lfssao.kernels.intrinsics import LINE, bytes_into_line, stream, streamed
from lfssao.kernels.jit import kernel

_ROWS = 16  # that a thread fills one after the other


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


@kernel(parallel=True)
def fill_around(texture, row, left, right, top, bottom, value):
    """A value into all of a texture but a window.

    Parameters
    ----------
    texture : (n,) uint32
        Out: rows of so many numbers one after the other; those of the window are left as they are.
    row : int
        Numbers in a row.
    left, right, top, bottom : int
        The window: first number of a row and the one behind the last, first row and the one behind the last.
    value : uint32
        The value's bits.
    """
    height = texture.shape[0] // row
    for block in prange((height + _ROWS - 1) // _ROWS):
        for j in range(block * _ROWS, min(height, (block + 1) * _ROWS)):
            start = j * row
            if top <= j < bottom:
                fill(texture, np.uint64(start), np.uint64(start + left), value)
                fill(texture, np.uint64(start + right), np.uint64(start + row), value)
            else:
                fill(texture, np.uint64(start), np.uint64(start + row), value)
        streamed()
