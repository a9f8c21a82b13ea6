"""Alchemy AO: SAO equation 1 on points of the positions texture around each texel."""

import numpy as np
from numba import prange

from lfssao.kernels.elementary import sincospi
from lfssao.kernels.frames import disk_axes
from lfssao.kernels.jit import kernel, wide_vectors
from lfssao.kernels.mapping import CROSSED_SLITS, project_crossed_slits, texel_number
from lfssao.kernels.power import power
from lfssao.kernels.rows import affine_rows, linear_rows, load_row, project_rows
from lfssao.kernels.runs import next_run
from lfssao.kernels.schedule import spread
from lfssao.kernels.spiral import hash_angle, rotated

# Texels are computed by tiles, so that the surface around them, where the turned taps of neighbours land far apart,
# stays in the nearest caches.
_ROWS_A_BLOCK = 8
_CHUNK = 128


@kernel(inline=True)
def spread_axes(away, radius, n, first, second):
    """The two axes, times radius, of the disks that face n texels' viewers; away: (3, >= n) their unit directions."""
    for i in range(n):
        ax, ay, az, bx, by, bz = disk_axes(away[0, i], away[1, i], away[2, i])
        first[0, i], first[1, i], first[2, i] = radius * ax, radius * ay, radius * az
        second[0, i], second[1, i], second[2, i] = radius * bx, radius * by, radius * bz


@kernel(inline=True)
def move_taps(x, y, n, cosine, sine, rows, along, across, a, b, c, q):
    """The mapping's affine half of the tap (x, y) of n points, turned at each, into a, b, c, q."""
    for i in range(n):
        u, v = rotated(x, y, cosine[i], sine[i])
        a[i] = rows[0, i] + (u * along[0, i] + v * across[0, i])
        b[i] = rows[1, i] + (u * along[1, i] + v * across[1, i])
        c[i] = rows[2, i] + (u * along[2, i] + v * across[2, i])
        q[i] = rows[3, i] + (u * along[3, i] + v * across[3, i])


@kernel(inline=True)
def term(x, y, z, nx, ny, nz, bias, epsilon, surface):
    """Equation 1's term of one tap: max(0, v . n + z_C beta) / (v . v + epsilon), v = (x, y, z).

    0 where the tap is outside or sees background (surface: its depth, +infinity there), where numerator or denominator
    is no number, and where the denominator is 0 (the tap's point is the texel's own) or overflows (it is too far away
    to occlude).
    """
    zero = epsilon - epsilon
    above = ((x * nx + y * ny) + z * nz) - bias
    square = ((x * x + y * y) + z * z) + epsilon
    ratio = above / square
    return ratio if (surface < np.inf) & (above > zero) & (square > zero) & (square < np.inf) else zero


@kernel(inline=True)
def add_crossed_slits(m, depth, places, width, height, n, points, up, bias, epsilon, a, b, c, total, found):
    """Add the terms of one tap of n texels; found: how many of a texel's taps are in the texture, in and out."""
    wide, high = m.dtype.type(width), m.dtype.type(height)
    zero, nothing = m.dtype.type(0), m.dtype.type(np.inf)
    z_module, z_observer, u_0, v_0 = m[12], m[13], m[14], m[15]
    for i in range(n):
        u, v, z, _ = project_crossed_slits(a[i], b[i], c[i], z_module, z_observer, u_0, v_0)
        there = (z < z_module) & (z > z_observer) & (u >= zero) & (u < wide) & (v >= zero) & (v < high)
        column, row = u if there else zero, v if there else zero
        texel = texel_number(column, row, wide)
        t = np.uint64(3) * np.uint64(texel)
        x, y, w = places[t], places[t + np.uint64(1)], places[t + np.uint64(2)]
        surface = depth[texel]
        surface = surface if there else nothing
        x, y, w = x - points[0, i], y - points[1, i], w - points[2, i]
        total[i] += term(x, y, w, up[0, i], up[1, i], up[2, i], bias[i], epsilon, surface)
        found[i] += np.int32(there)


@kernel(inline=True)
def add_terms(depth, places, n, points, up, bias, epsilon, texel, inside, total, found):
    """The same of any mapping, after ``project_rows``."""
    nothing = type(epsilon)(np.inf)
    for i in range(n):
        t = np.uint64(3) * np.uint64(texel[i])
        x, y, z = places[t], places[t + np.uint64(1)], places[t + np.uint64(2)]
        surface = depth[texel[i]]
        surface = surface if inside[i] else nothing
        x, y, z = x - points[0, i], y - points[1, i], z - points[2, i]
        total[i] += term(x, y, z, up[0, i], up[1, i], up[2, i], bias[i], epsilon, surface)
        found[i] += np.int32(inside[i])


