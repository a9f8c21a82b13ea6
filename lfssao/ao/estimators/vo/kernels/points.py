"""VO sections 3 and 4 by points in the ball, as Crytek and Blizzard sample it (sections 4.1, 4.4 and 4.5)."""

import numpy as np
from numba import prange

from lfssao.ao.estimators.vo.kernels.local_frame import (
    CHUNK,
    PLACE,
    POINT,
    SLOTS,
    TILE,
    TOTAL,
    chunk_span,
    load,
    map_rows,
    project,
    slot,
    start_points,
)
from lfssao.ao.kernels.spans import ROWS_A_BLOCK
from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import hold_inside, last_below, linear_row, texel_number

# Slots of this kernel's own, in place of those of the disk's frame.
_MIRRORED = 4  # the linear rows of 2 R r, r the direction of reflection
_LIFTED = 8  # of 2 R n
_REACH = 12  # z_S - z_Q up to which the surface hides
_NORMAL = 13
_MIRROR = 21  # r
_ACROSS = 24  # 2 r . n


@kernel(inline=True)
def start_reflections(rows, radius, mirrors, phase, tangent, normals, first, n, scratch, zero):
    """The slots that turn an offset: first reflected about r, then, where it is below the surface, by the surface."""
    two_radii = radius + radius
    if tangent:
        load(normals, first, n, scratch, _NORMAL)
    else:
        for i in range(n):
            scratch[slot(_NORMAL, i)] = zero
            scratch[slot(_NORMAL + 1, i)] = zero
            scratch[slot(_NORMAL + 2, i)] = zero
    for i in range(n):
        rx, ry, rz = mirrors[0, phase, i], mirrors[1, phase, i], mirrors[2, phase, i]
        nx, ny, nz = scratch[slot(_NORMAL, i)], scratch[slot(_NORMAL + 1, i)], scratch[slot(_NORMAL + 2, i)]
        scratch[slot(_MIRROR, i)], scratch[slot(_MIRROR + 1, i)], scratch[slot(_MIRROR + 2, i)] = rx, ry, rz
        across = (rx * nx + ry * ny) + rz * nz
        scratch[slot(_ACROSS, i)] = across + across
        map_rows(rows, two_radii, rx, ry, rz, scratch, _MIRRORED, i)
        map_rows(rows, two_radii, nx, ny, nz, scratch, _LIFTED, i)


@kernel(inline=True)
def start_reach(rows, radius, thickness, looks, first, n, scratch):
    """How far in cast z a surface hides: T R w_z, or infinity, for which the directions are not read."""
    if not thickness < np.inf:
        for i in range(n):
            scratch[slot(_REACH, i)] = thickness
        return
    load(looks, first, n, scratch, PLACE)
    for i in range(n):
        x, y, z = scratch[slot(PLACE, i)], scratch[slot(PLACE + 1, i)], scratch[slot(PLACE + 2, i)]
        scratch[slot(_REACH, i)] = (thickness * radius) * linear_row(rows, 3, x, y, z)


@kernel(inline=True)
def place_in_ball(n, x, y, z, offset_u, offset_v, offset_q, offset_z, scratch, zero):
    """The mapping's rows of P + R o'' into PLACE, o'' the offset o = (x, y, z) after its reflections.

    o' = o - 2 (o . r) r; o'' = o' - 2 (o' . n) n where o' . n < 0; ``offset_*`` are the linear rows of R o.
    """
    for i in range(n):
        mirror = (x * scratch[slot(_MIRROR, i)] + y * scratch[slot(_MIRROR + 1, i)]) + z * scratch[slot(_MIRROR + 2, i)]
        above = (x * scratch[slot(_NORMAL, i)] + y * scratch[slot(_NORMAL + 1, i)]) + z * scratch[slot(_NORMAL + 2, i)]
        above = above - mirror * scratch[slot(_ACROSS, i)]
        lift = above if above < zero else zero
        for k, offset in ((0, offset_u), (1, offset_v), (2, offset_q), (3, offset_z)):
            turned = (scratch[slot(POINT + k, i)] + offset) - mirror * scratch[slot(_MIRRORED + k, i)]
            scratch[slot(PLACE + k, i)] = turned - lift * scratch[slot(_LIFTED + k, i)]


