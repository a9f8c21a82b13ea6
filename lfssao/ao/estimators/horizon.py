"""Horizon-based AO (Bavoil, Sainz and Dimitrov 2008), which VO's table 1 calls HSAO.

Occlusion is the fraction of the hemisphere's directions, not weighted by the cosine, between the tangent plane and the
horizon. The limit for many directions and steps, without bias, where the view is parallel and sees all of the surface
within R, is

    (1 / 2 pi) integral_0^2pi integral W dM d theta

with M the sine of the horizon so far on the way out, which starts at the tangent plane's: 0 on a plane, at a convex
crease and on top of a sphere; 1/2 in a concave right-angle crease, as the nearest step sees the whole wall rise.

At finite resolution the texels that are read lie off the line of the march, where a slanted tangent plane is higher or
lower: a sloping plane hides a little of itself (up to about 0.1 near an edge), unless a bias forbids it. The paper
jitters the steps too; that is left out. Elevations are compared and subtracted as sines.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import Estimator, FloatArray, option
from lfssao.ao.estimators.look_ups import LookUps
from lfssao.ao.estimators.vo.local_frame import EDGE_ON, TILE, disk_mirrors
from lfssao.ao.formulas import ZENITH, fold_formulas
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import sincospi
from lfssao.core.jit import formula
from lfssao.core.numbers import alternatives, larger, least, most, rounded, select, smaller, within
from lfssao.core.quotients import divided, over
from lfssao.core.vectors import cross, dot

# Turn, reflection and place on the disk may be applied in any order: no term is rounded more than 21 times on its way
# into a row, and those of the row, 10, count twice where terms cancel.
ORDERS = 40
# Linear and quadratic part of 1 - W, W the attenuation.
_ATTENUATION = {"quadratic": (0.0, 1.0), "linear": (1.0, 0.0), "none": (0.0, 0.0)}


@dataclass(frozen=True)
class HorizonOptions(LookUps):
    """Options of ``hbao``; the paper leaves W open, and its authors' shader has the quadratic one."""

    directions: int = option(8, "directions of the disk", limits=(1, 1024))
    steps: int = option(8, "steps along each direction", limits=(1, 1024))
    bias: float = option(
        0.0, "angle, degrees, by which a horizon must exceed the tangent plane, against facets", limits=(0.0, 90.0)
    )
    attenuation: str = option(
        "quadratic", "W of a horizon at the distance r R: 1 - r^2, 1 - r or 1", choices=tuple(_ATTENUATION)
    )
    randomize: bool = option(True, "whether the directions are reflected differently over tiles of 4 x 4 texels")
    seed: int = option(0, "of those reflections", limits=(0, 2**53))


class Horizons(NamedTuple):
    """Directions and attenuation, arrays and scalars of the arithmetic's dtype.

    points: (n, 2), x and y of the directions, unit length. steps: how many along each. sides: 1, as the state begins
    anew at each direction. radius: world units. mirrors:
    (2, TILE, TILE), cosine and sine of the reflections of a tile. sine_bias, cosine_bias: of the angle by which the
    horizon must exceed the tangent plane. linear, quadratic: W = 1 - (linear r + quadratic r^2).
    """

    points: Any
    steps: int
    sides: int
    radius: Any
    mirrors: Any
    sine_bias: Any
    cosine_bias: Any
    linear: Any
    quadratic: Any

    def start(self, view: Any, texel: Any) -> Any:
        """P, w, R w_z, the images of P, R e and R f, and the slopes of the tangent plane along e and f."""
        p, w, images, (e, f, towards) = disk_around(self, view, texel)
        return p, w, self.radius * view.depth_along(w), images, (over(e, towards), over(f, towards))

    def counts(self, view: Any, here: Any) -> Any:
        """Whether the texel looks ahead, and there is a radius."""
        return here[2] > 0

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of P + R (x e + y f)."""
        return on_disk(self, here[3], s)

    def begin(self, view: Any, here: Any, s: Any) -> Any:
        """The horizon of the tangent plane, which falls with tau = x slope_e + y slope_f."""
        e, f = here[4]
        tau = divided(self.points[s, 0] * e + self.points[s, 1] * f)
        horizon = alternatives(_risen(self, least(tau)), _risen(self, most(tau)))
        return within(rounded(horizon, 4, horizon), -ZENITH, ZENITH)

    def part(self, view: Any, texel: Any, k: Any) -> Any:
        """Steps have equal distances, and the last one lands at the end."""
        return k / self.steps

    def step(self, view: Any, here: Any, s: Any, k: Any, state: Any, texel: Any, seen: Any) -> Any:
        """The attenuated rise above the horizon so far, and the horizon after it."""
        d, w = view.position(seen) - here[0], here[1]
        length = np.sqrt(dot(d, d))
        sine, r = within(-dot(d, w) / length, -ZENITH, ZENITH), length / rounded(self.radius, 4, length)
        weight = within(1 - (self.linear * r + self.quadratic * (r * r)), 0, 1)
        near = (r < 1) & view.other(seen, texel)
        return select(near, weight * larger(0, sine - state), 0), select(near, larger(state, sine), state)

    def leave(self, view: Any, here: Any, s: Any, state: Any) -> Any:
        """Nothing is added beside the rises."""
        return 0

    def end(self, total: Any) -> Any:
        """The mean over the directions."""
        return smaller(1, larger(0, total / self.points.shape[0]))


@formula
def disk_around(fan: Any, view: Any, texel: Any) -> Any:
    """Return P, w, the images of P, R e and R f, and the normal along e, f and -w.

    fan: has radius and mirrors as of ``Horizons``.
    """
    p, w, n = view.position(texel), view.direction(texel), view.normal(texel)
    e, f = axes_around(fan, view, texel, w)
    images = view.at(p), fan.radius * view.along(e), fan.radius * view.along(f)
    return p, w, images, (dot(n, e), dot(n, f), larger(EDGE_ON, -dot(n, w)))


@formula
def axes_around(fan: Any, view: Any, texel: Any, w: Any) -> Any:
    """Return e and f of a texel's disk, unit vectors at right angles to its viewing direction w and to each other."""
    r = view.rightward()
    a = r - dot(r, w) * w
    a = (1 / np.sqrt(dot(a, a))) * a
    b, (c, s) = cross(w, a), _reflected(fan, view, texel)
    return c * a + s * b, s * a - c * b


