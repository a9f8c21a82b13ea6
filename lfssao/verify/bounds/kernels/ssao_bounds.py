"""LF Algorithms 1 and 2 on pairs: which samples any float32 renderer must count as occluded, and which it may.

The image point of a sample is a box [u - e_u, u + e_u] x [v - e_v, v + e_v] and its depth a range. The renderer reads
one of the texels that the box touches, or none, and finds its depth in front of some depth of the range, or not. If all
of these agree, the sample is occluded or clear; else it is undecided.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import MATRIX, Projection
from lfssao.verify.bounds.kernels.pairs import Pair, divide, exact
from lfssao.verify.bounds.kernels.projection_bounds import (
    TURNED,
    Projected,
    offset_row,
    project,
    rows_of_point,
    turned_offset_row,
    widen,
)

CLEAR, OCCLUDED, UNDECIDED = 0, 1, 2

# A box of more texels than this is undecided without looking at them: it takes a mapping next to its singularity.
_MOST_TEXELS = 4096


class Inputs(NamedTuple):
    """The textures, mapping and samples that points are decided by."""

    depth: Any  # (H, W) float32
    positions: Any  # (H, W, 3) float32, world coordinates; (0, 0, 3) where Algorithm 1 makes them from depth
    back: Any  # (16,) float64: ``screen_to_world``, or empty
    offsets: Any  # (n, 3) float64: exact offsets of the samples, world units
    is_exact: Any  # (n,) bool: whether every renderer has this very offset
    kind: int  # the mapping's, apart from its numbers, as parallel kernels take no tuples of tuples
    numbers: Any  # (16,) or (44,) float64, each a float32


class Box(NamedTuple):
    """The texels that an image point may lie in: columns i0 to i1 and rows j0 to j1.

    ``may`` is whether it may lie in any, ``must`` whether it lies in one for sure, ``known`` whether the box is small
    enough to be looked at.
    """

    may: bool
    known: bool
    must: bool
    i0: int
    i1: int
    j0: int
    j1: int


@kernel(inline=True)
def mapping_of(inputs):
    """The mapping as a projection."""
    return Projection(inputs.kind, inputs.numbers)


@kernel(inline=True)
def vector(texture, row, column):
    """A texel's vector as exact pairs."""
    x, y, z = texture[row, column]
    return exact(np.float64(x)), exact(np.float64(y)), exact(np.float64(z))


@kernel(inline=True)
def texel_point(inputs, by, column, row):
    """World coordinates of a texel's surface as pairs: given, or made as in Algorithm 1, line 3."""
    if inputs.back.shape[0] == 0:
        return vector(inputs.positions, row, column)
    place = exact(column + 0.5), exact(row + 0.5), exact(np.float64(inputs.depth[row, column]))
    a, b, c, w = rows_of_point(Projection(MATRIX, inputs.back), place, by.operation)
    return divide(a, w, by), divide(b, w, by), divide(c, w, by)


@kernel(inline=True)
def box_of(shape, image):
    """The texels of a texture of that shape that an image point may lie in."""
    height, width = shape
    u_low, u_high = image.u.value - image.u.error, image.u.value + image.u.error
    v_low, v_high = image.v.value - image.v.error, image.v.value + image.v.error
    if not image.may or u_high < 0.0 or u_low >= width or v_high < 0.0 or v_low >= height:
        return Box(False, True, False, 0, 0, 0, 0)
    is_near = abs(image.u.value) + image.u.error < 1e15 and abs(image.v.value) + image.v.error < 1e15
    if not (is_near and abs(image.z.value) + image.z.error < np.inf):  # nor for NaN
        return Box(True, False, False, 0, 0, 0, 0)
    must = image.must and u_low >= 0.0 and u_high < width and v_low >= 0.0 and v_high < height
    i0, i1 = np.int64(max(u_low, 0.0)), np.int64(min(u_high, width - 1.0))
    j0, j1 = np.int64(max(v_low, 0.0)), np.int64(min(v_high, height - 1.0))
    return Box(True, (i1 - i0 + 1) * (j1 - j0 + 1) <= _MOST_TEXELS, must, i0, i1, j0, j1)


@kernel(inline=True)
def compare(depth, image):
    """The outcome of a sample at an image point: CLEAR, OCCLUDED or UNDECIDED."""
    box = box_of(depth.shape, image)
    if not box.may:
        return CLEAR
    if not box.known:
        return UNDECIDED
    z_low, z_high = image.z.value - image.z.error, image.z.value + image.z.error
    clear, occluded = not box.must, False
    for j in range(box.j0, box.j1 + 1):
        for i in range(box.i0, box.i1 + 1):
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


@kernel
def offset_rows(inputs, by):
    """The rows of M (o, 0) of every sample, (n, 4, 2): values and errors."""
    rows = np.zeros((inputs.offsets.shape[0], 4, 2))
    for s in range(inputs.offsets.shape[0]):
        for row in range(4 if inputs.kind == MATRIX else 3):
            rows[s, row, 0], rows[s, row, 1] = offset_row(inputs.numbers, row, inputs.offsets[s], by)
    return rows


