"""The three kinds of mapping step by step, as display, camera and kernels compute them, on numbers with error bounds.

In ``EXACT`` arithmetic the same steps give the exact image. Each class also has the kernels' own image and the mapping
as the kernels take it: ``to_image``, and a camera's inverse ``back``, for which AO is Algorithm 1 and points are u, v
and depth.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.kernels import ssao
from lfssao.bench.stability.running_error import DOUBLE, EXACT, Arithmetic, Tracked, all_of
from lfssao.core.affine import Matrix
from lfssao.optics.camera import Camera
from lfssao.optics.display import Display
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.kernels.display import display_module
from lfssao.optics.view import View, WorldToImage

Texture = NDArray[np.floating[Any]]
Point = tuple[Fraction, Fraction, Fraction]

# u, v and z of a point + offset, and whether it lies in the mapping's domain; None where rounding may decide.
Image = tuple[Tracked, Tracked, Tracked, bool | None]
Steps = Callable[[Point, Point], Image]


def rational(numbers: Any) -> Point:
    """Three floats as fractions."""
    x, y, z = (Fraction(float(n)) for n in numbers)
    return x, y, z


def exact_image(steps: Steps, point: Point, offset: Point) -> Point | None:
    """u, v and z of point + offset by steps in ``EXACT`` arithmetic; None outside the mapping's domain."""
    u, v, z, in_domain = steps(point, offset)
    return (u.value, v.value, z.value) if in_domain else None


def _given(arithmetic: Arithmetic, number: float | Fraction, probe: float) -> Tracked:
    return arithmetic.number(Fraction(number), abs(float(number)) * probe)


def _linear(row: Sequence[Tracked], p: Sequence[Tracked], turn: Sequence[Tracked] = ()) -> Tracked:
    """(row_0 x + row_1 y) + row_2 z of p = (x, y, z), turned by cosine and sine: what a matrix does to a direction."""
    along = row[0] * p[0] + row[1] * p[1]
    if turn:
        along = turn[0] * along + turn[1] * (row[1] * p[0] - row[0] * p[1])
    return along + row[2] * p[2]


def _affine(row: Sequence[Tracked], p: Sequence[Tracked]) -> Tracked:
    """The same + row_3: what a matrix does to a point."""
    return _linear(row, p) + row[3]


@dataclass(frozen=True, eq=False)
class CrossedSlits:
    """The first module of a flat display with the linear diffuser, in world coordinates of an affine map, (3, 4)."""

    display: Display
    physical_from_world: Matrix
    turn: tuple[float, ...] = ()  # cosine and sine by which samples are turned about world z; none: they are not
    back = None

    @property
    def to_image(self) -> WorldToImage:
        """World to image, as the kernels take it."""
        return self.display.view(0, self.physical_from_world).world_to_image

    def steps(self, work: Arithmetic, probe: float = 0.0) -> Steps:
        """The steps of ``Display.view``, in float64, and of CROSSED_SLITS in the kernels' arithmetic, ``work``.

        Inputs have the relative error ``probe``, for condition numbers.
        """
        make = DOUBLE if work.unit else EXACT
        shown, module = self.display, self.display.modules[0]
        m_x, m_z, width, height = (_given(make, n, probe) for n in (module.x, module.z, module.width, module.height))
        y_o, z_o = (_given(make, n, probe) for n in (shown.observer_height, shown.observer_z))
        screen_width, screen_height = (_given(make, n, probe) for n in (shown.screen_width, shown.screen_height))
        rows = [[_given(make, float(entry), probe) for entry in row] for row in self.physical_from_world]
        u_scale, v_scale, half = width / screen_width, -height / screen_height, make.number(0.5)
        for row, centre, factor in ((rows[0], m_x, u_scale * m_z), (rows[1], y_o, v_scale * z_o)):
            row[3] = row[3] - centre
            row[:] = [entry * factor for entry in row]
        u_0, v_0 = work.rounded(width * half + u_scale * m_x), work.rounded(height * half + v_scale * y_o)
        m_z, z_o = work.rounded(m_z), work.rounded(z_o)
        rows = [[work.rounded(entry) for entry in row] for row in rows]
        turn = [_given(work, n, probe) for n in self.turn]

        def image(point: Point, offset: Point) -> Image:
            place, way = ([_given(work, n, probe) for n in vector] for vector in (point, offset))
            a, b, c = (_affine(row, place) + _linear(row, way, turn) for row in rows)
            return u_0 + a / (m_z - c), v_0 + b / (z_o - c), c, all_of(c.is_less(m_z), z_o.is_less(c))

        return image

    def kernel_image(self, positions: Texture, offset: Texture) -> Texture:
        """U and v by the kernels' own lines, on arrays."""
        m = self.to_image.as_type(positions.dtype).numbers
        a, b, c = _rows(m, 3, np.moveaxis(positions, -1, 0), offset, self.turn)
        with np.errstate(all="ignore"):  # outside the domain
            u, v, *_ = mapping.project_crossed_slits.py_func(mapping.Slits(*m[12:]), a, b, c)
        return np.stack([u, v], axis=-1)


