"""``hbao`` on pairs: sums of attenuated rises of horizons, along the steps of directions.

A horizon is an interval, too: a step raises it by the surface of any texel that may be read, or not where that may be
none. A rise lies between those above the highest and above the lowest horizon so far. Sums are not rounded yet.
"""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.disk_bounds import deep_of, frame_of, mirror_of, offset_of, place_of, plane_of, way_of
from lfssao.verify.bounds.kernels.pairs import SAFETY, Pair, add, apart, divide, dot, exact, multiply, root, subtract
from lfssao.verify.bounds.kernels.projection_bounds import Projected, image_of, widen
from lfssao.verify.bounds.kernels.seen_bounds import box_of, mapping_of, texel_of, triple

_ZENITH = 1.0 + 2.0**-16  # no sine is larger, rounded or not


@kernel(inline=True)
def risen(fan, tau):
    """Sine of the angle of a slope and the bias, 1 beyond the zenith."""
    cosine = 1.0 / np.sqrt(1.0 + tau * tau)
    above = cosine * fan.cosine_bias + tau * cosine * fan.sine_bias > 0.0
    return cosine * fan.sine_bias - tau * cosine * fan.cosine_bias if above else 1.0


@kernel(inline=True)
def step_of(fan, radius, v, way, low, high, by):
    """The least and largest attenuated rise by a surface at v, and horizon after it, from low to high before."""
    length, r = root(dot(v, v, by), by), 4.0 * by.operation
    sine, far = divide(dot(way, v, by), length, by), divide(length, Pair(radius, r * radius), by)
    error, off = sine.error * SAFETY, far.error * SAFETY
    if far.value - off >= 1.0:
        return 0.0, 0.0, low, high
    if not (error < np.inf and off < np.inf):
        return 0.0, _ZENITH - low, low, _ZENITH
    near, far_off = max(far.value - off, 0.0), far.value + off
    strong = 1.0 - (fan.linear * near + fan.quadratic * near * near) + r
    weak = max(1.0 - (fan.linear * far_off + fan.quadratic * far_off * far_off) - r, 0.0)
    least, most = min(-sine.value - error, _ZENITH), min(error - sine.value, _ZENITH)
    rise = strong * max(most - low, 0.0) * (1.0 + r), max(high, most)
    if far_off >= 1.0:
        return 0.0, rise[0], low, rise[1]
    return weak * max(least - high, 0.0) * (1.0 - r), rise[0], max(low, least), rise[1]


@kernel
def march(seen, fan, image, way, horizon, j, i, by):
    """The least and largest sum of a direction's rises, and its steps that may be read in several texels."""
    (low, high), least, most, doubt, here = horizon, 0.0, 0.0, 0, triple(seen.positions[j, i])
    at, to = exact(i + 0.5), exact(j + 0.5)
    across, down = subtract(image.u, at, by), subtract(image.v, to, by)
    for step in range(1, fan.steps + 1):
        part = Pair(step / fan.steps, by.quotient)
        u, v = add(at, multiply(part, across, by), by), add(to, multiply(part, down, by), by)
        box = box_of(seen.depth.shape, widen(Projected(u, v, exact(0.0), image.may, image.must), by))
        # Before the texels of the box are looked at: none of them, any, or so many that all may be.
        rises, ends = (0.0, box.most * (_ZENITH - low)), (low, _ZENITH if box.most > 0.0 else high)
        if box.least > 0.0:
            rises, ends = (np.inf, 0.0), (np.inf, -np.inf)
        for k in range(box.texels):
            (row, column), (a, b, c, d) = texel_of(box, k), (0.0, 0.0, low, high)
            if seen.depth[row, column] < np.inf and not (row == j and column == i):
                v = apart(triple(seen.positions[row, column]), here, by)
                a, b, c, d = step_of(fan, seen.radius, v, way, low, high, by)
            rises, ends = (min(rises[0], a), max(rises[1], b)), (min(ends[0], c), max(ends[1], d))
        least, most, doubt, (low, high) = least + rises[0], most + rises[1], doubt + int(not box.sure), ends
    return least, most, doubt


@kernel(parallel=True)
def sum_rises(seen, fan, by, sums):
    """Write the least and largest sum of every texel's rises, and its steps in doubt, (3, H, W) float64."""
    for line in prange(seen.depth.shape[0]):
        j = np.int64(line)
        for i in range(seen.depth.shape[1]):
            way, normal = way_of(seen, j, i), triple(seen.normals[j, i])
            _, may, must = deep_of(seen, way, by)
            frame, mirror = frame_of(triple(seen.right), way, by), mirror_of(fan.mirrors, j, i)
            for s in range(fan.around.shape[0] if may and seen.depth[j, i] < np.inf else 0):
                offset = offset_of(seen, fan.around[s, 0], fan.around[s, 1], mirror, frame, j, i, by.angle, by)
                place = place_of(triple(seen.positions[j, i]), seen.radius, offset)
                image = image_of(mapping_of(seen), place, by)
                slope, off = plane_of(normal, way, offset, by), 8.0 * (by.operation + by.quotient + by.root)
                horizon, error = (-_ZENITH, _ZENITH), slope.error * SAFETY
                if error < np.inf:
                    horizon = risen(fan, slope.value + error) - off, risen(fan, slope.value - error) + off
                least, most, doubt = march(seen, fan, image, way, horizon, j, i, by)
                sums[0, j, i] += least if must else 0.0
                sums[1, j, i], sums[2, j, i] = sums[1, j, i] + most, sums[2, j, i] + doubt
