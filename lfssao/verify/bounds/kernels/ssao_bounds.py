"""LF Algorithms 1 and 2 on intervals: which samples any float32 renderer must count as occluded, and which it may.

The image point of a sample is a box [u - e_u, u + e_u] x [v - e_v, v + e_v] and its depth a range (pairs of
``kernels.pairs``). The renderer reads one of the texels that the box touches, or none, and finds its depth in
front of some depth of the range, or not. If all of these agree, the sample is occluded or clear; else it is undecided.

Rows of matrices. A row of T terms t_1 + ... + t_T (the products with the point, with the offset, and the constant;
terms of a zero coefficient are exact zeros) rounds each term at most once as a product and at most T - 1 times on its
way through the sums, whatever their order; M (p + o), with n coefficients and c constants (0 or 1), rounds it
1 + 1 + (n - 1) + c <= 2 n + c = T times. So the row is off by at most ((1 + r)^T - 1) sum abs(t_i): with T r < 2^-10,
T r (1 + T r) sum abs(t_i). The sum of sizes is one of the point plus one of the offset, and so is this error: both are
computed once a point and once a sample. Errors of the point and the offset themselves add abs(m_i) times their size.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import CROSSED_SLITS, DISPLAY, MATRIX, affine_row, linear_row
from lfssao.verify.bounds.kernels.pairs import FLUSHED, SAFETY, Pair, add, divide, exact, is_positive, subtract
from lfssao.verify.bounds.kernels.projection_bounds import display_pairs

CLEAR, OCCLUDED, UNDECIDED = 0, 1, 2

# A box of more texels than this is undecided without looking at them: it takes a mapping next to its singularity.
_MOST_TEXELS = 4096


class Inputs(NamedTuple):
    """What Algorithm 1 or 2 is run on.

    Attributes
    ----------
    depth : (H, W) float32
        The depth texture.
    positions : (H, W, 3) float32
        World coordinates; (0, 0, 3) where Algorithm 1 makes them from depth.
    back : (16,) float64
        ``screen_to_world``, or empty.
    offsets : (n, 3) float64
        Exact offsets of the samples, world units.
    is_exact : (n,) bool
        Whether every renderer has this very offset.
    kind : int
        Kind of the mapping.
    m : (16,) or (44,) float64
        Its numbers, each a float32.
    """

    depth: Any
    positions: Any
    back: Any
    offsets: Any
    is_exact: Any
    kind: int
    m: Any


class Projected(NamedTuple):
    """An image point with errors, and whether it may lie, and lies for sure, in the mapping's domain."""

    u: Pair
    v: Pair
    z: Pair
    may: bool
    must: bool


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
def point_row(m, row, x, y, z, r):
    """A row of M (p, 1), p the point's coordinates as pairs."""
    size = row_sizes(m, row, abs(x.value) + x.error, abs(y.value) + y.error, abs(z.value) + z.error)
    size += abs(m[4 * row + 3])
    own = row_sizes(m, row, x.error, y.error, z.error)
    # Flushed may be two operands and a product a coefficient, and the sums.
    flushed = FLUSHED * (4.0 + 4.0 * row_sizes(m, row, 1.0, 1.0, 1.0))
    return Pair(affine_row(m, row, x.value, y.value, z.value), row_roundings(m, row, r) * r * size + own + flushed)


@kernel(inline=True)
def offset_row(m, row, offset, by):
    """A row of M (o, 0), o an exact offset."""
    x, y, z = offset[0], offset[1], offset[2]
    size = row_sizes(m, row, abs(x), abs(y), abs(z)) * (1.0 + by.offset)
    r = by.operation
    return Pair(linear_row(m, row, x, y, z), row_roundings(m, row, r) * r * size + by.offset * size)


@kernel(inline=True)
def rows_of_point(kind, m, x, y, z, r):
    """All rows of M (p, 1); the fourth is 1 where the mapping has none."""
    q = point_row(m, 3, x, y, z, r) if kind == MATRIX else exact(1.0)
    return point_row(m, 0, x, y, z, r), point_row(m, 1, x, y, z, r), point_row(m, 2, x, y, z, r), q


@kernel(inline=True)
def texel_point(inputs, by, column, row):
    """World coordinates of a texel's surface as pairs: given, or made as in Algorithm 1, line 3."""
    if inputs.back.shape[0] == 0:
        place = inputs.positions[row, column]
        return exact(np.float64(place[0])), exact(np.float64(place[1])), exact(np.float64(place[2]))
    u, v, d = exact(column + 0.5), exact(row + 0.5), exact(np.float64(inputs.depth[row, column]))
    a, b, c, w = rows_of_point(MATRIX, inputs.back, u, v, d, by.operation)
    return divide(a, w, by), divide(b, w, by), divide(c, w, by)


