"""SAO's sampling pass: taps of a turned spiral in the z hierarchy (SAO section 2.3, equations 5 to 10 and 1; appendix).

Lengths are in radii, u = v / r, so that nothing depends on the scene's unit. Order of operations, for one texel:

    tap          (x, y) = (x', y') + (h_u cos, h_v sin), the hashed rotation applied to the table's cos and sin
    Q            the texel's line (sao.kernels.reconstruct) at the hierarchy's z, moved to world space
    u            (Q - C) / r as a product with 1 / r; u.u = (x x + y y) + z z, u.n likewise
    term         f ((u.n - bias) / (u.u + epsilon)), f = ((1 - u.u)^2) (1 - u.u) or 1; only positive parts count
    A            max(0, 1 - scale * sum of the terms from the first tap to the last)

Rows of texels are the inner loop and taps the outer one, so that LLVM makes vectors of neighbouring texels and gathers
of the look-ups; see lfssao.ao.kernels.ssao for why there are no views in it and why integers have the sizes they have.
"""

import numpy as np
from numba import prange

from lfssao.ao.estimators.sao.kernels.reconstruct import line_point
from lfssao.ao.kernels.spans import ROWS_A_BLOCK
from lfssao.core.elementary import sincospi
from lfssao.core.jit import kernel
from lfssao.core.power import power
from lfssao.optics.kernels.projection import linear_row
from lfssao.samples.kernels.spiral import hash_angle, rotated

# A screen radius is held below 2**20 texels: every tap that leaves a texture does so too then, and integers hold it.
_FAR = 1048576.0


@kernel(parallel=True)
def write_rotations(variant, rotations):
    """Cosine and sine of equation 8's angle at every texel, float64 rounded once; rotations: (2, H, W), out.

    variant: lfssao.samples.kernels.spiral.PAPER or COMMON.
    """
    for j in prange(rotations.shape[1]):
        for i in range(rotations.shape[2]):
            sine, cosine = sincospi(hash_angle(i, j, variant))
            rotations[0, j, i], rotations[1, j, i] = cosine, sine


@kernel(inline=True)
def mip_level(h, log_q, top):
    """Equation 9 as the paper computes it: clamp(findMSB(int(h)) - log_q, 0, top), int32, for 0 <= h <= 2**21.

    The most significant bit is the exponent of the whole number as a float32; findMSB(0) is negative.
    """
    level = (np.float32(np.int32(h)).view(np.int32) >> np.int32(23)) - np.int32(127) - log_q
    level = level if level > np.int32(0) else np.int32(0)
    return level if level < top else top


@kernel(inline=True)
def screen_radius(reach, length):
    """Equation 5: texels in a radius, from the radius and the length of a texel in one unit; at most 2**20.

    0 / 0, where a texel has no length and the ball none either, becomes that limit.
    """
    texels = reach / length
    limit = type(reach)(_FAR)
    return texels if texels < limit else limit


@kernel(inline=True)
def texel_lengths(lines, depth):
    """Lengths across and down of a texel at one depth, cast space: |b + z d|; equation 5's z / S' of a camera."""
    return abs(lines[2] + depth * lines[4]), abs(lines[7] + depth * lines[9])


@kernel(inline=True)
def line_gaps(table, m, depth, i, j, width, height):
    """The same for a TABLE, in world space: distances at one depth between a texel's line and its neighbours'.

    To the next texel across and down, the one before it at the end of a row or column; 0 where there is one only.
    """
    here = j * width + i
    right = here + 1 if i + 1 < width else here - min(i, 1)
    below = here + width if j + 1 < height else here - width * min(j, 1)
    return line_gap(table, m, depth, here, right), line_gap(table, m, depth, here, below)


@kernel(inline=True)
def line_gap(table, m, depth, one, other):
    """Distance in world space between two texels' lines at one depth."""
    x = (table[0, other] - table[0, one]) + depth * (table[1, other] - table[1, one])
    y = (table[2, other] - table[2, one]) + depth * (table[3, other] - table[3, one])
    zero = type(depth)(0)
    a, b, c = linear_row(m, 0, x, y, zero), linear_row(m, 1, x, y, zero), linear_row(m, 2, x, y, zero)
    return type(depth)(np.sqrt((a * a + b * b) + c * c))