def _rows(m: Texture, count: int, place: Any, offset: Texture, turn: Sequence[float] = ()) -> list[Texture]:
    """Rows of M place + M offset, the offset turned by cosine and sine, by the kernels' own lines."""
    turns = np.array(turn, m.dtype)[:, None] if turn else None
    projection = mapping.Projection(mapping.MATRIX if count == 4 else mapping.CROSSED_SLITS, m)
    ways = ssao.transform_offsets.py_func(offset[None, :], projection, turns)
    affine, way = mapping.affine_row.py_func, ssao.offset_row.py_func
    return [affine(m, row, *place) + way(ways, 0, row, turns, turns, 0) for row in range(count)]


@dataclass(frozen=True)
class CameraAtOrigin:
    """A 'perspective' or 'orthographic' camera at the origin that looks along -Z, with ``extent`` at ``distance``."""

    projection: str
    distance: float
    extent: float
    near: float
    far: float
    width: int
    height: int

    @cached_property
    def view(self) -> View:
        """The camera's view."""
        target = (0.0, 0.0, -self.distance)
        camera = Camera(self.projection, (0.0, 0.0, 0.0), target, (0.0, 1.0, 0.0), self.extent, self.near, self.far)
        return camera.view(self.width, self.height)

    @property
    def to_image(self) -> WorldToImage:
        """World to image, as the kernels take it."""
        return self.view.world_to_image

    @property
    def back(self) -> Matrix:
        """The matrix from screen to world."""
        assert self.view.screen_to_world is not None  # a camera's
        return self.view.screen_to_world

    def matrices(self, work: Arithmetic, probe: float = 0.0) -> tuple[list[list[Tracked]], list[list[Tracked]]]:
        """World to screen and back, rows of four, made in float64 and rounded to an arithmetic."""
        make = DOUBLE if work.unit else EXACT
        distance, extent = (_given(make, n, probe) for n in (self.distance, self.extent))
        near, far, width, height = (_given(make, n, probe) for n in (self.near, self.far, self.width, self.height))
        o, one, half = make.number(0), make.number(1), make.number(0.5)
        u_0, v_0, focal, span = width * half, height * half, height / extent, far - near
        if self.projection == "perspective":
            focal = focal * distance
            a, b = far / span, (far * near) / span
            forth = [[focal, o, -u_0, o], [o, -focal, -v_0, o], [o, o, -a, -b], [o, o, -one, o]]
            last = [[o, o, o, -one], [o, o, -(one / b), a / b]]
        else:
            forth = [[focal, o, o, u_0], [o, -focal, o, v_0], [o, o, -(one / span), -(near / span)], [o, o, o, one]]
            last = [[o, o, -span, -near], [o, o, o, one]]
        texel = one / focal
        back = [[texel, o, o, -(u_0 / focal)], [o, -texel, o, v_0 / focal], *last]
        forth, back = ([[work.rounded(entry) for entry in row] for row in matrix] for matrix in (forth, back))
        return forth, back

    def steps(self, work: Arithmetic, probe: float = 0.0) -> Steps:
        """The steps of Algorithm 1: a texel's (u, v, depth) into the world, the offset added, and back."""
        forth, back = self.matrices(work, probe)

        def image(point: Point, offset: Point) -> Image:
            screen, way = ([_given(work, n, probe) for n in vector] for vector in (point, offset))
            x, y, z, w = (_affine(row, screen) for row in back)
            place = [x / w, y / w, z / w]
            a, b, c, q = (_affine(row, place) + _linear(row, way) for row in forth)
            return a / q, b / q, c / q, q.is_positive()

        return image

    def kernel_image(self, positions: Texture, offset: Texture) -> Texture:
        """U and v by the kernels' own lines, on arrays."""
        m, back = self.to_image.as_type(positions.dtype).numbers, np.ravel(self.back).astype(positions.dtype)
        with np.errstate(all="ignore"):  # outside the domain
            x, y, z, w = _rows(back, 4, np.moveaxis(positions, -1, 0), np.zeros(3, positions.dtype))
            u, v, *_ = mapping.project_matrix.py_func(*_rows(m, 4, (x / w, y / w, z / w), offset))
        return np.stack([u, v], axis=-1)


