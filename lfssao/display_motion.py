"""Balls so small that they stay within their texel, of modules of any display: curved, conical, turned, distorted.

A point that a texel sees, P, lies on the ray through the texel's centre; a sample around it lies at P + d in physical
space. As the sample moves there from P, its image moves by at most J d, with J the range of the mapping's derivatives
over a part of what the view sees (``lfssao.display_slopes``) that holds all of the way. Parts are boxes of undistorted
image coordinates and depth, so that each is seen whole, one texel larger on each side than what they divide, and
deeper by as much as a sample lies before or behind its point. So the way leaves a part only when the image has moved
by a whole texel, and where J d stays below half of one it never does.

To J d is added what is off: float32's coordinates of the sample (whose bound is given) and float64's of P, both times
J; the two homographies of a module, given in float64, where they miss being inverses; the steps of the inverse
distortion, which end where they move no digit; and float32's rounding of the image (``lfssao.display_rounding``). All
of it is below half a texel, and the image has no other answer than a place, or nothing is said of the ball.
"""

from collections.abc import Sequence
from functools import partial
from math import inf, sqrt

import numpy as np

from lfssao.display_rounding import plain_image, rounded_image, rounded_points
from lfssao.display_slopes import Slopes, distorted_slopes, ray_points, screen_slopes, texel_slopes
from lfssao.display_window import distorted, projected
from lfssao.kernels.display import NEVER
from lfssao.matrix import multiply
from lfssao.ranges import SAFETY, Numbers, Range
from lfssao.view import View
from lfssao.window import Window, seen_window

# The parts that are too large to tell are halved along u, v and z so often, as long as there are no more than so many.
_ROUNDS = 7
_MOST_PARTS = 4096

# By how many texels a part is larger on each side.
_MARGIN = 0.75

# How far beside the box a ray may be that hits what is in it, in shares of their numbers.
_ROUNDING = 2.0**-38

# How far the inverse distortion may be off, in shares of the radius; float64 has 2^-53.
_NEWTON = 2.0**-40


def stays(lens: Numbers, point: Numbers, offsets: Numbers) -> bool:
    """Whether the images of samples around a physical point stay within half a texel of it; NaN does not.

    Only the outermost along x, y and z are asked: a question that costs little, before it is asked of all points.

    Parameters
    ----------
    lens : (32,) float64
        The module's numbers (``lfssao.kernels.display``).
    point : (3,) float64
        Metres.
    offsets : (n, 3) float64
        Of the samples from the point, metres.
    """
    u, v = plain_image(lens, *point.tolist())
    outermost = {*offsets.argmin(axis=0).tolist(), *offsets.argmax(axis=0).tolist()}
    moved = [plain_image(lens, *(point + offsets[number]).tolist()) for number in outermost]
    return all(abs(a - u) < 0.5 and abs(b - v) < 0.5 for a, b in moved)


def largest_ball(view: View, box: Numbers, offsets: Numbers, errors: Numbers, radii: Sequence[float]) -> float:
    """A radius below which the image of every sample stays in its texel; 0 where there is none.

    Parameters
    ----------
    view : View
        A module whose mapping has the same numbers as its rays.
    box : (2, 3) float64
        Lower and upper corner of a box around what it sees, physical space.
    offsets : (n, 3) float64
        The samples of radius 1 relative to their point, physical space.
    errors : (2, 3) float64
        How far x, y and z of a sample may be off in float32: base, and slope by the radius.
    radii : sequence of float
        The radii that are asked for: the result is as large as can be proven, or not far from it, where it has to be
        to tell them apart.
    """
    window, lens, most = seen_window(view, box), view.lens, max(radii) * SAFETY**2
    around = box + np.array([[-1.0], [1.0]]) * (_ROUNDING * max(np.abs(box).max(), np.abs(lens[:5]).max()))
    see, known = partial(_seen, lens, window, around), inf
    deeper = most * (np.abs(offsets[:, 2]).max() + errors[1, 2]) + errors[0, 2]
    with np.errstate(all="ignore"):  # NaN is asked for
        parts = np.array([*_undistorted(lens, window), box[:, 2]])[:, :, None]
        parts = see(_halves(_halves(_halves(parts), (0, 2)), (0,)))
        for _ in range(_ROUNDS):
            limits = _limits(lens, np.concatenate([parts, see(_middles(parts))], axis=2), deeper, offsets, errors)
            limits, points = limits[: parts.shape[2]], limits[parts.shape[2] :]
            most = float(points[points > 0.0].min(initial=most))  # no ball is larger than around one point
            short = limits <= max((radius for radius in radii if radius < most), default=-1.0)
            known, rest = min(known, float(limits[~short].min(initial=inf))), float(limits[short].min(initial=inf))
            parts = see(_halves(parts[:, :, short]))
            if not 0 < parts.shape[2] < _MOST_PARTS:
                break
    return min(most, known, rest if parts.size else inf)


