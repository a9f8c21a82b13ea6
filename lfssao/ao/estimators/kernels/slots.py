"""Slots: the numbers of a chunk of texels, in one array of k * CHUNK numbers, slot k of texel i at ``slot(k, i)``.

The slots' constant distances show LLVM that they do not overlap, so that it makes vectors of loops over texels.
"""

import numpy as np

from lfssao.core.jit import kernel

CHUNK = 256  # texels


@kernel(inline=True)
def slot(k, i):
    """Place of slot k of texel i of a chunk."""
    return np.uint64(k * CHUNK) + np.uint64(i)


@kernel(inline=True)
def load(triples, first, n, slots, k):
    """Copy n triples of an array (3 N,), from number ``first`` on, into slots k, k + 1 and k + 2."""
    for i in range(n):
        t = np.uint64(3) * (np.uint64(first) + np.uint64(i))
        slots[slot(k, i)] = triples[t]
        slots[slot(k + 1, i)] = triples[t + np.uint64(1)]
        slots[slot(k + 2, i)] = triples[t + np.uint64(2)]
