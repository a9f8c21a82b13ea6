"""A view of balls, as formulas read it: textures that all renderers have, and how far what they make of them is off."""

from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.sao.kernels.reconstruct import face_normal
from lfssao.ao.kernels.float_view import all_show, is_other, row_of_texel
from lfssao.ao.kernels.levels import level_texel, mip_level
from lfssao.ao.kernels.look_up import Look, corners_in
from lfssao.ao.kernels.texel_rays import bare_rays, on_ray, point_at
from lfssao.core.balls import SAFETY, UNKNOWN, Ball, ball_between
from lfssao.core.corners import blended, blended_vector, by_corners
from lfssao.core.doubts import Doubt
from lfssao.core.functions import arc_cosine_of_ball, cosine_and_sine_of_ball
from lfssao.core.intrinsics import memory_of
from lfssao.core.jit import formula
from lfssao.core.numbers import number, unless_none, within
from lfssao.core.places import image_or, offset_spot, point_spot, row_of
from lfssao.core.vectors import Vector, dot
from lfssao.optics.kernels.projection import image_of
from lfssao.samples.kernels.spiral import summed_angle, unit_of
from lfssao.verify.bounds.kernels.images import bare_errors, certain, linear_room
from lfssao.verify.bounds.kernels.moment_balls import filtered_balls

LOOK = 2.0**-20  # how far a coordinate of a viewing direction may be off
_NEAR = 2.0**-6  # radians up to which two sums are one with an error; it is twice a sample's own error
_SINGLE = 2.0**-24  # of a number that is rounded to float32
_FAR = 2.0**21  # texels, beyond which no sample lies


class BallLevels(NamedTuple):
    """The least and the largest z of ``lfssao.ao.kernels.levels.Levels``, and where each begins."""

    low: np.ndarray
    high: np.ndarray
    first: np.ndarray


@formula
def _vector(view, texture, texel, error):
    t = np.uint64(3) * np.uint64(texel)
    x, y, z = texture[t], texture[t + np.uint64(1)], texture[t + np.uint64(2)]
    return Vector(view.ball(x, error), view.ball(y, error), view.ball(z, error))


@formula
def image_at(view, place, z):
    """The image point u, v of a place of balls, at cast z, and whether there is one."""
    m = view.rows
    a, b, q = row_of(m, 0, place), row_of(m, 1, place), row_of(m, 2, place)
    return image_or(place, image_of(view.kind, view.lens, a, b, q, z))


@formula
def _divided(view, z, place):
    """A camera's image z of a place of row z, in doubt where the divisor may be 0 or less: nothing is seen there."""
    q = row_of(view.rows, 2, place)
    if not q.value > q.error * SAFETY:
        return view.ball(0.0, UNKNOWN)
    return z / q


@formula
def _with_room(view, z):
    """A camera's image z, and by how much it may seem off where a renderer compares distances (``linear_room``)."""
    return view.ball(z.value, min(UNKNOWN, z.error * SAFETY + linear_room(view.rows, 12, 8, z, view.by)))


@formula
def _place_error(view, texel):
    """By how much a coordinate of a texel's position is off: a cleared place is exact in a renderer's own axes."""
    t = np.uint64(3) * np.uint64(texel)
    x, y, z = view.positions[t], view.positions[t + np.uint64(1)], view.positions[t + np.uint64(2)]
    size = (abs(np.float64(x)) + abs(np.float64(y))) + abs(np.float64(z))
    return 0.0 if view.depth[texel] < np.inf else _SINGLE * size


@formula
def _place(texel, view):
    return _vector(view, view.positions, texel, _place_error(view, texel))


@formula
def _place_between(four, view):
    a, b = _place(four.texel, view), _place(four.right, view)
    return blended_vector(four, a, b, _place(four.below, view), _place(four.across, view))


@formula
def _position(rays, view, texel):
    """A texel's point: of the positions texture, or where it is made of depth, of that."""
    if rays is None or not view.remade:
        return by_corners(texel, _place, _place_between, (view,))
    return on_ray(view, texel, view.surface(texel))


