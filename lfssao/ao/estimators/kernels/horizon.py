"""Horizon-based AO (Bavoil, Sainz and Dimitrov 2008): how far the horizon rises above the tangent plane, all around."""

import numpy as np
from numba import prange

from lfssao.ao.estimators.vo.kernels.local_frame import (
    CHUNK,
    E1,
    EDGE_ON,
    LOOK,
    PLACE,
    SLOPES,
    SLOTS,
    STEEP,
    TILE,
    TOTAL,
    chunk_span,
    load,
    place_on_disk,
    project,
    slot,
    start_frames,
    start_points,
    start_slopes,
)
from lfssao.ao.kernels.spans import ROWS_A_BLOCK
from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import hold_inside, last_below, texel_number

_WHERE = E1  # P, in place of the frame's vectors, which are done with
_HORIZON = E1 + 3  # sine of the horizon's elevation so far
_AWAY = SLOTS  # D
_NEAR = SLOTS + 3  # 1 where the step's end lies in the texture, else 0
_WAY = E1 + 4  # from the texel's centre to the image of P + R (x e1' + y e2'), texels


@kernel(inline=True)
def start_direction(x, y, sine_bias, cosine_bias, column, row, n, scratch, one):
    """_HORIZON and _WAY of one direction of the disk, whose end has just been projected.

    The tangent plane rises in this direction by the angle t with sin t = -tau / sqrt(1 + tau^2), tau = x slope_1 + y
    slope_2, towards the viewer. The horizon starts at sin(t + bias), or at 1 where t + bias passes the zenith.
    """
    zero, half = one - one, type(one)(0.5)
    for i in range(n):
        tau = x * scratch[slot(SLOPES, i)] + y * scratch[slot(SLOPES + 1, i)]
        cosine = one / np.sqrt(one + tau * tau)
        sine = -tau * cosine
        risen = sine * cosine_bias + cosine * sine_bias
        scratch[slot(_HORIZON, i)] = risen if cosine * cosine_bias - sine * sine_bias > zero else one
        scratch[slot(_WAY, i)] = scratch[slot(PLACE, i)] - (type(one)(column + i) + half)
        scratch[slot(_WAY + 1, i)] = scratch[slot(PLACE + 1, i)] - (type(one)(row) + half)


@kernel(inline=True)
def raise_horizons(n, radius, linear, quadratic, scratch, one):
    """One step of one direction: where _AWAY lies above _HORIZON, that rises, and TOTAL gains the attenuated rise."""
    zero = one - one
    for i in range(n):
        dx, dy = scratch[slot(_AWAY, i)], scratch[slot(_AWAY + 1, i)]
        dz, near = scratch[slot(_AWAY + 2, i)], scratch[slot(_NEAR, i)]
        length = np.sqrt((dx * dx + dy * dy) + dz * dz)
        towards = (dx * scratch[slot(LOOK, i)] + dy * scratch[slot(LOOK + 1, i)]) + dz * scratch[slot(LOOK + 2, i)]
        sine, r, horizon = -towards / length, length / radius, scratch[slot(_HORIZON, i)]
        weight = one - (linear * r + quadratic * (r * r))
        # Not a number where the point itself is met or nothing is: then the horizon stays.
        sine = sine if (near > zero) & (r < one) else horizon
        higher = sine if sine > horizon else horizon
        gain = weight * (higher - horizon)
        scratch[slot(TOTAL, i)] += gain if higher > horizon else zero
        scratch[slot(_HORIZON, i)] = higher


