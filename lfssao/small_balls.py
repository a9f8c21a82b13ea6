"""Radii so small that the outcome of every sample is known before anything is looked up (LF Algorithms 1 and 2).

A visible point lies on the ray through its texel's centre, so its image is that centre, and a sample whose image stays
within half a texel of it reads the depth of the point itself: whether it is occluded is the sign of the depth between
the two. Over all texels of a view and all points of the scene's box, float32 arithmetic included, this is bounded.

Both mappings are quotients of a point's affine numbers, u = u_0 + a / d and, for a camera, image z = c / q. With t the
quotient at the point itself, (a + a_o) / (d + d_o) - t = (a_o - t d_o) / (d + d_o) for an offset with the linear
numbers a_o, d_o; numbers off by e_a and e_d add at most (e_a + |t| e_d) / (d + d_o), a rounding at most 2^-24 of what
is rounded. So the sample stays in the texel if the sum of all that is below half a texel, and it lies behind or before
the point for sure if c_o - D q_o (c_o on a display, where q = 1) is larger than the errors of c, q and D.

The numbers' errors: a row of a mapping, (m_0 x + m_1 y) + m_2 z + m_3 and the offset's added to it, rounds each term
at most seven times, the rounding of m and of the position or the offset included; so it is off by 8 x 2^-24 of its
terms' sizes. float64 made the position, whose errors are 2^-29 of float32's; how far the view's mapping and rays,
given in float64, miss being inverses is measured and added. Nothing is assumed of how they were made.

All of these bounds are linear in the radius, so they leave a range of radii.

Other displays, of curved screens, conical diffusers, turned and distorted modules, have the affine half and the depth
in common with the flat ones; how far an image moves there, ``lfssao.display_motion`` bounds.
"""

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfssao.display_motion import largest_ball, stays
from lfssao.kernels.mapping import CROSSED_SLITS, DISPLAY, MATRIX
from lfssao.kernels.rays import DISPLAY as RAYS_OF_DISPLAY
from lfssao.kernels.rays import FLAT_LINEAR, ORTHOGRAPHIC, PERSPECTIVE
from lfssao.matrix import Matrix, multiply
from lfssao.view import View
from lfssao.window import cast_box, ray_errors

Numbers = NDArray[np.float64]

_ROUND = 2.0**-24
_ROW = 8 * _ROUND + 2.0**-45
_DOUBLE = 2.0**-48  # some dozen operations in float64
_FLUSHED = 2.0**-140  # some numbers below float32's smallest, and what they are multiplied with to be added
_SAFETY = 1 + 2.0**-20  # outweighs the rounding of the bounds themselves
_LARGE = 1e30  # beyond it float32 may overflow on the way


class DecidedRadii(NamedTuple):
    """Between which radii all samples of all visible points are decided, both left out, and how.

    Attributes
    ----------
    low, high : float
        World units; low is not below high where there are none.
    behind : int
        How many of the samples lie behind their point's surface; none of them lies outside the texture.
    open : tuple of float
        Radii asked for whose ball appears smaller than half a texel in the middle of the scene's box and that are not
        decided: it does not everywhere, or that is not proven. Of displays that are not flat and linear only.
    """

    low: float = inf
    high: float = 0.0
    behind: int = 0
    open: tuple[float, ...] = ()

    def __contains__(self, radius: object) -> bool:
        return isinstance(radius, float | int) and self.low < radius < self.high


class _Line(NamedTuple):
    """A bound that is linear in the radius."""

    base: float
    slope: float

    def plus(self, other: "_Line", times: float = 1.0) -> "_Line":
        """The sum with so many times another."""
        return _Line(self.base + times * other.base, self.slope + times * other.slope)


def decided_radii(view: View, bounds: Numbers, samples: Numbers, radii: Sequence[float] = ()) -> DecidedRadii:
    """The radii whose outcome Algorithm 2 (of a camera: 1) in float32 need not look up.

    Parameters
    ----------
    view : View
        Where from.
    bounds : (2, 3) float64
        Lower and upper corner of a box around the scene, world units.
    samples : (n, 3) float64
        Offsets in the unit ball.
    radii : sequence of float
        Which radii are asked for, world units, of displays that are not flat and linear: there the range is no wider
        than it takes to decide them. All others are decided for any radius.

    Returns
    -------
    DecidedRadii
        None at all where no bounds are known.
    """
    numbers = view.world_to_image.numbers[:16]  # those of a display behind them are looked at where they are used
    if not max(np.abs(numbers).max(), np.abs(samples).max(), np.abs(bounds).max()) < _LARGE:
        return DecidedRadii()
    box = cast_box(view.cast_from_world, bounds)
    box = box + np.array([[-1.0], [1.0]]) * (_DOUBLE * np.abs(box).max())  # hits are rounded
    if (view.ray_kind, view.world_to_image.kind) == (FLAT_LINEAR, CROSSED_SLITS):
        return _of_display(view, box, samples)
    if (view.ray_kind, view.world_to_image.kind) == (RAYS_OF_DISPLAY, DISPLAY):
        return _of_module(view, box, samples, radii)
    if view.world_to_image.kind == MATRIX and view.screen_to_world is not None:
        return _of_camera(view, view.screen_to_world, box, samples)
    return DecidedRadii()


