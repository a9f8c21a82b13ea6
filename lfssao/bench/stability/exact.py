"""The three kinds of mapping step by step, as display, camera and kernels compute them, on numbers with error bounds.

In arithmetic without rounding the same steps give the exact image. Each class also has its view, whose numbers the
kernels take. A camera's AO is Algorithm 1, and its points are u, v and depth.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lfssao.bench.stability.running_error import DOUBLE, Arithmetic, Tracked, all_of
from lfssao.core.affine import Matrix
from lfssao.optics.camera import Camera
from lfssao.optics.display import Display
from lfssao.optics.kernels.display import display_module
from lfssao.optics.kernels.projection import DISPLAY
from lfssao.optics.view import View, WorldToImage

# u, v and z of a point + offset, and whether it lies in the mapping's domain; None where rounding may decide.
Image = tuple[Tracked, Tracked, Tracked, bool | None]
Steps = Callable[[Iterable[float], Iterable[float]], Image]


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

    @property
    def view(self) -> View:
        """The module's view."""
        return self.display.view(0, self.physical_from_world)

    def steps(self, work: Arithmetic) -> Steps:
        """The steps of ``Display.view``, in float64, and of CROSSED_SLITS in the kernels' arithmetic, ``work``."""
        make = DOUBLE if work.unit else work
        shown, module = self.display, self.display.modules[0]
        m_x, m_z, width, height = map(make.given, (module.x, module.z, module.width, module.height))
        y_o, z_o = map(make.given, (shown.observer_height, shown.observer_z))
        screen_width, screen_height = map(make.given, (shown.screen_width, shown.screen_height))
        rows = [[make.given(entry) for entry in row] for row in self.physical_from_world]
        u_scale, v_scale, half = width / screen_width, -height / screen_height, make.number(0.5)
        for row, centre, factor in ((rows[0], m_x, u_scale * m_z), (rows[1], y_o, v_scale * z_o)):
            row[3] = row[3] - centre
            row[:] = [entry * factor for entry in row]
        u_0, v_0 = work.rounded(width * half + u_scale * m_x), work.rounded(height * half + v_scale * y_o)
        m_z, z_o = work.rounded(m_z), work.rounded(z_o)
        rows = [[work.rounded(entry) for entry in row] for row in rows]
        turn = [work.given(n) for n in self.turn]

        def image(point: Iterable[float], offset: Iterable[float]) -> Image:
            place, way = ([work.given(n) for n in vector] for vector in (point, offset))
            a, b, c = (_affine(row, place) + _linear(row, way, turn) for row in rows)
            return u_0 + a / (m_z - c), v_0 + b / (z_o - c), c, all_of(c.is_less(m_z), z_o.is_less(c))

        return image


@dataclass(frozen=True)
class CameraAtOrigin:
    """A 'perspective' or 'orthographic' camera at the origin that looks along -Z, with ``extent`` at ``distance``."""

    projection: str
    far: float
    near, distance, extent, size = 0.5, 2.0, 1.5, 8  # size: width and height of its texture
    turn = ()

    @property
    def view(self) -> View:
        """The camera's view."""
        target = (0.0, 0.0, -self.distance)
        camera = Camera(self.projection, (0.0, 0.0, 0.0), target, (0.0, 1.0, 0.0), self.extent, self.near, self.far)
        return camera.view(self.size, self.size)

    def steps(self, work: Arithmetic) -> Steps:
        """The steps of Algorithm 1: a texel's (u, v, depth) into the world, the offset added, and back.

        The matrices are made in float64 and rounded to the arithmetic.
        """
        make = DOUBLE if work.unit else work
        distance, extent, near, far = map(make.given, (self.distance, self.extent, self.near, self.far))
        width = height = make.given(self.size)
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

        def image(point: Iterable[float], offset: Iterable[float]) -> Image:
            screen, way = ([work.given(n) for n in vector] for vector in (point, offset))
            x, y, z, w = (_affine(row, screen) for row in back)
            place = [x / w, y / w, z / w]
            a, b, c, q = (_affine(row, place) + _linear(row, way) for row in forth)
            return a / q, b / q, c / q, q.is_positive()

        return image


@dataclass(frozen=True, eq=False)
class GeneralDisplay:
    """Module ``index`` of any display, in physical coordinates, by its float64 numbers (``optics.kernels.display``)."""

    display: Display
    index: int = 0
    turn = ()

    @property
    def view(self) -> View:
        """The module's view, its mapping of kind DISPLAY even where a display has a simpler one."""
        same, numbers = np.eye(3, 4), self.display.module_numbers(self.index)
        to_image = WorldToImage(DISPLAY, np.concatenate([same.ravel(), numbers]))
        return replace(self.display.view(self.index, same), world_to_image=to_image)

    def steps(self, work: Arithmetic) -> Steps:
        """The steps of the kernel ``physical_to_image``."""
        d = display_module.py_func([work.given(n) for n in self.display.module_numbers(self.index)])
        m_x, m_y, m_z, y_o, z_o, screen, observers, conical = d[:8]
        one = work.number(1)

        def image(point: Iterable[float], offset: Iterable[float]) -> Image:
            x, y, z = (work.given(a) + work.given(b) for a, b in zip(point, offset, strict=True))
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


def _hypot(a: Tracked, b: Tracked) -> Tracked:
    return (a * a + b * b).root()


def _circle(curvature: Tracked, x: Tracked, z: Tracked, dx: Tracked, dz: Tracked) -> tuple[Tracked, bool | None]:
    """Fraction of the way along (dx, dz) at which a circle is left, and whether it is met."""
    a = curvature * (dx * dx + dz * dz)
    b = curvature * (x * dx + z * dz) - dz
    c = curvature * (x * x + z * z) - (z + z)
    discriminant = b * b - a * c
    missed = (-discriminant).is_positive()
    return -c / (b + discriminant.root()), None if missed is None else not missed


Mapping = CrossedSlits | CameraAtOrigin | GeneralDisplay
