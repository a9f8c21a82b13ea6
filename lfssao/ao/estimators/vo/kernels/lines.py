"""VO section 4.1: the ball is cut into lines along the viewing direction, each of which is integrated exactly."""

import numpy as np
from numba import prange

from lfssao.ao.estimators.vo.kernels.local_frame import (
    CHUNK,
    EDGE_ON,
    PLACE,
    SLOPES,
    SLOTS,
    STEEP,
    TILE,
    TOTAL,
    chunk_span,
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


@kernel(parallel=True)
def line_occlusion(
    depth, positions, directions, normals, tangent, kind, rows, lens, right, radius, turns,
    disk, half, weights, thickness, occlusion, outside,
):  # fmt: skip
    """Occlusion of every texel by lines through its ball (VO section 4.1, with 4.3 to 4.5).

    Of a line at (x, y) of the unit disk the ball holds t from -z_s to z_s, z_s = sqrt(1 - x^2 - y^2). The surface at t
    = d hides what lies behind it, as far as its thickness T reaches; the tangent plane (4.4) cuts off what lies behind
    itself, t > p. Hidden are

        max(min(min(z_s, p), d + T) - max(-z_s, d), 0)

    the complement in 2 z_s of VO's max(min(z_s, d_r) + z_s, 0), and of the sum of two such integrals with thickness.
    Each line's length is multiplied by its weight and the products are added from the first to the last.

    Parameters
    ----------
    depth : (H, W) float32 or float64
        Cast z of the visible surface, +infinity where there is none.
    positions, directions, normals : (H, W, 3), same dtype
        World coordinates; unit viewing directions; unit normals towards the viewer.
    tangent : bool
        Whether to clamp at the tangent plane; else the normals are not read.
    kind, rows, lens : int, (16,) and (4,) or (32,) same dtype
        The mapping (``lfssao.ao.estimators.vo.kernels.local_frame``).
    right : (3,) same dtype
        The view's rightward direction, world space.
    radius : scalar of the same dtype
        R, world units.
    turns : (2, TILE, CHUNK) same dtype
        The reflections of the disk.
    disk, half, weights : (n, 2), (n,) and (n,) same dtype
        x and y of the lines; z_s; what a unit of hidden length weighs, so that a ball hidden whole (or half a ball,
        with the tangent plane) gives 1.
    thickness : scalar of the same dtype
        T, in units of R; infinite: surfaces hide all that is behind them.
    occlusion : (H, W), same dtype
        Out: at most 1; 0 where there is no surface.
    outside : (H,) int64
        Out: lines of each row that have no image or lie outside the texture; they are open.
    """
    height, width = depth.shape
    size = height * width
    surface, shares = depth.reshape(size), occlusion.reshape(size)
    places, looks, upright = positions.reshape(3 * size), directions.reshape(3 * size), normals.reshape(3 * size)
    dtype = type(radius)
    zero, one, edge_on = dtype(0), dtype(1), dtype(EDGE_ON)
    right_edge, bottom_edge = dtype(last_below(dtype(width))), dtype(last_below(dtype(height)))
    blocks = (height + ROWS_A_BLOCK - 1) // ROWS_A_BLOCK
    for block in prange(blocks):
        scratch, missed = np.empty(SLOTS * CHUNK, depth.dtype), np.empty(CHUNK, np.int32)
        for j in range(block * ROWS_A_BLOCK, min(height, (block + 1) * ROWS_A_BLOCK)):
            lost = 0
            for chunk in range(0, width, CHUNK):
                skipped, n = chunk_span(surface, np.uint64(j * width + chunk), min(CHUNK, width - chunk), shares)
                if n == 0:
                    continue
                first = np.uint64(j * width + chunk + skipped)
                start_frames(rows, right, radius, turns, np.uint64(j % TILE), surface, looks, first, n, scratch)
                start_slopes(tangent, upright, first, n, scratch, edge_on)
                start_points(rows, places, first, n, scratch)
                for i in range(n):
                    scratch[slot(TOTAL, i)] = zero
                    missed[i] = 0
                for s in range(disk.shape[0]):
                    x, y, z_s, weight = disk[s, 0], disk[s, 1], half[s], weights[s]
                    place_on_disk(n, x, y, scratch)
                    project(kind, lens, n, scratch)
                    for i in range(n):
                        u, v = scratch[slot(PLACE, i)], scratch[slot(PLACE + 1, i)]
                        column_at, row_at = hold_inside(u, right_edge), hold_inside(v, bottom_edge)
                        inside = (column_at == u) & (row_at == v)
                        z = surface[texel_number(column_at, row_at, width)]
                        d = (z - scratch[slot(PLACE + 3, i)]) * scratch[slot(STEEP, i)]
                        plane = (x * scratch[slot(SLOPES, i)] + y * scratch[slot(SLOPES + 1, i)]) + scratch[
                            slot(SLOPES + 2, i)
                        ]
                        top = plane if plane < z_s else z_s
                        back = d + thickness
                        back = back if back < top else top
                        front = -z_s if d < -z_s else d
                        length = back - front
                        scratch[slot(TOTAL, i)] += weight * length if inside & (length > zero) else zero
                        missed[i] += np.int32(not inside)
                for i in range(n):
                    total, seen = scratch[slot(TOTAL, i)], scratch[slot(STEEP, i)] == scratch[slot(STEEP, i)]
                    total = total if total < one else one
                    shares[first + np.uint64(i)] = total if seen else zero
                    lost += missed[i] if seen else 0
            outside[j] = lost
