"""VO section 4.1: the ball is cut into lines along the viewing direction, each of which is integrated exactly."""

import numpy as np
from numba import prange

from lfssao.ao.estimators.kernels.slots import CHUNK, slot
from lfssao.ao.estimators.vo.kernels.local_frame import (
    PLACE,
    SLOTS,
    STEEP,
    TOTAL,
    chunk_span,
    finish_chunk,
    line_top,
    place_on_disk,
    project,
    start_disks,
)
from lfssao.ao.kernels.spans import ROWS_A_BLOCK
from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import hold_inside, last_below, texel_number


@kernel(inline=True)
def add_line(surface, size, disk, s, thickness, n, missed, slots):
    """Add the hidden length of line s of n texels, times its weight; surface: flat depth, size: (height, width)."""
    x, y, z_s, weight = disk.places[s, 0], disk.places[s, 1], disk.half[s], disk.weights[s]
    dtype = type(thickness)
    zero, right_edge, bottom_edge = dtype(0), last_below(dtype(size[1])), last_below(dtype(size[0]))
    # Apart from the sums: in one loop LLVM makes no vectors, and VO table 1 takes twice as long (results.py).
    for i in range(n):
        u, v = slots[slot(PLACE, i)], slots[slot(PLACE + 1, i)]
        column, row = hold_inside(u, right_edge), hold_inside(v, bottom_edge)
        inside = (column == u) & (row == v)
        z = surface[texel_number(column, row, size[1])]
        d = (z - slots[slot(PLACE + 3, i)]) * slots[slot(STEEP, i)]
        slots[slot(PLACE + 3, i)] = d if inside else dtype(np.inf)
        missed[i] += np.int32(not inside)
    for i in range(n):
        d, top = slots[slot(PLACE + 3, i)], line_top(x, y, z_s, i, slots)
        back = d + thickness
        back = back if back < top else top
        front = -z_s if d < -z_s else d
        length = back - front
        slots[slot(TOTAL, i)] += weight * length if length > zero else zero


@kernel(parallel=True)
def line_occlusion(seen, disk, turns, radius, thickness, occlusion, outside):
    """Occlusion of every texel by lines through its ball (VO section 4.1, with 4.3 to 4.5).

    The ball holds t from -z_s to z_s of a line at (x, y) of the unit disk, z_s = sqrt(1 - x^2 - y^2). The surface at t
    = d hides what lies behind it, as far as its thickness T reaches; the tangent plane (4.4) cuts off what lies behind
    itself, t > p. Hidden are

        max(min(min(z_s, p), d + T) - max(-z_s, d), 0)

    the complement in 2 z_s of VO's max(min(z_s, d_r) + z_s, 0), and of the sum of two such integrals with thickness.
    Each line's length is multiplied by its weight and the products are added from the first to the last.

    turns: (2, H * W), cosine and sine by which each texel's samples are turned, or None. radius: R, world units.
    thickness: T, in units of R, infinite where surfaces hide all that is behind them.
    occlusion: (H, W), out. outside: (H,), out: lines of each row that have no image or lie outside the texture; they
    are open.
    """
    size, fractions = occlusion.shape, occlusion.reshape(-1)
    height, width = size
    for block in prange((height + ROWS_A_BLOCK - 1) // ROWS_A_BLOCK):
        slots, missed = np.empty(SLOTS * CHUNK, fractions.dtype), np.empty(CHUNK, np.int32)
        for j in range(block * ROWS_A_BLOCK, min(height, (block + 1) * ROWS_A_BLOCK)):
            lost = 0
            for chunk in range(0, width, CHUNK):
                first, n = chunk_span(seen.depth, j * width + chunk, min(CHUNK, width - chunk), fractions)
                start_disks(seen, radius, disk, turns, j, first, n, missed, slots)
                for s in range(disk.half.shape[0]):
                    place_on_disk(n, disk.places[s, 0], disk.places[s, 1], slots)
                    project(seen.kind, seen.lens, n, slots)
                    add_line(seen.depth, size, disk, s, thickness, n, missed, slots)
                lost += finish_chunk(first, n, missed, slots, fractions)
            outside[j] = lost
