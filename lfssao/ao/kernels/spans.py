"""Spans: the texels of a row that see a surface. Estimators compute those, and write 0 for the rest."""

import numpy as np

from lfssao.core.jit import kernel

# Rows that a thread takes at once, with one set of scratch arrays: enough that starting costs nothing, few enough that
# they divide evenly among threads.
ROWS_A_BLOCK = 8

# Texels that are skipped together, two of the widest vectors: spans consist of whole groups.
GROUP = 32


@kernel(inline=True)
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
