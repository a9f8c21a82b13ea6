"""Random numbers as a function of a key and a counter: Philox4x32-10 (Salmon et al. 2011, Random123).

32-bit integer operations only, so a shader repeats it word for word, and any number of a stream can be had without
the ones before it.
"""

import numpy as np

from lfssao.core.jit import kernel

_MASK = np.uint64(0xFFFFFFFF)
_M0 = np.uint64(0xD2511F53)
_M1 = np.uint64(0xCD9E8D57)
_W0 = np.uint64(0x9E3779B9)
_W1 = np.uint64(0xBB67AE85)
_32 = np.uint64(32)


@kernel
def philox4x32(c0, c1, c2, c3, k0, k1):
    """Four 32-bit words (as uint64) of counter (c0, c1, c2, c3) under key (k0, k1): ten Philox rounds."""
    c0 = np.uint64(c0) & _MASK
    c1 = np.uint64(c1) & _MASK
    c2 = np.uint64(c2) & _MASK
    c3 = np.uint64(c3) & _MASK
    k0 = np.uint64(k0) & _MASK
    k1 = np.uint64(k1) & _MASK
    for _ in range(10):
        p0 = _M0 * c0
        p1 = _M1 * c2
        c0, c1, c2, c3 = (p1 >> _32) ^ c1 ^ k0, p1 & _MASK, (p0 >> _32) ^ c3 ^ k1, p0 & _MASK
        k0 = (k0 + _W0) & _MASK
        k1 = (k1 + _W1) & _MASK
    return c0, c1, c2, c3


@kernel
def random_word(seed, stream, index):
    """One 32-bit word (as uint64): word 0 of counter (index, stream, 0, 0) under the two halves of the seed."""
    seed = np.uint64(seed)
    word, _, _, _ = philox4x32(np.uint64(index), np.uint64(stream), 0, 0, seed & _MASK, seed >> _32)
    return word


@kernel
def random_signed(seed, stream, index):
    """A number uniform on (-1, 1), float64: (word + 1/2) / 2**31 - 1, exact, never 0, never an end."""
    return (np.float64(random_word(seed, stream, index)) + 0.5) / 2147483648.0 - 1.0


@kernel
def random_unit(seed, stream, index):
    """A number uniform on (0, 1), float64: (word + 1/2) / 2**32, exact, never an end."""
    return (np.float64(random_word(seed, stream, index)) + 0.5) / 4294967296.0


@kernel
def random_below(seed, stream, index, n):
    """An integer uniform on 0 .. n - 1 (int64): the high word of word * n, off by at most n / 2**32."""
    return np.int64((random_word(seed, stream, index) * np.uint64(n)) >> _32)