def _undistorted(lens: Numbers, window: Window) -> tuple[tuple[float, float], tuple[float, float]]:
    """Between which u, and which v, the undistorted image coordinates of a window's texels lie.

    Those are the distorted ones, relative to the centre, over L(r) = 1 + k1 r^2 + k2 r^4, r at most that of the
    window's farthest corner or where it folds: up to there r L(r) grows with r.
    """
    c_u, c_v, f, k1, k2, fold = lens[17:23].tolist()
    u, v = (window.left + 0.5, window.right - 0.5), (window.top + 0.5, window.bottom - 0.5)
    if k1 == 0.0 and k2 == 0.0:
        return u, v
    corner = sqrt(max((a - c_u) ** 2 + (b - c_v) ** 2 for a in u for b in v)) / f

    def length(square: float) -> float:
        return float(1.0 + square * (k1 + square * k2))

    low, high = 0.0, 1.0
    while high * high < fold and high * length(high * high) < corner:
        high *= 2.0
    high = min(high, sqrt(fold)) if fold < NEVER else high
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if middle * length(middle * middle) < corner else (low, middle)
    squares = [0.0, high * high, *([-0.5 * k1 / k2] if k2 and 0.0 < -0.5 * k1 / k2 < high * high else [])]
    ends = [length(square) for square in squares]
    shrink = Range(np.array([1.0 / max(ends)]), np.array([1.0 / min(ends)]))
    made = [Range(*np.array(n)[:, None]).plus(-c).times(shrink).plus(c) for n, c in ((u, c_u), (v, c_v))]
    (u_low, u_high), (v_low, v_high) = ((float(n.low[0]), float(n.high[0])) for n in made)
    return (u_low, u_high), (v_low, v_high)


def _halves(parts: Numbers, axes: Sequence[int] = (0, 1, 2)) -> Numbers:
    """Each part cut in two along u, v and z: (3, 2, n) to (3, 2, 8 n)."""
    for axis in axes:
        low, high = parts.copy(), parts.copy()
        low[axis, 1] = high[axis, 0] = 0.5 * (parts[axis, 0] + parts[axis, 1])
        parts = np.concatenate([low, high], axis=2)
    return parts


def _middles(parts: Numbers) -> Numbers:
    """The points in the middle of parts, as parts."""
    middle = 0.5 * (parts[:, :1] + parts[:, 1:])
    return np.concatenate([middle, middle], axis=1)


def _seen(lens: Numbers, window: Window, box: Numbers, parts: Numbers) -> Numbers:
    """The parts that have points in the box whose image is in the window, or may have."""
    u, v, z = (Range(*part) for part in parts)
    seen = np.ones(parts.shape[2], np.bool_)
    ends = (window.left, window.right), (window.top, window.bottom), *box[:, :2].T
    places = *distorted(lens, u, v), *ray_points(lens, *projected(lens[23:32], u, v), z)
    for place, (first, end) in zip(places, ends, strict=True):
        seen &= ~((place.high < first) | (place.low > end))
    return parts[:, :, seen]