@formula
def _z(texel, view):
    low, high = view.low[texel], view.high[texel]
    return view.ball(0.5 * (low + high), 0.5 * (high - low))


@formula
def _z_between(four, view):
    a, b = _z(four.texel, view), _z(four.right, view)
    return blended(four, a, b, _z(four.below, view), _z(four.across, view))


@formula
def cell_seen(linear, view, image, column, row, size):
    """The corners of a cell, and the places between them that an image point may have."""
    x, y = within(image.u - 0.5 - column, 0.0, 1.0), within(image.v - 0.5 - row, 0.0, 1.0)
    return corners_in(view.look, column, row, x, y, size)


@formula
def _normal(rays, view, texel):
    """A texel's normal: of the normals texture, or where it is made of points, of these."""
    if rays is None or not view.faces:
        return _vector(view, view.normals, texel, 0.0)
    size = view.low.shape[0] // view.width, view.width
    return face_normal(view, np.int64(texel), np.int64(view.column(texel)), np.int64(view.row(texel)), size)


@formula
def _third(third, view, texel):
    """The third number of a noise vector."""
    return view.ball(third[texel], 0.0)


@formula
def _raised(third, view, texel):
    """A noise vector of three numbers."""
    x, y = view.turn(texel)
    return (x * view.rightward() + y * view.upward()) + view.ball(third[texel], 0.0) * _vector(view, view.axes, 2, 0.0)


@formula
def _in_any_axes(v):
    """A vector with its roundings in any axes, whose coordinates differ."""
    size, own = abs(v.x.value) + abs(v.y.value) + abs(v.z.value), v.x.error + v.y.error + v.z.error
    e = own + 4.0 * v.x.operation * (size + own)
    return Vector(Ball(v.x.value, e, v.x), Ball(v.y.value, e, v.x), Ball(v.z.value, e, v.x))


