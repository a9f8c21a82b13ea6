"""SAO's sampling pass: taps of a turned spiral in the z hierarchy (SAO section 2.3, equations 5 to 10 and 1; appendix).

Lengths are in radii, u = v / r, so that nothing depends on the scene's unit. Order of operations, for one texel:

    tap          (x, y) = (x', y') + (h_u cos, h_v sin), the texel's turn applied to the table's cos and sin; the two
                 products may be rounded to whole numbers first (``landed``)
    Q            the texel's ray (sao.kernels.reconstruct) at the hierarchy's z, moved to world space
    u            (Q - C) / r as a product with 1 / r; u.u = (x x + y y) + z z, u.n likewise
    term         f ((u.n - bias) / (u.u + epsilon)), f = ((1 - u.u)^2) (1 - u.u) or 1; only positive parts count
    A            max(0, 1 - scale * sum of the terms from the first tap to the last)

Texels of a row that see a surface are gathered into slots; they are the inner loop and taps the outer one.
"""

from typing import NamedTuple

import numpy as np

from lfssao.ao.estimators.sao.kernels.reconstruct import SEPARABLE, TABLE, ray_point, table_point
from lfssao.ao.kernels.spans import CHUNK, slot
from lfssao.core.elementary import power
from lfssao.core.intrinsics import on_the_stack, scratch
from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import linear_row
from lfssao.samples.kernels.spiral import rotated, summed_angle, unit_of

# A screen radius is held below 2**20 texels: every tap that leaves a texture does so too then, and integers hold it.
_FAR = 1048576.0

# Slots of a texel.
_COSINE, _SINE = 0, 1
_C = 2  # its point, world space: x, y, z
_N = 5  # its normal: x, y, z
_LESS = 8  # what is taken off u.n
_ACROSS, _DOWN = 9, 10  # h_u and h_v of a tap at the spiral's end
_TOTAL = 11
_slots = on_the_stack(12 * CHUNK)


class Surface(NamedTuple):
    """The texels' surface: z of cast space; C and n, world space, (H, W, 3); turns, (2, H W); one dtype."""

    z: np.ndarray
    positions: np.ndarray
    normals: np.ndarray
    turns: np.ndarray


class Hierarchy(NamedTuple):
    """Levels of z one after the other, level l (W + 2**l - 1) >> l wide; where each begins, int32; log2 of q'."""

    z: np.ndarray
    first: np.ndarray
    log_q: int


class Falloff(NamedTuple):
    """Numbers of a term, scalars of the arithmetic's dtype.

    reach_u, reach_v: the radius in units of cast space, across and down (r in world units for rays in a TABLE).
    inverse: 1 / r. cubed: 1 for the appendix's falloff, 0 for equation 1. bias, depth_bias: u.n less bias + depth_bias
    (z - origin), in radii.
    """

    reach_u: np.floating
    reach_v: np.floating
    inverse: np.floating
    cubed: np.floating
    bias: np.floating
    depth_bias: np.floating
    epsilon: np.floating
    scale: np.floating


@kernel(inline=True)
def mip_level(h, log_q, top):
    """Equation 9: clamp(findMSB(int(h)) - log_q, 0, top), int32, 0 <= h <= 2**21, by the exponent of a float32."""
    level = (np.float32(np.int32(h)).view(np.int32) >> np.int32(23)) - np.int32(127) - log_q
    return min(top, max(np.int32(0), level))


@kernel(inline=True)
def texel_lengths(rays, depth, i, j, width, height):
    """Lengths across and down of texel (i, j) at one depth.

    SEPARABLE rays: |b + z d|, cast space; equation 5's z / S' of a camera. TABLE: distances in world space from its ray
    to the next texel's across and down (the one before it at the end of a row or column, 0 where it is alone).
    """
    if rays.kind == SEPARABLE:
        m = rays.numbers
        return abs(m[2] + depth * m[4]), abs(m[7] + depth * m[9])
    here = j * width + i
    right = here + 1 if i + 1 < width else here - min(i, 1)
    below = here + width if j + 1 < height else here - width * min(j, 1)
    return ray_gap(rays, depth, here, right), ray_gap(rays, depth, here, below)


@kernel(inline=True)
def ray_gap(rays, depth, one, other):
    """Distance in world space between two texels' rays at one depth."""
    table, m, zero = rays.table, rays.world, type(depth)(0)
    x = (table[0, other] - table[0, one]) + depth * (table[1, other] - table[1, one])
    y = (table[2, other] - table[2, one]) + depth * (table[3, other] - table[3, one])
    a, b, c = linear_row(m, 0, x, y, zero), linear_row(m, 1, x, y, zero), linear_row(m, 2, x, y, zero)
    return type(depth)(np.sqrt((a * a + b * b) + c * c))


