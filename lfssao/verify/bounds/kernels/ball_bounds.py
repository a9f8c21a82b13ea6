"""Points of each texel's ball on pairs: VO's, of which hidden ones are summed, and those of ``oriented-hemisphere``.

VO's offset is made by two reflections; no term of it, taken through them and a row in either order, is rounded more
than ``_ROUNDINGS`` times besides a row. The reflection by the tangent plane is no decision: its lift has no jump, so an
error of ``above`` is one of the place.

The weight of a point of the half ball is an interval: of each texel that its place may lie in, 0 if that may be none or
may not hide it. No term of a place P + R (x t + y b + z n), with t, b, n pairs, is rounded more often than a disk's
(``disk_bounds``).
"""

import numpy as np

from lfssao.ao.estimators.kernels.oriented import ANY, NEAR
from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.disk_bounds import ROUNDINGS, frame_of, place_of
from lfssao.verify.bounds.kernels.pairs import FLUSHED, SAFETY, Pair, exact, plus, sub, times, triple
from lfssao.verify.bounds.kernels.projection_bounds import TURNED, Place, at_point, row_of
from lfssao.verify.bounds.kernels.seen import look, surface_of, texel_of, texel_point, turn_of

_ROUNDINGS = 16  # of a term of a turned and reflected offset, but for a row's; 14 if they are counted
_SMALLEST = 2.0**-126
_OPEN = 2.0**-10  # width from which a weight counts as undecided


@kernel(inline=True)
def _dot(a, b):
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]


@kernel(inline=True)
def _sizes(a):
    return abs(np.float64(a[0])), abs(np.float64(a[1])), abs(np.float64(a[2]))


@kernel(inline=True)
def _minus(a, factor, b):
    """Vector a - factor b."""
    return a[0] - factor * b[0], a[1] - factor * b[1], a[2] - factor * b[2]


@kernel(inline=True)
def ball_place(seen, ball, s, j, i, by):
    """The place of a point of a texel's ball: turned, reflected by the texel's mirror, then by its tangent plane."""
    tile, (c, d), (x, y, z), r = ball.mirrors.shape[1], turn_of(seen, j, i), ball.offsets[s], seen.radius
    x, y, z = r * x, r * y, r * z
    offset, sizes = (c * x - d * y, d * x + c * y, z), (abs(c * x) + abs(d * y), abs(d * x) + abs(c * y), abs(z))
    mirror, k = ball.mirrors[:, j % tile, i % tile], _ROUNDINGS * by.operation
    offset = _minus(offset, 2.0 * _dot(mirror, offset), mirror)
    sizes = _minus(sizes, -2.0 * _dot(_sizes(mirror), sizes), _sizes(mirror))
    if ball.tangent:
        n = seen.normals[j, i]
        above, size = _dot(offset, n), _dot(sizes, _sizes(n))
        if above < k * (1.0 + k) * size:
            offset = _minus(offset, 2.0 * min(above, 0.0), n)
            sizes = _minus(sizes, -2.0 * size, _sizes(n))
    factor, flushed, (u, v, w), (a, b, e) = k * (1.0 + k), FLUSHED * (1.0 + r), offset, sizes
    moved = Pair(u, factor * a + flushed), Pair(v, factor * b + flushed), Pair(w, factor * e + flushed)
    return Place(texel_point(seen, j, i, by), moved, sizes, TURNED)


@kernel(inline=True)
def reach_of(seen, thickness, j, i, by):
    """Cast z by which a surface of a thickness hides behind its depth, with its error; infinite without one."""
    if not thickness < np.inf:
        return exact(np.inf)
    way = seen.directions[j, i]
    error = thickness * _dot(_sizes(way), _sizes(seen.axis)) * (8.0 * by.operation + by.quotient) * SAFETY
    return Pair(thickness * _dot(way, seen.axis), error + FLUSHED * (1.0 + thickness))


@kernel(inline=True)
def is_hidden(seen, depth, box, reach, by):
    """Whether a point of a cast depth may be, and is for sure, hidden in one of the texels that it may lie in."""
    may, must = box.most > 0.0, box.least > 0.0
    for k in range(box.texels):
        j, i = texel_of(box, k)
        nearest, farthest = depth.value - depth.error - seen.high[j, i], depth.value + depth.error - seen.low[j, i]
        slack = reach.error + by.operation * abs(farthest)
        may |= farthest > 0.0 and (nearest <= reach.value + slack or reach.value == np.inf)
        must &= nearest > 2.0 * _SMALLEST and (farthest <= reach.value - slack or reach.value == np.inf)
    return may, must


@kernel(rows="seen.depth")
def sum_hidden(begin, stop, seen, ball, thickness, by, sums):
    """Write the least and largest hidden fraction of every texel's ball, and its undecided points, (3, H, W)."""
    for j in range(begin, stop):
        for i in range(seen.depth.shape[1]):
            for s in range(ball.weights.shape[0] if seen.depth[j, i] < np.inf else 0):
                place = ball_place(seen, ball, s, j, i, by)
                (_, depth, box), reach = look(seen, place, by), reach_of(seen, thickness, j, i, by)
                may, must = is_hidden(seen, depth, box, reach, by)
                sums[0, j, i] += ball.weights[s] if must else 0.0
                sums[1, j, i] += ball.weights[s] if may else 0.0
                sums[2, j, i] += 1.0 if may and not must else 0.0


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
    ahead, bias = sub(z, surface, by), Pair(half.bias, 8.0 * by.operation * half.bias + FLUSHED)
    # z - bias, or surface + bias, may be rounded in place of their difference.
    slack = by.operation * (abs(z.value) + z.error + abs(surface.value) + surface.error + 2.0 * half.bias)
    error = (ahead.error + slack + bias.error) * SAFETY
    if ahead.value + error < bias.value:
        return 0.0, 0.0
    least, most = weight_of(half, sub(here, surface, by), by)
    return least if ahead.value - error >= bias.value else 0.0, most


@kernel(rows="seen.depth")
def sum_weights(begin, stop, seen, half, background, by, sums):
    """Write the least and largest mean weight of points, ``background`` at no surface, and those open, (3, H, W)."""
    n = half.points.shape[0]
    for j in range(begin, stop):
        for i in range(seen.depth.shape[1]):
            point, normal = triple(seen.positions[j, i]), triple(seen.normals[j, i])
            here = row_of(seen.axis, 0, at_point(point), by.operation)
            c, d = turn_of(seen, j, i)
            side = plus(times(triple(seen.right), exact(c), by), times(triple(half.up), exact(d), by), by)
            frame = frame_of(side, normal, by)
            for s in range(n if seen.depth[j, i] < np.inf else 0):
                place = place_of(point, half.radius, offset_of(half.points[s], frame, normal, by))
                z, (_, _, box) = row_of(seen.axis, 0, place, by.operation), look(seen, place, by)
                least, most = box.least, box.most
                for k in range(box.texels):
                    surface, weight = surface_of(seen, *texel_of(box, k)), (background, background)
                    if surface.value < np.inf:
                        weight = weight_at(half, z, here, surface, by)
                    least, most = min(least, weight[0]), max(most, weight[1])
                sums[0, j, i] += least / n
                sums[1, j, i] += most / n
                sums[2, j, i] += 1.0 if most - least > _OPEN else 0.0