@kernel(inline=True)
def turn_of(turns, column, row):
    """Cosine and sine of a texel; turns: (2, H, W) float32."""
    return np.float64(turns[0, row, column]), np.float64(turns[1, row, column])


@kernel(inline=True)
def _pair(rows, row):
    return Pair(rows[row, 0], rows[row, 1])


@kernel(inline=True)
def sample_rows(inputs, by, turns, column, row, offsets, s):
    """The rows of M (o, 0) of a sample at a texel, of ``offset_rows`` where turns are None."""
    if turns is None:
        known = offsets[s]
        return _pair(known, 0), _pair(known, 1), _pair(known, 2), _pair(known, 3)
    m, turn, offset = inputs.numbers, turn_of(turns, column, row), inputs.offsets[s]
    q = turned_offset_row(m, 3, offset, turn, by) if inputs.kind == MATRIX else exact(0.0)
    a, b = turned_offset_row(m, 0, offset, turn, by), turned_offset_row(m, 1, offset, turn, by)
    return a, b, turned_offset_row(m, 2, offset, turn, by), q


@kernel(inline=True)
def point_rows(inputs, by, turns, point):
    """``rows_of_point`` of a texel's surface, to which samples are added."""
    return rows_of_point(mapping_of(inputs), point, by.operation, 0 if turns is None else TURNED)


@kernel(inline=True)
def _plus(x, row, side):
    """A row of the point and one of the offset or, for a side of -1, its opposite: their sum's rounding is in both."""
    return Pair(x.value + side * row[0], x.error + row[1])


@kernel(inline=True)
def project_sample(inputs, by, rows, offset, side):
    """The image point of a texel's sample with its errors as they count.

    ``rows`` are ``point_rows`` of the texel's surface, ``offset`` those of the sample by ``sample_rows``, ``side`` is
    1, or -1 for the sample on the other side of the surface.
    """
    a, b = _plus(rows[0], offset[0], side), _plus(rows[1], offset[1], side)
    c, q = _plus(rows[2], offset[2], side), _plus(rows[3], offset[3], side)
    return widen(project(mapping_of(inputs), (a, b, c, q), by), by)


@kernel(inline=True)
def trace_sample(inputs, by, turns, column, row, rows, offsets, s):
    """Image point, errors included, and outcome of sample s of a texel; the arguments as of ``project_sample``."""
    image = project_sample(inputs, by, rows, sample_rows(inputs, by, turns, column, row, offsets, s), 1.0)
    outcome, m = compare(inputs.depth, image), inputs.numbers
    may_be_exact = inputs.kind != MATRIX and inputs.back.shape[0] == 0 and inputs.is_exact[s]  # z of a given point
    may_be_exact &= turns is None or (m[8] == 0.0 and m[9] == 0.0)  # that no turn changes
    if (
        outcome == UNDECIDED
        and may_be_exact
        and row_is_exact(inputs.numbers, 2, inputs.positions[row, column], inputs.offsets[s])
    ):
        image = Projected(image.u, image.v, exact(image.z.value), image.may, image.must)
        outcome = compare(inputs.depth, image)
    return image, outcome


@kernel(parallel=True)
def count_outcomes(inputs, by, turns, fewest, most):
    """Write the fewest and the most samples of every texel that a renderer may count as occluded, (H, W) int32."""
    offsets = offset_rows(inputs, by)
    for j in prange(inputs.depth.shape[0]):
        for i in range(inputs.depth.shape[1]):
            fewest[j, i], most[j, i] = 0, 0
            if not inputs.depth[j, i] < np.inf:
                continue
            rows = point_rows(inputs, by, turns, texel_point(inputs, by, i, j))
            for s in range(offsets.shape[0]):
                _, outcome = trace_sample(inputs, by, turns, i, j, rows, offsets, s)
                fewest[j, i] += np.int32(outcome == OCCLUDED)
                most[j, i] += np.int32(outcome != CLEAR)


@kernel
def trace_samples(inputs, by, turns, column, row, found):
    """Write the image points and outcomes of the samples of one texel, (n, 9) float64.

    A row is u, its error, v, its error, z, its error, whether it may and must lie in the domain, the outcome.
    """
    offsets = offset_rows(inputs, by)
    rows = point_rows(inputs, by, turns, texel_point(inputs, by, column, row))
    for s in range(offsets.shape[0]):
        image, outcome = trace_sample(inputs, by, turns, column, row, rows, offsets, s)
        found[s, 0], found[s, 1] = image.u
        found[s, 2], found[s, 3] = image.v
        found[s, 4], found[s, 5] = image.z
        found[s, 6], found[s, 7], found[s, 8] = image.may, image.must, outcome