def _of_display(view: View, box: Numbers, samples: Numbers) -> DecidedRadii:
    """The radii of a flat display's module."""
    rows, (z_m, z_o, u_0, v_0) = (
        view.world_to_image.numbers[:12].reshape(3, 4),
        view.world_to_image.numbers[12:].tolist(),
    )
    m_x, m_z, y_o, lens_z_o, u_scale, lens_u, v_scale, lens_v = view.lens.tolist()
    if (z_m, z_o) != (m_z, lens_z_o):
        return DecidedRadii()
    # What the rows make of cast space if rays and mapping are inverses.
    right = np.array([
        [u_scale * m_z, 0, 0, -u_scale * m_z * m_x], [0, v_scale * z_o, 0, -v_scale * z_o * y_o], [0, 0, 1, 0]
    ])  # fmt: skip
    made = _times(rows[:, :3], view.world_from_cast)
    made[:, 3] += rows[:, 3]
    farthest = np.append(np.abs(box).max(axis=0), 1.0)
    world = _times(np.abs(view.world_from_cast), farthest)
    error = _times(np.abs(made - right), farthest) + _times(np.abs(right[:, :2]), ray_errors(view, box))
    a, b, c = _row_errors(rows, world, error, samples)
    moved = multiply(samples, rows[:, :3].T)
    depth, aside = float(farthest[2]), float(np.abs(moved[:, 2]).max())
    d = c.plus(_Line(max(abs(z_m), abs(z_o)) + depth, aside), 2 * _ROUND)  # of z_m - Z and z_o - Z
    high = min(
        _largest(moved[:, 0], -moved[:, 2], _Line(z_m - float(box[1, 2]), -aside), a, d, view.width, u_0,
                 lens_u + u_scale * m_x),
        _largest(moved[:, 1], -moved[:, 2], _Line(float(box[0, 2]) - z_o, -aside), b, d, view.height, v_0,
                 lens_v + v_scale * y_o),
    )  # fmt: skip
    return _between(high, moved[:, 2], moved[:, 2], c.plus(_Line(depth, 0.0), 2 * _ROUND))


def _of_module(view: View, box: Numbers, samples: Numbers, radii: Sequence[float]) -> DecidedRadii:
    """The radii of any display's module: the affine half as of a flat one's, the rest in ``display_motion``."""
    rows = view.world_to_image.numbers[:12].reshape(3, 4)
    if not np.array_equal(view.world_to_image.numbers[12:], view.lens):
        return DecidedRadii()
    back = _times(rows[:, :3], view.world_from_cast)
    back[:, 3] += rows[:, 3]
    farthest = np.append(np.abs(box).max(axis=0), 1.0)
    world = _times(np.abs(view.world_from_cast), farthest)
    errors = _row_errors(rows, world, _times(np.abs(back - np.eye(3, 4)), farthest), samples)
    moved = multiply(samples, rows[:, :3].T)
    likely = [radius for radius in radii if stays(view.lens, box.mean(axis=0), radius * moved)]
    if not likely:
        return DecidedRadii()
    high = largest_ball(view, box, moved, np.array(errors).T, likely)
    error = errors[2].plus(_Line(float(farthest[2]), 0.0), 2 * _ROUND)
    made = _between(high, moved[:, 2], moved[:, 2], error)
    return made._replace(open=tuple(radius for radius in likely if radius not in made))