@kernel(inline=True)
def tap_place(across, down, tap_x, tap_y, cosine, sine, i, j, wide, high, columns, bits, top):
    """Equations 6 to 10: where a tap of texel (i, j) looks.

    Parameters
    ----------
    across, down : scalars
        h_u and h_v.
    tap_x, tap_y, cosine, sine : scalars
        The tap's direction in the table, and the texel's rotation.
    i, j, wide, high : scalars of the same dtype
        The texel; width and height of the texture.
    columns, bits, top : int32
        The width, log2 of q', the last level.

    Returns
    -------
    inside : bool
        Whether the tap lies in the texture; if not it is moved to its border.
    column, line : int32
        Its texel.
    level, place : int32
        The level, and the texel's place in it.
    """
    zero, one = type(wide)(0), type(wide)(1)
    ux, uy = rotated(tap_x, tap_y, cosine, sine)
    x, y = i + across * ux, j + down * uy
    inside = (x >= zero) & (x < wide) & (y >= zero) & (y < high)
    x = x if x > zero else zero
    x = x if x < wide - one else wide - one
    y = y if y > zero else zero
    y = y if y < high - one else high - one
    column, line = np.int32(x), np.int32(y)
    level = mip_level(across if across > down else down, bits, top)
    span = np.int32(np.int32(columns + np.int32(np.int32(1) << level)) - np.int32(1)) >> level
    place = np.int32(np.int32(np.int32(line >> level) * np.int32(span)) + np.int32(column >> level))
    return inside, column, line, level, place


@kernel(inline=True)
def tap_term(a, b, c, nx, ny, nz, less, share, epsilon):
    """One term of the sum, of u = (a, b, c): f max(u.n - less, 0) / (u.u + epsilon) with f = (1 - share u.u)^3, or 0.

    What is not a number, u being infinite or all of it 0 / 0, is 0.
    """
    zero, one = type(a)(0), type(a)(1)
    square = (a * a + b * b) + c * c
    above = ((a * nx + b * ny) + c * nz) - less
    left = one - share * square
    term = ((left * left) * left) * (above / (square + epsilon))
    return term if (above > zero) & (left > zero) & (term > zero) else zero


@kernel(inline=True)
def take_taps(
    pyramid, first, taps, lines, m, inverse, log_q, share, epsilon, j, width, height,
    n, at, cosine, sine, cx, cy, cz, nx, ny, nz, less, h_u, h_v, total, missed,
):  # fmt: skip
    """All taps of row j's n surface texels, lines SEPARABLE; arrays as gather_row makes them."""
    wide, high, row = m.dtype.type(width), m.dtype.type(height), m.dtype.type(j)
    half, zero = m.dtype.type(0.5), m.dtype.type(0)
    top, bits, columns = np.int32(first.shape[0] - 1), np.int32(log_q), np.int32(width)
    m0, m1, m2, m3, m4, m5 = m[0], m[1], m[2], m[3], m[4], m[5]
    m6, m7, m8, m9, m10, m11 = m[6], m[7], m[8], m[9], m[10], m[11]
    u_c, u_a, u_b, u_d, u_e = lines[0], lines[1], lines[2], lines[3], lines[4]
    v_c, v_a, v_b, v_d, v_e = lines[5], lines[6], lines[7], lines[8], lines[9]
    for s in range(taps.shape[0]):
        tap_x, tap_y, alpha = taps[s, 0], taps[s, 1], taps[s, 2]
        for i in range(n):
            inside, column, line, level, place = tap_place(
                h_u[i] * alpha, h_v[i] * alpha, tap_x, tap_y, cosine[i], sine[i],
                m.dtype.type(at[i]), row, wide, high, columns, bits, top,
            )  # fmt: skip
            depth = pyramid[np.uint32(first[np.uint32(level)] + place) & np.uint32(0x7FFFFFFF)]
            x = line_point(u_c, u_a, u_b, u_d, u_e, m.dtype.type(column) + half, depth)
            y = line_point(v_c, v_a, v_b, v_d, v_e, m.dtype.type(line) + half, depth)
            a = ((((m0 * x + m1 * y) + m2 * depth) + m3) - cx[i]) * inverse
            b = ((((m4 * x + m5 * y) + m6 * depth) + m7) - cy[i]) * inverse
            c = ((((m8 * x + m9 * y) + m10 * depth) + m11) - cz[i]) * inverse
            term = tap_term(a, b, c, nx[i], ny[i], nz[i], less[i], share, epsilon)
            itself = (column == at[i]) & (line == j)
            total[i] += term if inside & (depth < np.inf) & (not itself) else zero
            missed[i] += np.int32(not inside)


