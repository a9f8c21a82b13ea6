"""The ball around each visible point in the frame of its viewing direction, and the image of places in it.

Estimators that integrate over a ball along the line of sight (VO section 4, horizons) share this. P is a texel's
point, w the unit direction in which the texel looks (away from the viewer), R the radius. A place in the ball is

    P + R (x e1 + y e2 + t w),   e1, e2, w orthonormal, x, y, t in the unit ball's coordinates

e1 is the view's rightward direction made orthogonal to w, e2 = w x e1 (down, where the world is not mirrored). Both
are then reflected in the disk's plane about a direction that differs from texel to texel (VO section 4.5):

    e1' = c e1 + s e2,  e2' = s e1 - c e2,  (c, s) = (cos, sin) of twice the angle of that direction from e1

Places that turn by an angle of cosine C and sine S before that have c C + s S in place of c and s C - c S of s.

Depth is z of cast space (``optics.kernels.rays``), affine in world space: physical z of a display, eye z of a camera.
The surface that texel Q shows is met by the line P + R (x e1 + y e2) + t R w at

    t = (z_Q - z_S) / (R w_z),   S = P + R (x e1 + y e2), Q the texel that S lands in, w_z the z component of w

which takes one look-up. It is exact in parallel projection and for surfaces at constant z; elsewhere it takes the ray
of Q to be parallel to that of P. It is VO's d_r, depth 'mapped into the unit sphere's coordinate system'.

Kernels work through a row of texels in chunks; what belongs to a texel is in slots (``ao.kernels.spans``).
"""

from typing import NamedTuple

import numpy as np

from lfssao.ao.kernels.spans import CHUNK, load, slot
from lfssao.core.intrinsics import on_the_stack
from lfssao.core.jit import kernel
from lfssao.optics.kernels.display import VALID, display_module, physical_to_image
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX, affine_row, linear_row

TILE = 4  # texels; the random reflections repeat in squares of 4 x 4 (Mittring 2007); divides CHUNK

# Slots: four numbers k + 0 to k + 3 are the mapping's rows, three are x, y and z.
POINT = 0  # the rows of P
FIRST = 4  # the linear rows of R e1'
SECOND = 8  # of R e2'
STEEP = 12  # 1 / (R w_z); NaN for a texel that sees nothing and where R w_z is 0: its occlusion is 0
SLOPES = 13  # the tangent plane t = x slope_1 + y slope_2 + lift; lift is +infinity where it is not wanted
PLACE = 16  # a place: the mapping's rows, after ``project`` u, v, nothing, cast z
TOTAL = 20  # what the estimator sums
LOOK = 21  # w
E1 = 24  # e1'
E2 = 27  # e2'
SLOTS = 30
frame_slots = on_the_stack(SLOTS * CHUNK)

# A normal this near to edge-on, or turned away from the viewer, counts as this near: the plane's slope stays finite.
EDGE_ON = 2.0**-20


class SeenSurface(NamedTuple):
    """A view as kernels read it, arrays of the arithmetic's dtype, textures row by row.

    depth: (H * W,), cast z, +infinity where there is no surface. positions, directions, normals: (3 * H * W,), world
    coordinates, unit viewing directions, unit normals towards the viewer (the positions again where there are none).
    kind: that of the mapping. rows: (16,), four affine rows of world space, u, v, divisor (of MATRIX alone), cast z.
    lens: z_m, z_o, u_0, v_0 for CROSSED_SLITS, the module's 32 numbers for DISPLAY. right: (3,), the view's rightward
    direction, world space.
    """

    depth: np.ndarray
    positions: np.ndarray
    directions: np.ndarray
    normals: np.ndarray
    kind: int
    rows: np.ndarray
    lens: np.ndarray
    right: np.ndarray


class Disk(NamedTuple):
    """Samples of the unit disk, arrays of the arithmetic's dtype.

    places: (n, 2), x and y. half: (n,), z_s = sqrt(1 - x^2 - y^2). weights: (n,), of a unit of hidden length, so that a
    ball hidden whole (or half a ball, with the tangent plane) gives 1. finer: (n,) float64, half the log2 of each
    sample's fraction of the disk's area. mirrors: (2, TILE, CHUNK), c and s of the reflections of a tile. tangent:
    whether lines end at the tangent plane; else normals are not read.
    """

    places: np.ndarray
    half: np.ndarray
    weights: np.ndarray
    finer: np.ndarray
    mirrors: np.ndarray
    tangent: bool


