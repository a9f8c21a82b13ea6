"""Point sampling with options that LF does not have: hemisphere, range check, line 7's other form.

One row of texels at a time, in two loops a sample: where the row's samples land (an arithmetic loop, a kind of mapping
each), then what the textures hold there. The first writes texel numbers, so the options of the second need no loop for
each kind of mapping.
"""

import numpy as np
from numba import prange

from lfssao.kernels.jit import kernel
from lfssao.kernels.mapping import MATRIX, affine_row
from lfssao.kernels.rows import affine_rows, load_row, project_rows
from lfssao.kernels.runs import surface_span
from lfssao.kernels.schedule import spread
from lfssao.kernels.ssao import transform_offsets


@kernel(inline=True)
def forward_depth(kind, m, x, y, z):
    """Image z of a surface point, +infinity where the mapping is not defined: LF's alternative to line 7."""
    c = affine_row(m, 2, x, y, z)
    if kind == MATRIX:
        q = affine_row(m, 3, x, y, z)
        return c / q if q > 0 else m.dtype.type(np.inf)
    return c


@kernel(inline=True)
def count_near(kind, m, depth, places, reach, forward, n, points, texel, z, inside, count):
    """Lines 7 to 9 with the range check and line 7's other form; arguments of count_behind and share_behind."""
    for i in range(n):
        t = texel[i]
        x, y, w = places[t, 0], places[t, 1], places[t, 2]
        surface = depth[t]
        there = surface < np.inf
        surface = forward_depth(kind, m, x, y, w) if forward else surface
        dx, dy, dz = x - points[0, i], y - points[1, i], w - points[2, i]
        near = ((dx * dx + dy * dy) + dz * dz) <= reach
        count[i] += np.int32((surface < z[i]) & near & inside[i] & there)


@kernel
def finish_shares(depth, row, width, start, n, total, remap, count, missed, shares):
    """Write a row's shares, count / total, remapped or not; return how many samples of its points were outside."""
    zero, half, two = depth.dtype.type(0), depth.dtype.type(0.5), depth.dtype.type(2)
    for texel in range(row, row + width):
        shares[texel] = zero
    outside = 0
    for i in range(n):
        texel = start + np.uint64(i)
        if depth[texel] < np.inf:
            share = depth.dtype.type(count[i]) / total
            shares[texel] = two * max(zero, share - half) if remap else share
            outside += missed[i]
    return outside


@kernel(parallel=True)
def share_behind(depth, positions, normals, offsets, kind, m, hemisphere, reach, forward, remap, occlusion, outside):
    """Share of samples behind the visible surface, with options.

    Parameters
    ----------
    depth : (H, W) float32 or float64
        Image z, +infinity where there is no surface.
    positions, normals : (H, W, 3), same dtype
        World coordinates; unit normals, or (0, 0, 3) without ``hemisphere``.
    offsets : (n, 3), same dtype
        The samples relative to the point, world units.
    kind, m : int, (16,) or (44,) same dtype
        The mapping world -> image.
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
    height, width = depth.shape
    surface, places = depth.reshape(height * width), positions.reshape(height * width, 3)
    facing, shares = normals.reshape(normals.shape[0] * normals.shape[1], 3), occlusion.reshape(height * width)
    module, ends, samples = m[12:].copy(), transform_offsets(offsets, kind, m), offsets.shape[0]
    wide, high, total = m.dtype.type(width), m.dtype.type(height), m.dtype.type(samples)
    one, zero = m.dtype.type(1), m.dtype.type(0)
    reads = forward or reach < np.inf
    for k in prange(height):
        j = spread(k, height)
        start, n = surface_span(surface, j * width, width)
        points, up = np.empty((3, width), m.dtype), np.empty((3, width), m.dtype)
        rows, moved = np.empty((4, width), m.dtype), np.empty((4, width), m.dtype)
        z, turn = np.empty(width, m.dtype), np.ones(width, m.dtype)
        texel, inside = np.empty(width, np.uint32), np.empty(width, np.bool_)
        count, missed = np.zeros(width, np.int32), np.zeros(width, np.int32)
        load_row(places, start, n, points)
        if hemisphere:
            load_row(facing, start, n, up)
        affine_rows(kind, m, n, points, rows)
        for s in range(samples):
            ox, oy, oz = offsets[s, 0], offsets[s, 1], offsets[s, 2]
            if hemisphere:
                for i in range(n):
                    turn[i] = -one if (ox * up[0, i] + oy * up[1, i]) + oz * up[2, i] < zero else one
            for row in range(4):
                for i in range(n):
                    moved[row, i] = rows[row, i] + turn[i] * ends[s, row]
            project_rows(kind, m, module, wide, high, n, moved, texel, z, inside)
            if reads:
                count_near(kind, m, surface, places, reach, forward, n, points, texel, z, inside, count)
            else:
                for i in range(n):
                    count[i] += np.int32((surface[texel[i]] < z[i]) & inside[i])
            for i in range(n):
                missed[i] += np.int32(not inside[i])
        outside[j] = finish_shares(surface, j * width, width, start, n, total, remap, count, missed, shares)