@kernel(parallel=True)
def point_occlusion(
    depth, positions, directions, normals, tangent, kind, rows, lens, radius, mirrors,
    ball, weights, thickness, occlusion, outside,
):  # fmt: skip
    """Occlusion of every texel by points in its ball (VO's V(P) with rho = 1, section 4, by sums of points).

    A point is hidden where the surface that its texel shows lies before it, z_Q < z_S, by no more than the surface is
    thick (4.3). With ``tangent`` a point below the tangent plane is reflected by it (4.4). The weights of the hidden
    points are added from the first to the last.

    Parameters
    ----------
    depth : (H, W) float32 or float64
        Cast z of the visible surface, +infinity where there is none.
    positions, directions, normals : (H, W, 3), same dtype
        World coordinates; unit viewing directions, read for a finite thickness; unit normals towards the viewer.
    tangent : bool
        Whether to reflect by the tangent plane; else the normals are not read.
    kind, rows, lens : int, (16,) and (4,) or (32,) same dtype
        The mapping (``lfssao.ao.estimators.vo.kernels.local_frame``).
    radius : scalar of the same dtype
        R, world units.
    mirrors : (3, TILE, CHUNK) same dtype
        Unit directions r by which the offsets are reflected, or (0, 0, 0) for none.
    ball, weights : (n, 3) and (n,) same dtype
        Offsets in the unit ball, world axes; their weights, which sum to 1.
    thickness : scalar of the same dtype
        T, in units of R; infinite: surfaces hide all that is behind them.
    occlusion : (H, W), same dtype
        Out: at most 1; 0 where there is no surface.
    outside : (H,) int64
        Out: points of each row that have no image or lie outside the texture; they are open.
    """
    height, width = depth.shape
    size = height * width
    surface, shares = depth.reshape(size), occlusion.reshape(size)
    places, looks, upright = positions.reshape(3 * size), directions.reshape(3 * size), normals.reshape(3 * size)
    dtype = type(radius)
    zero, one = dtype(0), dtype(1)
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
                phase = np.uint64(j % TILE)
                start_reflections(rows, radius, mirrors, phase, tangent, upright, first, n, scratch, zero)
                start_reach(rows, radius, thickness, looks, first, n, scratch)
                start_points(rows, places, first, n, scratch)
                for i in range(n):
                    scratch[slot(TOTAL, i)] = zero
                    missed[i] = 0
                for s in range(ball.shape[0]):
                    x, y, z_o, weight = ball[s, 0], ball[s, 1], ball[s, 2], weights[s]
                    place_in_ball(
                        n, x, y, z_o,
                        radius * linear_row(rows, 0, x, y, z_o), radius * linear_row(rows, 1, x, y, z_o),
                        radius * linear_row(rows, 2, x, y, z_o), radius * linear_row(rows, 3, x, y, z_o), scratch, zero,
                    )  # fmt: skip
                    project(kind, lens, n, scratch)
                    for i in range(n):
                        u, v = scratch[slot(PLACE, i)], scratch[slot(PLACE + 1, i)]
                        column_at, row_at = hold_inside(u, right_edge), hold_inside(v, bottom_edge)
                        inside = (column_at == u) & (row_at == v)
                        before = scratch[slot(PLACE + 3, i)] - surface[texel_number(column_at, row_at, width)]
                        hidden = inside & (before > zero) & (before <= scratch[slot(_REACH, i)])
                        scratch[slot(TOTAL, i)] += weight if hidden else zero
                        missed[i] += np.int32(not inside)
                for i in range(n):
                    seen = surface[first + np.uint64(i)] < np.inf
                    total = scratch[slot(TOTAL, i)]
                    total = total if total < one else one
                    shares[first + np.uint64(i)] = total if seen else zero
                    lost += missed[i] if seen else 0
            outside[j] = lost
