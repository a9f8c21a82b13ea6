"""The mapping of curved displays: at 200 bits from its geometry, and what rounding can do to the kernel's steps."""

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np

from lfssao.bench.measure import Measured
from lfssao.bench.running_error import Arithmetic, Tracked
from lfssao.bench.slits import EXACT
from lfssao.display_file import find_display
from lfssao.kernels.landing import land
from lfssao.kernels.mapping import DISPLAY

BITS = 200
_PROBE = 2.0**-200


def picoarray(share: float, path: str) -> Measured:
    """Texels of picoarray's outermost modules, points of their rays at a share of the way from observers to lens."""
    shown_by, dtype = find_display("picoarray"), np.dtype(path)
    conditions, ulps, texels, bounds, exceeded = [0.0], [0.0], [0.0], [0.0], 0
    count = 0
    for index in (0, len(shown_by.modules) - 1):
        module, numbers = shown_by.modules[index], shown_by.module_numbers(index)
        u, v = (a.ravel() for a in np.meshgrid([0.5, module.width / 2, module.width - 0.5], [0.5, module.height - 0.5]))
        origin, direction, span = shown_by.texel_ray(index, u, v)
        z = span[:, :1] + share * (span[:, 1:] - span[:, :1])
        points = (origin + z * direction)[span[:, 0] < span[:, 1]]
        m = np.concatenate([np.eye(3, 4).ravel(), numbers]).astype(dtype)
        image = np.empty((len(points), 3), dtype)
        land(DISPLAY, m, points.astype(dtype), image)
        for point, ours in zip(points, image, strict=True):
            exact = curved_image(numbers, point)
            bound = _Steps(Arithmetic.of(dtype), numbers).image(point)
            probe = _Steps(EXACT, numbers, _PROBE).image(point)
            for a, b, known, probed in zip(ours[:2], exact, bound, probe, strict=True):
                error = float(abs(mpmath.mpf(float(a)) - b)) if np.isfinite(a) else np.inf
                texels.append(error)
                ulps.append(error / float(np.spacing(dtype.type(max(abs(float(b)), 1.0)))))
                bounds.append(known.error)
                conditions.append(probed.error / (_PROBE * max(abs(float(b)), 1.0)))
                exceeded += not error <= known.error
                count += 1
    return Measured(max(conditions), max(ulps), max(texels), max(bounds), exceeded, 0, 0, count)


def curved_image(numbers: Any, point: Any) -> tuple[Any, Any]:
    """U and v (texels) of a physical point, of a display with the linear diffuser and without distortion.

    Circles by centre and radius and the quadratic formula: none of the kernel's steps.
    """
    with mpmath.workprec(BITS):
        d = [mpmath.mpf(float(n)) for n in numbers]
        x, y, z = (mpmath.mpf(float(n)) for n in point)
        t_s, t_v = _crossing(d, d[5], mpmath.mpf(0), x, z), _crossing(d, d[6], d[4], x, z)
        s_x, s_z = d[0] + t_s * (x - d[0]), d[2] + t_s * (z - d[2])
        s_y = d[3] + (y - d[3]) * (t_v - t_s) / (t_v - 1)
        away = d[2] / (d[2] - s_z)  # the line from the lens, on to the plane z = 0
        p, q = d[0] + away * (s_x - d[0]), d[1] + away * (s_y - d[1])
        u, v, w = (d[k] * p + d[k + 1] * q + d[k + 2] for k in (8, 11, 14))
        return u / w, v / w


def _crossing(d: Sequence[Any], curvature: Any, z_0: Any, x: Any, z: Any) -> Any:
    """Share of the way from the lens to a point at which the circle through (0, z_0) is reached."""
    dx, dz = x - d[0], z - d[2]
    if curvature == 0:
        return (z_0 - d[2]) / dz
    centre = z_0 + 1 / curvature
    a = dx**2 + dz**2
    b = d[0] * dx + (d[2] - centre) * dz
    c = d[0] ** 2 + (d[2] - centre) ** 2 - 1 / curvature**2
    return (-b + mpmath.sign(curvature) * mpmath.sqrt(b**2 - a * c)) / a


class _Steps:
    """The kernel's steps for a linear diffuser without distortion, with bounds of their errors."""

    def __init__(self, work: Arithmetic, numbers: Any, probe: float = 0.0) -> None:
        self._work, self._probe = work, probe
        self._d = [self._input(n) for n in numbers]

    def _input(self, number: Any) -> Tracked:
        return self._work.rounded(Tracked(Fraction(float(number)), abs(float(number)) * self._probe))

    def image(self, point: Any) -> tuple[Tracked, Tracked]:
        w, d = self._work, self._d
        m_x, m_y, m_z, y_o, z_o = d[:5]
        x, y, z = (self._input(n) for n in point)
        dx, dz = w.subtract(x, m_x), w.subtract(z, m_z)
        t_s = self._circle(d[5], m_x, m_z, dx, dz)
        t_v = self._circle(d[6], m_x, w.subtract(m_z, z_o), dx, dz)
        share = w.divide(w.subtract(t_v, t_s), w.subtract(t_v, Tracked(Fraction(1))))
        s_y = w.add(y_o, w.multiply(w.subtract(y, y_o), share))
        s_x = w.add(m_x, w.multiply(t_s, dx))
        if d[5].value != 0:
            s_z = w.add(m_z, w.multiply(t_s, dz))
            scale = w.divide(m_z, w.subtract(m_z, s_z))
            s_x = w.add(m_x, w.multiply(w.subtract(s_x, m_x), scale))
            s_y = w.add(m_y, w.multiply(w.subtract(s_y, m_y), scale))
        u, v, divisor = (w.add(w.add(w.multiply(d[k], s_x), w.multiply(d[k + 1], s_y)), d[k + 2]) for k in (8, 11, 14))
        return w.divide(u, divisor), w.divide(v, divisor)

    def _circle(self, curvature: Tracked, x: Tracked, z: Tracked, dx: Tracked, dz: Tracked) -> Tracked:
        w = self._work
        a = w.multiply(curvature, w.add(w.multiply(dx, dx), w.multiply(dz, dz)))
        b = w.subtract(w.multiply(curvature, w.add(w.multiply(x, dx), w.multiply(z, dz))), dz)
        c = w.subtract(w.multiply(curvature, w.add(w.multiply(x, x), w.multiply(z, z))), w.add(z, z))
        root = w.root(w.subtract(w.multiply(b, b), w.multiply(a, c)))
        return w.divide(Tracked(-c.value, c.error), w.add(b, root))
