"""The order of bytes in which zip-compressed OpenEXR files hold their lines: what deflate is given."""

import numpy as np

from lfssao.kernels.jit import kernel


@kernel
def gather_lines(texels, width, places, words):
    """Lines with each channel after channel, as files hold them uncompressed.

    texels: (lines * W * C,) uint32, the bits of floats, channel beside channel; width: int, W; places: (C,) int64,
    which of the file's channels each is; words: as texels, out.
    """
    channels = places.size
    for start in range(0, words.size, channels * width):
        if channels == 3:
            _gather_three(texels[start:], width, places, words[start:])
            continue
        for channel in range(channels):
            line = start + places[channel] * width
            for i in range(width):
                words[line + i] = texels[start + channels * i + channel]


@kernel
def _gather_three(texels, width, places, words):
    """One line of three channels by itself: a known step makes vectors of the loop, a fifth of the time.

    The same loop within that over lines takes twice as long as this.
    """
    a, b, c = np.uint64(places[0] * width), np.uint64(places[1] * width), np.uint64(places[2] * width)
    for i in range(np.uint64(width)):
        k = np.uint64(3) * i
        words[a + i] = texels[k]
        words[b + i] = texels[k + np.uint64(1)]
        words[c + i] = texels[k + np.uint64(2)]


@kernel
def split_and_difference(stored, packed):
    """OpenEXR's two steps before deflate: bytes 0, 2, 4, ... before bytes 1, 3, 5, ..., then differences + 128.

    stored: (n,) uint16, two bytes each, the lower one first, n > 0; packed: (2 n,) uint8, out. Both halves in one loop
    over pairs of bytes: loops over every other byte take twice as long.
    """
    odd, bias = packed[stored.size :], np.uint16(128)
    for k in range(1, stored.size):
        now, before = stored[k], stored[k - 1]
        packed[k] = np.uint8(np.uint16(np.uint16(now - before) + bias))
        odd[k] = np.uint8(np.uint16(np.uint16((now >> np.uint16(8)) - (before >> np.uint16(8))) + bias))
    last = stored[stored.size - 1]
    packed[0] = np.uint8(stored[0])
    odd[0] = np.uint8(np.uint16(np.uint16((stored[0] >> np.uint16(8)) - last) + bias))
