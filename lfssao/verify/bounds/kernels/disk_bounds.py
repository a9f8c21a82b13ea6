"""Places on a disk around a texel's point, on pairs, for estimators whose samples lie on one.

Turn, reflection and place on the disk may be applied in any order: no term of an offset f a + g b, a and b the frame's
pairs, is rounded more than 21 times on its way into a row. A row's own roundings, 10 of P and the offset o, are counted
for their sum, abs(P) + abs(o) <= abs(P + o) + 2 abs(o).
"""

import numpy as np

from lfssao.ao.estimators.vo.kernels.local_frame import EDGE_ON
from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.pairs import (
    FLUSHED,
    SAFETY,
    Pair,
    add,
    apart,
    cross,
    divide,
    dot,
    exact,
    is_positive,
    multiply,
    root,
    times,
)
from lfssao.verify.bounds.kernels.projection_bounds import TURNED, project, rows_of_point, widen
from lfssao.verify.bounds.kernels.ssao_bounds import mapping_of, turn_of

ROUNDINGS = 48  # 21 and twice 10 if they are counted
LOOK = 2.0**-20  # how far a coordinate of a viewing direction may be off


@kernel(inline=True)
def way_of(directions, row, column):
    """A texel's viewing direction, three pairs."""
    x, y, z = directions[row, column]
    return Pair(np.float64(x), LOOK), Pair(np.float64(y), LOOK), Pair(np.float64(z), LOOK)


@kernel(inline=True)
def deep_of(disk, way, by):
    """R w_z, w_z the change of cast z along a viewing direction; whether it may be positive, and is for sure."""
    a = disk.axis
    deep = dot((exact(a[0]), exact(a[1]), exact(a[2])), way, by)
    deep = multiply(Pair(disk.radius, by.operation * disk.radius), deep, by)
    return deep, *is_positive(deep)


@kernel(inline=True)
def frame_of(right, way, by):
    """Unit vectors a and b across a viewing direction, triples of pairs: a to the right, b = w x a."""
    a = apart(right, times(way, dot(right, way, by), by), by)
    a = times(a, divide(exact(1.0), root(dot(a, a, by), by), by), by)
    return a, cross(way, a, by)


@kernel(inline=True)
def offset_of(disk, s, frame, turns, column, row, angle, by):
    """The place of sample s from the middle of a texel's disk, in radii: three pairs; angle: error of its own."""
    (a, b), tile, k = frame, disk.mirrors.shape[1], ROUNDINGS * by.operation
    x, y = disk.places[s, 0], disk.places[s, 1]
    c, d = disk.mirrors[0, row % tile, column % tile], disk.mirrors[1, row % tile, column % tile]
    cosine, sine, more, less = c, d, abs(c), abs(d)
    turned = angle * (abs(c) + abs(d)) * (abs(x) + abs(y))
    if turns is not None:
        p, q = turn_of(turns, column, row)
        cosine, sine, more, less = c * p + d * q, d * p - c * q, abs(c * p) + abs(d * q), abs(d * p) + abs(c * q)
    f = Pair(x * cosine + y * sine, k * (1.0 + k) * (abs(x) * more + abs(y) * less) + turned + 8.0 * FLUSHED)
    g = Pair(x * sine - y * cosine, k * (1.0 + k) * (abs(x) * less + abs(y) * more) + turned + 8.0 * FLUSHED)
    return (
        add(multiply(f, a[0], by), multiply(g, b[0], by), by),
        add(multiply(f, a[1], by), multiply(g, b[1], by), by),
        add(multiply(f, a[2], by), multiply(g, b[2], by), by),
    )


@kernel(inline=True)
def place_of(radius, here, offset):
    """P + R o, P exact and o three pairs; roundings of the sum are those of ``offset_of``."""
    r, flushed = radius, 8.0 * FLUSHED
    return (
        Pair(here[0].value + r * offset[0].value, r * offset[0].error + flushed),
        Pair(here[1].value + r * offset[1].value, r * offset[1].error + flushed),
        Pair(here[2].value + r * offset[2].value, r * offset[2].error + flushed),
    )


@kernel(inline=True)
def image_of(inputs, place, by):
    """The image point of a place on a disk."""
    mapping = mapping_of(inputs)
    return widen(project(mapping, rows_of_point(mapping, place, by.operation, TURNED), by), by)


@kernel(inline=True)
def plane_of(normal, way, offset, by):
    """Height of a tangent plane over an offset across the viewing direction, in radii."""
    towards = dot(normal, way, by)
    near = max(-towards.value - towards.error * SAFETY, EDGE_ON)
    far = max(-towards.value + towards.error * SAFETY, EDGE_ON)
    return divide(dot(normal, offset, by), Pair(0.5 * (near + far), 0.5 * (far - near)), by)
