"""sRGB codes to linear light and back (IEC 61966-2-1), by tables with equal bits on every machine."""

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

_BITS = 100  # behind the point: what is cut off lies far below half a unit in the last place of any of the tables


def _decode(halves: int) -> float:
    """Linear value of so many halves of an sRGB code, 0 to 510, in whole numbers: (n / d)^2.4 is a root of n^12 / d^12.

    Division of whole numbers rounds once, to the nearest float64.
    """
    if 100_000 * halves <= 4045 * 510:  # 0.04045
        return 100 * halves / (1292 * 510)
    power = ((1000 * halves + 55 * 510) ** 12 << 5 * _BITS) // (1055 * 510) ** 12
    root = 1 << -(-power.bit_length() // 5)
    while (closer := (4 * root + power // root**4) // 5) < root:  # Newton's steps, from above
        root = closer
    return root / (1 << _BITS)


@functools.cache
def decode_table() -> NDArray[np.float32]:
    """Linear value of each 8-bit sRGB code, (256,) float32, 0 to 1."""
    return np.array([_decode(2 * code) for code in range(256)], np.float32)


@functools.cache
def _code_edges() -> NDArray[np.float64]:
    """Linear values halfway, in sRGB, between neighbouring codes, (255,) float64."""
    return np.array([_decode(2 * code + 1) for code in range(255)])


def to_linear(codes: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Linear light, float32 0 to 1, of 8-bit sRGB codes of any shape."""
    return decode_table()[codes]


# Numbers between the lower limit, which lies below the first edge, and 1 in bins by their leading bits: 2^8 bins to
# each power of 2, fine enough that no bin holds two edges.
_LOWEST = np.float32(2.0**-13)
_SHIFT = np.uint32(23 - 8)
_BLOCK = 1 << 16  # numbers at a time, whose intermediate arrays fit the cache


def _bins(linear: NDArray[np.float32]) -> NDArray[np.uint32]:
    """The bin of each number, 0 for ``_LOWEST``."""
    return (linear.view(np.uint32) >> _SHIFT) - (_LOWEST.view(np.uint32) >> _SHIFT)


@functools.cache
def _first_codes() -> NDArray[np.uint8]:
    """The code of each bin's first number; no edge lies so near to it that rounding to float32 would matter."""
    count = int(_bins(np.array([1], np.float32))[0]) + 1
    starts = (np.arange(count, dtype=np.uint32) << _SHIFT) + _LOWEST.view(np.uint32)
    return np.searchsorted(_code_edges(), starts.view(np.float32), side="right").astype(np.uint8)


def to_codes(linear: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    """Nearest 8-bit sRGB codes of linear light of any shape; values outside 0 to 1 are clamped."""
    flat = np.ravel(linear)
    codes, first, edges = np.empty(flat.size, np.uint8), _first_codes(), np.append(_code_edges(), np.inf)
    for start in range(0, flat.size, _BLOCK):
        part = np.maximum(np.fmin(flat[start : start + _BLOCK], 1), _LOWEST)
        low = first.take(_bins(part.astype(np.float32, copy=False)))  # which is faster than [...] by small integers
        np.add(low, part >= edges.take(low), out=codes[start : start + _BLOCK], casting="unsafe")
    return codes.reshape(np.shape(linear))
