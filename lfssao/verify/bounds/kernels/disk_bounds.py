"""Estimators whose samples lie on a disk around a texel's point, on pairs: ``vo-lines`` and ``hbao``; ``sao``'s terms.

Turn, reflection and place on the disk may be applied in any order: no term of an offset f a + g b, a and b the frame's
pairs, is rounded more than 21 times on its way into a row. A row's own roundings of the offset, 10 of its terms, which
may cancel, are counted with them twice.

A sample's term is an interval: each texel that its place may lie in gives one, and a place that may lie in none 0.
Terms are hidden lengths of lines, of the pair d = (z_Q - z_S) / (R w_z); max(0, v . n - bias) / (v . v + epsilon), v
to where taps land; and attenuated rises of horizons along the steps of directions. A horizon is an interval, too: a
step raises it by the surface of any texel that may be read, or not where that may be none. A rise lies between those
above the highest and above the lowest horizon so far. Sums are not rounded yet.
"""

import numpy as np

from lfssao.ao.estimators.vo.kernels.local_frame import EDGE_ON
from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels import pairs
from lfssao.verify.bounds.kernels.old_seen import box_of, look, texel_of, turn_of
from lfssao.verify.bounds.kernels.pairs import FLUSHED, SAFETY, Pair, add, div, dot, exact, mul, positive, times, triple
from lfssao.verify.bounds.kernels.projection_bounds import TURNED, Place, Projected, widen

ROUNDINGS = 48  # 21 and twice 10 if they are counted
LOOK = 2.0**-20  # how far a coordinate of a viewing direction may be off
LIMITLESS = 1e300  # a term without an upper bound
_LARGE = 2.0**126  # sums of squares from it on may be infinite in float32
_ZENITH = 1.0 + 2.0**-16  # no sine is larger, rounded or not


@kernel(inline=True)
def way_of(seen, j, i):
    """A texel's viewing direction, three pairs."""
    x, y, z = seen.directions[j, i]
    return Pair(np.float64(x), LOOK), Pair(np.float64(y), LOOK), Pair(np.float64(z), LOOK)


@kernel(inline=True)
def deep_of(seen, way, by):
    """R w_z, w_z the change of cast z along a viewing direction; whether it may be positive, and is for sure."""
    deep = mul(Pair(seen.radius, by.operation * seen.radius), dot(triple(seen.axis), way, by), by)
    return deep, *positive(deep)


@kernel(inline=True)
def frame_of(right, way, by):
    """Unit vectors a and b across a viewing direction, triples of pairs: a to the right, b = w x a."""
    a = pairs.apart(right, times(way, dot(right, way, by), by), by)
    a = times(a, div(exact(1.0), pairs.root(dot(a, a, by), by), by), by)
    return a, pairs.cross(way, a, by)


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
    return div(dot(normal, offset, by), Pair(0.5 * (near + far), 0.5 * (far - near)), by)


@kernel(inline=True)
def term_of(v, normal, less, epsilon, falls, by):
    """The least and largest term max(0, v . n - less) / (v . v + epsilon), times max(0, 1 - v . v)^3 if it falls."""
    square, above = dot(v, v, by), pairs.sub(dot(v, normal, by), less, by)
    may, _ = positive(above)
    if not may:
        return 0.0, 0.0
    below = add(square, epsilon, by)
    term = div(pairs.ramp(above), below, by)
    if falls:
        left = pairs.ramp(pairs.sub(exact(1.0), square, by))
        term = mul(mul(mul(left, left, by), left, by), term, by)
    error = term.error * SAFETY
    if not error < np.inf:
        return 0.0, LIMITLESS
    sure = below.value + below.error < _LARGE
    return max(term.value - error, 0.0) if sure else 0.0, max(term.value + error, 0.0)


@kernel(inline=True)
def risen(fan, tau):
    """Sine of the angle of a slope and the bias, 1 beyond the zenith."""
    cosine = 1.0 / np.sqrt(1.0 + tau * tau)
    above = cosine * fan.cosine_bias + tau * cosine * fan.sine_bias > 0.0
    return cosine * fan.sine_bias - tau * cosine * fan.cosine_bias if above else 1.0


@kernel(inline=True)
def step_of(fan, radius, v, way, low, high, by):
    """The least and largest attenuated rise by a surface at v, and horizon after it, from low to high before."""
    length, r = pairs.root(dot(v, v, by), by), 4.0 * by.operation
    sine, far = div(dot(way, v, by), length, by), div(length, Pair(radius, r * radius), by)
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
    across, down = pairs.sub(image.u, at, by), pairs.sub(image.v, to, by)
    for step in range(1, fan.steps + 1):
        part = Pair(step / fan.steps, by.quotient)
        u, v = add(at, mul(part, across, by), by), add(to, mul(part, down, by), by)
        box = box_of(seen, widen(Projected(u, v, exact(0.0), image.may, image.must), by))
        # Before the texels of the box are looked at: none of them, any, or so many that all may be.
        rises, ends = (0.0, box.most * (_ZENITH - low)), (low, _ZENITH if box.most > 0.0 else high)
        if box.least > 0.0:
            rises, ends = (np.inf, 0.0), (np.inf, -np.inf)
        for k in range(box.texels):
            (row, column), (a, b, c, d) = texel_of(box, k), (0.0, 0.0, low, high)
            if seen.depth[row, column] < np.inf and not (row == j and column == i):
                v = pairs.apart(triple(seen.positions[row, column]), here, by)
                a, b, c, d = step_of(fan, seen.radius, v, way, low, high, by)
            rises, ends = (min(rises[0], a), max(rises[1], b)), (min(ends[0], c), max(ends[1], d))
        least, most, doubt, (low, high) = least + rises[0], most + rises[1], doubt + int(not box.sure), ends
    return least, most, doubt


@kernel(rows="seen.depth")
def sum_rises(begin, stop, seen, fan, by, sums):
    """Write the least and largest sum of every texel's rises, and its steps in doubt, (3, H, W) float64."""
    for j in range(begin, stop):
        for i in range(seen.depth.shape[1]):
            way, normal = way_of(seen, j, i), triple(seen.normals[j, i])
            _, may, must = deep_of(seen, way, by)
            frame, mirror = frame_of(triple(seen.right), way, by), mirror_of(fan.mirrors, j, i)
            for s in range(fan.around.shape[0] if may and seen.depth[j, i] < np.inf else 0):
                offset = offset_of(seen, fan.around[s, 0], fan.around[s, 1], mirror, frame, j, i, by.angle, by)
                place = place_of(triple(seen.positions[j, i]), seen.radius, offset)
                image, _, _ = look(seen, place, by)
                slope, off = plane_of(normal, way, offset, by), 8.0 * (by.operation + by.quotient + by.root)
                horizon, error = (-_ZENITH, _ZENITH), slope.error * SAFETY
                if error < np.inf:
                    horizon = risen(fan, slope.value + error) - off, risen(fan, slope.value - error) + off
                least, most, doubt = march(seen, fan, image, way, horizon, j, i, by)
                sums[0, j, i] += least if must else 0.0
                sums[1, j, i], sums[2, j, i] = sums[1, j, i] + most, sums[2, j, i] + doubt
