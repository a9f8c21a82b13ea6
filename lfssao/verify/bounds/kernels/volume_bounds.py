"""VO on pairs: sums of weighted points of each texel's ball that are hidden, and of weighted hidden lengths of lines.

A point's offset is made by two reflections; no term of it, taken through them and a row in either order, is rounded
more than ``_ROUNDINGS`` times besides a row. The reflection by the tangent plane is no decision: its lift has no jump,
so an error of ``above`` is one of the place.

A line's length is an interval: each texel that its place may lie in gives one, of the pair d = (z_Q - z_S) / (R w_z),
and a place that may lie in none gives 0.
"""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.disk_bounds import deep_of, frame_of, mirror_of, offset_of, place_of, plane_of, way_of
from lfssao.verify.bounds.kernels.pairs import FLUSHED, SAFETY, Pair, add, divide, exact, multiply, subtract
from lfssao.verify.bounds.kernels.projection_bounds import TURNED, Place, image_of
from lfssao.verify.bounds.kernels.seen_bounds import (
    box_of,
    cast_depth,
    mapping_of,
    surface_of,
    texel_of,
    texel_point,
    triple,
    turn_of,
)

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
def is_hidden(seen, image, depth, reach, by):
    """Whether a point of a cast depth may be, and is for sure, hidden at its image point."""
    box = box_of(seen.depth.shape, image)
    may, must = box.most > 0.0, box.least > 0.0
    for k in range(box.texels):
        j, i = texel_of(box, k)
        nearest, farthest = depth.value - depth.error - seen.high[j, i], depth.value + depth.error - seen.low[j, i]
        slack = reach.error + by.operation * abs(farthest)
        may |= farthest > 0.0 and (nearest <= reach.value + slack or reach.value == np.inf)
        must &= nearest > 2.0 * _SMALLEST and (farthest <= reach.value - slack or reach.value == np.inf)
    return may, must


@kernel(parallel=True)
def sum_hidden(seen, ball, thickness, by, sums):
    """Write the least and largest fraction of every texel's ball that is hidden, and its undecided points, (3, H, W).

    Sums are not rounded yet.
    """
    for j in prange(seen.depth.shape[0]):
        for i in range(seen.depth.shape[1]):
            for s in range(ball.weights.shape[0] if seen.depth[j, i] < np.inf else 0):
                place = ball_place(seen, ball, s, j, i, by)
                image = image_of(mapping_of(seen), place, by)
                depth, reach = cast_depth(seen, place, image, by), reach_of(seen, thickness, j, i, by)
                may, must = is_hidden(seen, image, depth, reach, by)
                sums[0, j, i] += ball.weights[s] if must else 0.0
                sums[1, j, i] += ball.weights[s] if may else 0.0
                sums[2, j, i] += 1.0 if may and not must else 0.0


@kernel(inline=True)
def tops_of(seen, disk, way, offset, half, j, i, by):
    """The least and largest end of a line: at the tangent plane, or half the ball's extent."""
    if not disk.tangent:
        return half, half
    plane = plane_of(triple(seen.normals[j, i]), way, offset, by)
    error = plane.error * SAFETY
    return min(plane.value - error, half), min(plane.value + error, half)


@kernel(inline=True)
def length_of(thickness, half, tops, d, by):
    """The least and largest hidden length of a line where the surface is met at d; thickness: in radii."""
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


@kernel(parallel=True)
def sum_lengths(seen, disk, thickness, by, sums):
    """Write the least and largest hidden fraction of every texel's ball, and its lines in doubt, (3, H, W).

    Sums are not rounded yet. A line is in doubt if it may be looked up in several texels.
    """
    for j in prange(seen.depth.shape[0]):
        for i in range(seen.depth.shape[1]):
            way = way_of(seen, j, i)
            deep, may, must = deep_of(seen, way, by)
            frame, steep = frame_of(triple(seen.right), way, by), divide(exact(1.0), deep, by)
            mirror = mirror_of(disk.mirrors, j, i)
            for s in range(disk.half.shape[0] if may and seen.depth[j, i] < np.inf else 0):
                half, weight = disk.half[s], disk.weights[s]
                offset = offset_of(seen, disk.places[s, 0], disk.places[s, 1], mirror, frame, j, i, 0.0, by)
                place = place_of(texel_point(seen, j, i, by), seen.radius, offset)
                image = image_of(mapping_of(seen), place, by)
                z, box = cast_depth(seen, place, image, by), box_of(seen.depth.shape, image)
                least, most = 2.0 * half * box.least, 2.0 * half * box.most
                for k in range(box.texels):
                    surface, length = surface_of(seen, *texel_of(box, k)), (0.0, 0.0)
                    if surface.value < np.inf:
                        tops = tops_of(seen, disk, way, offset, half, j, i, by)
                        length = length_of(thickness, half, tops, multiply(subtract(surface, z, by), steep, by), by)
                    least, most = min(least, length[0]), max(most, length[1])
                sums[0, j, i] += max(weight * least - FLUSHED, 0.0) if must else 0.0
                sums[1, j, i] += weight * most + FLUSHED if most > 0.0 else 0.0
                sums[2, j, i] += 0.0 if box.sure and must else 1.0
