"""``hbao`` on pairs: sums of attenuated rises of horizons, along the steps of directions.

A horizon is an interval, too: a step raises it by the surface of any texel that may be read, or not where that may be
none. A rise lies between those above the highest and above the lowest horizon so far. Sums are not rounded yet.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.disk_bounds import deep_of, frame_of, image_of, offset_of, place_of, plane_of, way_of
from lfssao.verify.bounds.kernels.pairs import SAFETY, Pair, add, apart, divide, dot, exact, multiply, root, subtract
from lfssao.verify.bounds.kernels.projection_bounds import Projected, widen
from lfssao.verify.bounds.kernels.ssao_bounds import box_of, vector

_ZENITH = 1.0 + 2.0**-16  # no sine is larger, rounded or not


class Fan(NamedTuple):
    """The directions of ``hbao``; numbers are float32 ones, held as float64."""

    places: Any  # (n, 2): unit vectors
    mirrors: Any  # (2, T, C): cosine and sine of a texel's reflection, in tiles of T x T texels
    steps: int
    sine_bias: float
    cosine_bias: float
    linear: float
    quadratic: float
    normals: Any  # (H, W, 3) float32
    directions: Any  # (H, W, 3) float32: viewing directions
    axis: Any  # (4,): the last row of ``cast_from_world``
    right: Any  # (3,): the view's rightward direction
    radius: float  # world units


@kernel(inline=True)
def risen(fan, tau):
    """Sine of the angle of a slope and the bias, 1 beyond the zenith."""
    cosine = 1.0 / np.sqrt(1.0 + tau * tau)
    above = cosine * fan.cosine_bias + tau * cosine * fan.sine_bias > 0.0
    return cosine * fan.sine_bias - tau * cosine * fan.cosine_bias if above else 1.0


@kernel(inline=True)
def step_of(fan, v, way, low, high, by):
    """The least and largest attenuated rise by a surface at v, and horizon after it, from low to high before."""
    length, r = root(dot(v, v, by), by), 4.0 * by.operation
    sine, far = divide(dot(way, v, by), length, by), divide(length, Pair(fan.radius, r * fan.radius), by)
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
def march(inputs, fan, image, here, way, horizon, column, row, by):
    """The least and largest sum of a direction's rises, and its steps that may be read in several texels."""
    (low, high), least, most, doubt = horizon, 0.0, 0.0, 0
    at, to = exact(column + 0.5), exact(row + 0.5)
    across, down = subtract(image.u, at, by), subtract(image.v, to, by)
    for step in range(1, fan.steps + 1):
        part = Pair(step / fan.steps, by.quotient)
        u, v = add(at, multiply(part, across, by), by), add(to, multiply(part, down, by), by)
        box = box_of(inputs.depth.shape, widen(Projected(u, v, exact(0.0), image.may, image.must), by))
        if not box.may:
            continue
        if not box.known:
            most, high, doubt = most + (_ZENITH - low), _ZENITH, doubt + 1
            continue
        rises, ends = (np.inf if box.must else 0.0, 0.0), (np.inf if box.must else low, -np.inf if box.must else high)
        for j in range(box.j0, box.j1 + 1):
            for i in range(box.i0, box.i1 + 1):
                a, b, c, d = 0.0, 0.0, low, high
                if inputs.depth[j, i] < np.inf and not (j == row and i == column):
                    a, b, c, d = step_of(fan, apart(vector(inputs.positions, j, i), here, by), way, low, high, by)
                rises, ends = (min(rises[0], a), max(rises[1], b)), (min(ends[0], c), max(ends[1], d))
        least, most, (low, high) = least + rises[0], most + rises[1], ends
        doubt += int(not box.must or box.i0 < box.i1 or box.j0 < box.j1)
    return least, most, doubt


@kernel(parallel=True)
def sum_rises(inputs, fan, by, turns, fewest, most, undecided):
    """Write the least and largest sum of every texel's rises, (H, W) float64, and its steps in doubt, int32."""
    for line in prange(inputs.depth.shape[0]):
        j = np.int64(line)
        for i in range(inputs.depth.shape[1]):
            fewest[j, i], most[j, i], undecided[j, i] = 0.0, 0.0, 0
            way, r = way_of(fan.directions, j, i), fan.right
            _, may, must = deep_of(fan, way, by)
            if not (may and inputs.depth[j, i] < np.inf):
                continue
            here, normal = vector(inputs.positions, j, i), vector(fan.normals, j, i)
            frame = frame_of((exact(r[0]), exact(r[1]), exact(r[2])), way, by)
            for s in range(fan.places.shape[0]):
                offset = offset_of(fan, s, frame, turns, i, j, by.angle, by)
                image = image_of(inputs, place_of(fan.radius, here, offset), by)
                slope, off = plane_of(normal, way, offset, by), 8.0 * (by.operation + by.quotient + by.root)
                horizon, error = (-_ZENITH, _ZENITH), slope.error * SAFETY
                if error < np.inf:
                    horizon = risen(fan, slope.value + error) - off, risen(fan, slope.value - error) + off
                if image.may:
                    a, b, doubt = march(inputs, fan, image, here, way, horizon, i, j, by)
                    fewest[j, i] += a if must else 0.0
                    most[j, i], undecided[j, i] = most[j, i] + b, undecided[j, i] + doubt