@kernel(inline=True)
def project(kind, m, a, b, c, q, by):
    """The half of a mapping that is not affine, of its rows' pairs."""
    if kind == CROSSED_SLITS:
        f, g = subtract(exact(m[12]), c, by), subtract(exact(m[13]), c, by)
        u = add(exact(m[14]), divide(a, f, by), by)
        v = add(exact(m[15]), divide(b, g, by), by)
        may_f, must_f = is_positive(f)
        may_g, must_g = is_positive(Pair(-g.value, g.error))
        return Projected(u, v, c, may_f & may_g, must_f & must_g)
    if kind == DISPLAY:
        u, v, may, must = display_pairs(m[12:], a, b, c, by)
        return Projected(u, v, c, may, must)
    may, must = is_positive(q)
    return Projected(divide(a, q, by), divide(b, q, by), divide(c, q, by), may, must)


@kernel(inline=True)
def compare(depth, image):
    """What a sample can be: CLEAR, OCCLUDED or UNDECIDED.

    Parameters
    ----------
    depth : (H, W) float32
        The depth texture.
    image : Projected
        The sample's image point.
    """
    height, width = depth.shape
    if not image.may:
        return CLEAR
    u_low, u_high = image.u.value - image.u.error, image.u.value + image.u.error
    v_low, v_high = image.v.value - image.v.error, image.v.value + image.v.error
    z_low, z_high = image.z.value - image.z.error, image.z.value + image.z.error
    if u_high < 0.0 or u_low >= width or v_high < 0.0 or v_low >= height:
        return CLEAR
    is_near = abs(image.u.value) + image.u.error < 1e15 and abs(image.v.value) + image.v.error < 1e15
    if not (is_near and abs(image.z.value) + image.z.error < np.inf):  # nor where it is not a number
        return UNDECIDED
    clear = not (image.must and u_low >= 0.0 and u_high < width and v_low >= 0.0 and v_high < height)
    occluded = False
    i0, i1 = np.int64(max(u_low, 0.0)), np.int64(min(u_high, width - 1.0))
    j0, j1 = np.int64(max(v_low, 0.0)), np.int64(min(v_high, height - 1.0))
    if (i1 - i0 + 1) * (j1 - j0 + 1) > _MOST_TEXELS:
        return UNDECIDED
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            surface = np.float64(depth[j, i])
            flushed = 0.0 if abs(surface) < 2.0**-126 else surface
            occluded = occluded or min(surface, flushed) < z_high
            clear = clear or not max(surface, flushed) < z_low
    if clear and occluded:
        return UNDECIDED
    return OCCLUDED if occluded else CLEAR


@kernel(inline=True)
def lowest_bit(x):
    """The largest power of two that a number, not 0, is a multiple of; infinity for 0."""
    if x == 0.0:
        return np.inf
    mantissa, exponent = math.frexp(x)
    whole = np.int64(mantissa * 2.0**53)
    return math.ldexp(np.float64(whole & -whole), exponent - 53)


@kernel
def row_is_exact(m, row, point, offset):
    """Whether a row of M (p + o, 1) comes out exactly in every order: all its terms are multiples of one power of two.

    Products of two float32 are exact in float64. If all terms are multiples of g, and their sizes sum to at most
    2^24 g, then so are all partial sums, and float32 holds each of them: no operation rounds. Likewise p + o. For g no
    less than 2^-126 nothing is flushed.
    """
    g, size = lowest_bit(m[4 * row + 3]), abs(m[4 * row + 3])
    fits = True
    for k in range(3):
        a, p, o = m[4 * row + k], np.float64(point[k]), offset[k]
        if a != 0.0:
            bit = min(lowest_bit(p), lowest_bit(o))
            fits = fits and abs(p) + abs(o) <= 2.0**24 * bit and bit >= 2.0**-126
            g = min(g, lowest_bit(a * p), lowest_bit(a * o))
            size += abs(a * p) + abs(a * o)
    return fits and size <= 2.0**24 * g and g >= 2.0**-126


@kernel(inline=True)
def depth_is_exact(inputs, column, row, s):
    """Whether a sample's image z is exact: a row of a display's mapping that rounds nothing, of a given point."""
    if inputs.kind == MATRIX or inputs.back.shape[0] != 0:
        return False
    return row_is_exact(inputs.m, 2, inputs.positions[row, column], inputs.offsets[s])


@kernel
def offset_rows(inputs, by):
    """The rows of M (o, 0) of every sample, (n, 4, 2): values and errors."""
    rows = np.zeros((inputs.offsets.shape[0], 4, 2))
    for s in range(inputs.offsets.shape[0]):
        for row in range(4 if inputs.kind == MATRIX else 3):
            rows[s, row, 0], rows[s, row, 1] = offset_row(inputs.m, row, inputs.offsets[s], by)
    return rows


