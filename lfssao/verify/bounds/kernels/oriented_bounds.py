"""``oriented-hemisphere`` on pairs: sums of weights of points that the surface hides.

A point's weight is an interval: of each texel that its place may lie in, 0 if that may be none or may not hide it. No
term of a place P + R (x t + y b + z n), with t, b, n pairs, is rounded more often than a disk's (``disk_bounds``).
"""

from typing import Any, NamedTuple

import numpy as np
from numba import prange

from lfssao.ao.estimators.kernels.oriented import ANY, NEAR
from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.disk_bounds import ROUNDINGS, frame_of, image_of, place_of
from lfssao.verify.bounds.kernels.pairs import FLUSHED, SAFETY, Pair, add, exact, subtract, times
from lfssao.verify.bounds.kernels.projection_bounds import TURNED, point_row
from lfssao.verify.bounds.kernels.ssao_bounds import box_of, turn_of, vector

_OPEN = 2.0**-10  # width from which a weight counts as undecided


class HalfBall(NamedTuple):
    """The points above each texel's surface; numbers are float32 ones, held as float64."""

    points: Any  # (n, 3): in the frame (t, b, n), z >= 0
    normals: Any  # (H, W, 3) float32
    right: Any  # (3,): the view's rightward and upward directions
    up: Any
    axis: Any  # (4,): the last row of ``cast_from_world``
    radius: float  # world units
    reach: float  # R and bias, in units of cast z
    bias: float
    range_check: int
    background: float  # weight of a point that looks at background


@kernel(inline=True)
def side_of(half, turns, column, row, by):
    """The vector c right + s up of a texel, three pairs."""
    a, b = half.right, half.up
    c, s = (1.0, 0.0) if turns is None else turn_of(turns, column, row)
    e = times((exact(a[0]), exact(a[1]), exact(a[2])), exact(c), by)
    f = times((exact(b[0]), exact(b[1]), exact(b[2])), exact(s), by)
    return add(e[0], f[0], by), add(e[1], f[1], by), add(e[2], f[2], by)


@kernel(inline=True)
def offset_of(half, s, frame, normal, by):
    """The place of point s from a texel's point, in radii: three pairs."""
    k = ROUNDINGS * by.operation
    x, y, z = half.points[s, 0], half.points[s, 1], half.points[s, 2]
    a = times(frame[0], Pair(x, k * abs(x)), by)
    b = times(frame[1], Pair(y, k * abs(y)), by)
    c = times(normal, Pair(z, k * abs(z)), by)
    return (
        add(add(a[0], b[0], by), c[0], by),
        add(add(a[1], b[1], by), c[1], by),
        add(add(a[2], b[2], by), c[2], by),
    )


@kernel(inline=True)
def smooth(part):
    """The weight part^2 (3 - 2 part), part held in [0, 1]."""
    part = min(part, 1.0)
    return part * part * (3.0 - 2.0 * part)


@kernel(inline=True)
def weight_of(half, far, by):
    """The least and largest weight of a hidden point, far the difference of depths that the range check reads."""
    error, r = far.error * SAFETY, 4.0 * by.operation
    if half.range_check == ANY:
        return 1.0, 1.0
    nearest, farthest = max(abs(far.value) - error, 0.0), abs(far.value) + error
    if half.range_check == NEAR:
        sure, may = farthest < half.reach * (1.0 - r), nearest <= half.reach * (1.0 + r)
        return 1.0 if sure else 0.0, 1.0 if may else 0.0
    # Either part^2 (3 - 2 part) or 3 part^2 - 2 part^3: part^2 is at most the weight, and up to 17 of it are rounded.
    off, r = 20.0 * by.operation, r + by.quotient
    least, most = half.reach * (1.0 - r), half.reach * (1.0 + r)
    low = 1.0 if farthest <= least else max(smooth(least / farthest) * (1.0 - off) - FLUSHED, 0.0)
    return low, 1.0 + off if nearest <= most else smooth(most / nearest) * (1.0 + off) + FLUSHED


@kernel(inline=True)
def weight_range(inputs, half, image, z, here, low, high, by):
    """The least and largest weight of a point of cast depth z at an image point; here: cast depth of its texel."""
    box = box_of(inputs.depth.shape, image)
    if not (box.may and box.known):
        return 0.0, 1.0 if box.may else 0.0
    least, most, bias = 1.0 if box.must else 0.0, 0.0, Pair(half.bias, 8.0 * by.operation * half.bias + FLUSHED)
    for j in range(box.j0, box.j1 + 1):
        for i in range(box.i0, box.i1 + 1):
            smallest, largest = half.background, half.background
            if low[j, i] < np.inf:
                surface = Pair(0.5 * (low[j, i] + high[j, i]), 0.5 * (high[j, i] - low[j, i]))
                ahead = subtract(z, surface, by)
                # z - bias, or surface + bias, may be rounded in place of their difference.
                slack = by.operation * (abs(z.value) + z.error + abs(surface.value) + surface.error + 2.0 * half.bias)
                error = (ahead.error + slack + bias.error) * SAFETY
                smallest, largest = 0.0, 0.0
                if not ahead.value + error < bias.value:
                    smallest, largest = weight_of(half, subtract(here, surface, by), by)
                    smallest = smallest if ahead.value - error >= bias.value else 0.0
            least, most = min(least, smallest), max(most, largest)
    return least, most


@kernel(parallel=True)
def sum_weights(inputs, half, low, high, by, turns, fewest, most, undecided):
    """Write the least and largest mean weight of every texel's points, (H, W) float64; sums are not rounded yet.

    ``low`` and ``high`` are those of ``volume_bounds.write_cast_depths``; ``undecided``, (H, W) int32, gets the number
    of points whose weight is open.
    """
    n = half.points.shape[0]
    for j in prange(inputs.depth.shape[0]):
        for i in range(inputs.depth.shape[1]):
            fewest[j, i], most[j, i], undecided[j, i] = 0.0, 0.0, 0
            if not inputs.depth[j, i] < np.inf:
                continue
            point, normal = vector(inputs.positions, j, i), vector(half.normals, j, i)
            frame = frame_of(side_of(half, turns, i, j, by), normal, by)
            here = point_row(half.axis, 0, point, by.operation)
            for k in range(n):
                place = place_of(half.radius, point, offset_of(half, k, frame, normal, by))
                z = point_row(half.axis, 0, place, by.operation, TURNED)
                least, largest = weight_range(inputs, half, image_of(inputs, place, by), z, here, low, high, by)
                fewest[j, i] += least / n
                most[j, i] += largest / n
                undecided[j, i] += np.int32(largest - least > _OPEN)