@kernel(inline=True)
def landed(offset, landing):
    """An offset in texels as it is (None), cut towards 0 (0), or the nearest whole number (1)."""
    if landing is None:
        return offset
    return np.floor(offset + type(offset)(0.5)) if landing == 1 else np.trunc(offset)


@kernel(inline=True)
def tap_place(x, y, h, width, wide, high, bits, top):
    """Equations 9 and 10: the texel of the hierarchy that a tap at (x, y), h texels from its own, reads.

    bits, top: log2 of q', the last level; wide, high: the texture's size in x's dtype. Returns whether the tap lies in
    the texture (if not it is moved to its border), its column and row, the level, and the texel's place in it, int32.
    """
    zero, one = type(wide)(0), type(wide)(1)
    inside = (x >= zero) & (x < wide) & (y >= zero) & (y < high)
    x, y = min(wide - one, max(zero, x)), min(high - one, max(zero, y))
    column, row = np.int32(x), np.int32(y)
    level = mip_level(h, bits, top)
    span = np.int32(np.int32(width + np.int32(np.int32(1) << level)) - np.int32(1)) >> level
    place = np.int32(np.int32(np.int32(row >> level) * np.int32(span)) + np.int32(column >> level))
    return inside, column, row, level, place


@kernel(inline=True)
def tap_term(a, b, c, nx, ny, nz, less, falloff):
    """F max(u.n - less, 0) / (u.u + epsilon) of u = (a, b, c), f = (1 - u.u)^3 or 1; 0 where that is no number."""
    zero, one = type(a)(0), type(a)(1)
    square = (a * a + b * b) + c * c
    above = ((a * nx + b * ny) + c * nz) - less
    left = one - falloff.cubed * square
    term = ((left * left) * left) * (above / (square + falloff.epsilon))
    return term if (above > zero) & (left > zero) & (term > zero) else zero


@kernel(inline=True)
def add_taps(kind, hierarchy, taps, landing, angles, rays, falloff, size, row, n, columns, values):
    """Sum all taps of n texels of a row, kind a constant, size (height, width); return how many are outside."""
    total, missed, m, width = scratch(values.dtype), scratch(np.int32), rays.world, np.int32(size[1])
    dtype = values.dtype.type
    wide, high, zero = dtype(size[1]), dtype(size[0]), dtype(0)
    z, first = hierarchy.z, hierarchy.first
    top, bits = np.int32(first.shape[0] - 1), np.int32(hierarchy.log_q)
    for i in range(n):
        total[i], missed[i] = zero, 0
    for s in range(taps.shape[0]):
        tap_x, tap_y, alpha = taps[s, 0], taps[s, 1], taps[s, 2]
        if angles is not None:
            tap_x, tap_y = dtype(1), zero
            for i in range(n):
                sine, cosine = unit_of(summed_angle(columns[i], row, angles[s]))
                values[slot(_COSINE, i)], values[slot(_SINE, i)] = cosine, sine
        for i in range(n):
            u, v = rotated(tap_x, tap_y, values[slot(_COSINE, i)], values[slot(_SINE, i)])
            across, down = values[slot(_ACROSS, i)] * alpha, values[slot(_DOWN, i)] * alpha
            x, y = dtype(columns[i]) + landed(across * u, landing), dtype(row) + landed(down * v, landing)
            h = across if across > down else down
            inside, column, line, level, place = tap_place(x, y, h, width, wide, high, bits, top)
            depth = z[np.uint32(first[np.uint32(level)] + place) & np.uint32(0x7FFFFFFF)]
            if kind == SEPARABLE:
                x, y = ray_point(rays.numbers, column, line, depth)
            else:
                texel = np.uint32(np.int32(np.int32(line * width) + column)) & np.uint32(0x7FFFFFFF)
                x, y = table_point(rays.table, texel, depth)
            a = ((((m[0] * x + m[1] * y) + m[2] * depth) + m[3]) - values[slot(_C, i)]) * falloff.inverse
            b = ((((m[4] * x + m[5] * y) + m[6] * depth) + m[7]) - values[slot(_C + 1, i)]) * falloff.inverse
            c = ((((m[8] * x + m[9] * y) + m[10] * depth) + m[11]) - values[slot(_C + 2, i)]) * falloff.inverse
            nx, ny, nz = values[slot(_N, i)], values[slot(_N + 1, i)], values[slot(_N + 2, i)]
            term = tap_term(a, b, c, nx, ny, nz, values[slot(_LESS, i)], falloff)
            itself = (column == columns[i]) & (line == row)
            total[i] += term if inside & (depth < np.inf) & (not itself) else zero
            missed[i] += np.int32(not inside)
    outside = 0
    for i in range(n):
        values[slot(_TOTAL, i)] = total[i]
        outside += missed[i]
    return outside