@kernel(inline=True)
def _plus(x, row):
    """A row of the point and one of the offset: their sum's rounding is in both."""
    return Pair(x.value + row[0], x.error + row[1])


@kernel(inline=True)
def trace_sample(inputs, by, column, row, rows, offsets, s):
    """Image point of a texel's sample, its errors as they count, and the outcome.

    Parameters
    ----------
    inputs : Inputs
        The textures and samples.
    by : Errors
        What a renderer's arithmetic may be off by.
    column, row : int
        The texel.
    rows : 4 Pairs
        ``rows_of_point`` of its surface.
    offsets : (n, 4, 2) float64
        ``offset_rows``.
    s : int
        Number of the sample.
    """
    a, b, c = _plus(rows[0], offsets[s, 0]), _plus(rows[1], offsets[s, 1]), _plus(rows[2], offsets[s, 2])
    image = project(inputs.kind, inputs.m, a, b, c, _plus(rows[3], offsets[s, 3]), by)
    u = Pair(image.u.value, image.u.error * SAFETY + by.coordinate)
    v = Pair(image.v.value, image.v.error * SAFETY + by.coordinate)
    z = Pair(image.z.value, image.z.error * SAFETY)
    image = Projected(u, v, z, image.may, image.must)
    outcome = compare(inputs.depth, image)
    if outcome == UNDECIDED and inputs.is_exact[s] and depth_is_exact(inputs, column, row, s):
        image = Projected(u, v, exact(z.value), image.may, image.must)
        outcome = compare(inputs.depth, image)
    return image, outcome


@kernel(parallel=True)
def count_outcomes(inputs, by, fewest, most):
    """The fewest and the most samples that a renderer may count as occluded, of every texel.

    Parameters
    ----------
    inputs : Inputs
        The textures and samples.
    by : Errors
        What a renderer's arithmetic may be off by.
    fewest, most : (H, W) int32
        Out.
    """
    offsets = offset_rows(inputs, by)
    for j in prange(inputs.depth.shape[0]):
        for i in range(inputs.depth.shape[1]):
            fewest[j, i], most[j, i] = 0, 0
            if not inputs.depth[j, i] < np.inf:
                continue
            x, y, z = texel_point(inputs, by, i, j)
            rows = rows_of_point(inputs.kind, inputs.m, x, y, z, by.operation)
            for s in range(offsets.shape[0]):
                _, outcome = trace_sample(inputs, by, i, j, rows, offsets, s)
                fewest[j, i] += np.int32(outcome == OCCLUDED)
                most[j, i] += np.int32(outcome != CLEAR)


@kernel
def trace_samples(inputs, by, column, row, found):
    """What count_outcomes finds for each sample of one texel.

    Parameters
    ----------
    inputs : Inputs
        The textures and samples.
    by : Errors
        What a renderer's arithmetic may be off by.
    column, row : int
        The texel.
    found : (n, 9) float64
        Out: u, its error, v, its error, z, its error, whether it may and must lie in the domain, the outcome.
    """
    offsets = offset_rows(inputs, by)
    x, y, z = texel_point(inputs, by, column, row)
    rows = rows_of_point(inputs.kind, inputs.m, x, y, z, by.operation)
    for s in range(offsets.shape[0]):
        image, outcome = trace_sample(inputs, by, column, row, rows, offsets, s)
        found[s, 0], found[s, 1] = image.u
        found[s, 2], found[s, 3] = image.v
        found[s, 4], found[s, 5] = image.z
        found[s, 6], found[s, 7], found[s, 8] = image.may, image.must, outcome


@kernel(parallel=True)
def map_positions(positions, allowance, kind, m, by, image, error, sure):
    """Image points of positions, and by how much they may be off.

    Parameters
    ----------
    positions : (n, 3) float64
        World coordinates.
    allowance : (n, 3) float64
        How far each coordinate may be off by itself.
    kind, m
        As of ``Inputs``.
    by : Errors
        What a renderer's arithmetic may be off by.
    image, error : (n, 3) float64
        Out: u, v, z and their errors; minus infinity where a position lies outside the mapping's domain for sure.
    sure : (n,) bool
        Out: whether it lies in the domain for sure.
    """
    for k in prange(positions.shape[0]):
        x = Pair(positions[k, 0], allowance[k, 0])
        y = Pair(positions[k, 1], allowance[k, 1])
        z = Pair(positions[k, 2], allowance[k, 2])
        a, b, c, q = rows_of_point(kind, m, x, y, z, by.operation)
        found = project(kind, m, a, b, c, q, by)
        image[k, 0], error[k, 0] = found.u
        image[k, 1], error[k, 1] = found.v
        image[k, 2], error[k, 2] = found.z
        sure[k] = found.must
        if not found.may:
            error[k, 0] = -np.inf
