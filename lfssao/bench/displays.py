"""The mapping of any display: at 200 bits from its geometry, and what rounding can do to the kernel's steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from lfssao.bench.exact import Point
from lfssao.bench.running_error import PROBE, Arithmetic, Tracked, all_of
from lfssao.display import Display
from lfssao.kernels.landing import land
from lfssao.kernels.mapping import DISPLAY
from lfssao.view import WorldToImage

BITS = 200
ONE = Tracked(Fraction(1))
ZERO = Tracked(Fraction(0))


@dataclass(frozen=True, eq=False)
class AnyDisplay:
    """One module of any display, world coordinates being physical (``lfssao.bench.measure.Mapping``).

    What is exact is the mapping that the module's float64 numbers stand for (``lfssao.kernels.display``).

    Attributes
    ----------
    display : Display
        The display.
    index : int
        Number of the module.
    """

    display: Display
    index: int = 0

    @cached_property
    def numbers(self) -> NDArray[np.float64]:
        """The module's numbers."""
        return self.display.module_numbers(self.index)

    @property
    def to_image(self) -> WorldToImage:
        """As the kernels take it."""
        return WorldToImage(DISPLAY, np.concatenate([np.eye(3, 4).ravel(), self.numbers]))

    @property
    def back(self) -> None:
        """A module's mapping has no inverse."""
        return

    def exact(self, point: Point, offset: Point) -> Point | None:
        """Image of point + offset, to 200 bits."""
        x, y, z = (a + b for a, b in zip(point, offset, strict=True))
        found = display_image(self.numbers, (x, y, z))
        return None if found is None else (_fraction(found[0]), _fraction(found[1]), z)

    def steps(self, arithmetic: Arithmetic, probe: bool = False) -> "_Steps":
        """What rounding can do."""
        return _Steps(arithmetic, self.numbers, PROBE if probe else 0.0)

    def landed(self, positions: NDArray[np.floating[Any]], offset: NDArray[np.floating[Any]]) -> NDArray[Any]:
        """U and v by the kernel; NaN outside the domain."""
        places = np.ascontiguousarray((positions + offset).reshape(-1, 3))
        image = np.empty_like(places)
        land(DISPLAY, self.to_image.as_type(places.dtype), places, image)
        return image[:, :2].reshape(*positions.shape[:-1], 2)


def display_image(numbers: Any, point: Point) -> tuple[Any, Any] | None:
    """U and v (texels) of a physical point; None where the display cannot show it.

    Circles by centre and radius and the quadratic formula, the conical diffuser by its ray between screen and
    observers: none of the kernel's steps.
    """
    with mpmath.workprec(BITS):
        d = [mpmath.mpf(float(n)) for n in numbers]
        x, y, z = (mpmath.mpf(n.numerator) / n.denominator for n in point)
        place = _on_screen(d, x, y, z) if z < d[2] else None
        if place is None:
            return None
        s_x, s_y, s_z = place
        away = d[2] / (d[2] - s_z)  # the line from the lens, on to the plane z = 0
        p, q = d[0] + away * (s_x - d[0]), d[1] + away * (s_y - d[1])
        u, v, w = (d[k] * p + d[k + 1] * q + d[k + 2] for k in (8, 11, 14))
        a, b = (u / w - d[17]) / d[19], (v / w - d[18]) / d[19]
        radius = mpmath.hypot(a, b)
        if not (away > 0 and w > 0 and (radius**2 < d[22] or d[20] == d[21] == 0)):
            return None
        grown = 1 + d[20] * radius**2 + d[21] * radius**4
        return d[17] + d[19] * a * grown, d[18] + d[19] * b * grown


def _on_screen(d: Sequence[Any], x: Any, y: Any, z: Any) -> tuple[Any, Any, Any] | None:
    """The point of the screen that shows a physical point."""
    t_s, t_v = _crossing(d, d[5], mpmath.mpf(0), x, z), _crossing(d, d[6], d[4], x, z)
    if t_s is None or t_v is None or not (t_v > 1 and 0 < t_s < t_v):
        return None
    s_x, s_z = d[0] + t_s * (x - d[0]), d[2] + t_s * (z - d[2])
    s_y = d[3] + (y - d[3]) * (t_v - t_s) / (t_v - 1)
    if d[7] == 0:
        return s_x, s_y, s_z
    # x = s_x + (e_x - s_x) z / z_o, where e_x - s_x = (s_x - m_x) h_e / h_m.
    widening = mpmath.hypot(s_y - d[3], d[4]) / mpmath.hypot(s_y - d[1], d[2])
    stretched = 1 + widening * z / d[4]
    return (d[0] + (x - d[0]) / stretched, s_y, mpmath.mpf(0)) if stretched > 0 else None


def _crossing(d: Sequence[Any], curvature: Any, z_0: Any, x: Any, z: Any) -> Any:
    """Share of the way from the lens to a point at which the circle through (0, z_0) is left; None if it is not."""
    dx, dz = x - d[0], z - d[2]
    if curvature == 0:
        return (z_0 - d[2]) / dz
    centre = z_0 + 1 / curvature
    a = dx**2 + dz**2
    b = d[0] * dx + (d[2] - centre) * dz
    c = d[0] ** 2 + (d[2] - centre) ** 2 - 1 / curvature**2
    if b**2 < a * c:
        return None
    return (-b + mpmath.sign(curvature) * mpmath.sqrt(b**2 - a * c)) / a


