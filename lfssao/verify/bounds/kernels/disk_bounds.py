"""Places on a disk around a texel's point, on pairs, for estimators whose samples lie on one.

Turn, reflection and place on the disk may be applied in any order: no term of an offset f a + g b, a and b the frame's
pairs, is rounded more than 21 times on its way into a row. A row's own roundings, 10 of P and the offset o, are counted
for their sum, abs(P) + abs(o) <= abs(P + o) + 2 abs(o).
"""

from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.pairs import (
    FLUSHED,
    Pair,
    add,
    divide,
    dot,
    exact,
    multiply,
    root,
    subtract,
)
from lfssao.verify.bounds.kernels.ssao_bounds import turn_of

_ROUNDINGS = 48  # 21 and twice 10 if they are counted


@kernel(inline=True)
def frame_of(right, way, by):
    """Unit vectors a and b across a viewing direction, triples of pairs: a to the right, b = w x a."""
    along = dot(right, way, by)
    x = subtract(right[0], multiply(along, way[0], by), by)
    y = subtract(right[1], multiply(along, way[1], by), by)
    z = subtract(right[2], multiply(along, way[2], by), by)
    scale = divide(exact(1.0), root(dot((x, y, z), (x, y, z), by), by), by)
    x, y, z = multiply(x, scale, by), multiply(y, scale, by), multiply(z, scale, by)
    return (x, y, z), (
        subtract(multiply(way[1], z, by), multiply(way[2], y, by), by),
        subtract(multiply(way[2], x, by), multiply(way[0], z, by), by),
        subtract(multiply(way[0], y, by), multiply(way[1], x, by), by),
    )


@kernel(inline=True)
def offset_of(lines, s, frame, turns, column, row, by):
    """The place of line s from the middle of a texel's disk, in radii: three pairs."""
    (a, b), tile, k = frame, lines.mirrors.shape[1], _ROUNDINGS * by.operation
    x, y = lines.places[s, 0], lines.places[s, 1]
    c, d = lines.mirrors[0, row % tile, column % tile], lines.mirrors[1, row % tile, column % tile]
    cosine, sine, more, less = c, d, abs(c), abs(d)
    if turns is not None:
        p, q = turn_of(turns, column, row)
        cosine, sine, more, less = c * p + d * q, d * p - c * q, abs(c * p) + abs(d * q), abs(d * p) + abs(c * q)
    f = Pair(x * cosine + y * sine, k * (1.0 + k) * (abs(x) * more + abs(y) * less) + 8.0 * FLUSHED)
    g = Pair(x * sine - y * cosine, k * (1.0 + k) * (abs(x) * less + abs(y) * more) + 8.0 * FLUSHED)
    return (
        add(multiply(f, a[0], by), multiply(g, b[0], by), by),
        add(multiply(f, a[1], by), multiply(g, b[1], by), by),
        add(multiply(f, a[2], by), multiply(g, b[2], by), by),
    )
