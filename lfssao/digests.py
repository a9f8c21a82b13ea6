"""SHA-256 of arrays: of one by hashlib, of several together as vectors where that takes less time."""

import functools
import hashlib
from collections.abc import Sequence
from math import isqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

_BLOCK = 64  # bytes, SHA-256's
_STATE = 8  # words
_LANES = 16  # that are hashed at once


def _cube_root(number: int) -> int:
    """The whole part of a whole number's cube root, by Newton's steps from above."""
    root = 1 << -(-number.bit_length() // 3)
    while (closer := (2 * root + number // root**2) // 3) < root:
        root = closer
    return root


_PRIMES = [n for n in range(2, 312) if all(n % k for k in range(2, n))]
_FRACTION = 0xFFFFFFFF  # the first 32 bits behind the point, of numbers with 32 there
_CONSTANTS = np.array([_cube_root(n << 96) & _FRACTION for n in _PRIMES], np.uint32)  # section 4.2.2
_FIRST_STATE = np.array([isqrt(n << 64) & _FRACTION for n in _PRIMES[:_STATE]], np.uint32)  # section 5.3.3


def digest(array: NDArray[Any]) -> str:
    """SHA-256 over an array's numbers, little-endian, row by row; hexadecimal."""
    return hashlib.sha256(_bytes_of(array).data).hexdigest()


def digests(arrays: Sequence[NDArray[Any]]) -> list[str]:
    """``digest`` of each array; of large ones, many and of alike sizes, all at once.

    Parameters
    ----------
    arrays : sequence of arrays
        Of any dtypes and shapes.
    """
    texts = [_bytes_of(array) for array in arrays]
    lanes = _lanes([text.size for text in texts])
    # A lane that has no more to hash costs as much as one that has.
    longest = max((sum(texts[k].size for k in lane) for lane in lanes), default=0)
    if _wide_vectors() and 2 * sum(text.size for text in texts) >= _LANES * longest > 0:
        return hash_together(texts, lanes)
    return [hashlib.sha256(text.data).hexdigest() for text in texts]


def _bytes_of(array: NDArray[Any]) -> NDArray[np.uint8]:
    return np.ascontiguousarray(array, array.dtype.newbyteorder("<")).reshape(-1).view(np.uint8)


@functools.cache
def _wide_vectors() -> bool:
    """Whether the processor has vectors of 16 words, with rotations: others hash as fast by instructions for SHA."""
    from llvmlite import binding

    return bool(binding.get_host_cpu_features().get("avx512f"))


def _lanes(sizes: Sequence[int]) -> list[list[int]]:
    """Which texts each lane takes, one after the other: the longest first, each where there is least to do."""
    lanes: list[list[int]] = [[] for _ in range(_LANES)]
    loads = [0] * _LANES
    for text in sorted(range(len(sizes)), key=lambda k: -sizes[k]):
        lane = loads.index(min(loads))
        lanes[lane].append(text)
        loads[lane] += sizes[text]
    return lanes


def hash_together(texts: Sequence[NDArray[np.uint8]], lanes: Sequence[Sequence[int]]) -> list[str]:
    """SHA-256 of each text, hexadecimal, in lanes.

    Parameters
    ----------
    texts : sequence of (n,) uint8
        Contiguous.
    lanes : sequence of sequence of int
        For each of 16 lanes the numbers of the texts that it takes, in that order; each text once.
    """
    from lfssao.kernels.sha256 import hash_blocks  # late: one texture needs no numba

    tails = [_tail(text) for text in texts]
    queues = [[part for k in lane for part in _parts(k, texts[k], tails[k])] for lane in lanes]
    states, out = np.repeat(_FIRST_STATE, _LANES), [""] * len(texts)
    left, addresses = np.zeros(_LANES, np.int64), np.zeros(_LANES, np.int64)
    ends: list[int | None] = [None] * _LANES
    while True:
        for lane, queue in enumerate(queues):
            if left[lane] == 0 and queue:
                addresses[lane], left[lane], ends[lane] = queue.pop(0)
        busy = left > 0
        if not busy.any():
            return out
        count = int(left[busy].min())
        addresses[~busy] = addresses[busy][0]  # anything that can be read
        hash_blocks(addresses, states, _CONSTANTS, count)
        left[busy] -= count
        for lane, text in enumerate(ends):
            if busy[lane] and left[lane] == 0 and text is not None:
                out[text] = states[lane::_LANES].astype(">u4").tobytes().hex()
                states[lane::_LANES] = _FIRST_STATE


def _tail(text: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """What is behind a text's last whole block, a bit of 1, zeros and its size in bits (FIPS 180-4, section 5.1.1)."""
    rest = text[text.size // _BLOCK * _BLOCK :].tobytes() + b"\x80"
    zeros = bytes(-(len(rest) + 8) % _BLOCK)
    return np.frombuffer(rest + zeros + (8 * text.size).to_bytes(8, "big"), np.uint8)


def _parts(number: int, text: NDArray[np.uint8], tail: NDArray[np.uint8]) -> list[tuple[int, int, int | None]]:
    """A text's whole blocks, if there are any, and its tail: where they are, how many, and whose end they are."""
    parts: list[tuple[int, int, int | None]] = [(text.ctypes.data, text.size // _BLOCK, None)]
    return [*(part for part in parts if part[1]), (tail.ctypes.data, tail.size // _BLOCK, number)]
