"""Deflate (RFC 1950 and 1951) of textures' packed lines.

Integers alone decide, so the bytes are the same on every machine; those of libraries depend on the processor, or on
the version. Only what textures hold is looked for: repeats of two distances, and noise, which no code makes shorter.
The format's own code is taken for the rest: one made for each chunk saves a twentieth of the bytes, but takes a quarter
more time, and half as much again to be compiled.
"""

import numpy as np

from lfssao.kernels.adler32 import adler32
from lfssao.kernels.intrinsics import put_word
from lfssao.kernels.jit import kernel
from lfssao.kernels.repeats import LONGEST, find_repeats

_END = 256  # the symbol behind the literal bytes; then come those of lengths
_REACH = 32768  # how far back a match may begin
_MOST = 65535  # bytes of a stored block
_STORED, _FINAL, _FIXED = 0, 1, 2  # kinds of blocks, and that none follows, in their first three bits
_WORTH = 64  # literals that are stored for what it takes to end a block and to begin one
SLACK = 1024  # bytes beyond twice the packed ones that a stream may take

# Codes stand as bits * 256 + their number, the bit that is read first is the lowest. Of each symbol first the code as
# it is printed, and how many bits it has (RFC 1951, section 3.2.6).
_PRINTED = [(48 + k, 8) for k in range(144)] + [(400 + k, 9) for k in range(112)]
_PRINTED += [(k, 7) for k in range(24)] + [(192 + k, 8) for k in range(8)]
_CODES = np.array([int(f"{code:0{size}b}"[::-1], 2) << 8 | size for code, size in _PRINTED])
_DISTANCES = np.array([int(f"{code:05b}"[::-1], 2) << 8 | 5 for code in range(30)])

# Of each length its symbol's code, and behind it which of the symbol's lengths it is (section 3.2.5).
_OF_SYMBOLS = [0] * 8 + [bits for bits in range(1, 6) for _ in range(4)]
_TOLD = [(257 + k, extra, bits) for k, bits in enumerate(_OF_SYMBOLS) for extra in range(1 << bits)]
_TOLD[-1] = 285, 0, 0  # the longest has a symbol of its own
_LENGTHS = np.array([0, 0, 0, *[_CODES[s] + ((extra << 8 + (_CODES[s] & 255)) | bits) for s, extra, bits in _TOLD]])


@kernel
def deflate(packed, far, repeats, ahead, out):
    """A zlib stream; how many bytes it takes, int64.

    packed: (n,) uint8, n > 0; far: int > 1, the bytes of a line in either half; repeats: (n // 4 + 2, 2) int32,
    scratch; ahead: (k,) uint32, as of ``find_repeats``; out: (2 n + SLACK,) uint8, out.
    """
    number = find_repeats(packed, far if far <= _REACH else packed.size, repeats, ahead)
    line = _distance(min(far, _REACH))
    out[0], out[1] = 0x78, 0x01  # deflate, quickly
    place, bits, count = _put(out, 2, 0, 0, _FIXED << 8 | 3)
    k = 0
    for n in range(number):
        end = k + repeats[n, 0]
        if end - k >= _WORTH:
            place, bits, count = _put(out, place, bits, count, _CODES[_END])
            while k < end:
                size = min(end - k, _MOST)
                place, bits, count = _put(out, place, bits, count, _STORED << 8 | 3)
                place += 1 if count else 0
                put_word(out, place, size | (_MOST - size) << 16)
                place += 4
                for byte in range(size):
                    out[np.uint64(place) + np.uint64(byte)] = packed[np.uint64(k) + np.uint64(byte)]
                place, bits, count = place + size, 0, 0
                k += size
            place, bits, count = _put(out, place, bits, count, _FIXED << 8 | 3)
        while k < end:
            place, bits, count = _put(out, place, bits, count, _CODES[packed[np.uint64(k)]])
            k += 1
        length, distance = repeats[n, 1], _DISTANCES[1]
        if length < 0:
            length, distance = -length, line
        k += length
        while length > 0:
            place, bits, count = _put(out, place, bits, count, _LENGTHS[min(length, LONGEST)])
            place, bits, count = _put(out, place, bits, count, distance)
            length -= LONGEST
    place, bits, count = _put(out, place, bits, count, _CODES[_END])
    # An empty stored block ends the stream, wherever the last block with a code stopped.
    place, bits, count = _put(out, place, bits, count, (_STORED | _FINAL) << 8 | 3)
    place += 1 if count else 0
    put_word(out, place, _MOST << 16)
    place += 4
    checksum = adler32(packed)
    for byte in range(4):
        out[place + byte] = checksum >> (24 - 8 * byte) & 255
    return place + 4


@kernel(inline=True)
def _put(out, place, bits, count, code):
    """Append a code; ``count`` bits that fill no byte yet are in ``bits``."""
    bits |= code >> 8 << count
    count += code & 255
    put_word(out, place, bits)
    return place + (count >> 3), bits >> (count & 56), count & 7


@kernel(inline=True)
def _distance(far):
    """A distance's code, and behind it which of its symbol's distances it is."""
    extra = 0
    while far - 1 >> extra + 2:
        extra += 1
    code = _DISTANCES[2 * extra + (far - 1 >> extra)]
    return (code >> 8 | (far - 1 & (1 << extra) - 1) << 5) << 8 | 5 + extra
