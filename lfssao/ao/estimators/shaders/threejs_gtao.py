"""GTAO of three.js: examples/jsm/shaders/GTAOShader.js and postprocessing/GTAOPass.js, 2026.

It is ``gtao`` but for these: points are rebuilt from depth where a step lies; a slice counts by the angle alone, and
not by the length N of the normal's part in it; a step raises the horizon by a part of the difference, which sinks from
step to step; and what is nearer or farther than a thickness is not seen.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import option
from lfssao.ao.estimators.look_ups import LookUps
from lfssao.ao.estimators.oriented import cast_length
from lfssao.ao.estimators.slices import WEIGHTINGS, arc
from lfssao.ao.formulas import ZENITH, folded
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import sincospi
from lfssao.core.jit import formula
from lfssao.core.numbers import (
    alternatives,
    larger,
    least,
    most,
    number,
    power,
    rounded,
    select,
    smaller,
    tabled,
    within,
)
from lfssao.core.vectors import dot


@dataclass(frozen=True)
class ThreeOptions(LookUps):
    """Options of ``threejs-gtao``."""

    slices: int = option(3, "DIRECTIONS, slices through the viewing direction", limits=(1, 64))
    steps: int = option(6, "STEPS along each side of a slice", limits=(1, 256))
    exponent: float = option(1.0, "distanceExponent, power of a step's part of R", limits=(0.0, 16.0))
    thickness: float = option(
        4.0, "depth by which a step may be nearer or farther, in radii", limits=(0.0, 1e6), power=1
    )
    fall_off: float = option(1.0, "distanceFallOff, how much later steps raise less", limits=(0.0, 1.0))
    power: float = option(1.0, "scale, power of the visibility", limits=(0.0, 16.0))
    weighting: str = option("cosine", "weights of directions", choices=WEIGHTINGS)
    projected: bool = option(False, "whether a slice counts by the length of the normal's part in it")


class Slices(NamedTuple):
    """Both sides of slices, (2 n, 2); steps; 1, as sides add up apart; R; parts of R from step 0 on; the options."""

    points: Any
    steps: int
    sides: int
    radius: Any
    parts: Any
    thickness: Any
    fall_off: Any
    exponent: float
    power: float
    cosine: bool
    projected: bool

    def start(self, view: Any, texel: Any) -> Any:
        """P, w, z, n, the directions of the screen, turned, and the images of P and of R times these."""
        p, (x, y) = view.position(texel), view.turn(texel)
        shorter = 1 / np.sqrt(x * x + y * y)
        right, up, cosine, sine = view.rightward(), view.upward(), shorter * x, shorter * y
        a, b = cosine * right + sine * up, cosine * up - sine * right
        images = view.at(p), self.radius * view.along(a), self.radius * view.along(b)
        return p, view.direction(texel), view.surface(texel), view.normal(texel), (a, b), images

    def counts(self, view: Any, here: Any) -> Any:
        """Whether there is a radius."""
        return self.radius > 0

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of P + R d."""
        p, a, b = here[5]
        return p + self.points[s, 0] * a + self.points[s, 1] * b

    def begin(self, view: Any, here: Any, s: Any) -> Any:
        """The cosine of the tangent plane's angle."""
        e, _, _ = _tilt(self, here, s)
        return within(-e, -ZENITH, ZENITH)

    def part(self, view: Any, texel: Any, k: Any) -> Any:
        """(k / steps)^exponent."""
        return tabled(self.parts, k, _part, (self.steps, self.exponent))

    def step(self, view: Any, here: Any, s: Any, k: Any, state: Any, texel: Any, seen: Any) -> Any:
        """Nothing, and the cosine after a rise by 1 - f + f 2 / (k + 1) of the difference, f the fall-off."""
        p, w, z, _, _, _ = here
        u, v, _ = view.image(self.place(view, here, s))
        column, row = number(view.column(texel), u) + 0.5, number(view.row(texel), v) + 0.5
        way, deep = self.part(view, texel, k), view.surface(seen)
        away = view.apart(view.point_at(column + way * (u - column), row + way * (v - row), deep), p)
        square = dot(away, away)
        cosine = within(-dot(away, w) / np.sqrt(square), -ZENITH, ZENITH)
        weight = 1 + self.fall_off * (2 / (k + 1) - 1)
        raised = alternatives(_raised(least(state), cosine, weight), _raised(most(state), cosine, weight))
        near = (abs(deep - z) < rounded(self.thickness, 4, z)) & (square > 0)  # its own texel's surface counts, too
        return 0, select(near, raised, state)

    def leave(self, view: Any, here: Any, s: Any, state: Any) -> Any:
        """The visible part of a side."""
        cosine, (e, towards, length) = smaller(1, larger(-1, state)), _tilt(self, here, s)
        low, high = least(cosine), most(cosine)
        made = alternatives(arc(low, view.arc_cosine(low), towards, e), arc(high, view.arc_cosine(high), towards, e))
        made = select(self.cosine, made, 0.5 - 0.5 * cosine)
        return select(self.projected, length * made, made)

    def end(self, total: Any) -> Any:
        """1 - visibility^power, of the mean over the slices."""
        visibility = smaller(1, larger(0, total / (self.points.shape[0] // 2)))
        return 1 - power(visibility, self.power)


@formula
def _part(k: Any, steps: Any, exponent: Any) -> Any:
    """The part of R at which step k lies."""
    return power(k / steps, exponent)


@formula
def _tilt(slices: Any, here: Any, s: Any) -> Any:
    """The sine and the cosine of the normal's angle in a slice, on the side of s, and the length of its part there."""
    _, w, _, n, (a, b), _ = here
    d = slices.points[s, 0] * a + slices.points[s, 1] * b
    e = d - dot(d, w) * w
    along, towards = dot(n, e) / np.sqrt(dot(e, e)), -dot(n, w)
    length = np.sqrt(along * along + towards * towards)
    return along / length, towards / length, length


@formula
def _raised(state: Any, cosine: Any, weight: Any) -> Any:
    """A horizon's cosine after a step."""
    return state + larger(0, (cosine - state) * weight)


def three_gtao(buffers: Buffers, radius: float, points: None, weights: None, options: ThreeOptions) -> Slices:
    """Return the formulas' numbers, in the textures' dtype; it takes no samples."""
    kind = buffers.depth.dtype.type
    ahead = np.array([sincospi(k / options.slices)[::-1] for k in range(options.slices)])
    return Slices(
        points=np.stack([ahead, -ahead], axis=1).reshape(-1, 2).astype(kind),
        steps=options.steps,
        sides=1,
        radius=kind(radius),
        parts=np.array([_part(kind(k), options.steps, options.exponent) for k in range(options.steps + 1)]),
        thickness=kind(cast_length(buffers.view, options.thickness * float(radius))),
        fall_off=kind(options.fall_off),
        exponent=options.exponent,
        power=options.power,
        cosine=options.weighting == "cosine",
        projected=options.projected,
    )


ENTRIES = (
    folded(
        "threejs-gtao",
        three_gtao,
        title="horizons in slices, raised step by step, each slice of equal weight",
        source="three.js GTAOShader",
        formula="ao = 1 - ((1 / slices) sum of a(h_1, -n) + a(h_2, n))^power, a as of gtao",
        options=ThreeOptions,
        count=36,
        normals=True,
        texel_bytes=24,
        turns=True,
        rotation="tiles",
    ),
)
