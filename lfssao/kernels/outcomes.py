"""LF Algorithms 1 and 2 with errors: which samples any float32 renderer of a model must count, and which it may.

Of each sample the image point is a box [u - e_u, u + e_u] x [v - e_v, v + e_v] and its depth a range (pairs of
``lfssao.kernels.rounding``). The renderer reads one of the texels that the box touches, or none, and finds its depth in
front of some depth of the range, or not. Where all of these agree the sample is occluded or clear; else it is open.

Rows of matrices. A row of T terms t_1 + ... + t_T (the products with the point, with the offset, and the constant;
terms of a zero coefficient are exact zeros) rounds each term at most once as a product and at most T - 1 times on its
way through the sums, whatever their order; M (p + o), with n coefficients and c constants (0 or 1), rounds it
1 + 1 + (n - 1) + c <= 2 n + c = T times. So the row is off by at most ((1 + r)^T - 1) sum abs(t_i): with T r < 2^-10,
T r (1 + T r) sum abs(t_i). The sum of sizes is one of the point plus one of the offset, so is this error: both are
computed once a point and once a sample. What the point and the offset are off by themselves adds abs(m_i) times that.
"""

import math

import numpy as np
from numba import prange

from lfssao.kernels.display_bounds import display_pairs
from lfssao.kernels.jit import kernel
from lfssao.kernels.mapping import CROSSED_SLITS, DISPLAY, MATRIX, affine_row, linear_row
from lfssao.kernels.rounding import FLUSHED, SAFETY, add, divide

CLEAR, OCCLUDED, OPEN = 0, 1, 2

# A box of more texels than this is called open without looking at them: it takes a mapping next to its singularity.
_MOST_TEXELS = 4096


@kernel(inline=True)
def row_roundings(m, row, r):
    """How often, in units of r, a term of a row is rounded at most: T (1 + T r)."""
    terms = 0
    for k in range(3):
        terms += 2 if m[4 * row + k] != 0.0 else 0
    terms += 1 if m[4 * row + 3] != 0.0 else 0
    return terms * (1.0 + terms * r)


@kernel(inline=True)
def row_sizes(m, row, x, y, z):
    """abs(m0) x + abs(m1) y + abs(m2) z for x, y, z >= 0."""
    k = 4 * row
    return (abs(m[k]) * x + abs(m[k + 1]) * y) + abs(m[k + 2]) * z


@kernel(inline=True)
def row_flushed(m, row):
    """What flushing makes of a row: two operands and a product a coefficient, and the sums."""
    return FLUSHED * (4.0 + 4.0 * row_sizes(m, row, 1.0, 1.0, 1.0))


@kernel
def offset_pairs(offsets, offset_error, rows, m, r, pairs):
    """The samples' half of a mapping's rows.

    Parameters
    ----------
    offsets : (n, 3) float64
        Exact offsets, world units.
    offset_error : float
        Relative error of the offsets that a renderer uses.
    rows : int
        How many rows.
    m : float64 array
        The mapping's numbers.
    r : float
        Relative error of an operation.
    pairs : (n, 4, 2) float64
        Out: value and error of each row.
    """
    for s in range(offsets.shape[0]):
        x, y, z = offsets[s, 0], offsets[s, 1], offsets[s, 2]
        for row in range(rows):
            size = row_sizes(m, row, abs(x), abs(y), abs(z)) * (1.0 + offset_error)
            pairs[s, row, 0] = linear_row(m, row, x, y, z)
            pairs[s, row, 1] = row_roundings(m, row, r) * r * size + offset_error * size


@kernel(inline=True)
def point_pair(m, row, r, x, e_x, y, e_y, z, e_z):
    """The point's half of a row: value and error; e_x, e_y, e_z: errors of the point's coordinates."""
    size = row_sizes(m, row, abs(x) + e_x, abs(y) + e_y, abs(z) + e_z) + abs(m[4 * row + 3])
    own = row_sizes(m, row, e_x, e_y, e_z)
    return affine_row(m, row, x, y, z), row_roundings(m, row, r) * r * size + own + row_flushed(m, row)


@kernel(inline=True)
def texel_point(back, u, v, d, r, quotient):
    """Algorithm 1, line 3, of pairs: the world point of screen point (u, v, d), exact numbers, by rows of four."""
    w, e_w = point_pair(back, 3, r, u, 0.0, v, 0.0, d, 0.0)
    a, e_a = point_pair(back, 0, r, u, 0.0, v, 0.0, d, 0.0)
    b, e_b = point_pair(back, 1, r, u, 0.0, v, 0.0, d, 0.0)
    c, e_c = point_pair(back, 2, r, u, 0.0, v, 0.0, d, 0.0)
    x, e_x = divide(a, e_a, w, e_w, quotient)
    y, e_y = divide(b, e_b, w, e_w, quotient)
    z, e_z = divide(c, e_c, w, e_w, quotient)
    return x, e_x, y, e_y, z, e_z


