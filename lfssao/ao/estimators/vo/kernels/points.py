"""VO sections 3 and 4 by points in the ball, as Crytek and Blizzard sample it (sections 4.1, 4.4 and 4.5)."""

from typing import NamedTuple

import numpy as np

from lfssao.ao.estimators.vo.kernels import local_frame as frame
from lfssao.ao.estimators.vo.kernels.local_frame import PLACE, POINT, STEEP, TILE, TOTAL
from lfssao.ao.kernels.spans import CHUNK, load, slot
from lfssao.ao.kernels.ssao import offset_row, transform_offsets, turned_offset
from lfssao.core.intrinsics import scratch
from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import MATRIX, Projection, hold_inside, last_below, linear_row, texel_number

# Slots of this kernel's own, in place of those of the disk's frame.
_MIRRORED = 4  # the linear rows of 2 R r, r the direction of reflection
_LIFTED = 8  # of 2 R n
_NORMAL = 13
_MIRROR = 21  # r
_ACROSS = 24  # 2 r . n
_REACH = 25  # z_S - z_Q up to which the surface hides


class Ball(NamedTuple):
    """Samples of the unit ball, arrays of the arithmetic's dtype.

    offsets: (n, 3), world axes. weights: (n,), their sum is 1. mirrors: (3, TILE, CHUNK), unit directions by which the
    offsets are reflected, or 0 for none. tangent: whether points below the tangent plane are reflected by it; else
    normals are not read.
    """

    offsets: np.ndarray
    weights: np.ndarray
    mirrors: np.ndarray
    tangent: bool


@kernel(inline=True)
def start_reflections(seen, radius, ball, j, first, n, slots):
    """The slots that turn an offset: first reflected about r, then, where it is below the surface, by the surface."""
    two_radii, phase = radius + radius, np.uint64(j % TILE)
    if ball.tangent:
        load(seen.normals, first, n, slots, _NORMAL)
    else:
        for i in range(n):
            slots[slot(_NORMAL, i)], slots[slot(_NORMAL + 1, i)], slots[slot(_NORMAL + 2, i)] = 0, 0, 0
    for i in range(n):
        rx, ry, rz = ball.mirrors[0, phase, i], ball.mirrors[1, phase, i], ball.mirrors[2, phase, i]
        nx, ny, nz = slots[slot(_NORMAL, i)], slots[slot(_NORMAL + 1, i)], slots[slot(_NORMAL + 2, i)]
        slots[slot(_MIRROR, i)], slots[slot(_MIRROR + 1, i)], slots[slot(_MIRROR + 2, i)] = rx, ry, rz
        across = (rx * nx + ry * ny) + rz * nz
        slots[slot(_ACROSS, i)] = across + across
        frame.map_rows(seen.rows, two_radii, rx, ry, rz, slots, _MIRRORED, i)
        frame.map_rows(seen.rows, two_radii, nx, ny, nz, slots, _LIFTED, i)


@kernel(inline=True)
def start_reach(seen, radius, thickness, first, n, slots):
    """How far in cast z a surface hides: T R w_z, or infinity, for which directions are not read; STEEP for the end."""
    if thickness < np.inf:
        load(seen.directions, first, n, slots, PLACE)
    for i in range(n):
        x, y, z = slots[slot(PLACE, i)], slots[slot(PLACE + 1, i)], slots[slot(PLACE + 2, i)]
        reach = (thickness * radius) * linear_row(seen.rows, 3, x, y, z) if thickness < np.inf else thickness
        slots[slot(_REACH, i)] = reach
        slots[slot(STEEP, i)] = radius if seen.depth[first + np.uint64(i)] < np.inf else type(radius)(np.nan)