@formula
def on_disk(fan: Any, images: Any, s: Any) -> Any:
    """Return the image of P + R (x e + y f), of direction s; images: those of P, R e and R f."""
    p, e, f = images
    return p + fan.points[s, 0] * e + fan.points[s, 1] * f


@formula
def _reflected(fan: Any, view: Any, texel: Any) -> Any:
    """Cosine and sine of a texel's turn, reflected."""
    row, column, (p, q) = view.row(texel) % TILE, view.column(texel) % TILE, view.turn_by_angle(texel)
    c, s = fan.mirrors[0, row, column], fan.mirrors[1, row, column]
    cosine = rounded(c * p, ORDERS, p) + rounded(s * q, ORDERS, p)
    return cosine, rounded(s * p, ORDERS, p) - rounded(c * q, ORDERS, p)


@formula
def _risen(fan: Any, tau: Any) -> Any:
    """Sine of t + bias, tan t = -tau, or 1 where t + bias passes the zenith."""
    cosine = 1 / np.sqrt(1 + tau * tau)
    sine = -tau * cosine
    risen = sine * fan.cosine_bias + cosine * fan.sine_bias
    return select(cosine * fan.cosine_bias - sine * fan.sine_bias > 0, risen, 1)


def around(directions: int) -> FloatArray:
    """Return x and y of directions all around, (n, 2), unit length."""
    return np.array([sincospi((2 * k + 1) / directions)[::-1] for k in range(directions)])


def horizons(buffers: Buffers, radius: float, points: None, weights: None, options: HorizonOptions) -> Horizons:
    """Return the formulas' numbers, in the textures' dtype; hbao takes no samples."""
    dtype = buffers.depth.dtype
    sine_bias, cosine_bias = sincospi(options.bias / 180.0)
    linear, quadratic = _ATTENUATION[options.attenuation]
    mirrors = disk_mirrors(options.randomize, options.seed, dtype)
    return Horizons(
        points=around(options.directions).astype(dtype),
        steps=options.steps,
        sides=1,
        radius=dtype.type(radius),
        mirrors=np.ascontiguousarray(mirrors[:, :, :TILE]),
        sine_bias=dtype.type(sine_bias),
        cosine_bias=dtype.type(cosine_bias),
        linear=dtype.type(linear),
        quadratic=dtype.type(quadratic),
    )


ENTRIES = (
    Estimator(
        name="hbao",
        title="horizons above the tangent plane",
        source="Bavoil, Sainz and Dimitrov 2008, equations 1 and 2",
        formula="ao = (1 / directions) sum of W(|Q - C| / R) (sin of a horizon - sin of the one before)",
        run=partial(fold_formulas, horizons),
        formulas=horizons,
        options=HorizonOptions,
        dimensions=0,
        integrand=("uniform", "quadratic"),
        count=64,
        normals=True,
        texel_bytes=24,
        turns=True,
    ),
)
