"""The chunks of one part of a zip-compressed OpenEXR file (openexr.com, "OpenEXR File Layout")."""

import numpy as np

from lfssao.kernels.deflate import deflate
from lfssao.kernels.exr_lines import gather_lines, split_and_difference
from lfssao.kernels.intrinsics import put_word
from lfssao.kernels.jit import kernel

LINES = 16  # of a chunk of compression 'zip'; the last has what is left
HEAD = 12  # bytes before a chunk's data: the part's number, the first line's, and how many bytes there are


@kernel
def write_chunks(
    texels, texel_halves, width, places, part, top, gathered, gathered_halves, packed, repeats, sizes, out
):
    """A part's chunks behind each other; how many bytes they take, int64.

    One call makes all: between several, threads that write files would wait for each other, as Python runs one alone.

    Parameters
    ----------
    texels, texel_halves : (H * W * C,) uint32, (2 H * W * C,) uint16
        The bits of floats, channel beside channel, and the halves of the same memory, the lower one first.
    width, places : int, (C,) int64
        W, and which of the file's channels each is.
    part, top : int
        The part's number and its first line's.
    gathered, gathered_halves, packed, repeats : (n,) uint32, (2 n,) uint16, (4 n,) uint8, (n + 2, 2) int32
        Scratch, n at least LINES * W * C; the second is the memory of the first.
    sizes : (chunks,) int64
        Out: bytes of each, head included.
    out : (m,) uint8
        Out, m at least 4 H * W * C + HEAD * chunks, and beyond it 4 n and deflate's SLACK.
    """
    line, end = width * places.size, 0
    for number in range(sizes.size):
        first = number * LINES * line
        count = min(LINES * line, texels.size - first)
        stored = texel_halves[2 * first : 2 * (first + count)]
        if places.size > 1:  # else they are in memory as they are in the file
            gather_lines(texels[first : first + count], width, places, gathered[:count])
            stored = gathered_halves[: 2 * count]
        split_and_difference(stored, packed[: 4 * count])
        start, ahead = end + HEAD, texels[first + count : first + 2 * count]
        size = deflate(packed[: 4 * count], 2 * width, repeats, ahead, out[start:])
        if size >= 4 * count:  # then readers take the lines as they are
            size = 4 * count
            for k in range(stored.size):
                out[start + 2 * k], out[start + 2 * k + 1] = np.uint8(stored[k]), np.uint8(stored[k] >> np.uint16(8))
        put_word(out, end, part | (top + number * LINES) << 32)
        for k in range(4):
            out[end + 8 + k] = size >> 8 * k & 255
        sizes[number] = HEAD + size
        end = start + size
    return end
