"""``point`` and ``hemisphere`` on pairs: their samples are decided as Algorithm 2's, but for three more decisions.

- The surface of a texel has a range of depths: with its own rounding where it is made from a position.
- The range check, distance^2 <= R^2, or distance <= R: both are admitted.
- The half ball's turn, offset . normal < 0. If rounding may change the sign, both sides are taken.
"""

import numpy as np
from numba import prange

from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.pairs import Pair, add, dot, exact, is_positive, multiply, subtract
from lfssao.verify.bounds.kernels.projection_bounds import project, rows_of_point, widen
from lfssao.verify.bounds.kernels.ssao_bounds import (
    box_of,
    mapping_of,
    offset_rows,
    point_rows,
    project_sample,
    sample_rows,
    texel_point,
    turn_of,
    vector,
)

SINGLE = 2.0**-24  # relative error of a number rounded to the nearest float32


@kernel(parallel=True)
def write_surface_depths(inputs, by, from_positions, background, low, high):
    """Write the least and largest depth that a texel's surface may be compared with, (H, W) float64.

    That is the depth texture or, with ``from_positions``, the image z of the texel's position; where there is no
    surface ``background``, +infinity or, if it occludes, -infinity.
    """
    for j in prange(inputs.depth.shape[0]):
        for i in range(inputs.depth.shape[1]):
            depth = np.float64(inputs.depth[j, i])
            depth = depth if depth < np.inf else background
            low[j, i], high[j, i] = depth, depth
            if from_positions and abs(depth) < np.inf:
                rows = rows_of_point(mapping_of(inputs), texel_point(inputs, by, i, j), by.operation)
                image = widen(project(mapping_of(inputs), rows, by), by)
                low[j, i] = image.z.value - image.z.error if image.may else np.inf
                high[j, i] = image.z.value + image.z.error if image.must else np.inf
            if abs(depth) < 2.0**-126:  # may be flushed to zero
                low[j, i], high[j, i] = min(low[j, i], 0.0), max(high[j, i], 0.0)


@kernel(inline=True)
def in_range(here, there, radius, by):
    """Whether a place, three pairs, may be and is for sure within R of another, by distances or by their squares."""
    away = subtract(there[0], here[0], by), subtract(there[1], here[1], by), subtract(there[2], here[2], by)
    square, reach = dot(away, away, by), Pair(radius, radius * SINGLE)
    reach = multiply(reach, reach, by)
    rounded = square.error + 2.0 * by.root * (square.value + square.error)
    return is_positive(Pair(reach.value - square.value, reach.error + rounded))


@kernel(inline=True)
def is_below(offset, normal, by, turns, column, row):
    """Whether an offset, turned at its texel, may and does for sure point below the surface of a normal."""
    x, y = Pair(-offset[0], by.offset * abs(offset[0])), Pair(-offset[1], by.offset * abs(offset[1]))
    z = Pair(-offset[2], by.offset * abs(offset[2]))
    if turns is None:
        return is_positive(dot(normal, (x, y, z), by))
    c, s = turn_of(turns, column, row)
    u = add(multiply(exact(c), x, by), multiply(exact(-s), y, by), by)
    v = add(multiply(exact(s), x, by), multiply(exact(c), y, by), by)
    return is_positive(dot(normal, (u, v, z), by))


@kernel(inline=True)
def is_hidden(inputs, image, low, high, here, reach, by):
    """Whether a sample at an image point may be and is for sure behind a surface, and in range of its texel's place."""
    box = box_of(inputs.depth.shape, image)
    if not (box.may and box.known):
        return box.may, False
    z_low, z_high = image.z.value - image.z.error, image.z.value + image.z.error
    may, must = False, box.must
    for j in range(box.j0, box.j1 + 1):
        for i in range(box.i0, box.i1 + 1):
            behind, surely = low[j, i] < z_high, high[j, i] < z_low
            if behind and reach < np.inf:
                near, near_surely = in_range(here, vector(inputs.positions, j, i), reach, by)
                behind, surely = near, surely & near_surely
            may, must = may | behind, must & surely
    return may, must


@kernel(parallel=True)
def count_hidden(inputs, normals, low, high, reach, by, turns, fewest, most):
    """Write the fewest and the most samples of every texel that a renderer may count as hidden, (H, W) int32.

    Normals, (H, W, 3) float32, take samples to the upper half of the ball; (0, 0, 3) for the whole ball. ``low`` and
    ``high`` are those of ``write_surface_depths``; ``reach`` is R of the range check, infinite without one.
    """
    offsets, half = offset_rows(inputs, by), normals.shape[0] != 0
    for j in prange(inputs.depth.shape[0]):
        for i in range(inputs.depth.shape[1]):
            fewest[j, i], most[j, i] = 0, 0
            if not inputs.depth[j, i] < np.inf:
                continue
            here = texel_point(inputs, by, i, j)
            rows = point_rows(inputs, by, turns, here)
            for s in range(offsets.shape[0]):
                below, surely = False, False
                if half:
                    below, surely = is_below(inputs.offsets[s], vector(normals, j, i), by, turns, i, j)
                offset = sample_rows(inputs, by, turns, i, j, offsets, s)
                image = project_sample(inputs, by, rows, offset, -1.0 if surely else 1.0)
                may, must = is_hidden(inputs, image, low, high, here, reach, by)
                if below and not surely:
                    image = project_sample(inputs, by, rows, offset, -1.0)
                    may_too, must_too = is_hidden(inputs, image, low, high, here, reach, by)
                    may, must = may | may_too, must & must_too
                fewest[j, i] += np.int32(must)
                most[j, i] += np.int32(may)
