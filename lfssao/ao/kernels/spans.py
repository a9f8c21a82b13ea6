"""Spans: the texels of a row that see a surface. Estimators compute those, and write 0 for the rest.

Slots: the numbers of a chunk of texels, in one array of k * CHUNK numbers, slot k of texel i at ``slot(k, i)``.
The slots' constant distances show LLVM that they do not overlap, so that it makes vectors of loops over texels.
"""

import numpy as np

from lfssao.core.jit import formula, kernel

# Texels that are skipped together, two of the widest vectors: spans consist of whole groups.
GROUP = 32

CHUNK = 256  # texels of a chunk


@formula
def sees_surface(depth, first, end):
    """Whether one of the texels from number ``first`` to before ``end`` sees a surface."""
    some = np.int32(0)
    for texel in range(first, end):
        some |= np.int32(depth[np.uint64(texel)] < np.inf)
    return some != 0


@kernel
def next_span(depth, at, end, most):
    """Find the next span of texels from number ``at`` to before ``end``: its first texel and its length.

    depth: (H * W,), +infinity where there is no surface. Each group of a span sees a surface, and none before it does.
    A span has at most ``most`` texels, a multiple of GROUP; it is (end, 0) where no more surface is seen.
    """
    while at < end and not sees_surface(depth, at, min(at + GROUP, end)):
        at += GROUP
    start, last = min(at, end), min(at + most, end)
    while at < last and sees_surface(depth, at, min(at + GROUP, last)):
        at += GROUP
    return start, min(at, last) - start


@formula
def slot(k, i):
    """Place of slot k of texel i of a chunk."""
    return np.uint64(k * CHUNK) + np.uint64(i)


@formula
def load(triples, first, n, slots, k):
    """Copy n triples of an array (3 N,), from number ``first`` on, into slots k, k + 1 and k + 2."""
    for i in range(n):
        t = np.uint64(3) * (np.uint64(first) + np.uint64(i))
        slots[slot(k, i)] = triples[t]
        slots[slot(k + 1, i)] = triples[t + np.uint64(1)]
        slots[slot(k + 2, i)] = triples[t + np.uint64(2)]
