"""``vo-points`` and ``vo-points-normal`` on pairs: sums of weighted points of each texel's ball that are hidden.

VO's offset is made of a point by two reflections; no term of it, taken through them and a row in either order, is
rounded more than ``_ROUNDINGS`` times, so a coordinate is off by that times the sizes of its terms. The reflection by
the tangent plane is no decision: its lift min(above, 0) has no jump, so an error of ``above`` is one of the place.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import MATRIX
from lfssao.verify.bounds.kernels.pairs import FLUSHED, SAFETY, Pair, exact
from lfssao.verify.bounds.kernels.projection_bounds import point_row, project, rows_of_point, turned_offset, widen
from lfssao.verify.bounds.kernels.ssao_bounds import box_of, mapping_of, texel_point, turn_of

_ROUNDINGS = 24  # of a term of a turned and reflected offset, rows included; 19 if they are counted
_SMALLEST = 2.0**-126


class Ball(NamedTuple):
    """The ball of ``vo-points`` around each texel's place; lengths are in world units."""

    fractions: Any  # (n,) float64: weights of the points, their sum 1
    mirrors: Any  # (3, T, T) float64: direction of a texel's mirror, in tiles of T x T texels; zeros for none
    normals: Any  # (H, W, 3) float32: normals of the tangent planes; (0, 0, 3) for none
    directions: Any  # (H, W, 3) float32: viewing directions, read for a thickness; (0, 0, 3) for an infinite one
    axis: Any  # (4,) float64: the last row of ``cast_from_world``, each number a float32
    radius: float
    thickness: float


@kernel(inline=True)
def _dot(a, b):
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]


@kernel(inline=True)
def _sizes(a):
    return abs(a[0]), abs(a[1]), abs(a[2])


@kernel(inline=True)
def _minus(a, factor, b):
    """Vector a - factor b."""
    return a[0] - factor * b[0], a[1] - factor * b[1], a[2] - factor * b[2]


@kernel(inline=True)
def reflect(offset, sizes, mirror, normal, by):
    """An offset after both reflections, and the sizes of its coordinates' terms, which came with sizes."""
    unit = _sizes(mirror)
    turned = _minus(offset, 2.0 * _dot(mirror, offset), mirror)
    sizes = _minus(sizes, -2.0 * _dot(unit, sizes), unit)
    above, size = _dot(turned, normal), _dot(sizes, _sizes(normal))
    k = _ROUNDINGS * by.operation
    if not above < k * (1.0 + k) * size:
        return turned, sizes
    return _minus(turned, 2.0 * min(above, 0.0), normal), _minus(sizes, -2.0 * size, _sizes(normal))


@kernel(inline=True)
def cast_depth(axis, place, by):
    """Cast z of a place, three pairs."""
    depth = point_row(axis, 0, place, by.operation)
    return Pair(depth.value, depth.error * SAFETY)


@kernel(parallel=True)
def write_cast_depths(inputs, axis, by, low, high):
    """Write the least and largest cast z of each texel's surface, (H, W) float64; its depth but for a camera's."""
    for j in prange(inputs.depth.shape[0]):
        for i in range(inputs.depth.shape[1]):
            depth = exact(np.float64(inputs.depth[j, i]))
            if inputs.kind == MATRIX and depth.value < np.inf:
                depth = cast_depth(axis, texel_point(inputs, by, i, j), by)
            low[j, i], high[j, i] = depth.value - depth.error, depth.value + depth.error


@kernel(inline=True)
def reach_of(ball, row, column, by):
    """Cast z by which a surface hides behind its depth, with its error; infinite without a thickness."""
    if ball.directions.shape[0] == 0:
        return Pair(np.inf, 0.0)
    w = ball.directions[row, column]
    way = np.float64(w[0]), np.float64(w[1]), np.float64(w[2])
    size = ball.thickness * _dot(_sizes(way), _sizes(ball.axis))
    error = size * (8.0 * by.operation + by.quotient) * SAFETY + FLUSHED * (1.0 + ball.thickness)
    return Pair(ball.thickness * _dot(way, ball.axis), error)


@kernel(inline=True)
def place_of(inputs, ball, turns, row, column, s, by):
    """World coordinates of a point of a texel's ball, three pairs."""
    tile, normal = ball.mirrors.shape[1], (0.0, 0.0, 0.0)
    if ball.normals.shape[0] != 0:
        n = ball.normals[row, column]
        normal = np.float64(n[0]), np.float64(n[1]), np.float64(n[2])
    offset = inputs.offsets[s][0], inputs.offsets[s][1], inputs.offsets[s][2]
    sizes = _sizes(offset)
    if turns is not None:
        offset, sizes = turned_offset(offset, turn_of(turns, column, row))
    offset, sizes = reflect(offset, sizes, ball.mirrors[:, row % tile, column % tile], normal, by)
    here, k = inputs.positions[row, column], _ROUNDINGS * by.operation
    factor, flushed = k * (1.0 + k), FLUSHED * (1.0 + ball.radius)
    return (
        Pair(here[0] + offset[0], factor * (abs(here[0]) + sizes[0]) + flushed),
        Pair(here[1] + offset[1], factor * (abs(here[1]) + sizes[1]) + flushed),
        Pair(here[2] + offset[2], factor * (abs(here[2]) + sizes[2]) + flushed),
    )


@kernel(inline=True)
def is_hidden(inputs, image, depth, reach, low, high, by):
    """Whether a point of a cast depth may be, and is for sure, hidden at its image point."""
    box = box_of(inputs.depth.shape, image)
    if not (box.may and box.known):
        return box.may, False
    may, must = False, box.must
    for j in range(box.j0, box.j1 + 1):
        for i in range(box.i0, box.i1 + 1):
            nearest, farthest = depth.value - depth.error - high[j, i], depth.value + depth.error - low[j, i]
            slack = reach.error + by.operation * abs(farthest)
            may |= farthest > 0.0 and (nearest <= reach.value + slack or reach.value == np.inf)
            must &= nearest > 2.0 * _SMALLEST and (farthest <= reach.value - slack or reach.value == np.inf)
    return may, must


@kernel(parallel=True)
def sum_hidden(inputs, ball, low, high, by, turns, fewest, most, undecided):
    """Write the least and largest fraction of every texel's ball that a renderer may find hidden, (H, W) float64.

    Sums are not rounded yet. ``low`` and ``high`` are those of ``write_cast_depths``; ``undecided``, (H, W) int32,
    gets the number of undecided points.
    """
    for j in prange(inputs.depth.shape[0]):
        for i in range(inputs.depth.shape[1]):
            fewest[j, i], most[j, i], undecided[j, i] = 0.0, 0.0, 0
            if not inputs.depth[j, i] < np.inf:
                continue
            reach = reach_of(ball, j, i, by)
            for s in range(inputs.offsets.shape[0]):
                place = place_of(inputs, ball, turns, j, i, s, by)
                rows = rows_of_point(mapping_of(inputs), place, by.operation)
                image = widen(project(mapping_of(inputs), rows, by), by)
                depth = cast_depth(ball.axis, place, by) if inputs.kind == MATRIX else image.z
                may, must = is_hidden(inputs, image, depth, reach, low, high, by)
                fewest[j, i] += ball.fractions[s] if must else 0.0
                most[j, i] += ball.fractions[s] if may else 0.0
                undecided[j, i] += np.int32(may and not must)
