"""Point sampling with options that LF does not have: hemisphere, range check, line 7's other form.

One row of texels at a time, in two loops a sample: where the row's samples land (an arithmetic loop, a kind of mapping
each), then what the textures hold there. The first writes texel numbers, so the options of the second need no loop for
each kind of mapping.
"""

import numpy as np
from numba import prange

from lfssao.kernels.display import VALID, physical_to_image
from lfssao.kernels.jit import kernel
from lfssao.kernels.mapping import (
    CROSSED_SLITS,
    MATRIX,
    affine_row,
    nearest_texel,
    project_crossed_slits,
    project_matrix,
)
from lfssao.kernels.schedule import spread
from lfssao.kernels.ssao import surface_span, transform_offsets


@kernel(inline=True)
def locate_row(kind, m, module, width, height, n, rows, ends, turn, s, texel, z, inside):
    """Where sample s of each of n points lands.

    Parameters
    ----------
    kind, m : int, array
        The mapping.
    module : array
        m[12:], the module's numbers of kind DISPLAY.
    width, height : scalars of m's dtype
        Size of the texture.
    n : int
        How many points.
    rows : (4, >= n)
        The points after the mapping's affine half.
    ends : (samples, 4)
        The samples after its linear half.
    turn : (>= n,)
        1, or -1 where the sample is taken on the other side of its point.
    s : int
        Number of the sample.
    texel, z, inside : (>= n,) uint32, dtype, bool
        Out: the texel (any one where the sample lands outside); image z; whether it is in the texture and the domain.
    """
    oa, ob, oc, oq = ends[s, 0], ends[s, 1], ends[s, 2], ends[s, 3]
    if kind == CROSSED_SLITS:
        z_module, z_observer, u_0, v_0 = m[12], m[13], m[14], m[15]
        for i in range(n):
            t = turn[i]
            a, b, c = rows[0, i] + t * oa, rows[1, i] + t * ob, rows[2, i] + t * oc
            u, v, z[i], valid = project_crossed_slits(a, b, c, z_module, z_observer, u_0, v_0)
            there, texel[i] = nearest_texel(u, v, width, height)
            inside[i] = there & valid
    elif kind == MATRIX:
        for i in range(n):
            t = turn[i]
            a, b, c = rows[0, i] + t * oa, rows[1, i] + t * ob, rows[2, i] + t * oc
            u, v, z[i], valid = project_matrix(a, b, c, rows[3, i] + t * oq)
            there, texel[i] = nearest_texel(u, v, width, height)
            inside[i] = there & valid
    else:
        for i in range(n):
            t = turn[i]
            a, b, c = rows[0, i] + t * oa, rows[1, i] + t * ob, rows[2, i] + t * oc
            u, v, answer = physical_to_image(module, a, b, c)
            z[i] = c
            there, texel[i] = nearest_texel(u, v, width, height)
            inside[i] = there & (answer == VALID)


@kernel(inline=True)
def affine_rows(kind, m, n, points, rows):
    """The mapping's affine half of n points (3, >= n) into rows (4, >= n); row 3 for a camera only."""
    for i in range(n):
        x, y, z = points[0, i], points[1, i], points[2, i]
        rows[0, i], rows[1, i], rows[2, i] = (
            affine_row(m, 0, x, y, z),
            affine_row(m, 1, x, y, z),
            affine_row(m, 2, x, y, z),
        )
        rows[3, i] = affine_row(m, 3, x, y, z) if kind == MATRIX else rows[2, i]


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


@kernel(inline=True)
def load_points(places, facing, hemisphere, start, n, points, up):
    """The positions and, for the hemisphere, the normals of n texels from texel number ``start`` on: (3, >= n) each."""
    for i in range(n):
        texel = start + np.uint64(i)
        points[0, i], points[1, i], points[2, i] = places[texel, 0], places[texel, 1], places[texel, 2]
        if hemisphere:
            up[0, i], up[1, i], up[2, i] = facing[texel, 0], facing[texel, 1], facing[texel, 2]


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
        points, rows, up = np.empty((3, width), m.dtype), np.empty((4, width), m.dtype), np.zeros((3, width), m.dtype)
        z, turn = np.empty(width, m.dtype), np.ones(width, m.dtype)
        texel, inside = np.empty(width, np.uint32), np.empty(width, np.bool_)
        count, missed = np.zeros(width, np.int32), np.zeros(width, np.int32)
        load_points(places, facing, hemisphere, start, n, points, up)
        affine_rows(kind, m, n, points, rows)
        for s in range(samples):
            ox, oy, oz = offsets[s, 0], offsets[s, 1], offsets[s, 2]
            if hemisphere:
                for i in range(n):
                    turn[i] = -one if (ox * up[0, i] + oy * up[1, i]) + oz * up[2, i] < zero else one
            locate_row(kind, m, module, wide, high, n, rows, ends, turn, s, texel, z, inside)
            if reads:
                count_near(kind, m, surface, places, reach, forward, n, points, texel, z, inside, count)
            else:
                for i in range(n):
                    count[i] += np.int32((surface[texel[i]] < z[i]) & inside[i])
            for i in range(n):
                missed[i] += np.int32(not inside[i])
        outside[j] = finish_shares(surface, j * width, width, start, n, total, remap, count, missed, shares)
