"""Bytes that repeat those two places, or a line, before: all that textures' packed lines have to repeat.

A texel is two bytes in either half of the packed lines, so that runs of equal texels repeat what lies two bytes before.
A line repeats the one before where channels are equal, and in part where few values occur.
"""

import numpy as np

from lfssao.kernels.intrinsics import COMPARED, equal_bytes, prefetch, trailing_zeros
from lfssao.kernels.jit import kernel

NEAR = 2
LEAST = 4  # bytes; shorter ones cost as much as they save
LONGEST = 258  # bytes of deflate's matches; a longer repeat is several
_LINE = 16  # numbers of a cache line
_FETCHED = 4  # lines at a time: more wait for each other


@kernel
def find_repeats(packed, far, repeats, ahead):
    """Repeats, the longer one at the first place where there is any, and behind its end again; their number, int64.

    packed: (n,) uint8; far: int, how many places before the other of both begins; repeats: (m, 2) int32, out, m at
    least n / LEAST + 2: how many bytes repeat nothing, then how many repeat, negative where those of a line before. The
    last says 0. No length is less than LEAST beyond a multiple of LONGEST. ahead: (k,) uint32, what will be read next:
    it is brought near, as memory has nothing to do here.
    """
    number, start, place, fetched = 0, 0, NEAR, 0
    while place + COMPARED <= packed.size:
        if fetched < ahead.size:
            for line in range(_FETCHED):
                prefetch(ahead, fetched + _LINE * line)
            fetched += _FETCHED * _LINE
        near, line = equal_bytes(packed, place, place - NEAR), np.uint64(0)
        if place >= far:
            line = equal_bytes(packed, place, place - far)
        worth = _four(near) | _four(line)
        if not worth:
            place += COMPARED - LEAST + 1
            continue
        first = trailing_zeros(worth)
        near_length, far_length = _ones(near, first), _ones(line, first)
        if first + max(near_length, far_length) == COMPARED:
            distance = NEAR if first + near_length == COMPARED else far
            more = _beyond(packed, place + COMPARED, distance)
            near_length += more if distance == NEAR else 0
            far_length += 0 if distance == NEAR else more
        length = max(near_length, far_length)
        if length > LONGEST and length % LONGEST < LEAST:
            length -= length % LONGEST
        place += first
        repeats[number, 0] = place - start
        repeats[number, 1] = length if near_length >= far_length else -length
        number += 1
        place += length
        start = place
    repeats[number, 0] = packed.size - start
    repeats[number, 1] = 0
    return number + 1


@kernel(inline=True)
def _four(equal):
    """Where the bit and the three above it are 1: LEAST in a row."""
    two = equal & equal >> np.uint64(1)
    return two & two >> np.uint64(2)


@kernel(inline=True)
def _ones(equal, at):
    """How many bits from one on are 1."""
    return trailing_zeros(~(equal >> np.uint64(at)))


@kernel(inline=True)
def _beyond(packed, place, distance):
    """How many bytes from a place on are those before."""
    start = place
    while place + COMPARED <= packed.size:
        equal = equal_bytes(packed, place, place - distance)
        if ~equal:
            return place + _ones(equal, 0) - start
        place += COMPARED  # a constant, so that the processor compares on before it knows
    while place < packed.size and packed[place] == packed[place - distance]:
        place += 1
    return place - start