@kernel(inline=True)
def image_pairs(kind, m, a, e_a, b, e_b, c, e_c, q, e_q, r, quotient, root_error):
    """The half of a mapping that is not affine, of pairs.

    Returns
    -------
    u, e_u, v, e_v, z, e_z : float
        Image point and errors.
    may, must : bool
        Whether the point may lie in the mapping's domain, and whether it lies there for sure.
    """
    if kind == CROSSED_SLITS:
        f, e_f = add(m[12], 0.0, -c, e_c, r)
        g, e_g = add(m[13], 0.0, -c, e_c, r)
        u, e_u = divide(a, e_a, f, e_f, quotient)
        v, e_v = divide(b, e_b, g, e_g, quotient)
        u, e_u = add(m[14], 0.0, u, e_u, r)
        v, e_v = add(m[15], 0.0, v, e_v, r)
        behind, before = e_f * SAFETY, e_g * SAFETY
        may = (not f <= -behind) & (not g >= before)
        return u, e_u, v, e_v, c, e_c, may, (f > behind) & (g < -before)
    if kind == DISPLAY:
        u, e_u, v, e_v, may, must = display_pairs(m, a, e_a, b, e_b, c, e_c, r, quotient, root_error)
        return u, e_u, v, e_v, c, e_c, may, must
    u, e_u = divide(a, e_a, q, e_q, quotient)
    v, e_v = divide(b, e_b, q, e_q, quotient)
    z, e_z = divide(c, e_c, q, e_q, quotient)
    room = e_q * SAFETY
    return u, e_u, v, e_v, z, e_z, not q <= -room, q > room


@kernel(inline=True)
def compare(depth, width, height, u, e_u, v, e_v, z, e_z, may, must):
    """What a sample can be: CLEAR, OCCLUDED or OPEN.

    Parameters
    ----------
    depth : (H * W,) float32
        The depth texture, row by row.
    width, height : int
        Its size.
    u, e_u, v, e_v, z, e_z : float
        Image point and errors.
    may, must : bool
        Whether it may lie, and lies, in the mapping's domain.
    """
    if not may:
        return CLEAR
    u_low, u_high, v_low, v_high = u - e_u, u + e_u, v - e_v, v + e_v
    if u_high < 0.0 or u_low >= width or v_high < 0.0 or v_low >= height:
        return CLEAR
    if not (abs(u) + e_u < 1e15 and abs(v) + e_v < 1e15 and abs(z) + e_z < np.inf):  # nor where it is not a number
        return OPEN
    clear = not (must and u_low >= 0.0 and u_high < width and v_low >= 0.0 and v_high < height)
    occluded = False
    i0, i1 = np.int64(max(u_low, 0.0)), np.int64(min(u_high, width - 1.0))
    j0, j1 = np.int64(max(v_low, 0.0)), np.int64(min(v_high, height - 1.0))
    if (i1 - i0 + 1) * (j1 - j0 + 1) > _MOST_TEXELS:
        return OPEN
    z_low, z_high = z - e_z, z + e_z
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            surface = np.float64(depth[np.uint64(j * width + i)])
            flushed = 0.0 if abs(surface) < 2.0**-126 else surface
            occluded = occluded or min(surface, flushed) < z_high
            clear = clear or not max(surface, flushed) < z_low
    if clear and occluded:
        return OPEN
    return OCCLUDED if occluded else CLEAR


@kernel(inline=True)
def lowest_bit(x):
    """The largest power of two that a number, not 0, is a multiple of; infinity for 0."""
    if x == 0.0:
        return np.inf
    mantissa, exponent = math.frexp(x)
    whole = np.int64(mantissa * 2.0**53)
    return math.ldexp(np.float64(whole & -whole), exponent - 53)