class BallView(NamedTuple):
    """A view's textures row by row, with the words of ``lfssao.ao.formulas.Seen``.

    Textures are float32, numbers of the mapping and of the axes are float32 ones, held as float64: those of
    ``lfssao.ao.kernels.float_view.FloatView``, and low and high, (H W,) float64, the least and the largest z of each
    surface. by: ``images.Errors``. turned: whether turns are not all 0. asked: (2,), 1 after a
    condition was in doubt, and the answer to those, 0 or 1.
    """

    depth: np.ndarray
    positions: np.ndarray
    normals: np.ndarray
    directions: np.ndarray
    turns: np.ndarray
    kind: int
    rows: np.ndarray
    lens: np.ndarray
    axes: np.ndarray
    width: int
    low: np.ndarray
    high: np.ndarray
    by: NamedTuple
    turned: bool
    moments_of: Any = None  # ``moment_balls.BallPyramid``, where textures are filtered
    divides: bool = False
    asked: np.ndarray = np.zeros(2)
    rays: Any = None
    levels: Any = None  # ``BallLevels``
    remade: bool = False  # whether a renderer makes points of depth, by the rays
    faces: bool = False  # whether it makes normals of points
    look: Look = Look()  # as of ``FloatView``; one that reads no other texels where that has none
    third: Any = None  # likewise

    def ball(self, value, error):
        return Ball(np.float64(value), np.float64(error), certain(0.0, self.by))

    def position(self, texel):
        return _position(self.rays, self, texel)

    def normal(self, texel):
        return _normal(self.rays, self, texel)

    def direction(self, texel):
        return _vector(self, self.directions, texel, LOOK)

    def turn(self, texel):
        return self.ball(self.turns[0][texel], 0.0), self.ball(self.turns[1][texel], 0.0)

    def noise(self, texel):
        x, y = self.turn(texel)
        return unless_none(self.third, x * self.rightward() + y * self.upward(), _raised, (self, texel))

    def jitter(self, texel):
        x, _ = self.turn(texel)
        return unless_none(self.third, number(0, x), _third, (self, texel))

    def turn_by_angle(self, texel):
        off = self.by.angle if self.turned else 0.0
        return self.ball(self.turns[0][texel], off), self.ball(self.turns[1][texel], off)

    def sine_of_angle(self, x):
        return self.ball(x, self.by.angle)

    def arc_cosine(self, x):
        return arc_cosine_of_ball(x, self.by.angle)

    def cosine_and_sine(self, angle):
        return cosine_and_sine_of_ball(angle, self.by.angle)

    def hashed_turn(self, at, angle):
        # A sum in float32 is the nearest number: either of two, where the angle may be on both sides of their middle.
        off = self.by.quotient + 3.0 * self.by.operation  # of a product of 2 pi, tau and alpha
        low = summed_angle(at[0].value, at[1].value, angle * (1.0 - off))
        high = summed_angle(at[0].value, at[1].value, angle * (1.0 + off))
        two, error = high - low > _NEAR, self.by.operation + self.by.angle
        if two:
            self.asked[0] = 1.0
        sine, cosine = unit_of(high if two and self.asked[1] == 1.0 else low)
        error += 0.0 if two else high - low
        return self.ball(cosine, error), self.ball(sine, error)

    def fork(self, condition):
        if condition.may == condition.must:
            return condition.must
        self.asked[0] = 1.0
        return self.asked[1] == 1.0

    def surface(self, texel):
        return by_corners(texel, _z, _z_between, (self,))

    def image_z(self, texel):
        z = self.surface(texel)
        return _with_room(self, z) if self.divides else z

    def coarse_z(self, seen, h, log_q):
        first, error = self.levels.first, h.error * SAFETY
        bits, top, width = np.int32(log_q), np.int32(first.shape[0] - 1), np.int32(self.width)
        row, column = np.int32(self.row(seen)), np.int32(self.column(seen))
        low, high = mip_level(max(h.value - error, 0.0), bits, top), mip_level(min(h.value + error, _FAR), bits, top)
        near, far = np.inf, -np.inf
        for level in range(low, high + 1):
            place = level_texel(first, np.int32(level), column, row, width)
            near, far = min(near, self.levels.low[place]), max(far, self.levels.high[place])
        like = certain(0.0, self.by)
        if far < np.inf:
            return ball_between(near, far, like), Doubt(True, True)
        return Ball(0.0, UNKNOWN, like), Doubt(near < np.inf, False)

    def point_at(self, u, v, z):
        return point_at(self.rays, u, v, z)

    def apart(self, there, here):
        return _in_any_axes(there - here) if self.remade else there - here

    def sample_offset(self, x):
        return self.ball(x, self.by.offset * abs(x))

    def shows(self, texel):
        return all_show(texel, self)

    def other(self, seen, texel):
        return is_other(seen, texel)

    def image(self, place):
        return image_at(self, place, self.depth_at(place))

    def moments(self, seen, level):
        return filtered_balls(self.moments_of, level, seen[0], seen[1], self.by)

    def row(self, texel):
        return row_of_texel(texel, self.width)

    def column(self, texel):
        return texel - row_of_texel(texel, self.width) * self.width

    def rightward(self):
        return _vector(self, self.axes, 0, 0.0)

    def upward(self):
        return _vector(self, self.axes, 1, 0.0)

    def at(self, point):
        return point_spot(point)

    def along(self, direction):
        return offset_spot(direction)

    def depth_at(self, place):
        z = row_of(self.rows, 3, place)
        return _with_room(self, _divided(self, z, place)) if self.divides else z

    def depth_along(self, direction):
        m = self.rows
        return dot(Vector(self.ball(m[12], 0.0), self.ball(m[13], 0.0), self.ball(m[14], 0.0)), direction)


@formula
def answering(view, asked):
    """The view with its textures as bare memory, whose conditions in doubt are answered by the kernel's own array."""
    return BallView(
        memory_of(view.depth), memory_of(view.positions), memory_of(view.normals), memory_of(view.directions),
        (memory_of(view.turns[0]), memory_of(view.turns[1])), view.kind, memory_of(view.rows), memory_of(view.lens),
        memory_of(view.axes), view.width, view.low, memory_of(view.high), bare_errors(view.by), view.turned,
        view.moments_of, view.divides, asked, bare_rays(view.rays), view.levels, view.remade, view.faces, view.look,
        memory_of(view.third),
    )  # fmt: skip