@kernel
def add_separable_taps(hierarchy, taps, landing, angles, rays, falloff, size, row, n, columns, values):
    """``add_taps`` of SEPARABLE rays; a function of its own, as LLVM makes vectors of one of two such loops only."""
    return add_taps(SEPARABLE, hierarchy, taps, landing, angles, rays, falloff, size, row, n, columns, values)


@kernel
def add_table_taps(hierarchy, taps, landing, angles, rays, falloff, size, row, n, columns, values):
    """``add_taps`` of rays in a TABLE."""
    return add_taps(TABLE, hierarchy, taps, landing, angles, rays, falloff, size, row, n, columns, values)


@kernel(inline=True)
def gather_texels(surface, rays, falloff, row, left, columns, values):
    """Copy the texels of a row that see a surface, among CHUNK from column ``left`` on, to slots; return how many."""
    height, width = surface.z.shape
    origin, far, n = values.dtype.type(rays.origin), values.dtype.type(_FAR), 0
    for i in range(left, min(left + CHUNK, width)):
        z = surface.z[row, i]
        if z < np.inf:
            columns[n] = i
            texel = np.uint64(row) * np.uint64(width) + np.uint64(i)
            values[slot(_COSINE, n)], values[slot(_SINE, n)] = surface.turns[0, texel], surface.turns[1, texel]
            for k in range(3):
                values[slot(_C + k, n)] = surface.positions[row, i, k]
                values[slot(_N + k, n)] = surface.normals[row, i, k]
            values[slot(_LESS, n)] = falloff.bias + falloff.depth_bias * (z - origin)
            across, down = texel_lengths(rays, z, i, row, width, height)
            # Equation 5: texels in a radius, from it and a texel's length in one unit; of 0 / 0 the largest.
            values[slot(_ACROSS, n)] = min(far, falloff.reach_u / across)
            values[slot(_DOWN, n)] = min(far, falloff.reach_v / down)
            n += 1
    return n


@kernel(rows="visibility")
def scalable_visibility(begin, stop, surface, hierarchy, taps, landing, angles, rays, falloff, visibility, outside):
    """A of every texel by the appendix's falloff or equation 1, before averaging.

    Readings. Equation 10 is the hierarchy's texel ((x', y') + h_i u_i) >> m_i, its '/ 2^m' the shift, h_i is h'_i and
    a coordinate is cut down to a whole number; the position is rebuilt at the unshifted texel. A tap outside the
    texture contributes nothing and is counted, one that sees no surface contributes nothing, and neither does one on
    the texel itself: v is 0 there, and on a module, whose C is read from the positions texture, rounding is not. On a
    module the ball's image is an ellipse: h is h_u across and h_v down, and the larger one chooses the level.

    taps: (s, 3), by ``lfssao.samples.kernels.spiral.unit_taps``. landing: that of ``landed``. angles: None, or of taps,
    (s,) float32, that the common hash is added to in float32, in place of the surface's turns. visibility: (H, W), out,
    A, 1 where there is no surface. outside: (H,), out: taps of each row that lie outside the texture.
    """
    height, width = visibility.shape
    dtype = visibility.dtype.type
    zero, one, size = dtype(0), dtype(1), (height, width)
    columns, values = scratch(np.int32), _slots(visibility.dtype)
    for j in range(begin, stop):
        missed = 0
        visibility[j, :] = one
        for left in range(0, width, CHUNK):
            n = gather_texels(surface, rays, falloff, j, left, columns, values)
            if rays.kind == SEPARABLE:
                missed += add_separable_taps(
                    hierarchy, taps, landing, angles, rays, falloff, size, j, n, columns, values
                )
            else:
                missed += add_table_taps(hierarchy, taps, landing, angles, rays, falloff, size, j, n, columns, values)
            for i in range(n):
                visibility[j, columns[i]] = max(zero, one - falloff.scale * values[slot(_TOTAL, i)])
        outside[j] = missed


@kernel(rows="z")
def occlusion_of(begin, stop, visibility, z, k, occlusion):
    """1 - A^k, A^k in float64 (lfssao.core.elementary) rounded once; 0 where there is no surface. (H, W), k float64."""
    width = z.shape[1]
    for j in range(begin, stop):
        one, zero = z.dtype.type(1), z.dtype.type(0)
        if k == 1.0:  # as power has it, but in vectors
            for i in range(width):
                a = one - visibility[j, i]
                occlusion[j, i] = a if z[j, i] < np.inf else zero
        else:
            for i in range(width):
                a = z.dtype.type(power(np.float64(visibility[j, i]), k))
                occlusion[j, i] = one - a if z[j, i] < np.inf else zero
