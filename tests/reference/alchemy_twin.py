"""lfssao.kernels.alchemy and power a second time, one texel and one tap at a time. Nothing here comes from lfssao."""

import math

import numpy as np

from reference import point_twin, twins
from reference import spiral as spiral_twin


def log(x):
    if x in (0.0, math.inf):
        return -math.inf if x == 0.0 else x
    if not x > 0.0:
        return math.nan
    fraction, k = math.frexp(x)  # in [1/2, 1)
    if fraction < 0.7071067811865476:
        fraction, k = 2.0 * fraction, k - 1
    s = (fraction - 1.0) / (fraction + 1.0)
    series = 1.0 / 23.0
    for n in range(21, 1, -2):
        series = series * (s * s) + 1.0 / n
    return k * twins.LN2_HIGH + ((2.0 * s + 2.0 * s * (s * s * series)) + k * twins.LN2_LOW)


def power(x, k):
    if k in (0.0, 1.0):
        return x if k else 1.0
    return twins.exp(k * log(x)) if x > 0.0 else 0.0


def dot(a, b):
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]


def disk_axes(d):
    x, y, z = d
    one = type(x)(1)
    sign = one if z >= 0 else -one
    a = -one / (sign + z)
    b = x * y * a
    return (one + sign * x * x * a, sign * b, -sign * x), (b, sign + y * y * a, -y)


@np.errstate(all="ignore")
def alchemy(depth, positions, normals, directions, taps, kind, m, away, radius, beta, epsilon, scale, k, variant):
    """1 - A and the number of taps outside; variant 'none': taps are not turned."""
    dtype = depth.dtype.type
    zero, one = dtype(0), dtype(1)
    occlusion, outside = np.zeros_like(depth), 0
    for j, i in np.ndindex(depth.shape):
        if not depth[j, i] < np.inf:
            continue
        c, n = positions[j, i], normals[j, i]
        bias = beta * max(dot(away, c) + away[3], zero)
        sine, cosine = zero, one
        if variant != "none":
            sine, cosine = (dtype(a) for a in twins.sincospi(spiral_twin.hash_angle(i, j, variant)))
        axes = [[radius * a for a in axis] for axis in disk_axes(directions[j, i])]
        rows = range(4 if kind == twins.MATRIX else 3)
        total = zero
        for tap in taps:
            x, y = tap[0] * cosine - tap[1] * sine, tap[0] * sine + tap[1] * cosine
            moved = []
            for row in rows:
                offset = x * twins.linear_row(m, row, *axes[0]) + y * twins.linear_row(m, row, *axes[1])
                moved.append(twins.affine_row(m, row, *c) + offset)
            u, v, _, valid = point_twin.project(kind, m, moved)
            texel = point_twin.texel_at(depth.shape, u, v, valid)
            if texel is None:
                outside += 1
                continue
            q = positions[texel] - c
            above = dot(q, n) - bias
            square = dot(q, q) + epsilon
            if depth[texel] < np.inf and above > 0 and 0 < square < np.inf:
                total = total + above / square
        a = one - scale * total
        a = a if a > 0 else zero
        occlusion[j, i] = one - dtype(power(float(a), k))
    return occlusion, outside