@kernel
def finish_alchemy(depth, at, start, n, taps, scale, k, total, found, occlusion):
    """Write 0 from texel number ``at`` to the run's start and 1 - max(0, 1 - scale total)^k of the n in the run.

    Returns how many taps of the run's visible points were outside.
    """
    zero, one = scale - scale, depth.dtype.type(1)
    for texel in range(np.uint64(at), np.uint64(start)):
        occlusion[texel] = zero
    outside = 0
    for i in range(n):
        texel = np.uint64(start + i)
        there = depth[texel] < np.inf
        a = one - scale * total[i]
        a = a if a > zero else zero
        occlusion[texel] = one - depth.dtype.type(power(np.float64(a), k)) if there else zero
        outside += taps - found[i] if there else 0
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
    places, facing = positions.reshape(3 * height * width), normals.reshape(3 * height * width)
    looking, module = directions.reshape(3 * height * width), m[12:].copy()
    wide, high, zero, samples = m.dtype.type(width), m.dtype.type(height), m.dtype.type(0), taps.shape[0]
    blocks = (height + _ROWS_A_BLOCK - 1) // _ROWS_A_BLOCK
    for block in prange(blocks):
        wide_vectors()
        top = spread(block, blocks) * _ROWS_A_BLOCK
        bottom = min(height, top + _ROWS_A_BLOCK)
        points, up, seen = (
            np.empty((3, _CHUNK), m.dtype),
            np.empty((3, _CHUNK), m.dtype),
            np.empty((3, _CHUNK), m.dtype),
        )
        first, second = np.empty((3, _CHUNK), m.dtype), np.empty((3, _CHUNK), m.dtype)
        rows, along, across = (
            np.empty((4, _CHUNK), m.dtype),
            np.empty((4, _CHUNK), m.dtype),
            np.empty((4, _CHUNK), m.dtype),
        )
        a, b, c, q = (
            np.empty(_CHUNK, m.dtype),
            np.empty(_CHUNK, m.dtype),
            np.empty(_CHUNK, m.dtype),
            np.empty(_CHUNK, m.dtype),
        )
        sine, cosine = np.zeros(_CHUNK, m.dtype), np.ones(_CHUNK, m.dtype)
        z, bias, total = np.empty(_CHUNK, m.dtype), np.empty(_CHUNK, m.dtype), np.empty(_CHUNK, m.dtype)
        texel, inside, found = np.empty(_CHUNK, np.uint32), np.empty(_CHUNK, np.bool_), np.empty(_CHUNK, np.int32)
        for j in range(top, bottom):
            outside[j] = 0
        for column in range(0, width, _CHUNK):
            for j in range(top, bottom):
                at = j * width + column
                end = min(at + _CHUNK, (j + 1) * width)
                while at < end:
                    start, n = next_run(surface, at, end)
                    load_row(places, start, n, points)
                    load_row(facing, start, n, up)
                    load_row(looking, start, n, seen)
                    spread_axes(seen, radius, n, first, second)
                    affine_rows(kind, m, n, points, rows)
                    linear_rows(kind, m, n, first, along)
                    linear_rows(kind, m, n, second, across)
                    for i in range(n):
                        far = ((away[0] * points[0, i] + away[1] * points[1, i]) + away[2] * points[2, i]) + away[3]
                        bias[i] = beta * max(far, zero)
                        total[i], found[i] = zero, 0
                    if turn >= 0:
                        for i in range(n):
                            sine[i], cosine[i] = sincospi(hash_angle(start - j * width + i, j, turn))
                    for s in range(samples):
                        move_taps(taps[s, 0], taps[s, 1], n, cosine, sine, rows, along, across, a, b, c, q)
                        if kind == CROSSED_SLITS:
                            add_crossed_slits(
                                m, surface, places, width, height, n, points, up, bias, epsilon, a, b, c, total, found
                            )  # fmt: skip
                        else:
                            project_rows(kind, m, module, wide, high, n, a, b, c, q, texel, z, inside)
                            add_terms(surface, places, n, points, up, bias, epsilon, texel, inside, total, found)
                    outside[j] += finish_alchemy(surface, at, start, n, samples, scale, k, total, found, shares)
                    at = start + n
