"""Points of VO's ball around each texel on pairs, of which hidden ones are summed.

VO's offset is made by two reflections; no term of it, taken through them and a row in either order, is rounded more
than ``_ROUNDINGS`` times besides a row. The reflection by the tangent plane is no decision: its lift has no jump, so an
error of ``above`` is one of the place.
"""

import numpy as np

from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.old_seen import look, texel_of, texel_point, turn_of
from lfssao.verify.bounds.kernels.pairs import FLUSHED, SAFETY, Pair, exact
from lfssao.verify.bounds.kernels.projection_bounds import TURNED, Place

_ROUNDINGS = 16  # of a term of a turned and reflected offset, but for a row's; 14 if they are counted
_SMALLEST = 2.0**-126


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