@kernel(inline=True)
def row_is_exact(m, row, x, y, z, ox, oy, oz):
    """Whether a row of M (p + o, 1) comes out exactly in every order: all its terms are multiples of one power of two.

    Products of two float32 are exact in float64. If all terms are multiples of g, and their sizes sum to at most
    2^24 g, then so are all partial sums, and float32 holds each of them: no operation rounds. Likewise p + o. For g no
    less than 2^-126 nothing is flushed.
    """
    g, size = lowest_bit(m[4 * row + 3]), abs(m[4 * row + 3])
    fits = True
    for k in range(3):
        a = m[4 * row + k]
        p, o = (x, ox) if k == 0 else (y, oy) if k == 1 else (z, oz)
        if a != 0.0:
            bit = min(lowest_bit(p), lowest_bit(o))
            fits = fits and abs(p) + abs(o) <= 2.0**24 * bit and bit >= 2.0**-126
            g = min(g, lowest_bit(a * p), lowest_bit(a * o))
            size += abs(a * p) + abs(a * o)
    return fits and size <= 2.0**24 * g and g >= 2.0**-126


@kernel
def depth_is_exact(kind, m, x, y, z, offsets, s):
    """Whether a sample's image z is exact: a row of a display's mapping that rounds nothing, of an exact offset."""
    return kind != MATRIX and row_is_exact(m, 2, x, y, z, offsets[s, 0], offsets[s, 1], offsets[s, 2])


@kernel(inline=True)
def sample_pairs(kind, m, rows, p, e_p, pairs, s, r, quotient, root_error, slack):
    """Image point of a sample: the point's rows, p and e_p, plus the offset's, through the mapping."""
    a, e_a = p[0] + pairs[s, 0, 0], e_p[0] + pairs[s, 0, 1]
    b, e_b = p[1] + pairs[s, 1, 0], e_p[1] + pairs[s, 1, 1]
    c, e_c = p[2] + pairs[s, 2, 0], e_p[2] + pairs[s, 2, 1]
    q, e_q = 1.0, 0.0
    if rows == 4:
        q, e_q = p[3] + pairs[s, 3, 0], e_p[3] + pairs[s, 3, 1]
    u, e_u, v, e_v, z, e_z, may, must = image_pairs(kind, m, a, e_a, b, e_b, c, e_c, q, e_q, r, quotient, root_error)
    return u, e_u * SAFETY + slack, v, e_v * SAFETY + slack, z, e_z * SAFETY, may, must


@kernel(inline=True)
def point_rows(rows, m, r, x, e_x, y, e_y, z, e_z, p, e_p):
    """The point's half of all rows into p and e_p."""
    for row in range(rows):
        p[row], e_p[row] = point_pair(m, row, r, x, e_x, y, e_y, z, e_z)


@kernel(parallel=True)
def count_outcomes(depth, positions, back, offsets, exact, kind, m, errors, fewest, most):
    """The fewest and the most samples that a renderer may count as occluded, of every texel.

    Parameters
    ----------
    depth : (H, W) float32
        The depth texture.
    positions : (H, W, 3) float32
        World coordinates; (0, 0, 3) where Algorithm 1 makes them from depth.
    back : (16,) float64
        ``screen_to_world``, or empty.
    offsets : (n, 3) float64
        Exact offsets of the samples, world units.
    exact : (n,) bool
        Whether a renderer's offset is this one for sure.
    kind, m : int, (16,) or (44,) float64
        The mapping, each number a float32.
    errors : (5,) float64
        Relative errors of + - *, of a quotient, of a root, of the offsets; how far in texels a look-up may miss.
    fewest, most : (H, W) int32
        Out.
    """
    height, width = depth.shape
    surface, places = depth.reshape(height * width), positions.reshape(positions.shape[0] * positions.shape[1], 3)
    r, quotient, root_error, slack = errors[0], errors[1], errors[2], errors[4]
    rows = 4 if kind == MATRIX else 3
    given = back.shape[0] == 0
    pairs = np.zeros((offsets.shape[0], 4, 2))
    offset_pairs(offsets, errors[3], rows, m, r, pairs)
    for j in prange(height):
        p, e_p = np.zeros(4), np.zeros(4)
        for i in range(width):
            texel = np.uint64(j * width + i)
            fewest[j, i], most[j, i] = 0, 0
            d = np.float64(surface[texel])
            if not d < np.inf:
                continue
            if not given:
                x, e_x, y, e_y, z, e_z = texel_point(back, i + 0.5, j + 0.5, d, r, quotient)
            else:
                x, e_x = np.float64(places[texel, 0]), 0.0
                y, e_y = np.float64(places[texel, 1]), 0.0
                z, e_z = np.float64(places[texel, 2]), 0.0
            point_rows(rows, m, r, x, e_x, y, e_y, z, e_z, p, e_p)
            for s in range(offsets.shape[0]):
                u, e_u, v, e_v, depth_of, e_d, may, must = sample_pairs(
                    kind, m, rows, p, e_p, pairs, s, r, quotient, root_error, slack
                )
                outcome = compare(surface, width, height, u, e_u, v, e_v, depth_of, e_d, may, must)
                if outcome == OPEN and exact[s] and given and depth_is_exact(kind, m, x, y, z, offsets, s):
                    outcome = compare(surface, width, height, u, e_u, v, e_v, depth_of, 0.0, may, must)
                fewest[j, i] += np.int32(outcome == OCCLUDED)
                most[j, i] += np.int32(outcome != CLEAR)


