"""Ambient occlusion at several resolutions, coarse to fine, with joint bilateral upsampling (after Hoang and Low).

A level is a texture of texel numbers: which texel of the full textures each of its texels stands for, -1 for none. So
every position and normal that is read is one that the G-buffer holds.
"""

from math import sqrt

import numpy as np
from numba import prange

from lfssao.kernels.jit import kernel

BOTH, MAXIMUM, AVERAGE = 0, 1, 2


@kernel
def first_level(depth, level):
    """The finest level, every texel for itself; depth: (H, W), level: (H, W) int32, out."""
    height, width = depth.shape
    for j in range(height):
        for i in range(width):
            level[j, i] = j * width + i if depth[j, i] < np.inf else -1


@kernel(inline=True)
def _ranks_before(depth, width, one, k, other, n):
    """Whether candidate ``other``, the n-th, comes before candidate ``one``, the k-th, by depth and then by order."""
    a, b = depth[one // width, one % width], depth[other // width, other % width]
    return (b < a) | ((b == a) & (n < k))


@kernel(parallel=True)
def halve(depth, fine, coarse):
    """The next coarser level: of each 2 x 2 texels that see a surface the lower median by depth.

    Parameters
    ----------
    depth : (H, W)
        The full depth texture.
    fine, coarse : (h, w), (ceil(h / 2), ceil(w / 2)) int32
        A level; out, the next.
    """
    for j in prange(coarse.shape[0]):
        for i in range(coarse.shape[1]):
            seen = 0
            for k in range(4):
                y, x = 2 * j + k // 2, 2 * i + k % 2
                seen += np.int64(y < fine.shape[0] and x < fine.shape[1] and fine[y, x] >= 0)
            coarse[j, i] = -1
            for k in range(4):
                y, x = 2 * j + k // 2, 2 * i + k % 2
                if not (y < fine.shape[0] and x < fine.shape[1] and fine[y, x] >= 0):
                    continue
                rank = 0
                for n in range(4):
                    v, u = 2 * j + n // 2, 2 * i + n % 2
                    if n != k and v < fine.shape[0] and u < fine.shape[1] and fine[v, u] >= 0:
                        rank += np.int64(_ranks_before(depth, depth.shape[1], fine[y, x], k, fine[v, u], n))
                if rank == (seen - 1) // 2:
                    coarse[j, i] = fine[y, x]


@kernel(inline=True)
def obscured(vx, vy, vz, nx, ny, nz, squared):
    """What a point at v from a point of normal n takes: (1 - v.v / R^2) max(0, v.n) / sqrt(v.v) inside R, else 0."""
    zero = type(vx)(0)
    d = (vx * vx + vy * vy) + vz * vz
    above = (vx * nx + vy * ny) + vz * nz
    if not ((d > 0) & (d < squared) & (above > 0)):
        return zero
    return (type(d)(1) - d / squared) * (above / sqrt(d))


@kernel(parallel=True)
def level_occlusion(level, places, facing, reach, squared, occlusion, outside):
    """Occlusion of one level from the square of texels around each.

    Parameters
    ----------
    level : (h, w) int32
        The level.
    places, facing : (H * W, 3) float32 or float64
        Positions and unit normals of the full textures.
    reach : int
        The square has 2 reach + 1 texels along an edge; its (2 reach + 1)^2 - 1 taps are taken row by row.
    squared : scalar, same dtype
        R squared, world units.
    occlusion : (h, w), same dtype
        Out: sum of what the taps take over their number; 0 where there is no surface.
    outside : (h,) int64
        Out: taps of each row that lie outside the texture; they take nothing.
    """
    height, width = level.shape
    zero = occlusion.dtype.type(0)
    number = occlusion.dtype.type((2 * reach + 1) * (2 * reach + 1) - 1)
    for j in prange(height):
        beyond = 0
        for i in range(width):
            occlusion[j, i] = zero
            at = level[j, i]
            if at < 0:
                continue
            px, py, pz = places[at, 0], places[at, 1], places[at, 2]
            nx, ny, nz = facing[at, 0], facing[at, 1], facing[at, 2]
            total = zero
            for y in range(j - reach, j + reach + 1):
                for x in range(i - reach, i + reach + 1):
                    if not (0 <= y < height and 0 <= x < width):
                        beyond += 1
                        continue
                    tap = level[y, x]
                    if tap >= 0 and tap != at:
                        total += obscured(
                            places[tap, 0] - px, places[tap, 1] - py, places[tap, 2] - pz, nx, ny, nz, squared
                        )  # fmt: skip
            occlusion[j, i] = total / number
        outside[j] = beyond


@kernel(inline=True)
def _weight(places, facing, p, q, radius):
    """How much coarse texel q counts for fine texel p: by normals ((1 + n.m) / 2)^8, by depth (R / (R + s))^16.

    s is the distance of q from p's tangent plane. The powers are squarings.
    """
    one = radius - radius + places.dtype.type(1)
    half = places.dtype.type(0.5)
    s = (places[q, 0] - places[p, 0]) * facing[p, 0] + (places[q, 1] - places[p, 1]) * facing[p, 1]
    s = abs(s + (places[q, 2] - places[p, 2]) * facing[p, 2])
    a = (facing[p, 0] * facing[q, 0] + facing[p, 1] * facing[q, 1]) + facing[p, 2] * facing[q, 2]
    a = half * (one + a)
    a = a * a
    a = a * a
    a = a * a
    sum_ = radius + s
    b = radius / sum_ if (sum_ > 0) & (sum_ < np.inf) else one - one
    b = b * b
    b = b * b
    b = b * b
    b = b * b
    w = a * b
    return w if w < np.inf else one - one


@kernel(parallel=True)
def refine(fine, coarse, places, facing, radius, coarse_most, coarse_sum, most, total):
    """Carry the maximum and the sum over levels from a coarse level to the next finer one, where it has been estimated.

    Parameters
    ----------
    fine, coarse : (h, w), (ceil(h / 2), ceil(w / 2)) int32
        The levels.
    places, facing : (H * W, 3)
        Positions and unit normals of the full textures.
    radius : scalar
        R, world units.
    coarse_most, coarse_sum : (ceil(h / 2), ceil(w / 2))
        Maximum and sum over the coarser levels.
    most, total : (h, w)
        In: the fine level's own occlusion, in both. Out: the maximum with, and the sum with, what comes from the four
        coarse texels around, each weighed by 9, 3, 3 or 1 and by ``_weight``, over the sum of the weights; 0 from
        there where that is 0.
    """
    zero = most.dtype.type(0)
    for j in prange(fine.shape[0]):
        for i in range(fine.shape[1]):
            p = fine[j, i]
            if p < 0:
                continue
            weights, high, mean = zero, zero, zero
            for k in range(4):
                # Row k // 2 = 0 is the texel's own coarse row, 1 the next on the side that the texel lies on.
                y = j // 2 + (k // 2) * (2 * (j % 2) - 1)
                x = i // 2 + (k % 2) * (2 * (i % 2) - 1)
                if not (0 <= y < coarse.shape[0] and 0 <= x < coarse.shape[1]) or coarse[y, x] < 0:
                    continue
                share = most.dtype.type((3 - 2 * (k // 2)) * (3 - 2 * (k % 2)))
                w = share * _weight(places, facing, p, coarse[y, x], radius)
                weights += w
                high += w * coarse_most[y, x]
                mean += w * coarse_sum[y, x]
            if weights > zero:
                most[j, i] = max(most[j, i], high / weights)
                total[j, i] = total[j, i] + mean / weights


@kernel(parallel=True)
def combine(most, total, levels, how):
    """Occlusion from maximum and sum over the levels, into ``most``: by MAXIMUM, AVERAGE, or BOTH, held to 0 to 1.

    BOTH is 1 - (1 - maximum) (1 - average).
    """
    zero, one = most.dtype.type(0), most.dtype.type(1)
    number = most.dtype.type(levels)
    for j in prange(most.shape[0]):
        for i in range(most.shape[1]):
            average = total[j, i] / number
            value = average if how == AVERAGE else most[j, i]
            if how == BOTH:
                value = one - (one - most[j, i]) * (one - average)
            most[j, i] = min(max(value, zero), one)
