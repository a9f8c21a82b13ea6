"""Point sampling with options that LF does not have: hemisphere, range check, line 7's other form.

Runs of texels that see a surface, one sample at a time. A sample of the half ball is added to the points first; then it
is looked up by the loops of Algorithms 1 and 2 where depth alone decides. The options that read the positions texture
take two loops: where the samples land (one for each kind of mapping), then what the textures hold there. The first
writes texel numbers, so that the second need not know the kind. Both are in a function of their own, which is not
inlined: beside them LLVM makes no vectors of the loops of Algorithms 1 and 2, and those take six times as long.
"""

import numpy as np
from numba import prange

from lfssao.ao.estimators.kernels.rows import affine_rows, load_row, project_rows
from lfssao.ao.kernels.spans import ROWS_A_BLOCK, next_span
from lfssao.ao.kernels.ssao import count_matrix, count_slits, finish_run, transform_offsets
from lfssao.core.intrinsics import CHUNK, scratch
from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX, affine_row, slits_of


@kernel(inline=True)
def forward_depth(projection, x, y, z):
    """Image z of a surface point, +infinity where the mapping is not defined: LF's alternative to line 7."""
    kind, m = projection
    c = affine_row(m, 2, x, y, z)
    if kind == MATRIX:
        q = affine_row(m, 3, x, y, z)
        return c / q if q > 0 else m.dtype.type(np.inf)
    return c


@kernel(inline=True)
def move_row(offsets, ends, s, hemisphere, n, up, rows, a, b, c, q):
    """Line 5 and the affine half of line 6 of sample s for n points, turned where it is below the surface."""
    x, y, z = offsets[s, 0], offsets[s, 1], offsets[s, 2]
    one, zero = type(x)(1), type(x)(0)
    for i in range(n):
        turn = -one if hemisphere & ((x * up[0, i] + y * up[1, i]) + z * up[2, i] < zero) else one
        a[i], b[i] = rows[0, i] + turn * ends[s, 0], rows[1, i] + turn * ends[s, 1]
        c[i], q[i] = rows[2, i] + turn * ends[s, 2], rows[3, i] + turn * ends[s, 3]


@kernel
def count_near(
    projection, depth, places, reach, forward, width, height, n, points, a, b, c, q, texel, z, inside, count
):
    """Lines 6 to 9 with the range check and line 7's other form; arguments of share_behind and project_rows.

    Returns how many of the samples are in the texture and the mapping's domain.
    """
    project_rows(projection, width, height, n, a, b, c, q, texel, z, inside)
    found = np.int32(0)
    for i in range(n):
        t = np.uint64(3) * np.uint64(texel[i])
        x, y, w = places[t], places[t + np.uint64(1)], places[t + np.uint64(2)]
        surface = depth[texel[i]]
        there = surface < np.inf
        surface = forward_depth(projection, x, y, w) if forward else surface
        dx, dy, dz = x - points[0, i], y - points[1, i], w - points[2, i]
        near = ((dx * dx + dy * dy) + dz * dz) <= reach
        count[i] += np.int32((surface < z[i]) & near & inside[i] & there)
        found = np.int32(found + np.int32(inside[i]))
    return found


@kernel(inline=True)
def remap_shares(shares, at, end):
    """Map shares by 2 max(0, share - 1/2), from texel number ``at`` to before ``end``."""
    for texel in range(np.uint64(at), np.uint64(end)):
        above = shares[texel] - shares.dtype.type(0.5)
        shares[texel] = shares.dtype.type(2) * max(shares.dtype.type(0), above)


@kernel(parallel=True)
def share_behind(depth, positions, normals, offsets, projection, hemisphere, reach, forward, remap, occlusion, outside):
    """Share of samples behind the visible surface, with options.

    Parameters
    ----------
    depth : (H, W) float32 or float64
        Image z, +infinity where there is no surface.
    positions, normals : (H, W, 3), same dtype
        World coordinates; unit normals, or (0, 0, 3) without ``hemisphere``.
    offsets : (n, 3), same dtype
        The samples relative to the point, world units.
    projection : Projection
        The mapping world -> image, same dtype.
    hemisphere : bool
        Whether an offset o with (o_x n_x + o_y n_y) + o_z n_z < 0 is replaced by -o.
    reach : scalar, same dtype
        Square of the distance, world units, from the point to the surface point at the sample's texel, up to which
        the latter occludes; infinity: any.
    forward : bool
        Whether that surface's depth is the mapped position and not the depth texture's.
    remap : bool
        Whether the share is mapped by 2 max(0, share - 1/2).
    occlusion : (H, W), same dtype
        Out.
    outside : (H,) int64
        Out: samples of each row outside the texture or the mapping's domain; they count as not occluded.
    """
    (height, width), (kind, m) = depth.shape, projection
    surface, shares = depth.reshape(height * width), occlusion.reshape(height * width)
    places, facing = positions.reshape(3 * height * width), normals.reshape(normals.size)
    ends, samples = transform_offsets(offsets, projection), offsets.shape[0]
    wide, high = m.dtype.type(width), m.dtype.type(height)
    still = np.zeros((1, 4), m.dtype)  # samples are in a, b, c, q already
    looks = not forward and reach == np.inf  # at depths alone
    blocks = (height + ROWS_A_BLOCK - 1) // ROWS_A_BLOCK
    for block in prange(blocks):
        points, up = np.empty((3, CHUNK), m.dtype), np.zeros((3, CHUNK), m.dtype)
        rows, a, b = np.empty((4, CHUNK), m.dtype), scratch(m.dtype), scratch(m.dtype)
        c, q, count = scratch(m.dtype), scratch(m.dtype), scratch(np.int32)
        z, texel, inside = np.empty(CHUNK, m.dtype), np.empty(CHUNK, np.uint32), np.empty(CHUNK, np.bool_)
        for j in range(block * ROWS_A_BLOCK, min(height, (block + 1) * ROWS_A_BLOCK)):
            at, end = j * width, (j + 1) * width
            outside[j] = 0
            while at < end:
                start, n = next_span(surface, at, end, CHUNK)
                load_row(places, start, n, points)
                if hemisphere:
                    load_row(facing, start, n, up)
                affine_rows(projection, n, points, rows)
                for i in range(n):
                    count[i] = 0
                found = 0
                for s in range(samples):
                    move_row(offsets, ends, s, hemisphere, n, up, rows, a, b, c, q)
                    if looks and kind == CROSSED_SLITS:
                        found += count_slits(slits_of(m), surface, width, height, n, a, b, c, 0, 1, still, count)
                    elif looks and kind == MATRIX:
                        found += count_matrix(surface, width, height, n, a, b, c, q, 0, 1, still, count)
                    else:
                        found += count_near(
                            projection, surface, places, reach, forward, wide, high, n, points, a, b, c, q, texel,
                            z, inside, count,
                        )  # fmt: skip
                outside[j] += finish_run(surface, at, start, n, samples, count, shares) - found
                if remap:
                    remap_shares(shares, at, start + n)
                at = start + n
