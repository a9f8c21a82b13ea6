"""Alchemy AO: SAO equation 1 on points of the positions texture around each texel."""

import numpy as np
from numba import prange

from lfssao.kernels.elementary import sincospi
from lfssao.kernels.frames import disk_axes
from lfssao.kernels.jit import kernel
from lfssao.kernels.power import power
from lfssao.kernels.rows import affine_rows, linear_rows, load_row, project_rows
from lfssao.kernels.runs import surface_span
from lfssao.kernels.schedule import spread
from lfssao.kernels.spiral import hash_angle, rotated


@kernel(inline=True)
def spread_axes(away, radius, n, first, second):
    """The two axes, times radius, of the disks that face n texels' viewers; away: (3, >= n) their unit directions."""
    for i in range(n):
        ax, ay, az, bx, by, bz = disk_axes(away[0, i], away[1, i], away[2, i])
        first[0, i], first[1, i], first[2, i] = radius * ax, radius * ay, radius * az
        second[0, i], second[1, i], second[2, i] = radius * bx, radius * by, radius * bz


@kernel(inline=True)
def add_terms(depth, places, n, points, up, bias, epsilon, texel, inside, total):
    """Add equation 1's term of one tap of n texels: max(0, v . n + z_C beta) / (v . v + epsilon).

    0 where the tap is outside or sees background, where numerator or denominator is no number, and where the
    denominator is 0 (the tap's point is the texel's own) or overflows (it is too far away to occlude).
    """
    zero = epsilon - epsilon
    for i in range(n):
        t = texel[i]
        x, y, z = places[t, 0] - points[0, i], places[t, 1] - points[1, i], places[t, 2] - points[2, i]
        above = ((x * up[0, i] + y * up[1, i]) + z * up[2, i]) - bias[i]
        square = ((x * x + y * y) + z * z) + epsilon
        counts = inside[i] & (depth[t] < np.inf) & (above > zero) & (square > zero) & (square < np.inf)
        total[i] += above / square if counts else zero


@kernel
def finish_alchemy(depth, row, width, start, n, scale, k, total, missed, occlusion):
    """Write a row's 1 - max(0, 1 - scale total)^k; return how many taps of its visible points were outside."""
    zero, one = scale - scale, depth.dtype.type(1)
    for texel in range(row, row + width):
        occlusion[texel] = zero
    outside = 0
    for i in range(n):
        texel = start + np.uint64(i)
        if depth[texel] < np.inf:
            a = one - scale * total[i]
            a = a if a > zero else zero
            occlusion[texel] = one - depth.dtype.type(power(np.float64(a), k))
            outside += missed[i]
    return outside


@kernel(parallel=True)
def alchemy(
    depth,
    positions,
    normals,
    directions,
    taps,
    kind,
    m,
    away,
    radius,
    beta,
    epsilon,
    scale,
    k,
    turn,
    occlusion,
    outside,
):
    """Alchemy AO of every texel.

    Parameters
    ----------
    depth : (H, W) float32 or float64
        Image z, +infinity where there is no surface.
    positions, normals, directions : (H, W, 3), same dtype
        World coordinates; unit normals; unit directions in which texels look.
    taps : (s, 2), same dtype
        Points of the unit disk.
    kind, m : int, (16,) or (44,) same dtype
        The mapping world -> image.
    away : (4,) same dtype
        -z_C as an affine function of the point: ((a x + b y) + c z) + d, 0 where that is below 0.
    radius, beta, epsilon : scalars, same dtype
        R, world units; equation 1's beta; epsilon, squared world units.
    scale : scalar, same dtype
        2 sigma / s, world units.
    k : float64
        Equation 1's exponent.
    turn : int
        Which form of equation 8 turns the taps of each texel (``lfssao.kernels.spiral``), -1 for none.
    occlusion : (H, W), same dtype
        Out: 1 - A.
    outside : (H,) int64
        Out: taps of each row outside the texture or the mapping's domain; they add nothing.
    """
    height, width = depth.shape
    surface, shares = depth.reshape(height * width), occlusion.reshape(height * width)
    places, facing = positions.reshape(height * width, 3), normals.reshape(height * width, 3)
    looking, module = directions.reshape(height * width, 3), m[12:].copy()
    wide, high, zero = m.dtype.type(width), m.dtype.type(height), m.dtype.type(0)
    for block in prange(height):
        j = spread(block, height)
        start, n = surface_span(surface, j * width, width)
        points, up = np.empty((3, width), m.dtype), np.empty((3, width), m.dtype)
        first, second = np.empty((3, width), m.dtype), np.empty((3, width), m.dtype)
        rows, moved = np.empty((4, width), m.dtype), np.empty((4, width), m.dtype)
        along, across = np.empty((4, width), m.dtype), np.empty((4, width), m.dtype)
        sine, cosine = np.zeros(width, m.dtype), np.ones(width, m.dtype)
        z, bias, total = np.empty(width, m.dtype), np.empty(width, m.dtype), np.zeros(width, m.dtype)
        texel, inside, missed = np.empty(width, np.uint32), np.empty(width, np.bool_), np.zeros(width, np.int32)
        load_row(places, start, n, points)
        load_row(facing, start, n, up)
        load_row(looking, start, n, moved)
        spread_axes(moved, radius, n, first, second)
        affine_rows(kind, m, n, points, rows)
        linear_rows(kind, m, n, first, along)
        linear_rows(kind, m, n, second, across)
        for i in range(n):
            far = ((away[0] * points[0, i] + away[1] * points[1, i]) + away[2] * points[2, i]) + away[3]
            bias[i] = beta * max(far, zero)
            if turn >= 0:
                sine[i], cosine[i] = sincospi(hash_angle(np.int64(start) - j * width + i, j, turn))
        for s in range(taps.shape[0]):
            for i in range(n):
                x, y = rotated(taps[s, 0], taps[s, 1], cosine[i], sine[i])
                for row in range(4):
                    moved[row, i] = rows[row, i] + (x * along[row, i] + y * across[row, i])
            project_rows(kind, m, module, wide, high, n, moved, texel, z, inside)
            add_terms(surface, places, n, points, up, bias, epsilon, texel, inside, total)
            for i in range(n):
                missed[i] += np.int32(not inside[i])
        outside[j] = finish_alchemy(surface, j * width, width, start, n, scale, k, total, missed, shares)
