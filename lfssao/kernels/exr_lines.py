"""The order of bytes in which zip-compressed OpenEXR files hold their lines: what deflate is given."""

import numpy as np

from lfssao.kernels.jit import kernel


@kernel
def gather_lines(pixels, order, first, words):
    """Lines from ``first`` on, each channel after channel, as files hold them uncompressed.

    pixels: (H, W, C) uint32, the bits of floats; order: (C,) int64, the channel that comes first, second, ... in the
    file; words: (lines * C * W,) uint32, out.
    """
    width, channels = pixels.shape[1], pixels.shape[2]
    for line in range(words.size // (width * channels)):
        for place in range(channels):
            channel = order[place]
            start = (line * channels + place) * width
            for i in range(width):
                words[start + i] = pixels[first + line, i, channel]


@kernel
def split_and_difference(words, packed):
    """OpenEXR's two steps before deflate: bytes 0, 2, 4, ... before bytes 1, 3, 5, ..., then differences + 128.

    A word stands for its four bytes, the lowest first, a number of packed for its two. words: (n,) uint32, n > 0;
    packed: (2 n,) uint16, out.
    """
    n, eight = words.size, np.uint32(8)
    even, odd = packed[1:n], packed[n + 1 :]
    for k in range(n - 1):
        even[k] = _differences(words[k + 1], words[k])
    for k in range(n - 1):
        odd[k] = _differences(words[k + 1] >> eight, words[k] >> eight)
    packed[0] = _differences(words[0], np.uint32(128 << 16))
    packed[n] = _differences(words[0] >> eight, words[n - 1])


@kernel(inline=True)
def _differences(word, before):
    """Byte 0 of word less byte 2 of before, byte 2 of word less byte 0 of it, each + 128, as one number."""
    bias, byte, half = np.uint32(128), np.uint32(255), np.uint32(16)
    low, high = (word - (before >> half) + bias) & byte, ((word >> half) - word + bias) & byte
    return np.uint16(low | high << np.uint32(8))