@kernel(inline=True)
def chunk_span(depth, chunk, n, occlusion):
    """First texel, a multiple of TILE after ``chunk``, and number of those from the first surface to the last of n.

    The occlusion of the others is written, 0; depth and occlusion are flat.
    """
    start, end = 0, n
    while start < n and not depth[np.uint64(chunk + start)] < np.inf:
        start += 1
    while end > start and not depth[np.uint64(chunk + end - 1)] < np.inf:
        end -= 1
    start -= start % TILE
    for k in range(start):
        occlusion[np.uint64(chunk + k)] = 0
    for k in range(end, n):
        occlusion[np.uint64(chunk + k)] = 0
    return np.uint64(chunk + start), max(end - start, 0)


@kernel(inline=True)
def finish_chunk(first, n, count, missed, slots, occlusion):
    """Write TOTAL / count held in [0, 1], 0 where STEEP is NaN; return how many samples of other texels are outside."""
    zero, one, lost = occlusion.dtype.type(0), occlusion.dtype.type(1), 0
    for i in range(n):
        total = slots[slot(TOTAL, i)] / occlusion.dtype.type(count)
        seen = slots[slot(STEEP, i)] == slots[slot(STEEP, i)]
        occlusion[first + np.uint64(i)] = min(one, max(zero, total)) if seen else zero
        lost += missed[i] if seen else 0
    return lost


@kernel(inline=True)
def start_disks(seen, radius, mirrors, tangent, turns, j, first, n, missed, slots):
    """Frames, tangent planes, points and sums of n texels of row j from number ``first`` on."""
    start_frames(seen, radius, mirrors, turns, j, first, n, slots)
    start_slopes(tangent, seen.normals, first, n, slots)
    start_points(seen, first, n, missed, slots)


@kernel(inline=True)
def map_rows(rows, scale, x, y, z, slots, k, i):
    """Scale times the mapping's four linear rows of (x, y, z), into slots k to k + 3."""
    slots[slot(k, i)] = scale * linear_row(rows, 0, x, y, z)
    slots[slot(k + 1, i)] = scale * linear_row(rows, 1, x, y, z)
    slots[slot(k + 2, i)] = scale * linear_row(rows, 2, x, y, z)
    slots[slot(k + 3, i)] = scale * linear_row(rows, 3, x, y, z)


@kernel(inline=True)
def start_points(seen, first, n, missed, slots):
    """POINT: the mapping's rows of n positions from texel number ``first`` on; sums are 0, PLACE is overwritten."""
    load(seen.positions, first, n, slots, PLACE)
    for i in range(n):
        slots[slot(TOTAL, i)], missed[i] = 0, 0
        x, y, z = slots[slot(PLACE, i)], slots[slot(PLACE + 1, i)], slots[slot(PLACE + 2, i)]
        for k in range(4):
            slots[slot(POINT + k, i)] = affine_row(seen.rows, k, x, y, z)


@kernel(inline=True)
def start_frames(seen, radius, mirrors, turns, j, first, n, slots):
    """LOOK, E1, E2, FIRST, SECOND and STEEP of n texels of row j from number ``first`` on; mirrors: as of ``Disk``.

    turns: (2, H * W), cosines and sines.
    """
    zero, one, nothing = type(radius)(0), type(radius)(1), type(radius)(np.nan)
    rx, ry, rz = seen.right[0], seen.right[1], seen.right[2]
    phase = np.uint64(j % TILE)
    load(seen.directions, first, n, slots, LOOK)
    for i in range(n):
        wx, wy, wz = slots[slot(LOOK, i)], slots[slot(LOOK + 1, i)], slots[slot(LOOK + 2, i)]
        along = (rx * wx + ry * wy) + rz * wz
        ax, ay, az = rx - along * wx, ry - along * wy, rz - along * wz
        scale = one / np.sqrt((ax * ax + ay * ay) + az * az)
        ax, ay, az = ax * scale, ay * scale, az * scale
        bx, by, bz = wy * az - wz * ay, wz * ax - wx * az, wx * ay - wy * ax
        c, s = mirrors[0, phase, i], mirrors[1, phase, i]
        cosine, sine = turns[0, first + np.uint64(i)], turns[1, first + np.uint64(i)]
        c, s = c * cosine + s * sine, s * cosine - c * sine
        ex, ey, ez = c * ax + s * bx, c * ay + s * by, c * az + s * bz
        fx, fy, fz = s * ax - c * bx, s * ay - c * by, s * az - c * bz
        slots[slot(E1, i)], slots[slot(E1 + 1, i)], slots[slot(E1 + 2, i)] = ex, ey, ez
        slots[slot(E2, i)], slots[slot(E2 + 1, i)], slots[slot(E2 + 2, i)] = fx, fy, fz
        map_rows(seen.rows, radius, ex, ey, ez, slots, FIRST, i)
        map_rows(seen.rows, radius, fx, fy, fz, slots, SECOND, i)
        deep = radius * linear_row(seen.rows, 3, wx, wy, wz)
        there = (seen.depth[first + np.uint64(i)] < np.inf) & (deep > zero)
        slots[slot(STEEP, i)] = one / deep if there else nothing


