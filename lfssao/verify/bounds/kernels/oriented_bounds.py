"""``oriented-hemisphere`` on pairs: sums of weights of points that the surface hides.

A point's weight is an interval: of each texel that its place may lie in, 0 if that may be none or may not hide it. No
term of a place P + R (x t + y b + z n), with t, b, n pairs, is rounded more often than a disk's (``disk_bounds``).
"""

import numpy as np
from numba import prange

from lfssao.ao.estimators.kernels.oriented import ANY, NEAR
from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.disk_bounds import ROUNDINGS, frame_of, place_of
from lfssao.verify.bounds.kernels.pairs import FLUSHED, SAFETY, Pair, exact, plus, subtract, times
from lfssao.verify.bounds.kernels.projection_bounds import at_point, image_of, row_of
from lfssao.verify.bounds.kernels.seen_bounds import box_of, mapping_of, surface_of, texel_of, triple, turn_of

_OPEN = 2.0**-10  # width from which a weight counts as undecided


@kernel(inline=True)
def side_of(seen, half, j, i, by):
    """The vector c right + s up of a texel, three pairs."""
    c, s = turn_of(seen, j, i)
    return plus(times(triple(seen.right), exact(c), by), times(triple(half.up), exact(s), by), by)


@kernel(inline=True)
def offset_of(point, frame, normal, by):
    """The place of a point from a texel's, in radii: three pairs."""
    k, (x, y, z) = ROUNDINGS * by.operation, point
    along = plus(times(frame[0], Pair(x, k * abs(x)), by), times(frame[1], Pair(y, k * abs(y)), by), by)
    return plus(along, times(normal, Pair(z, k * abs(z)), by), by)


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
def weight_at(half, z, here, surface, by):
    """The least and largest weight of a point of cast depth z before a surface; here: cast depth of its texel."""
    ahead, bias = subtract(z, surface, by), Pair(half.bias, 8.0 * by.operation * half.bias + FLUSHED)
    # z - bias, or surface + bias, may be rounded in place of their difference.
    slack = by.operation * (abs(z.value) + z.error + abs(surface.value) + surface.error + 2.0 * half.bias)
    error = (ahead.error + slack + bias.error) * SAFETY
    if ahead.value + error < bias.value:
        return 0.0, 0.0
    least, most = weight_of(half, subtract(here, surface, by), by)
    return least if ahead.value - error >= bias.value else 0.0, most


@kernel(parallel=True)
def sum_weights(seen, half, background, by, sums):
    """Write the least and largest mean weight of every texel's points, and its undecided points, (3, H, W) float64.

    Sums are not rounded yet. ``background`` is the weight of a point that looks at it.
    """
    n = half.points.shape[0]
    for j in prange(seen.depth.shape[0]):
        for i in range(seen.depth.shape[1]):
            point, normal = triple(seen.positions[j, i]), triple(seen.normals[j, i])
            here = row_of(seen.axis, 0, at_point(point), by.operation)
            frame = frame_of(side_of(seen, half, j, i, by), normal, by)
            for s in range(n if seen.depth[j, i] < np.inf else 0):
                place = place_of(point, half.radius, offset_of(half.points[s], frame, normal, by))
                z = row_of(seen.axis, 0, place, by.operation)
                box = box_of(seen.depth.shape, image_of(mapping_of(seen), place, by))
                least, most = box.least, box.most
                for k in range(box.texels):
                    surface, weight = surface_of(seen, *texel_of(box, k)), (background, background)
                    if surface.value < np.inf:
                        weight = weight_at(half, z, here, surface, by)
                    least, most = min(least, weight[0]), max(most, weight[1])
                sums[0, j, i] += least / n
                sums[1, j, i] += most / n
                sums[2, j, i] += 1.0 if most - least > _OPEN else 0.0