def _fraction(number: Any) -> Fraction:
    """A number of mpmath as what it is."""
    sign, mantissa, exponent, _ = number._mpf_
    size = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
    return -size if sign else size


class _Steps:
    """The kernel's steps (``lfssao.kernels.display``), with bounds of their errors."""

    def __init__(self, work: Arithmetic, numbers: Any, probe: float) -> None:
        self._work, self._probe = work, probe
        self._d = [self._input(Fraction(float(n))) for n in numbers]

    def _input(self, number: Fraction) -> Tracked:
        return self._work.rounded(Tracked(number, abs(float(number)) * self._probe))

    def image(self, point: Point, offset: Point) -> tuple[Tracked, Tracked, Tracked, bool | None]:
        """u, v and z of point + offset, rounded on their way in; whether the display shows it, None if not known."""
        w, d = self._work, self._d
        x, y, z = (w.add(self._input(a), self._input(b)) for a, b in zip(point, offset, strict=True))
        m_x, m_y, m_z, y_o, z_o = d[:5]
        dx, dz = w.subtract(x, m_x), w.subtract(z, m_z)
        t_s, meets_screen = self._circle(d[5], m_x, m_z, dx, dz)
        t_v, meets_observers = self._circle(d[6], m_x, w.subtract(m_z, z_o), dx, dz)
        shown = [z.surely(m_z), meets_screen, meets_observers, ONE.surely(t_v), ZERO.surely(t_s), t_s.surely(t_v)]
        share = w.divide(w.subtract(t_v, t_s), w.subtract(t_v, ONE))
        s_y = w.add(y_o, w.multiply(w.subtract(y, y_o), share))
        if not d[7].value:
            s_x = w.add(m_x, w.multiply(t_s, dx))
            if d[5].value:
                s_z = w.add(m_z, w.multiply(t_s, dz))
                scale = w.divide(m_z, w.subtract(m_z, s_z))
                shown.append(ZERO.surely(scale))
                s_x = w.add(m_x, w.multiply(w.subtract(s_x, m_x), scale))
                s_y = w.add(m_y, w.multiply(w.subtract(s_y, m_y), scale))
        else:
            kappa = w.multiply(w.divide(z, z_o), w.divide(self._hypot(s_y, y_o, z_o), self._hypot(s_y, m_y, m_z)))
            divisor = w.add(ONE, kappa)
            shown.append(ZERO.surely(divisor))
            s_x = w.divide(w.add(x, w.multiply(m_x, kappa)), divisor)
        u, v, divisor = (w.add(w.add(w.multiply(d[k], s_x), w.multiply(d[k + 1], s_y)), d[k + 2]) for k in (8, 11, 14))
        shown.append(ZERO.surely(divisor))
        u, v = w.divide(u, divisor), w.divide(v, divisor)
        if d[20].value or d[21].value:
            u, v, unfolded = self._distorted(u, v)
            shown.append(unfolded)
        return u, v, z, all_of(*shown)

    def _hypot(self, s_y: Tracked, y: Tracked, z: Tracked) -> Tracked:
        w = self._work
        away = w.subtract(s_y, y)
        return w.root(w.add(w.multiply(away, away), w.multiply(z, z)))

    def _distorted(self, u: Tracked, v: Tracked) -> tuple[Tracked, Tracked, bool | None]:
        w, d = self._work, self._d
        a, b = w.divide(w.subtract(u, d[17]), d[19]), w.divide(w.subtract(v, d[18]), d[19])
        r2 = w.add(w.multiply(a, a), w.multiply(b, b))
        factor = w.add(ONE, w.multiply(r2, w.add(d[20], w.multiply(r2, d[21]))))
        u = w.add(d[17], w.multiply(d[19], w.multiply(a, factor)))
        v = w.add(d[18], w.multiply(d[19], w.multiply(b, factor)))
        return u, v, r2.surely(d[22])

    def _circle(
        self, curvature: Tracked, x: Tracked, z: Tracked, dx: Tracked, dz: Tracked
    ) -> tuple[Tracked, bool | None]:
        """Where it is left, and whether it is met."""
        w = self._work
        a = w.multiply(curvature, w.add(w.multiply(dx, dx), w.multiply(dz, dz)))
        b = w.subtract(w.multiply(curvature, w.add(w.multiply(x, dx), w.multiply(z, dz))), dz)
        c = w.subtract(w.multiply(curvature, w.add(w.multiply(x, x), w.multiply(z, z))), w.add(z, z))
        discriminant = w.subtract(w.multiply(b, b), w.multiply(a, c))
        missed = discriminant.surely(ZERO)
        t = w.divide(Tracked(-c.value, c.error), w.add(b, w.root(discriminant)))
        return t, None if missed is None else not missed
