"""The hemisphere in the frame of each texel's normal: points that turn with it, and a check of the range in depth."""

from typing import NamedTuple

import numpy as np

from lfssao.ao.estimators.vo.kernels import local_frame as frame
from lfssao.ao.estimators.vo.kernels.local_frame import FIRST, PLACE, POINT, SECOND, STEEP, TOTAL
from lfssao.ao.kernels.spans import CHUNK, load, slot
from lfssao.core.intrinsics import on_the_stack, scratch
from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import hold_inside, last_below, texel_number

# Slots of this kernel's own. FIRST and SECOND are the linear rows of R t and R b.
_THIRD = 21  # the linear rows of R n
_NORMAL = 25
_slots = on_the_stack(28 * CHUNK)

ANY, NEAR, SMOOTH = 0, 1, 2  # range checks


class Hemisphere(NamedTuple):
    """Points of the upper half ball, arrays and scalars of the arithmetic's dtype.

    points: (n, 3), in the frame (t, b, n), z >= 0. up: (3,), the view's upward direction, as long as its rightward one.
    radius: world units. reach, bias: R, and by how much a surface must be nearer than a point, in units of cast z.
    range_check: ANY, NEAR or SMOOTH.
    """

    points: np.ndarray
    up: np.ndarray
    radius: np.floating
    reach: np.floating
    bias: np.floating
    range_check: int


@kernel(inline=True)
def start_axes(seen, half, turns, first, n, slots):
    """The frame of n texels from number ``first`` on, times R; STEEP is NaN where a texel sees no surface.

    t is c right + s up without its part along the normal, of length 1, and b = n x t. turns: (2, H * W).
    """
    radius, right, up, one = half.radius, seen.right, half.up, type(half.radius)(1)
    load(seen.normals, first, n, slots, _NORMAL)
    for i in range(n):
        texel = first + np.uint64(i)
        c, s = turns[0, texel], turns[1, texel]
        nx, ny, nz = slots[slot(_NORMAL, i)], slots[slot(_NORMAL + 1, i)], slots[slot(_NORMAL + 2, i)]
        rx, ry, rz = c * right[0] + s * up[0], c * right[1] + s * up[1], c * right[2] + s * up[2]
        along = (nx * rx + ny * ry) + nz * rz
        x, y, z = rx - along * nx, ry - along * ny, rz - along * nz
        scale = one / np.sqrt((x * x + y * y) + z * z)
        x, y, z = x * scale, y * scale, z * scale
        frame.map_rows(seen.rows, radius, x, y, z, slots, FIRST, i)
        frame.map_rows(seen.rows, radius, ny * z - nz * y, nz * x - nx * z, nx * y - ny * x, slots, SECOND, i)
        frame.map_rows(seen.rows, radius, nx, ny, nz, slots, _THIRD, i)
        slots[slot(STEEP, i)] = one if seen.depth[texel] < np.inf else type(radius)(np.nan)


@kernel(inline=True)
def place_above(point, n, slots):
    """The mapping's rows of C + R (x t + y b + z n) into PLACE."""
    x, y, z = point[0], point[1], point[2]
    for k in range(4):
        for i in range(n):
            along = (slots[slot(POINT + k, i)] + x * slots[slot(FIRST + k, i)]) + y * slots[slot(SECOND + k, i)]
            slots[slot(PLACE + k, i)] = along + z * slots[slot(_THIRD + k, i)]


@kernel(inline=True)
def add_weights(surface, size, half, n, missed, slots):
    """Add the weight of one point of n texels where it is hidden; surface: flat depth, size: (height, width)."""
    dtype, reach = type(half.bias), half.reach
    check = half.range_check
    zero, one, three = dtype(0), dtype(1), dtype(3)
    right_edge, bottom_edge = last_below(dtype(size[1])), last_below(dtype(size[0]))
    for i in range(n):
        u, v = slots[slot(PLACE, i)], slots[slot(PLACE + 1, i)]
        column, row = hold_inside(u, right_edge), hold_inside(v, bottom_edge)
        inside = (column == u) & (row == v)
        nearest = surface[texel_number(column, row, size[1])]
        far = abs(slots[slot(POINT + 3, i)] - nearest)
        weight = one
        if check == NEAR:
            weight = one if far < reach else zero
        if check == SMOOTH:
            part = reach / far if far > reach else one
            weight = (part * part) * (three - (part + part))
        hidden = inside & (slots[slot(PLACE + 3, i)] - nearest >= half.bias)
        slots[slot(TOTAL, i)] += weight if hidden else zero
        missed[i] += np.int32(not inside)


@kernel(rows="occlusion")
def oriented_occlusion(begin, stop, seen, surface, half, turns, occlusion, outside):
    """Mean weight of the points that the surface hides, of every texel, into occlusion (H, W).

    surface: (H * W,), cast z that points are compared with, where ``seen`` has none too. outside: (H,), out: points of
    each row outside the texture or the mapping's domain; they are not hidden.
    """
    size, fractions, count = occlusion.shape, occlusion.reshape(-1), half.points.shape[0]
    width = size[1]
    slots, missed = _slots(fractions.dtype), scratch(np.int32)
    for j in range(begin, stop):
        outside[j] = 0
        for chunk in range(0, width, CHUNK):
            first, n = frame.chunk_span(seen.depth, j * width + chunk, min(CHUNK, width - chunk), fractions)
            start_axes(seen, half, turns, first, n, slots)
            frame.start_points(seen, first, n, missed, slots)
            for s in range(count):
                place_above(half.points[s], n, slots)
                frame.project(seen.kind, seen.lens, n, slots)
                add_weights(surface, size, half, n, missed, slots)
            outside[j] += frame.finish_chunk(first, n, count, missed, slots, fractions)