def _of_camera(view: View, back: Matrix, box: Numbers, samples: Numbers) -> DecidedRadii:
    """The radii of a camera."""
    rows, depths = view.world_to_image.numbers.reshape(4, 4), _depths(view, box)
    if depths is None:
        return DecidedRadii()
    low, high = depths
    depth = max(abs(low), abs(high))
    screen = np.array([view.width, view.height, depth, 1.0])
    # Line 3: the texel's point, h / w, of the exact numbers (u, v, D, 1).
    size = _times(np.abs(back), screen)
    e_h = _ROW * size + _FLUSHED
    aside, along = float(_times(np.abs(back[3:, :2]), screen[:2])[0]), [back[3, 2] * low, back[3, 2] * high]
    w_high, room = float(back[3, 3] + max(along) + aside), float(back[3, 3] + min(along) - aside - e_h[3])
    if not room > 0:
        return DecidedRadii()
    world = size[:3] / room
    e_world = (e_h[:3] + world * e_h[3]) / room + _ROUND * world + _FLUSHED
    doubt = np.abs(_times(rows, back) - np.eye(4)) + _DOUBLE * _times(np.abs(rows), np.abs(back))
    error = _times(np.abs(rows[:, :3]), e_world) + _times(doubt, screen) / room
    a, b, c, q = _row_errors(rows, world, error, samples)
    moved = multiply(samples, rows[:, :3].T)
    farther = float(np.abs(moved[:, 3]).max())
    least, most = _Line(1 / w_high, -farther), _Line(1 / room, farther).plus(q)
    reach = min(
        _largest(moved[:, 0], moved[:, 3], least, a, q, view.width, 0.0, 0.0),
        _largest(moved[:, 1], moved[:, 3], least, b, q, view.height, 0.0, 0.0),
    )
    error_z = c.plus(q, depth).plus(most, 2 * _ROUND * (depth + 1))
    return _between(reach, moved[:, 2] - low * moved[:, 3], moved[:, 2] - high * moved[:, 3], error_z)


def _row_errors(rows: Numbers, world: Numbers, error: Numbers, samples: Numbers) -> list[_Line]:
    """How far float32 may be off each row of a mapping.

    Parameters
    ----------
    rows : (k, 4) float64
        The mapping.
    world : (3,) float64
        Upper bounds of the sizes of world coordinates.
    error : (k,) float64
        How far the rows are off before anything is rounded to float32.
    samples : (n, 3) float64
        Offsets in the unit ball.
    """
    size = _times(np.abs(rows), np.append(world, 1.0))
    base = error + _ROW * size + _FLUSHED * (1 + np.abs(rows).sum(axis=1) + world.sum())
    slope = _ROW * multiply(np.abs(samples), np.abs(rows[:, :3]).T).max(axis=0)
    return [_Line(*pair) for pair in zip(base.tolist(), slope.tolist(), strict=True)]


def _largest(
    numerator: Numbers, divisor: Numbers, least: _Line, a: _Line, d: _Line, size: int, u_0: float, right: float
) -> float:
    """The radius below which the image of every sample stays in its texel, along one axis; 0 where there is none.

    Parameters
    ----------
    numerator, divisor : (n,) float64
        What the samples of radius 1 add to a and d.
    least : _Line
        A lower bound of the size of d + d_o.
    a, d : _Line
        Errors of a and d.
    size : int
        Number of texels.
    u_0, right : float
        What is added to the quotient, and what it should be.
    """
    ends = 0.5 - right, size - 0.5 - right  # of t; what is linear in it is largest there
    most, reach = max(abs(t) for t in ends), max(float(np.abs(numerator - t * divisor).max()) for t in ends)
    half = 0.5 - abs(u_0 - right) - 4 * _ROUND * (abs(u_0) + most + 1)
    off, room = _Line(0.0, reach).plus(a).plus(d, most), least.plus(d, -1.0)
    if not (half > 0 and room.base > 0):
        return 0.0
    # off < half room, and room > 0 with it, as off is positive.
    base, slope = half * room.base - off.base, off.slope - half * room.slope
    return max(base, 0.0) / slope if slope > 0 else inf


def _between(high: float, near: Numbers, far: Numbers, error: _Line) -> DecidedRadii:
    """The radii whose samples stay in their texel and lie behind or before it by more than an error.

    Parameters
    ----------
    high : float
        The radius below which they stay.
    near, far : (n,) float64
        How far behind the point a sample of radius 1 lies, at the least and at the greatest depth.
    error : _Line
        By how much it may be off.
    """
    behind, before = (near > 0) & (far > 0), (near < 0) & (far < 0)
    gap = float(np.minimum(np.abs(near), np.abs(far)).min()) - error.slope
    if not ((behind | before).all() and gap > 0):
        return DecidedRadii()
    return DecidedRadii(error.base / gap * _SAFETY, high / _SAFETY, int(behind.sum()))


def _depths(view: View, box: Numbers) -> tuple[float, float] | None:
    """Bounds of a camera's depth texture over a box of eye space; None where it reaches the eye."""
    near, far = view.lens[4:6].tolist()
    ends = []
    for z in box[:, 2].tolist():
        if view.ray_kind == PERSPECTIVE and z > 0:
            ends.append(far / (far - near) * (1 - near / z))
        elif view.ray_kind == ORTHOGRAPHIC:
            ends.append((z - near) / (far - near))
        else:
            return None
    margin = 2 * _ROUND * (1 + max(map(abs, ends)))
    return min(ends) - margin, max(ends) + margin


def _times(matrix: Numbers, right: Numbers) -> Numbers:
    """Matrix times matrix, or vector."""
    product = multiply(matrix, right.reshape(len(right), -1))
    return product if right.ndim == 2 else product[:, 0]
