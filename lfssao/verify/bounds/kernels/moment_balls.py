"""Moments of filtered textures as balls: of an image point and a level of detail that are off, and of rounded means."""

from typing import NamedTuple

import numpy as np

from lfssao.ao.kernels.moments import Pyramid, filtered_moments, look_up
from lfssao.core.balls import SAFETY, UNKNOWN, Ball
from lfssao.core.jit import formula

_MOST_CELLS = 64  # a point that may lie in more squares between four texels is anywhere
_LINEAR = 12.0  # roundings of a number between eight texels, at most
_FLUSHED = 2.0**-100  # outweighs what is flushed from moments


class BallPyramid(NamedTuple):
    """Moments of the middles of depths, and what they may be off by, pyramids of three numbers a texel.

    values: fraction, means of z and z^2. errors: means of abs(z), and how far those of z and z^2 are off at level 0.
    roundings: of a texel, from level to level.
    """

    values: Pyramid
    errors: Pyramid
    roundings: float


@formula
def _differences(pyramid, level, x, y, off_x, off_y):
    """Largest size of each of three numbers around (x, y), and by how much it may change: (3,), (3,).

    Between four texels a number changes along an axis by no more than two of them differ. x, y: in texels of the level,
    border included; off_x, off_y: how far they are off. Infinite where they are off by many texels.
    """
    numbers, pitch, start = pyramid.numbers, pyramid.pitches[level], pyramid.starts[level]
    last = pyramid.starts[level + 1] if level + 1 < pyramid.starts.shape[0] else numbers.shape[0] // 3
    high = (last - start) // pitch
    i0, i1 = np.int64(max(x - off_x, 0.0)), np.int64(min(x + off_x, pitch - 2.0))
    j0, j1 = np.int64(max(y - off_y, 0.0)), np.int64(min(y + off_y, high - 2.0))
    a, b, c, d, e, f = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if not (i1 - i0 + 1) * (j1 - j0 + 1) <= _MOST_CELLS:
        return (UNKNOWN, UNKNOWN, UNKNOWN), (UNKNOWN, UNKNOWN, UNKNOWN)
    for k in range(3):
        size, across, down = 0.0, 0.0, 0.0
        for j in range(j0, j1 + 2):
            for i in range(i0, i1 + 2):
                at = 3 * (start + j * pitch + i) + k
                size = max(size, abs(numbers[at]))
                if i <= i1:
                    across = max(across, abs(numbers[at + 3] - numbers[at]))
                if j <= j1:
                    down = max(down, abs(numbers[at + 3 * pitch] - numbers[at]))
        change = off_x * across + off_y * down
        if k == 0:
            a, d = size, change
        elif k == 1:
            b, e = size, change
        else:
            c, f = size, change
    return (a, b, c), (d, e, f)


@formula
def filtered_balls(pyramid, level, u, v, by):
    """Fraction that sees a surface and its moments, as of ``filtered_moments``, of balls.

    With trilinear T and the values V_k of levels, T at another point and level differs by no more than V_k of any level
    between may change around the point, and by what the level is off times the largest step from V_k to V_k+1 there.
    """
    values, last = pyramid.values, np.float64(pyramid.values.starts.shape[0] - 1)
    off = min(level.error * SAFETY + by.coordinate, 1e6)
    at = min(max(level.value, 0.0), last)
    lowest, highest = np.int64(min(max(level.value - off, 0.0), last)), np.int64(min(max(level.value + off, 0.0), last))
    x, y = u.value, v.value
    share, first, second = filtered_moments(values, at, x, y)
    e0, e1, e2, step0, step1, step2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    here = look_up(values, lowest, x, y)
    for k in range(lowest, min(highest + 1, np.int64(last)) + 1):
        scale = 1.0 / np.float64(1 << k)
        off_x, off_y = u.error * SAFETY * scale + by.coordinate, v.error * SAFETY * scale + by.coordinate
        sizes, changes = _differences(values, k, x * scale + 0.5, y * scale + 0.5, off_x, off_y)
        errors, _ = _differences(pyramid.errors, k, x * scale + 0.5, y * scale + 0.5, off_x, off_y)
        r = (_LINEAR + k * pyramid.roundings) * by.operation
        e0 = max(e0, changes[0] + r * sizes[0])
        e1 = max(e1, changes[1] + r * errors[0] + errors[1])
        e2 = max(e2, changes[2] + r * sizes[2] + errors[2])
        a, b, c = look_up(values, k, x, y)
        step0, step1, step2 = max(step0, abs(a - here[0])), max(step1, abs(b - here[1])), max(step2, abs(c - here[2]))
        here = a, b, c
    e0, e1, e2 = e0 + off * step0, e1 + off * step1, e2 + off * step2
    like = u
    return (
        Ball(share, min(e0, UNKNOWN), like),
        Ball(first, min(e1 + _FLUSHED, UNKNOWN), like),
        Ball(second, min(e2 + _FLUSHED, UNKNOWN), like),
    )
