"""The ball around each visible point in the frame of its viewing direction, and where places in it land in the image.

Estimators that integrate over a ball along the line of sight (VO section 4, horizons) share this. P is a texel's
point, w the unit direction in which the texel looks (away from the viewer), R the radius. A place in the ball is

    P + R (x e1 + y e2 + t w),   e1, e2, w orthonormal, x, y, t in the unit ball's coordinates

e1 is the view's rightward direction made orthogonal to w, e2 = w x e1 (down, where the world is not mirrored). Both
are then reflected in the disk's plane about a direction that differs from texel to texel (VO section 4.5):

    e1' = c e1 + s e2,  e2' = s e1 - c e2,  (c, s) = (cos, sin) of twice the angle of that direction from e1

Depth is z of cast space (``optics.kernels.rays``), affine in world space: physical z of a display, eye z of a camera.
The surface that texel Q shows is met by the line P + R (x e1 + y e2) + t R w at

    t = (z_Q - z_S) / (R w_z),   S = P + R (x e1 + y e2), Q the texel that S lands in, w_z the z component of w

which takes one look-up, is exact in parallel projection and for surfaces at constant z, and elsewhere takes the ray
of Q to be parallel to that of P. It is VO's d_r, depth 'mapped into the unit sphere's coordinate system'.

The mapping is handed in as ``rows``, four affine rows of world space (u-row, v-row, divisor, cast z), and what
``lens`` holds for its kind: z_m, z_o, u_0, v_0 for CROSSED_SLITS, the module's 32 numbers for DISPLAY, nothing for
MATRIX. The u- and v-row are those of ``lfssao.optics.kernels.projection``; the divisor's is read for MATRIX alone.

Kernels work through a row of texels in chunks. ``scratch`` is one array of SLOTS * CHUNK numbers, slot k of texel i at
``slot(k, i)``: with constant distances between the slots LLVM sees that they do not overlap, and makes vectors. For
the same reason interleaved triples are copied into slots first, by loops that do nothing else.
"""

import numpy as np

from lfssao.core.jit import kernel
from lfssao.optics.kernels.display import VALID, display_module, physical_to_image
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX, affine_row, linear_row

CHUNK = 256
TILE = 4  # texels; the random reflections repeat in squares of 4 x 4 (Mittring 2007); divides CHUNK

# Slots. Of those of four numbers k + 0 to k + 3 are the mapping's rows, of those of three x, y and z.
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

# A normal this near to edge-on, or turned away from the viewer, counts as this near: the plane's slope stays finite.
EDGE_ON = 2.0**-20


@kernel(inline=True)
def slot(k, i):
    """Where slot k of texel i of a chunk is."""
    return np.uint64(k * CHUNK) + np.uint64(i)


@kernel(inline=True)
def load(triples, first, n, scratch, k):
    """Copy n triples of an array (3 N,), from number ``first`` on, into slots k, k + 1 and k + 2.

    Of one flat array, 3 t + k, LLVM takes them apart with shuffles; of a second index it makes gathers. (``load_row``
    of ``kernels.rows`` does the same for loops whose rows are longer than a chunk, where slots have no constant
    distance.)
    """
    for i in range(n):
        t = np.uint64(3) * (np.uint64(first) + np.uint64(i))
        scratch[slot(k, i)] = triples[t]
        scratch[slot(k + 1, i)] = triples[t + np.uint64(1)]
        scratch[slot(k + 2, i)] = triples[t + np.uint64(2)]


@kernel(inline=True)
def chunk_span(depth, first, n, occlusion):
    """Of n texels, those from the first that sees a surface to the last; the occlusion of the others is written, 0.

    Parameters
    ----------
    depth : (N,) array
        +infinity where there is no surface.
    first : uint64
        Number of the first texel.
    n : int
        How many texels.
    occlusion : (N,) array
        Out.

    Returns
    -------
    start, length : int
        How many texels come before, a multiple of TILE, and how many there are.
    """
    start, end = 0, n
    while start < n and not depth[first + np.uint64(start)] < np.inf:
        start += 1
    while end > start and not depth[first + np.uint64(end - 1)] < np.inf:
        end -= 1
    start -= start % TILE
    for k in range(start):
        occlusion[first + np.uint64(k)] = 0
    for k in range(end, n):
        occlusion[first + np.uint64(k)] = 0
    return start, max(end - start, 0)


