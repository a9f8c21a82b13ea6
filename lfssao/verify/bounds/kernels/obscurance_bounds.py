"""``alchemy`` on pairs: sums of max(0, v . n - bias) / (v . v + epsilon), v to where taps land.

A term is that of any texel which its tap may land in, and 0 where that may be none. Sums are not rounded yet.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.disk_bounds import LOOK, image_of, offset_of, place_of, way_of
from lfssao.verify.bounds.kernels.pairs import (
    SAFETY,
    Pair,
    add,
    apart,
    divide,
    dot,
    exact,
    is_positive,
    multiply,
    positive_part,
    subtract,
)
from lfssao.verify.bounds.kernels.projection_bounds import point_row
from lfssao.verify.bounds.kernels.ssao_bounds import box_of, vector

LIMITLESS = 1e300  # a term without an upper bound
_LARGE = 2.0**126  # sums of squares from it on may be infinite in float32


class Taps(NamedTuple):
    """The taps of ``alchemy``; numbers are float32 ones, held as float64."""

    places: Any  # (n, 2): x and y in the unit disk
    mirrors: Any  # (2, 1, 1): cosine 1 and sine 0: nothing is reflected
    normals: Any  # (H, W, 3) float32
    directions: Any  # (H, W, 3) float32: viewing directions
    away: Any  # (4,): distance from the viewers as an affine function of a point
    radius: float  # world units
    beta: float
    epsilon: float  # squared world units


@kernel(inline=True)
def axes_of(way, sign, by):
    """Axes e and -f of ``lfssao.core.vectors.disk_axes`` for a sign of z: those of a reflection by (1, 0)."""
    x, y, z = way
    g = exact(sign)
    a = divide(Pair(-sign, 0.0), add(exact(1.0), multiply(g, z, by), by), by)
    b, gx = multiply(multiply(x, y, by), a, by), multiply(g, x, by)
    e = add(exact(1.0), multiply(multiply(gx, x, by), a, by), by), multiply(g, b, by), Pair(-gx.value, gx.error)
    last = add(g, multiply(multiply(y, y, by), a, by), by)
    return e, (Pair(-b.value, b.error), Pair(-last.value, last.error), y)


@kernel(inline=True)
def term_of(v, normal, less, epsilon, falls, by):
    """The least and largest term max(0, v . n - less) / (v . v + epsilon), times max(0, 1 - v . v)^3 if it falls."""
    square, above = dot(v, v, by), subtract(dot(v, normal, by), less, by)
    may, _ = is_positive(above)
    if not may:
        return 0.0, 0.0
    below = add(square, epsilon, by)
    term = divide(positive_part(above), below, by)
    if falls:
        left = positive_part(subtract(exact(1.0), square, by))
        term = multiply(multiply(multiply(left, left, by), left, by), term, by)
    error = term.error * SAFETY
    if not error < np.inf:
        return 0.0, LIMITLESS
    sure = below.value + below.error < _LARGE
    return max(term.value - error, 0.0) if sure else 0.0, max(term.value + error, 0.0)


@kernel(inline=True)
def tap_range(inputs, taps, image, here, normal, less, i, j, by):
    """The least and largest term of a tap at an image point, and whether it lies in one texel, or in none, for sure."""
    box = box_of(inputs.depth.shape, image)
    if not (box.may and box.known):
        return 0.0, LIMITLESS if box.may else 0.0, not box.may
    epsilon = Pair(taps.epsilon, 4.0 * by.operation * taps.epsilon)
    least, most = LIMITLESS if box.must else 0.0, 0.0
    for row in range(box.j0, box.j1 + 1):
        for column in range(box.i0, box.i1 + 1):
            low, high = 0.0, 0.0
            if inputs.depth[row, column] < np.inf and not (row == j and column == i):
                v = apart(vector(inputs.positions, row, column), here, by)
                low, high = term_of(v, normal, less, epsilon, False, by)
            least, most = min(least, low), max(most, high)
    return least, most, box.must and box.i0 == box.i1 and box.j0 == box.j1


@kernel(parallel=True)
def sum_terms(inputs, taps, by, turns, fewest, most, undecided):
    """Write the least and largest sum of every texel's terms, (H, W) float64, and the number of taps in doubt, int32.

    The disk has either pair of axes where a viewing direction may have either sign of z.
    """
    for j in prange(inputs.depth.shape[0]):
        for i in range(inputs.depth.shape[1]):
            fewest[j, i], most[j, i], undecided[j, i] = 0.0, 0.0, 0
            if not inputs.depth[j, i] < np.inf:
                continue
            here, normal, way = (
                vector(inputs.positions, j, i),
                vector(taps.normals, j, i),
                way_of(taps.directions, j, i),
            )
            less = multiply(exact(taps.beta), positive_part(point_row(taps.away, 0, here, by.operation)), by)
            fewest[j, i] = np.inf
            for sign in (-1.0, 1.0):
                if sign * way[2].value < -LOOK:
                    continue
                axes, low, high, doubt = axes_of(way, sign, by), 0.0, 0.0, 0
                for s in range(taps.places.shape[0]):
                    offset = offset_of(taps, s, axes, turns, i, j, by.angle if turns is not None else 0.0, by)
                    image = image_of(inputs, place_of(taps.radius, here, offset), by)
                    least, largest, sure = tap_range(inputs, taps, image, here, normal, less, i, j, by)
                    low, high, doubt = low + least, high + largest, doubt + int(not sure)
                fewest[j, i], most[j, i] = min(fewest[j, i], low), max(most[j, i], high)
                undecided[j, i] = max(undecided[j, i], doubt)
