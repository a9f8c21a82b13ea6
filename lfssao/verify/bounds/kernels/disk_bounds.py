"""Places on a disk around a texel's point, on pairs, for estimators whose samples lie on one.

Turn, reflection and place on the disk may be applied in any order: no term of an offset f a + g b, a and b the frame's
pairs, is rounded more than 21 times on its way into a row. A row's own roundings of the offset, 10 of its terms, which
may cancel, are counted with them twice.
"""

import numpy as np

from lfssao.ao.estimators.vo.kernels.local_frame import EDGE_ON
from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels import pairs
from lfssao.verify.bounds.kernels.pairs import (
    FLUSHED,
    SAFETY,
    Pair,
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
from lfssao.verify.bounds.kernels.projection_bounds import TURNED, Place
from lfssao.verify.bounds.kernels.seen_bounds import triple, turn_of

ROUNDINGS = 48  # 21 and twice 10 if they are counted
LOOK = 2.0**-20  # how far a coordinate of a viewing direction may be off


@kernel(inline=True)
def way_of(seen, j, i):
    """A texel's viewing direction, three pairs."""
    x, y, z = seen.directions[j, i]
    return Pair(np.float64(x), LOOK), Pair(np.float64(y), LOOK), Pair(np.float64(z), LOOK)


@kernel(inline=True)
def deep_of(seen, way, by):
    """R w_z, w_z the change of cast z along a viewing direction; whether it may be positive, and is for sure."""
    deep = multiply(Pair(seen.radius, by.operation * seen.radius), dot(triple(seen.axis), way, by), by)
    return deep, *is_positive(deep)


@kernel(inline=True)
def frame_of(right, way, by):
    """Unit vectors a and b across a viewing direction, triples of pairs: a to the right, b = w x a."""
    a = apart(right, times(way, dot(right, way, by), by), by)
    a = times(a, divide(exact(1.0), root(dot(a, a, by), by), by), by)
    return a, cross(way, a, by)


@kernel(inline=True)
def mirror_of(mirrors, j, i):
    """Cosine and sine of a texel's reflection; mirrors: as of ``local_frame.Disk``."""
    tile = mirrors.shape[1]
    return mirrors[0, j % tile, i % tile], mirrors[1, j % tile, i % tile]


@kernel(inline=True)
def offset_of(seen, x, y, mirror, frame, j, i, angle, by):
    """The place of a sample (x, y) from the middle of a texel's disk, in radii; angle: error of its own."""
    (a, b), k, (c, d), (p, q) = frame, ROUNDINGS * by.operation, mirror, turn_of(seen, j, i)
    turned = angle * (abs(c) + abs(d)) * (abs(x) + abs(y)) + 8.0 * FLUSHED
    cosine, sine, more, less = c * p + d * q, d * p - c * q, abs(c * p) + abs(d * q), abs(d * p) + abs(c * q)
    f = Pair(x * cosine + y * sine, k * (1.0 + k) * (abs(x) * more + abs(y) * less) + turned)
    g = Pair(x * sine - y * cosine, k * (1.0 + k) * (abs(x) * less + abs(y) * more) + turned)
    return pairs.plus(times(a, f, by), times(b, g, by), by)


@kernel(inline=True)
def place_of(point, radius, offset):
    """The place P + R o, P and o three pairs each; roundings of the product are those of ``offset_of``."""
    (x, y, z), r, flushed = offset, radius, 8.0 * FLUSHED
    moved = (
        Pair(r * x.value, r * x.error + flushed),
        Pair(r * y.value, r * y.error + flushed),
        Pair(r * z.value, r * z.error + flushed),
    )
    return Place(point, moved, (abs(r * x.value), abs(r * y.value), abs(r * z.value)), TURNED)


@kernel(inline=True)
def plane_of(normal, way, offset, by):
    """Height of a tangent plane over an offset across the viewing direction, in radii."""
    towards = dot(normal, way, by)
    near = max(-towards.value - towards.error * SAFETY, EDGE_ON)
    far = max(-towards.value + towards.error * SAFETY, EDGE_ON)
    return divide(dot(normal, offset, by), Pair(0.5 * (near + far), 0.5 * (far - near)), by)
