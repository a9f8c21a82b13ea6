"""HBAO of NVIDIA's gl_ssao sample: hbao.frag.glsl and ssao.cpp, 2026, not deinterleaved.

Each tap looks at the surface in a whole number of texels from its own, at least about one, up to a part of R away.
Points are rebuilt from depth where a tap looks, beyond the border too, where depth is held. A texel's noise is cosine,
sine, and the part of a step by which all its taps lie further out.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import option
from lfssao.ao.estimators.look_ups import Bordered
from lfssao.ao.formulas import summed
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import sincospi
from lfssao.core.jit import formula
from lfssao.core.numbers import larger, number, power, rounded, select, smaller, within
from lfssao.core.places import image_place
from lfssao.core.vectors import dot
from lfssao.errors import InputError

ATTENUATIONS = "quadratic", "none"


@dataclass(frozen=True)
class NvidiaOptions(Bordered):
    """Options of ``nvidia-hbao``."""

    directions: int = option(8, "directions", limits=(1, 256))
    steps: int = option(4, "taps of a direction", limits=(1, 256))
    reach: float = option(0.5, "part of R that taps are spread over", limits=(0.01, 4.0))
    bias: float = option(0.1, "cosine that a tap's direction to the normal must exceed", limits=(0.0, 0.9999))
    power: float = option(1.5, "power of the visibility", limits=(0.0, 16.0))
    attenuation: str = option(
        "quadratic", "weight of a tap that sees a point V away: max(0, 1 - |V|^2 / R^2), or 1", choices=ATTENUATIONS
    )
    snap: bool = option(True, "whether a tap lies at the nearest centre of a texel")


class Taps(NamedTuple):
    """Directions, x and y, and numbers of taps, (n, 3); the disk's radius; 1 / R^2; bias, a tap's share, and power."""

    points: Any
    reach: Any
    between: Any  # one more than the taps of a direction
    inverse: Any
    bias: Any
    share: Any
    exponent: float
    snap: bool

    def start(self, view: Any, texel: Any) -> Any:
        """P, its normal, the texel's place, steps across and up in texels, its direction, and its part of a step."""
        p, column, row = view.position(texel), view.column(texel), view.row(texel)
        right, _, _ = view.image(view.at(p) + self.reach * view.along(view.rightward()))
        _, up, _ = view.image(view.at(p) + self.reach * view.along(view.upward()))
        column, row = number(column, right), number(row, up)
        steps = (right - (column + 0.5)) / self.between, (up - (row + 0.5)) / self.between
        return p, view.normal(texel), (column, row), steps, view.turn(texel), view.jitter(texel)

    def counts(self, view: Any, here: Any) -> Any:
        """Whether there is a radius."""
        return self.inverse < np.inf

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The centre of the texel that tap s looks at."""
        return image_place(*_tap(self, view, here, s))

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """max(0, n . V / |V| - bias) max(0, 1 - |V|^2 / R^2), V from P to the point that the tap sees."""
        u, v = _tap(self, view, here, s)
        away = view.apart(view.point_at(u, v, view.surface(seen)), here[0])
        square = dot(away, away)
        above = dot(here[1], away) / np.sqrt(square) - rounded(self.bias, 0, square)
        left = 1 - square * rounded(self.inverse, 1, square, 1)
        return select((square > 0) & (left > 0), smaller(1, larger(0, above)) * within(left, 0, 1), 0)

    def background(self) -> Any:
        """The term of a tap before background, which is far away."""
        return 0

    def end(self, total: Any) -> Any:
        """1 - (1 - 2 / ((1 - bias) n) sum)^power."""
        return 1 - power(larger(0, smaller(1, 1 - rounded(self.share, 3, total, 2) * total)), self.exponent)


@formula
def _tap(taps: Any, view: Any, here: Any, s: Any) -> Any:
    """The image point of tap s: (jitter + k) steps and one texel out, or the nearest centre of a texel."""
    _, _, (column, row), (across, up), (cosine, sine), jitter = here
    x, y = view.sine_of_angle(taps.points[s, 0]), view.sine_of_angle(taps.points[s, 1])
    k = jitter + number(taps.points[s, 2], jitter)
    right, high = (k * across + 1) * (x * cosine - y * sine), (k * up - 1) * (x * sine + y * cosine)
    whole, above = select(taps.snap, np.floor(right + 0.5), right), select(taps.snap, np.floor(high + 0.5), high)
    return column + (whole + 0.5), row + (above + 0.5)


def nvidia_hbao(buffers: Buffers, radius: float, points: None, weights: None, options: NvidiaOptions) -> Taps:
    """Return the formulas' numbers, in the textures' dtype; the sample makes its own taps."""
    if buffers.view.screen_to_world is None:
        raise InputError("estimator nvidia-hbao looks at whole texels of a camera, and this view is of a display")
    kind, n, around = buffers.depth.dtype.type, options.directions * options.steps, range(options.directions)
    unit = [sincospi(2 * k / options.directions)[::-1] for k in around]
    table = np.array([[x, y, k] for x, y in unit for k in range(options.steps)])
    with np.errstate(over="ignore", divide="ignore"):
        return Taps(
            points=table.astype(kind),
            reach=kind(options.reach * radius),
            between=kind(options.steps + 1),
            inverse=kind(0 if options.attenuation == "none" and radius > 0 else 1 / np.float64(radius) ** 2),
            bias=kind(options.bias),
            share=kind(2 / ((1 - options.bias) * n)),
            exponent=options.power,
            snap=options.snap,
        )


ENTRIES = (
    summed(
        "nvidia-hbao",
        nvidia_hbao,
        title="cosines to the normal of points around, in place of horizons",
        source="NVIDIA gl_ssao, hbao.frag.glsl",
        formula="ao = 1 - (1 - 2 / ((1 - bias) n) sum of max(0, n.V / |V| - bias) max(0, 1 - |V|^2 / R^2))^power",
        options=NvidiaOptions,
        dimensions=0,
        count=32,
        normals=True,
        texel_bytes=16,
        turns=True,
        rotation="tiles",
        vectors=True,
    ),
)