@dataclass(frozen=True, eq=False)
class GeneralDisplay:
    """Module ``index`` of any display, in physical coordinates, by its float64 numbers (``optics.kernels.display``)."""

    display: Display
    index: int = 0
    back = None

    @property
    def to_image(self) -> WorldToImage:
        """World to image, as the kernels take it."""
        numbers = self.display.module_numbers(self.index)
        return WorldToImage(mapping.DISPLAY, np.concatenate([np.eye(3, 4).ravel(), numbers]))

    def steps(self, work: Arithmetic, probe: float = 0.0) -> Steps:
        """The steps of the kernel ``physical_to_image``."""
        d = display_module.py_func([_given(work, float(n), probe) for n in self.display.module_numbers(self.index)])
        m_x, m_y, m_z, y_o, z_o, screen, observers, conical = d[:8]
        one = work.number(1)

        def image(point: Point, offset: Point) -> Image:
            x, y, z = (_given(work, a, probe) + _given(work, b, probe) for a, b in zip(point, offset, strict=True))
            dx, dz = x - m_x, z - m_z
            t_s, meets_screen = _circle(screen, m_x, m_z, dx, dz)
            t_v, meets_observers = _circle(observers, m_x, m_z - z_o, dx, dz)
            shown = [z.is_less(m_z), meets_screen, meets_observers, one.is_less(t_v), t_s.is_positive()]
            shown.append(t_s.is_less(t_v))
            s_y = y_o + (y - y_o) * ((t_v - t_s) / (t_v - one))
            if conical.value:
                kappa = (z / z_o) * (_hypot(s_y - y_o, z_o) / _hypot(s_y - m_y, m_z))
                s_x = (x + m_x * kappa) / (one + kappa)
                shown.append((one + kappa).is_positive())
            else:
                s_x = m_x + t_s * dx
            if screen.value:
                scale = m_z / (m_z - (m_z + t_s * dz))
                s_x, s_y = m_x + (s_x - m_x) * scale, m_y + (s_y - m_y) * scale
                shown.append(scale.is_positive())
            u, v, w = ((d.homography[k] * s_x + d.homography[k + 1] * s_y) + d.homography[k + 2] for k in (0, 3, 6))
            u, v = u / w, v / w
            shown.append(w.is_positive())
            if d.k1.value or d.k2.value:
                a, b = (u - d.c_u) / d.unit, (v - d.c_v) / d.unit
                r2 = a * a + b * b
                factor = one + r2 * (d.k1 + r2 * d.k2)
                u, v = d.c_u + d.unit * (a * factor), d.c_v + d.unit * (b * factor)
                shown.append(r2.is_less(d.fold))
            return u, v, z, all_of(*shown)

        return image

    def kernel_image(self, positions: Texture, offset: Texture) -> Texture:
        """U and v by the kernel; NaN outside the domain."""
        places = np.ascontiguousarray((positions + offset).reshape(-1, 3))
        image = np.empty_like(places)
        mapping.land(self.to_image.as_type(places.dtype), places, image)
        return image[:, :2].reshape(*positions.shape[:-1], 2)


def _hypot(a: Tracked, b: Tracked) -> Tracked:
    return (a * a + b * b).root()


def _circle(curvature: Tracked, x: Tracked, z: Tracked, dx: Tracked, dz: Tracked) -> tuple[Tracked, bool | None]:
    """Fraction of the way along (dx, dz) at which a circle is left, and whether it is met."""
    a = curvature * (dx * dx + dz * dz)
    b = curvature * (x * dx + z * dz) - dz
    c = curvature * (x * x + z * z) - (z + z)
    discriminant = b * b - a * c
    missed = discriminant.is_less(0)
    return -c / (b + discriminant.root()), None if missed is None else not missed


Mapping = CrossedSlits | CameraAtOrigin | GeneralDisplay
