"""Which texels of a row see a surface: estimators compute those, and write 0 for the rest."""

import numpy as np

from lfssao.kernels.jit import kernel

# Texels looked at together: two of the widest vectors. Runs are of whole groups, except where the row ends.
_GROUP = 32

# Texels that are computed or left out together where triangles say which see a surface: as few as hide what starting a
# loop takes.
PIECE = 64


@kernel(inline=True)
def sees_surface(depth, first, end):
    """Whether one of the texels from number ``first`` to before ``end`` sees a surface."""
    if depth[first] < np.inf:
        return True
    some = np.int32(0)
    for texel in range(first, end):
        some |= np.int32(depth[texel] < np.inf)
    return some != 0


@kernel(inline=True)
def sees_triangle(triangle, first, end):
    """Whether one of the texels from number ``first`` to before ``end`` names a triangle, which -1 does not."""
    common = np.int32(-1)
    for texel in range(first, end):
        common &= triangle[texel]
    return common != -1


@kernel
def next_run(depth, at, end):
    """The next texels worth computing of a row.

    Parameters
    ----------
    depth : (H * W,) array
        The depth texture, +infinity where there is no surface.
    at, end : int
        Texel numbers: where to look from; the row's end.

    Returns
    -------
    start, n : int
        Texel number and length of the run; between runs no texel sees a surface, within one not every texel need.
        (end, 0) where there is no more.
    """
    while at < end and not sees_surface(depth, np.uint64(at), np.uint64(min(at + _GROUP, end))):
        at += _GROUP
    start = min(at, end)
    while at < end and sees_surface(depth, np.uint64(at), np.uint64(min(at + _GROUP, end))):
        at += _GROUP
    return start, min(at, end) - start


@kernel
def run_of(depth, at, end, every):
    """next_run, or all the texels that are left of the row where ``every`` is asked for."""
    if every:
        return at, end - at
    return next_run(depth, at, end)
