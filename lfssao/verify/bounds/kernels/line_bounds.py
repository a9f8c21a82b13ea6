"""``vo-lines`` and ``vo-lines-normal`` on pairs: sums of weighted hidden lengths of lines through each texel's ball.

A line's length is an interval: each texel that its place may lie in gives one, of the pair d = (z_Q - z_S) / (R w_z),
and a place that may lie in none gives 0.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import MATRIX
from lfssao.verify.bounds.kernels.disk_bounds import deep_of, frame_of, image_of, offset_of, place_of, plane_of, way_of
from lfssao.verify.bounds.kernels.pairs import (
    FLUSHED,
    SAFETY,
    Pair,
    add,
    divide,
    exact,
    multiply,
    subtract,
)
from lfssao.verify.bounds.kernels.projection_bounds import TURNED, point_row
from lfssao.verify.bounds.kernels.ssao_bounds import box_of, vector


class Lines(NamedTuple):
    """The lines of ``vo-lines`` through each texel's ball; numbers are float32 ones, held as float64."""

    places: Any  # (n, 2): x and y in the unit disk
    half: Any  # (n,): half of the ball's extent along each line, in radii
    units: Any  # (n,): weights of a unit of length
    mirrors: Any  # (2, T, T): cosine and sine of a texel's reflection, in tiles of T x T texels
    normals: Any  # (H, W, 3) float32: normals of the tangent planes; (0, 0, 3) for none
    directions: Any  # (H, W, 3) float32: viewing directions
    axis: Any  # (4,): the last row of ``cast_from_world``
    right: Any  # (3,): the view's rightward direction
    radius: float  # world units
    thickness: float  # in radii, infinite for none


@kernel(inline=True)
def tops_of(lines, column, row, way, offset, half, by):
    """The least and largest end of a line: at the tangent plane, or half the ball's extent."""
    if lines.normals.shape[0] == 0:
        return half, half
    plane = plane_of(vector(lines.normals, row, column), way, offset, by)
    error = plane.error * SAFETY
    return min(plane.value - error, half), min(plane.value + error, half)


@kernel(inline=True)
def length_of(thickness, half, tops, d, by):
    """The least and largest hidden length of a line where the surface is met at d."""
    error = d.error * SAFETY
    if not error < np.inf:
        return 0.0, 2.0 * half
    least, most = tops
    if thickness < np.inf:
        back = add(d, Pair(thickness, thickness * (2.0 * by.operation + by.quotient)), by)
        least = min(least, back.value - back.error * SAFETY)
        most = min(most, back.value + back.error * SAFETY)
    least -= max(d.value + error, -half)
    most -= max(d.value - error, -half)
    r = 2.0 * by.operation
    return max(least * (1.0 - r) - FLUSHED, 0.0), most * (1.0 + r) + FLUSHED if most > 0.0 else 0.0


@kernel(inline=True)
def hidden_length(inputs, lines, s, image, z, steep, tops, low, high, by):
    """The least and largest hidden length of line s, and whether its place lies in one texel, or in none, for sure."""
    box, half = box_of(inputs.depth.shape, image), lines.half[s]
    if not (box.may and box.known):
        return 0.0, 2.0 * half if box.may else 0.0, not box.may
    least, most = 2.0 * half if box.must else 0.0, 0.0
    for j in range(box.j0, box.j1 + 1):
        for i in range(box.i0, box.i1 + 1):
            shortest, longest = 0.0, 0.0
            if low[j, i] < np.inf:
                surface = Pair(0.5 * (low[j, i] + high[j, i]), 0.5 * (high[j, i] - low[j, i]))
                d = multiply(subtract(surface, z, by), steep, by)
                shortest, longest = length_of(lines.thickness, half, tops, d, by)
            least, most = min(least, shortest), max(most, longest)
    return least, most, box.must and box.i0 == box.i1 and box.j0 == box.j1


@kernel(parallel=True)
def sum_lengths(inputs, lines, low, high, by, turns, fewest, most, undecided):
    """Write the least and largest hidden fraction of every texel's ball, (H, W) float64; sums are not rounded yet.

    ``low`` and ``high`` are those of ``volume_bounds.write_cast_depths``; ``undecided``, (H, W) int32, gets the number
    of lines that may be looked up in several texels.
    """
    for j in prange(inputs.depth.shape[0]):
        for i in range(inputs.depth.shape[1]):
            fewest[j, i], most[j, i], undecided[j, i] = 0.0, 0.0, 0
            way, r = way_of(lines.directions, j, i), lines.right
            deep, may, must = deep_of(lines, way, by)
            if not (may and inputs.depth[j, i] < np.inf):
                continue
            frame, steep = frame_of((exact(r[0]), exact(r[1]), exact(r[2])), way, by), divide(exact(1.0), deep, by)
            for s in range(lines.half.shape[0]):
                offset = offset_of(lines, s, frame, turns, i, j, 0.0, by)
                place = place_of(lines.radius, vector(inputs.positions, j, i), offset)
                image = image_of(inputs, place, by)
                z = point_row(lines.axis, 0, place, by.operation, TURNED) if inputs.kind == MATRIX else image.z
                tops = tops_of(lines, i, j, way, offset, lines.half[s], by)
                least, longest, sure = hidden_length(inputs, lines, s, image, z, steep, tops, low, high, by)
                fewest[j, i] += max(lines.units[s] * least - FLUSHED, 0.0) if must else 0.0
                most[j, i] += lines.units[s] * longest + FLUSHED if longest > 0.0 else 0.0
                undecided[j, i] += np.int32(not (sure and must))