@kernel(inline=True)
def map_rows(rows, scale, x, y, z, scratch, k, i):
    """Scale times the mapping's four linear rows of (x, y, z), into slots k to k + 3."""
    scratch[slot(k, i)] = scale * linear_row(rows, 0, x, y, z)
    scratch[slot(k + 1, i)] = scale * linear_row(rows, 1, x, y, z)
    scratch[slot(k + 2, i)] = scale * linear_row(rows, 2, x, y, z)
    scratch[slot(k + 3, i)] = scale * linear_row(rows, 3, x, y, z)


@kernel(inline=True)
def start_points(rows, places, first, n, scratch):
    """POINT: the mapping's rows of n positions from texel number ``first`` on; PLACE is overwritten."""
    load(places, first, n, scratch, PLACE)
    for i in range(n):
        x, y, z = scratch[slot(PLACE, i)], scratch[slot(PLACE + 1, i)], scratch[slot(PLACE + 2, i)]
        scratch[slot(POINT, i)] = affine_row(rows, 0, x, y, z)
        scratch[slot(POINT + 1, i)] = affine_row(rows, 1, x, y, z)
        scratch[slot(POINT + 2, i)] = affine_row(rows, 2, x, y, z)
        scratch[slot(POINT + 3, i)] = affine_row(rows, 3, x, y, z)


@kernel(inline=True)
def start_frames(rows, right, radius, turns, phase, depth, looks, first, n, scratch):
    """LOOK, E1, E2, FIRST, SECOND and STEEP of n texels from texel number ``first`` on.

    Parameters
    ----------
    rows : (16,) array
        The mapping's four affine rows.
    right : (3,) array
        The view's rightward direction, world space, any length but 0.
    radius : scalar
        R, world units.
    turns : (2, TILE, CHUNK) array
        c and s of the reflections, for each phase and column.
    phase : uint64
        Number of the row in its tile.
    depth : (N,) array
        Cast z; +infinity where there is no surface.
    looks : (3 N,) array
        Viewing directions, world space.
    first : uint64
        Number of the first texel.
    n : int
        How many texels.
    scratch : (SLOTS * CHUNK,) array
        Out.
    """
    zero, one, nothing = type(radius)(0), type(radius)(1), type(radius)(np.nan)
    rx, ry, rz = right[0], right[1], right[2]
    load(looks, first, n, scratch, LOOK)
    for i in range(n):
        wx, wy, wz = scratch[slot(LOOK, i)], scratch[slot(LOOK + 1, i)], scratch[slot(LOOK + 2, i)]
        along = (rx * wx + ry * wy) + rz * wz
        ax, ay, az = rx - along * wx, ry - along * wy, rz - along * wz
        scale = one / np.sqrt((ax * ax + ay * ay) + az * az)
        ax, ay, az = ax * scale, ay * scale, az * scale
        bx, by, bz = wy * az - wz * ay, wz * ax - wx * az, wx * ay - wy * ax
        c, s = turns[0, phase, i], turns[1, phase, i]
        ex, ey, ez = c * ax + s * bx, c * ay + s * by, c * az + s * bz
        fx, fy, fz = s * ax - c * bx, s * ay - c * by, s * az - c * bz
        scratch[slot(E1, i)], scratch[slot(E1 + 1, i)], scratch[slot(E1 + 2, i)] = ex, ey, ez
        scratch[slot(E2, i)], scratch[slot(E2 + 1, i)], scratch[slot(E2 + 2, i)] = fx, fy, fz
        map_rows(rows, radius, ex, ey, ez, scratch, FIRST, i)
        map_rows(rows, radius, fx, fy, fz, scratch, SECOND, i)
        deep = linear_row(rows, 3, wx, wy, wz)
        deep = radius * deep
        seen = (depth[first + np.uint64(i)] < np.inf) & (deep > zero)
        scratch[slot(STEEP, i)] = one / deep if seen else nothing