@kernel(inline=True)
def start_slopes(tangent, normals, first, n, slots):
    """SLOPES: the plane n . (x e1' + y e2' + t w) = 0 as t = x slope_1 + y slope_2 + lift, or t = +infinity."""
    zero, edge_on = normals.dtype.type(0), normals.dtype.type(EDGE_ON)
    if not tangent:
        for i in range(n):
            slots[slot(SLOPES, i)], slots[slot(SLOPES + 1, i)] = zero, zero
            slots[slot(SLOPES + 2, i)] = normals.dtype.type(np.inf)
        return
    load(normals, first, n, slots, SLOPES)
    for i in range(n):
        x, y, z = slots[slot(SLOPES, i)], slots[slot(SLOPES + 1, i)], slots[slot(SLOPES + 2, i)]
        wx, wy, wz = slots[slot(LOOK, i)], slots[slot(LOOK + 1, i)], slots[slot(LOOK + 2, i)]
        ex, ey, ez = slots[slot(E1, i)], slots[slot(E1 + 1, i)], slots[slot(E1 + 2, i)]
        fx, fy, fz = slots[slot(E2, i)], slots[slot(E2 + 1, i)], slots[slot(E2 + 2, i)]
        towards = max(edge_on, -((x * wx + y * wy) + z * wz))
        slots[slot(SLOPES, i)] = ((x * ex + y * ey) + z * ez) / towards
        slots[slot(SLOPES + 1, i)] = ((x * fx + y * fy) + z * fz) / towards
        slots[slot(SLOPES + 2, i)] = zero


@kernel(inline=True)
def line_top(x, y, z_s, i, slots):
    """End of the line at (x, y) of texel i's disk: at the tangent plane or at z_s."""
    plane = (x * slots[slot(SLOPES, i)] + y * slots[slot(SLOPES + 1, i)]) + slots[slot(SLOPES + 2, i)]
    return plane if plane < z_s else z_s


@kernel(inline=True)
def place_on_disk(n, x, y, slots):
    """The mapping's rows of the place (x, y) of each texel's disk, (P + x R e1') + y R e2', into PLACE."""
    for i in range(n):
        for k in range(4):
            along = slots[slot(POINT + k, i)] + x * slots[slot(FIRST + k, i)]
            slots[slot(PLACE + k, i)] = along + y * slots[slot(SECOND + k, i)]


@kernel(inline=True)
def project(kind, lens, n, slots):
    """PLACE in place: the mapping's rows become u, v and (in the fourth slot) cast z; u is NaN where there is no image.

    As ``project_crossed_slits`` and ``project_matrix``, but for the truth value (``mapping.hold_inside`` says why).
    """
    if kind == CROSSED_SLITS:
        z_module, z_observer, u_0, v_0 = lens[0], lens[1], lens[2], lens[3]
        for i in range(n):
            z = slots[slot(PLACE + 3, i)]
            u = u_0 + slots[slot(PLACE, i)] / (z_module - z)
            slots[slot(PLACE, i)] = u if (z < z_module) & (z > z_observer) else type(z)(np.nan)
            slots[slot(PLACE + 1, i)] = v_0 + slots[slot(PLACE + 1, i)] / (z_observer - z)
    elif kind == MATRIX:
        for i in range(n):
            q = slots[slot(PLACE + 2, i)]
            u = slots[slot(PLACE, i)] / q
            slots[slot(PLACE, i)] = u if q > type(q)(0) else type(q)(np.nan)
            slots[slot(PLACE + 1, i)] = slots[slot(PLACE + 1, i)] / q
    else:
        d = display_module(lens)
        for i in range(n):
            z = slots[slot(PLACE + 3, i)]
            u, v, answer = physical_to_image(d, slots[slot(PLACE, i)], slots[slot(PLACE + 1, i)], z)
            slots[slot(PLACE, i)] = u if answer == VALID else type(z)(np.nan)
            slots[slot(PLACE + 1, i)] = v