def _limits(lens: Numbers, parts: Numbers, deeper: float, offsets: Numbers, errors: Numbers) -> Numbers:
    """The radius below which samples around the points of a part move by less than half a texel; 0 for none.

    Parameters
    ----------
    lens : (32,) float64
        The module's numbers.
    parts : (3, 2, n) float64
        Ends of undistorted u and v and of z.
    deeper : float
        What z changes by on the way to a sample, at the most.
    offsets, errors : (m, 3), (2, 3) float64
        Those of ``largest_ball``.
    """
    margins = _MARGIN, _MARGIN, deeper
    u, v, z = (Range(low - more, high + more) for (low, high), more in zip(parts, margins, strict=True))
    miss, doubt = _mismatch(lens, u, v), np.zeros(parts.shape[2], np.bool_)
    s_x, s_y = projected(lens[23:32], u, v)
    u, v = (n.plus(Range(-miss, miss)) for n in (u, v))
    plain = texel_slopes(lens, s_x, s_y, u, v, screen_slopes(lens, s_x, s_y, z))
    x, y = rounded_points(lens, u, v, z, doubt)
    seen = np.stack([x.error, y.error, np.zeros_like(x.error)])
    sigma = s_x.plus(-float(lens[0])).times(1.0 / float(lens[2]))
    image = rounded_image(lens, sigma, *ray_points(lens, s_x, s_y, z), z, doubt)
    steps = _distortion_steps(lens, u, v, miss)
    # In undistorted coordinates, so that the way does not leave the part.
    limits = [_below(_MARGIN - 2.0 * miss, slopes, seen, offsets, errors) for slopes in plain]
    for place, step, slopes in zip(image, steps, distorted_slopes(lens, u, v, plain), strict=True):
        limits.append(_below(0.5 - place.error - step, slopes, seen, offsets, errors))
    least = np.minimum.reduce(limits)
    return np.where((least > 0.0) & ~doubt, least, 0.0)


def _mismatch(lens: Numbers, u: Range, v: Range) -> Numbers:
    """How far the homography takes the inverse's points from where they came from, (n,) texels; NaN if far.

    With M the product, u goes to (M_0 . (u, v, 1)) / (M_2 . (u, v, 1)), which differs from u by the numerator minus u
    times the divisor, over the divisor.
    """
    forth, back = lens[8:17].reshape(3, 3), lens[23:32].reshape(3, 3)
    error = 2.0**-50 * multiply(np.abs(forth), np.abs(back))
    miss = multiply(forth, back)
    miss, scale = np.abs(miss - miss[2, 2] * np.eye(3)) + error, miss[2, 2] - error[2, 2]
    place = np.stack([u.size, v.size, np.ones_like(u.size)])
    off = multiply(miss, place)
    room = scale - off[2]
    apart = (np.maximum(off[0], off[1]) + np.maximum(u.size, v.size) * off[2]) / room
    return np.where((room > 0.0) & (apart < 0.25), apart, np.nan)


def _distortion_steps(lens: Numbers, u: Range, v: Range, miss: Numbers) -> list[Numbers]:
    """How far in texels, u and v, a point is off that is off by ``miss`` before the distortion, and its inverse."""
    one, zero = (Range.constant(n, u) for n in (1.0, 0.0))
    rows = distorted_slopes(lens, u, v, [(one, zero, zero), (zero, one, zero)])
    inverse = 0.0 if lens[20] == 0.0 and lens[21] == 0.0 else _NEWTON * np.maximum(u.size, v.size)
    return [(along.size + across.size) * miss + inverse for along, across, _ in rows]


def _below(half: Numbers, slopes: Slopes, seen: Numbers, offsets: Numbers, errors: Numbers) -> Numbers:
    """The radius below which an image coordinate moves by less than ``half``, in each part; below 0 for none.

    Parameters
    ----------
    half : (n,) float64
        Texels, in each part.
    slopes : Slopes
        The coordinate's derivatives.
    seen : (3, n) float64
        How far a point that a texel sees may be off.
    offsets, errors : (m, 3), (2, 3) float64
        Those of ``largest_ball``.
    """
    low, high = (np.stack(ends) for ends in zip(*slopes, strict=True))
    size, middle, spread = np.maximum(np.abs(low), np.abs(high)), 0.5 * (low + high), 0.5 * (high - low)
    way = (np.abs(multiply(offsets, middle)) + multiply(np.abs(offsets), spread)).max(axis=0)
    base, by_radius = ((size * (seen + errors[:1].T)).sum(axis=0), way + (size * errors[1:].T).sum(axis=0))
    limit: Numbers = (half / SAFETY - base * SAFETY) / (by_radius * SAFETY)
    return limit