@kernel(inline=True)
def take_taps_table(
    pyramid, first, taps, origin_x, slope_x, origin_y, slope_y, m, inverse, log_q, share, epsilon, j, width, height,
    n, at, cosine, sine, cx, cy, cz, nx, ny, nz, less, h_u, h_v, total, missed,
):  # fmt: skip
    """All taps of row j's texels, lines a TABLE; as take_taps."""
    wide, high, row = m.dtype.type(width), m.dtype.type(height), m.dtype.type(j)
    zero = m.dtype.type(0)
    top, bits, columns = np.int32(first.shape[0] - 1), np.int32(log_q), np.int32(width)
    m0, m1, m2, m3, m4, m5 = m[0], m[1], m[2], m[3], m[4], m[5]
    m6, m7, m8, m9, m10, m11 = m[6], m[7], m[8], m[9], m[10], m[11]
    for s in range(taps.shape[0]):
        tap_x, tap_y, alpha = taps[s, 0], taps[s, 1], taps[s, 2]
        for i in range(n):
            inside, column, line, level, place = tap_place(
                h_u[i] * alpha, h_v[i] * alpha, tap_x, tap_y, cosine[i], sine[i],
                m.dtype.type(at[i]), row, wide, high, columns, bits, top,
            )  # fmt: skip
            depth = pyramid[np.uint32(first[np.uint32(level)] + place) & np.uint32(0x7FFFFFFF)]
            tapped = np.uint32(np.int32(np.int32(line * columns) + column)) & np.uint32(0x7FFFFFFF)
            x = origin_x[tapped] + depth * slope_x[tapped]
            y = origin_y[tapped] + depth * slope_y[tapped]
            a = ((((m0 * x + m1 * y) + m2 * depth) + m3) - cx[i]) * inverse
            b = ((((m4 * x + m5 * y) + m6 * depth) + m7) - cy[i]) * inverse
            c = ((((m8 * x + m9 * y) + m10 * depth) + m11) - cz[i]) * inverse
            term = tap_term(a, b, c, nx[i], ny[i], nz[i], less[i], share, epsilon)
            itself = (column == at[i]) & (line == j)
            total[i] += term if inside & (depth < np.inf) & (not itself) else zero
            missed[i] += np.int32(not inside)


@kernel(inline=True)
def gather_row(
    depths, places, faces, turns, bias, depth_bias, origin, j, width, at, cosine, sine, cx, cy, cz, nx, ny, nz, less,
):  # fmt: skip
    """The texels of row j that see a surface, one after the other: column, rotation, C, n, bias; returns how many."""
    n = 0
    for i in range(width):
        texel = np.uint64(j * width + i)
        if depths[texel] < np.inf:
            at[n] = i
            cosine[n], sine[n] = turns[0, texel], turns[1, texel]
            cx[n], cy[n], cz[n] = places[texel, 0], places[texel, 1], places[texel, 2]
            nx[n], ny[n], nz[n] = faces[texel, 0], faces[texel, 1], faces[texel, 2]
            less[n] = bias + depth_bias * (depths[texel] - origin)
            n += 1
    return n


