"""Adler-32 (RFC 1950): the sum of all bytes, and the sum of all such sums on the way, modulo a prime."""

import numpy as np

from lfssao.kernels.intrinsics import scratch
from lfssao.kernels.jit import kernel

_PRIME = 65521
_COLUMNS, _ROWS = 64, 16  # so few rows that their sums of sums fit 16 bits
_REDUCED = 1 << 22  # bytes after which sums are reduced: those of sums stay below 2^54


@kernel
def adler32(data):
    """The checksum, int64; data: (n,) uint8.

    Bytes of a block stand in rows, whose columns are summed side by side: sums one after the other are no vectors.
    """
    low, high, place = 1, 0, 0
    sums, sums_of_sums = scratch(np.uint16), scratch(np.uint16)
    while place + _ROWS * _COLUMNS <= data.size:
        for i in range(_COLUMNS):
            sums[i] = sums_of_sums[i] = np.uint16(0)
        for _ in range(_ROWS):
            for i in range(_COLUMNS):
                sums[i] = np.uint16(sums[i] + np.uint16(data[np.uint64(place + i)]))
                sums_of_sums[i] = np.uint16(sums_of_sums[i] + sums[i])
            place += _COLUMNS
        # A byte counts once for itself and each byte behind it: whole rows, less the columns before its own.
        total, rows, columns = np.uint32(0), np.uint32(0), np.uint32(0)
        for i in range(_COLUMNS):
            total = np.uint32(total + np.uint32(sums[i]))
            rows = np.uint32(rows + np.uint32(sums_of_sums[i]))
            columns = np.uint32(columns + np.uint32(np.uint32(i) * np.uint32(sums[i])))
        high += _COLUMNS * (_ROWS * low + np.int64(rows)) - np.int64(columns)
        low += np.int64(total)
        if place % _REDUCED == 0:  # seldom, as a division takes as long as a row
            low %= _PRIME
            high %= _PRIME
    low %= _PRIME
    high %= _PRIME
    while place < data.size:
        low += np.int64(data[place])
        high += low
        place += 1
    return high % _PRIME << 16 | low % _PRIME
