"""A chunk of lines as zip-compressed OpenEXR files hold it before deflate, byte by byte; nothing here is lfssao's."""

import struct


def lines_as_stored(pixels, order, first, count):
    """The bytes of lines first ... first + count - 1, each channel after channel in the order; pixels[line][i][c]."""
    out = bytearray()
    for line in pixels[first : first + count]:
        for channel in order:
            for texel in line:
                out += struct.pack("<I", texel[channel])
    return bytes(out)


def before_deflate(stored):
    """Every second byte first, then the others; each less the one before it, plus 128."""
    turned = stored[0::2] + stored[1::2]
    return bytes([turned[0]]) + bytes((turned[k] - turned[k - 1] + 128) % 256 for k in range(1, len(turned)))