@kernel
def finish_row(start, width, n, at, scale, total, missed, visibility):
    """Write a row's A from its sums, 1 where there is no surface; return how many taps were outside."""
    zero, one = visibility.dtype.type(0), visibility.dtype.type(1)
    for texel in range(start, start + width):
        visibility[texel] = one
    outside = 0
    for i in range(n):
        left = one - scale * total[i]
        visibility[np.uint64(start + at[i])] = left if left > zero else zero
        outside += missed[i]
    return outside


@kernel(parallel=True)
def scalable_visibility(
    z, pyramid, first, positions, normals, rotations, taps, lines, m, reach_u, reach_v, inverse, log_q, share, bias,
    depth_bias, origin, epsilon, scale, visibility, outside,
):  # fmt: skip
    """A of every texel by the appendix's falloff or equation 1, before averaging; lines SEPARABLE.

    Readings. Equation 10 is the hierarchy's texel ((x', y') + h_i u_i) >> m_i, its '/ 2^m' the shift, h_i is h'_i and
    a coordinate is cut down to a whole number; the position is rebuilt at the unshifted texel. A tap outside the
    texture contributes nothing and is counted, one that sees no surface contributes nothing, and neither does one on
    the texel itself: v is 0 there, and on a module, whose C is read from the positions texture, rounding is not.

    On a module the ball's image is an ellipse: h is h_u across and h_v down, and the larger one chooses the level.

    Parameters
    ----------
    z : (H, W) float32 or float64
        z of cast space, +infinity where there is no surface.
    pyramid : (n,), same dtype
        The levels of the z hierarchy one after the other, level 0 first.
    first : (levels,) int32
        Place of each level's first texel; level l is (W + 2**l - 1) >> l texels wide.
    positions, normals : (H, W, 3), same dtype
        C and n, world space.
    rotations : (2, H, W), same dtype
        Of write_rotations.
    taps : (s, 3), same dtype
        Of lfssao.samples.kernels.spiral.unit_taps.
    lines, m : (10,), (12,), same dtype
        The texels' lines and the map to world space (lfssao.ao.estimators.sao.kernels.reconstruct).
    reach_u, reach_v : scalars of the same dtype
        The radius in units of cast space, across and down.
    inverse : scalar of the same dtype
        1 / r, world units.
    log_q : int
        log2 of q', equation 9.
    share : scalar of the same dtype
        1 for the appendix's falloff, (1 - u.u)^3; 0 for equation 1, which has none.
    bias, depth_bias, origin : scalars of the same dtype
        What is taken off u.n: bias + depth_bias (z - origin), in radii.
    epsilon, scale : scalars of the same dtype
        Of the order of operations above.
    visibility : (H, W), same dtype
        Out: A, 1 where there is no surface.
    outside : (H,) int64
        Out: taps of each row's surfaces that lie outside the texture.
    """
    height, width = z.shape
    depths, places, faces = z.reshape(-1), positions.reshape(height * width, 3), normals.reshape(height * width, 3)
    turns, out = rotations.reshape(2, height * width), visibility.reshape(-1)
    blocks = (height + ROWS_A_BLOCK - 1) // ROWS_A_BLOCK
    for block in prange(blocks):
        at, cosine, sine = np.empty(width, np.int32), np.empty(width, m.dtype), np.empty(width, m.dtype)
        cx, cy, cz = np.empty(width, m.dtype), np.empty(width, m.dtype), np.empty(width, m.dtype)
        nx, ny, nz = np.empty(width, m.dtype), np.empty(width, m.dtype), np.empty(width, m.dtype)
        h_u, h_v, less = np.empty(width, m.dtype), np.empty(width, m.dtype), np.empty(width, m.dtype)
        total, missed = np.empty(width, m.dtype), np.empty(width, np.int32)
        for j in range(block * ROWS_A_BLOCK, min(height, (block + 1) * ROWS_A_BLOCK)):
            n = gather_row(
                depths, places, faces, turns, bias, depth_bias, origin, j, width,
                at, cosine, sine, cx, cy, cz, nx, ny, nz, less,
            )  # fmt: skip
            for i in range(n):
                across, down = texel_lengths(lines, depths[np.uint64(j * width + at[i])])
                h_u[i], h_v[i] = screen_radius(reach_u, across), screen_radius(reach_v, down)
                total[i], missed[i] = 0, 0
            take_taps(
                pyramid, first, taps, lines, m, inverse, log_q, share, epsilon, j, width, height,
                n, at, cosine, sine, cx, cy, cz, nx, ny, nz, less, h_u, h_v, total, missed,
            )  # fmt: skip
            outside[j] = finish_row(j * width, width, n, at, scale, total, missed, out)