@kernel
def trace_samples(depth, point, back, offsets, exact, kind, m, errors, i, j, found):
    """What count_outcomes finds for each sample of one texel.

    Parameters
    ----------
    depth : (H, W) float32
        The depth texture.
    point : (3,) float32
        World coordinates of the texel's surface; not read with ``back``.
    back : (16,) float64
        ``screen_to_world``, or empty.
    offsets, exact, kind, m, errors
        As for count_outcomes.
    i, j : int
        Column and row of the texel.
    found : (n, 9) float64
        Out: u, its error, v, its error, z, its error, whether it may and must lie in the domain, the outcome.
    """
    height, width = depth.shape
    r, quotient, root_error, slack = errors[0], errors[1], errors[2], errors[4]
    rows = 4 if kind == MATRIX else 3
    given = back.shape[0] == 0
    pairs = np.zeros((offsets.shape[0], 4, 2))
    offset_pairs(offsets, errors[3], rows, m, r, pairs)
    p, e_p = np.zeros(4), np.zeros(4)
    x, e_x = np.float64(point[0]), 0.0
    y, e_y = np.float64(point[1]), 0.0
    z, e_z = np.float64(point[2]), 0.0
    if not given:
        x, e_x, y, e_y, z, e_z = texel_point(back, i + 0.5, j + 0.5, np.float64(depth[j, i]), r, quotient)
    point_rows(rows, m, r, x, e_x, y, e_y, z, e_z, p, e_p)
    surface = depth.reshape(height * width)
    for s in range(offsets.shape[0]):
        u, e_u, v, e_v, depth_of, e_d, may, must = sample_pairs(
            kind, m, rows, p, e_p, pairs, s, r, quotient, root_error, slack
        )
        outcome = compare(surface, width, height, u, e_u, v, e_v, depth_of, e_d, may, must)
        if outcome == OPEN and exact[s] and given and depth_is_exact(kind, m, x, y, z, offsets, s):
            e_d = 0.0
            outcome = compare(surface, width, height, u, e_u, v, e_v, depth_of, e_d, may, must)
        found[s, 0], found[s, 1], found[s, 2], found[s, 3], found[s, 4], found[s, 5] = u, e_u, v, e_v, depth_of, e_d
        found[s, 6], found[s, 7], found[s, 8] = np.float64(may), np.float64(must), np.float64(outcome)


@kernel(parallel=True)
def map_positions(positions, allowance, kind, m, errors, image, doubt, sure):
    """Where points land in the image, and by how much that may be off.

    Parameters
    ----------
    positions : (H, W, 3) float64
        World coordinates.
    allowance : (H, W, 3) float64
        How far each coordinate may be off by itself.
    kind, m, errors
        As for count_outcomes; of the errors the first three are read.
    image, doubt : (H, W, 3) float64
        Out: u, v, z and their errors; minus infinity where a position lies outside the mapping's domain for sure.
    sure : (H, W) bool
        Out: whether it lies in the domain for sure.
    """
    rows = 4 if kind == MATRIX else 3
    for j in prange(positions.shape[0]):
        p, e_p = np.zeros(4), np.zeros(4)
        for i in range(positions.shape[1]):
            x, y, z = positions[j, i, 0], positions[j, i, 1], positions[j, i, 2]
            point_rows(rows, m, errors[0], x, allowance[j, i, 0], y, allowance[j, i, 1], z, allowance[j, i, 2], p, e_p)
            u, e_u, v, e_v, d, e_d, may, must = image_pairs(
                kind, m, p[0], e_p[0], p[1], e_p[1], p[2], e_p[2], p[3], e_p[3], errors[0], errors[1], errors[2]
            )
            image[j, i, 0], image[j, i, 1], image[j, i, 2] = u, v, d
            doubt[j, i, 0], doubt[j, i, 1], doubt[j, i, 2] = e_u, e_v, e_d
            sure[j, i] = must
            if not may:
                doubt[j, i, 0] = -np.inf