@kernel(inline=True)
def start_slopes(tangent, normals, first, n, scratch, edge_on):
    """SLOPES: the plane n . (x e1' + y e2' + t w) = 0 as t = x slope_1 + y slope_2 + lift, or t = +infinity."""
    if not tangent:
        for i in range(n):
            scratch[slot(SLOPES, i)] = edge_on - edge_on
            scratch[slot(SLOPES + 1, i)] = edge_on - edge_on
            scratch[slot(SLOPES + 2, i)] = type(edge_on)(np.inf)
        return
    load(normals, first, n, scratch, SLOPES)
    for i in range(n):
        x, y, z = scratch[slot(SLOPES, i)], scratch[slot(SLOPES + 1, i)], scratch[slot(SLOPES + 2, i)]
        wx, wy, wz = scratch[slot(LOOK, i)], scratch[slot(LOOK + 1, i)], scratch[slot(LOOK + 2, i)]
        ex, ey, ez = scratch[slot(E1, i)], scratch[slot(E1 + 1, i)], scratch[slot(E1 + 2, i)]
        fx, fy, fz = scratch[slot(E2, i)], scratch[slot(E2 + 1, i)], scratch[slot(E2 + 2, i)]
        towards = -((x * wx + y * wy) + z * wz)
        towards = towards if towards > edge_on else edge_on
        scratch[slot(SLOPES, i)] = ((x * ex + y * ey) + z * ez) / towards
        scratch[slot(SLOPES + 1, i)] = ((x * fx + y * fy) + z * fz) / towards
        scratch[slot(SLOPES + 2, i)] = edge_on - edge_on


@kernel(inline=True)
def place_on_disk(n, x, y, scratch):
    """The mapping's rows of the place (x, y) of each texel's disk, (P + x R e1') + y R e2', into PLACE."""
    for i in range(n):
        for k in range(4):
            along = scratch[slot(POINT + k, i)] + x * scratch[slot(FIRST + k, i)]
            scratch[slot(PLACE + k, i)] = along + y * scratch[slot(SECOND + k, i)]


@kernel(inline=True)
def project(kind, lens, n, scratch):
    """PLACE in place: the mapping's rows become u, v and (in the fourth slot) cast z; u is NaN where there is no image.

    As ``project_crossed_slits`` and ``project_matrix``, but for the truth value (``mapping.hold_inside`` says why).
    """
    if kind == CROSSED_SLITS:
        z_module, z_observer, u_0, v_0 = lens[0], lens[1], lens[2], lens[3]
        for i in range(n):
            z = scratch[slot(PLACE + 3, i)]
            u = u_0 + scratch[slot(PLACE, i)] / (z_module - z)
            scratch[slot(PLACE, i)] = u if (z < z_module) & (z > z_observer) else type(z)(np.nan)
            scratch[slot(PLACE + 1, i)] = v_0 + scratch[slot(PLACE + 1, i)] / (z_observer - z)
    elif kind == MATRIX:
        for i in range(n):
            q = scratch[slot(PLACE + 2, i)]
            u = scratch[slot(PLACE, i)] / q
            scratch[slot(PLACE, i)] = u if q > type(q)(0) else type(q)(np.nan)
            scratch[slot(PLACE + 1, i)] = scratch[slot(PLACE + 1, i)] / q
    else:
        d = display_module(lens)
        for i in range(n):
            z = scratch[slot(PLACE + 3, i)]
            u, v, answer = physical_to_image(d, scratch[slot(PLACE, i)], scratch[slot(PLACE + 1, i)], z)
            scratch[slot(PLACE, i)] = u if answer == VALID else type(z)(np.nan)
            scratch[slot(PLACE + 1, i)] = v