@kernel(parallel=True)
def scalable_visibility_table(
    z, pyramid, first, positions, normals, rotations, taps, table, m, reach_u, reach_v, inverse, log_q, share, bias,
    depth_bias, origin, epsilon, scale, visibility, outside,
):  # fmt: skip
    """As scalable_visibility, the texels' lines a TABLE, (4, H * W); reach_u and reach_v are r, world units.

    A kernel of its own, as LLVM makes vectors of one of the two loops only where both stand in one function.
    """
    height, width = z.shape
    depths, places, faces = z.reshape(-1), positions.reshape(height * width, 3), normals.reshape(height * width, 3)
    turns, out = rotations.reshape(2, height * width), visibility.reshape(-1)
    origin_x, slope_x, origin_y, slope_y = table[0], table[1], table[2], table[3]
    blocks = (height + ROWS_A_BLOCK - 1) // ROWS_A_BLOCK
    for block in prange(blocks):
        at, cosine, sine = np.empty(width, np.int32), np.empty(width, m.dtype), np.empty(width, m.dtype)
        cx, cy, cz = np.empty(width, m.dtype), np.empty(width, m.dtype), np.empty(width, m.dtype)
        nx, ny, nz = np.empty(width, m.dtype), np.empty(width, m.dtype), np.empty(width, m.dtype)
        h_u, h_v, less = np.empty(width, m.dtype), np.empty(width, m.dtype), np.empty(width, m.dtype)
        total, missed = np.empty(width, m.dtype), np.empty(width, np.int32)
        for j in range(block * ROWS_A_BLOCK, min(height, (block + 1) * ROWS_A_BLOCK)):
            n = gather_row(
                depths, places, faces, turns, bias, depth_bias, origin, j, width,
                at, cosine, sine, cx, cy, cz, nx, ny, nz, less,
            )  # fmt: skip
            for i in range(n):
                across, down = line_gaps(table, m, depths[np.uint64(j * width + at[i])], at[i], j, width, height)
                h_u[i], h_v[i] = screen_radius(reach_u, across), screen_radius(reach_v, down)
                total[i], missed[i] = 0, 0
            take_taps_table(
                pyramid, first, taps, origin_x, slope_x, origin_y, slope_y, m, inverse, log_q, share, epsilon, j, width,
                height, n, at, cosine, sine, cx, cy, cz, nx, ny, nz, less, h_u, h_v, total, missed,
            )  # fmt: skip
            outside[j] = finish_row(j * width, width, n, at, scale, total, missed, out)


@kernel(parallel=True)
def occlusion_of(visibility, z, k, occlusion):
    """1 - A^k, A^k in float64 (lfssao.core.power) rounded once; 0 where there is no surface. (H, W), k float64."""
    height, width = z.shape
    for j in prange(height):
        one, zero = z.dtype.type(1), z.dtype.type(0)
        if k == 1.0:  # as power has it, but in vectors
            for i in range(width):
                a = one - visibility[j, i]
                occlusion[j, i] = a if z[j, i] < np.inf else zero
        else:
            for i in range(width):
                a = z.dtype.type(power(np.float64(visibility[j, i]), k))
                occlusion[j, i] = one - a if z[j, i] < np.inf else zero
