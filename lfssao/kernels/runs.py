"""Which texels of a row see a surface: estimators compute those, and write 0 for the rest."""

import numpy as np

from lfssao.kernels.jit import kernel

# Rows that a thread takes at once, with one set of scratch arrays: enough that starting costs nothing, few enough that
# they divide evenly among threads.
ROWS_A_BLOCK = 8

# Texels looked at together: two of the widest vectors. Runs are of whole groups, except where they or the row end.
_GROUP = 32

# Texels that are skipped together.
_MANY = 256


@kernel(inline=True)
def sees_surface(depth, first, end):
    """Whether one of the texels from number ``first`` to before ``end`` sees a surface."""
    if depth[first] < np.inf:
        return True
    some = np.int32(0)
    for texel in range(first, end):
        some |= np.int32(depth[texel] < np.inf)
    return some != 0


@kernel
def run_length(depth, at, end):
    """How many texels from number ``at`` on are in groups of which one sees a surface."""
    start = at
    while at < end and sees_surface(depth, at, min(at + np.uint64(_GROUP), end)):
        at += np.uint64(_GROUP)
    return min(at, end) - start


@kernel(inline=True)
def next_run(depth, at, end, most):
    """The next texels worth computing of a row.

    Many groups at a time are skipped first: of a small scene most rows see nothing.

    Parameters
    ----------
    depth : (H * W,) array
        The depth texture, +infinity where there is no surface.
    at, end : int
        Texel numbers: where to look from; the row's end.
    most : int
        How many texels a run has at most.

    Returns
    -------
    start, n : int
        Texel number and length of the run; before it no texel sees a surface, within it not every texel need.
        (end, 0) where there is no more.
    """
    start, last = np.uint64(at), np.uint64(end)
    while start + np.uint64(_MANY) <= last:
        some = np.int32(0)
        for k in range(_MANY):
            some |= np.int32(depth[start + np.uint64(k)] < np.inf)
        if some != 0:
            break
        start += np.uint64(_MANY)
    while start < last and not sees_surface(depth, start, min(start + np.uint64(_GROUP), last)):
        start += np.uint64(_GROUP)
    while start < last and not depth[start] < np.inf:
        start += np.uint64(1)
    if start >= last:
        return end, 0
    return np.int64(start), np.int64(run_length(depth, start, min(start + np.uint64(most), last)))


@kernel
def next_groups(depth, at, end):
    """The next whole groups of a row of which each sees a surface, as next_run has them but for its exact beginning.

    For kernels in which LLVM gives up the vectors of their loops if what they call has more loops than this.
    """
    while at < end and not sees_surface(depth, np.uint64(at), np.uint64(min(at + _GROUP, end))):
        at += _GROUP
    start = np.uint64(min(at, end))
    return np.int64(start), np.int64(run_length(depth, start, np.uint64(end)))
