"""Sobol's sequence with its indices shuffled and its digits scrambled by a hash (Burley 2020).

All of it is arithmetic of 32-bit words, which a shader does alike, so that one point costs it a few operations and no
table. Burley's seeds must be hashes: here each column's key is the finalizer of MurmurHash3 of the seed and the column.
"""

import numpy as np

from lfssao.core.jit import formula, kernel
from lfssao.samples.kernels.square import sobol_word, stretch

_WORD, _GOLDEN = np.uint64(0xFFFFFFFF), np.uint64(0x9E3779B9)
_SHUFFLE = 3  # the key of the indices; those of the columns are 0, 1 and 2


@formula
def times(x, factor):
    """The low 32 bits of a product."""
    return (x * np.uint64(factor)) & _WORD


@kernel
def finalized(x):
    """A word whose bits all depend on all of another's: MurmurHash3's finalizer, one to one."""
    x ^= x >> np.uint64(16)
    x = times(x, 0x85EBCA6B)
    x ^= x >> np.uint64(13)
    x = times(x, 0xC2B2AE35)
    return x ^ (x >> np.uint64(16))


@kernel
def key_of(seed, column):
    """The 32-bit key of a column, of a seed of 64 bits; that of a seed below 2**32 needs no 64-bit numbers."""
    high, low = seed >> np.uint64(32), seed & _WORD
    folded = low ^ finalized(high)
    return finalized((folded + _GOLDEN * np.uint64(column + 1)) & _WORD)


@kernel
def backwards(x):
    """A word's 32 bits in reverse order."""
    x = ((x >> np.uint64(1)) & np.uint64(0x55555555)) | ((x & np.uint64(0x55555555)) << np.uint64(1))
    x = ((x >> np.uint64(2)) & np.uint64(0x33333333)) | ((x & np.uint64(0x33333333)) << np.uint64(2))
    x = ((x >> np.uint64(4)) & np.uint64(0x0F0F0F0F)) | ((x & np.uint64(0x0F0F0F0F)) << np.uint64(4))
    x = ((x >> np.uint64(8)) & np.uint64(0x00FF00FF)) | ((x & np.uint64(0x00FF00FF)) << np.uint64(8))
    return (x >> np.uint64(16)) | ((x << np.uint64(16)) & _WORD)


@kernel
def scrambled(x, key):
    """A word whose bits are flipped, each by a hash of the key and of the bits above it (Burley, section 3).

    The hash is Laine and Karras's, in which a bit depends on those below it, with Burley's constants.
    """
    x = (backwards(x) + key) & _WORD
    x ^= times(x, 0x6C50B47C)
    x ^= times(x, 0xB82F1E52)
    x ^= times(x, 0xC7AFE638)
    x ^= times(x, 0x8D22F6E6)
    return backwards(x)


@kernel
def burley_points(seed, out):
    """Dimensions 0 and 1 on [-1, 1]^2 and, in a third column, dimension 2 on (0, 1); coordinates are cell middles."""
    shuffle = key_of(seed, _SHUFFLE)
    for a in range(out.shape[1]):
        key = key_of(seed, a)
        for k in range(out.shape[0]):
            index = np.int64(scrambled(np.uint64(k), shuffle))
            word = scrambled(np.uint64(sobol_word(index, a)), key)
            out[k, a] = (np.float64(word) + 0.5) * 2.0**-32
    stretch(out)