@kernel(parallel=True)
def horizon_occlusion(
    depth, positions, directions, normals, kind, rows, lens, right, radius, turns, around, steps, sine_bias,
    cosine_bias, linear, quadratic, occlusion, outside,
):  # fmt: skip
    """Occlusion of every texel by the horizons in directions of its disk.

    A = (1 / 2 pi) integral over theta of (sin h - sin t) W, elevations above the plane through P at right angles to
    the viewing direction, by the mean over the directions. Along each, the image of P + R (x e1' + y e2') is neared in
    equal steps from the texel's centre. The surface at Q, D = Q - P, has sin = -(D . w) / |D| and r = |D| / R. Where
    it lies above the horizon so far and r < 1, W (sin - horizon) is added, W = 1 - (linear r + quadratic r^2), and it
    becomes the horizon. Each direction's sum is divided by their number at the end.

    Parameters
    ----------
    depth, positions, directions, normals, kind, rows, lens, right, radius, turns
        As for ``line_occlusion``; the normals are always read.
    around : (n, 2) same dtype
        x and y of the directions, unit length.
    steps : int
        How many steps along each.
    sine_bias, cosine_bias : scalars of the same dtype
        Of the angle by which the horizon must exceed the tangent plane.
    linear, quadratic : scalars of the same dtype
        The attenuation.
    occlusion : (H, W), same dtype
        Out: at most 1; 0 where there is no surface.
    outside : (H,) int64
        Out: steps of each row that lie outside the texture, or in a direction whose end has no image; they are open.
    """
    height, width = depth.shape
    size = height * width
    surface, shares = depth.reshape(size), occlusion.reshape(size)
    places, looks, upright = positions.reshape(3 * size), directions.reshape(3 * size), normals.reshape(3 * size)
    dtype = type(radius)
    zero, one, half, edge_on = dtype(0), dtype(1), dtype(0.5), dtype(EDGE_ON)
    right_edge, bottom_edge = dtype(last_below(dtype(width))), dtype(last_below(dtype(height)))
    count = dtype(around.shape[0])
    blocks = (height + ROWS_A_BLOCK - 1) // ROWS_A_BLOCK
    for block in prange(blocks):
        scratch, missed = np.empty((SLOTS + 4) * CHUNK, depth.dtype), np.empty(CHUNK, np.int32)
        texels = np.empty(CHUNK, np.uint32)
        for j in range(block * ROWS_A_BLOCK, min(height, (block + 1) * ROWS_A_BLOCK)):
            lost = 0
            for chunk in range(0, width, CHUNK):
                skipped, n = chunk_span(surface, np.uint64(j * width + chunk), min(CHUNK, width - chunk), shares)
                column = chunk + skipped
                if n == 0:
                    continue
                first = np.uint64(j * width + chunk + skipped)
                start_frames(rows, right, radius, turns, np.uint64(j % TILE), surface, looks, first, n, scratch)
                start_slopes(True, upright, first, n, scratch, edge_on)
                start_points(rows, places, first, n, scratch)
                load(places, first, n, scratch, _WHERE)
                for i in range(n):
                    scratch[slot(TOTAL, i)] = zero
                    missed[i] = 0
                for s in range(around.shape[0]):
                    x, y = around[s, 0], around[s, 1]
                    place_on_disk(n, x, y, scratch)
                    project(kind, lens, n, scratch)
                    start_direction(x, y, sine_bias, cosine_bias, column, j, n, scratch, one)
                    for step in range(1, steps + 1):
                        part = dtype(step) / dtype(steps)
                        for i in range(n):
                            u = (dtype(column + i) + half) + part * scratch[slot(_WAY, i)]
                            v = (dtype(j) + half) + part * scratch[slot(_WAY + 1, i)]
                            column_at, row_at = hold_inside(u, right_edge), hold_inside(v, bottom_edge)
                            inside = (column_at == u) & (row_at == v)
                            texels[i] = texel_number(column_at, row_at, width)
                            scratch[slot(_NEAR, i)] = one if inside else zero
                            missed[i] += np.int32(not inside)
                        for i in range(n):
                            t = np.uint64(3) * np.uint64(texels[i])
                            scratch[slot(_AWAY, i)] = places[t] - scratch[slot(_WHERE, i)]
                            scratch[slot(_AWAY + 1, i)] = places[t + np.uint64(1)] - scratch[slot(_WHERE + 1, i)]
                            scratch[slot(_AWAY + 2, i)] = places[t + np.uint64(2)] - scratch[slot(_WHERE + 2, i)]
                        raise_horizons(n, radius, linear, quadratic, scratch, one)
                for i in range(n):
                    seen = scratch[slot(STEEP, i)] == scratch[slot(STEEP, i)]
                    total = scratch[slot(TOTAL, i)] / count
                    total = total if total < one else one
                    shares[first + np.uint64(i)] = total if seen else zero
                    lost += missed[i] if seen else 0
            outside[j] = lost