@kernel(inline=True)
def place_in_ball(ends, radius, offsets, s, turns, first, n, slots):
    """The mapping's rows of P + R o'' into PLACE, o'' offset s after its turn and its reflections.

    o' = o - 2 (o . r) r; o'' = o' - 2 (o' . n) n where o' . n < 0. ends: (n, 3, 4), those of ``transform_offsets``.
    turns: (2, H * W), cosines and sines.
    """
    (a, b, z), zero = (offsets[s, 0], offsets[s, 1], offsets[s, 2]), type(radius)(0)
    for i in range(n):
        texel = first + np.uint64(i)
        x, y = turned_offset(a, b, turns, texel)
        u, v = offset_row(ends, s, 0, turns, turns, texel), offset_row(ends, s, 1, turns, turns, texel)
        q, w = offset_row(ends, s, 2, turns, turns, texel), offset_row(ends, s, 3, turns, turns, texel)
        mirror = (x * slots[slot(_MIRROR, i)] + y * slots[slot(_MIRROR + 1, i)]) + z * slots[slot(_MIRROR + 2, i)]
        above = (x * slots[slot(_NORMAL, i)] + y * slots[slot(_NORMAL + 1, i)]) + z * slots[slot(_NORMAL + 2, i)]
        above = above - mirror * slots[slot(_ACROSS, i)]
        lift = above if above < zero else zero
        for k, row in ((0, u), (1, v), (2, q), (3, w)):
            turned = (slots[slot(POINT + k, i)] + radius * row) - mirror * slots[slot(_MIRRORED + k, i)]
            slots[slot(PLACE + k, i)] = turned - lift * slots[slot(_LIFTED + k, i)]


@kernel(inline=True)
def add_point(surface, size, weight, n, missed, slots):
    """Add the weight of one point of n texels where it is hidden; surface: flat depth, size: (height, width)."""
    dtype = type(weight)
    zero, right_edge, bottom_edge = dtype(0), last_below(dtype(size[1])), last_below(dtype(size[0]))
    for i in range(n):
        u, v = slots[slot(PLACE, i)], slots[slot(PLACE + 1, i)]
        column, row = hold_inside(u, right_edge), hold_inside(v, bottom_edge)
        inside = (column == u) & (row == v)
        before = slots[slot(PLACE + 3, i)] - surface[texel_number(column, row, size[1])]
        hidden = inside & (before > zero) & (before <= slots[slot(_REACH, i)])
        slots[slot(TOTAL, i)] += weight if hidden else zero
        missed[i] += np.int32(not inside)


@kernel(rows="occlusion")
def point_occlusion(begin, stop, seen, ball, turns, radius, thickness, occlusion, outside):
    """Occlusion of every texel by points in its ball (VO's V(P) with rho = 1, section 4, by sums of points).

    A point is hidden where the surface that its texel shows lies before it, z_Q < z_S, by no more than the surface is
    thick (4.3). With ``ball.tangent`` a point below the tangent plane is reflected by it (4.4). The weights of the
    hidden points are added from the first to the last. Parameters are those of ``line_occlusion``, with a Ball.
    """
    size, fractions, offsets = occlusion.shape, occlusion.reshape(-1), ball.offsets
    width = size[1]
    ends = transform_offsets(offsets, Projection(MATRIX, seen.rows), turns)
    slots, missed = frame.frame_slots(fractions.dtype), scratch(np.int32)
    for j in range(begin, stop):
        outside[j] = 0
        for chunk in range(0, width, CHUNK):
            first, n = frame.chunk_span(seen.depth, j * width + chunk, min(CHUNK, width - chunk), fractions)
            start_reflections(seen, radius, ball, j, first, n, slots)
            start_reach(seen, radius, thickness, first, n, slots)
            frame.start_points(seen, first, n, missed, slots)
            for s in range(offsets.shape[0]):
                place_in_ball(ends, radius, offsets, s, turns, first, n, slots)
                frame.project(seen.kind, seen.lens, n, slots)
                add_point(seen.depth, size, ball.weights[s], n, missed, slots)
            outside[j] += frame.finish_chunk(first, n, 1, missed, slots, fractions)
