"""``alchemy`` on pairs: sums of max(0, v . n - bias) / (v . v + epsilon), v to where taps land.

A term is that of any texel which its tap may land in, and 0 where that may be none. Sums are not rounded yet.
"""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.disk_bounds import LOOK, offset_of, place_of, way_of
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
from lfssao.verify.bounds.kernels.projection_bounds import at_point, image_of, row_of
from lfssao.verify.bounds.kernels.seen_bounds import box_of, mapping_of, texel_of, triple

LIMITLESS = 1e300  # a term without an upper bound
_LARGE = 2.0**126  # sums of squares from it on may be infinite in float32


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
def sum_of(seen, taps, axes, normal, less, epsilon, j, i, by):
    """The least and largest sum of a texel's terms on a disk of these axes, and its taps in doubt."""
    low, high, doubt, here = 0.0, 0.0, 0, triple(seen.positions[j, i])
    for s in range(taps.shape[0]):
        angle = by.angle if seen.turns.shape[1] > 0 else 0.0
        offset = offset_of(seen, taps[s, 0], taps[s, 1], (1.0, 0.0), axes, j, i, angle, by)
        box = box_of(seen.depth.shape, image_of(mapping_of(seen), place_of(here, seen.radius, offset), by))
        least, most = LIMITLESS * box.least, LIMITLESS * box.most
        for k in range(box.texels):
            (row, column), (a, b) = texel_of(box, k), (0.0, 0.0)
            if seen.depth[row, column] < np.inf and not (row == j and column == i):
                v = apart(triple(seen.positions[row, column]), here, by)
                a, b = term_of(v, normal, less, epsilon, False, by)
            least, most = min(least, a), max(most, b)
        low, high, doubt = low + least, high + most, doubt + int(not box.sure)
    return low, high, doubt


@kernel(parallel=True)
def sum_terms(seen, taps, away, strength, by, sums):
    """Write the least and largest sum of every texel's terms, and its taps in doubt, (3, H, W) float64.

    ``taps`` are points of the unit disk, (n, 2); ``away``, (4,), is the distance from the viewers, affine. The disk has
    either pair of axes where a viewing direction may have either sign of z.
    """
    for row in prange(seen.depth.shape[0]):
        j = np.int64(row)
        for i in range(seen.depth.shape[1]):
            here, normal, way = triple(seen.positions[j, i]), triple(seen.normals[j, i]), way_of(seen, j, i)
            far = positive_part(row_of(away, 0, at_point(here), by.operation))
            less, epsilon = multiply(exact(strength.beta), far, by), strength.epsilon
            found = np.inf, 0.0, 0
            for sign in (-1.0, 1.0):
                if seen.depth[j, i] < np.inf and sign * way[2].value >= -LOOK:
                    axes, room = axes_of(way, sign, by), Pair(epsilon, 4.0 * by.operation * epsilon)
                    low, high, doubt = sum_of(seen, taps, axes, normal, less, room, j, i, by)
                    found = min(found[0], low), max(found[1], high), max(found[2], doubt)
            if seen.depth[j, i] < np.inf:
                sums[0, j, i], sums[1, j, i], sums[2, j, i] = found
