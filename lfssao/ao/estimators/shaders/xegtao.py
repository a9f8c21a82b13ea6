"""XeGTAO 1.30 (Intel 2021): XeGTAO_MainPass of XeGTAO.hlsli, in 32 bits, with XE_GTAO_FP32_DEPTHS.

It is ``gtao`` but for these: a texel's noise, two numbers from 0 to 1, turns the slices and moves the steps, each by
another part of a step; a step looks at the nearest centre of a texel, one or more away, and its point is rebuilt from
depth there; angles come of a polynomial whose square root halves the bits of a float, and formulas take sines of them;
the projected normal's length is drawn towards 1; visibility grows where R is a few texels, and is at least 0.03.

Levels of depth stay out: the text is DepthMIPSamplingOffset = 30, which reads the first one. So do 16-bit arithmetic,
the denoiser, and bent normals.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray, option
from lfssao.ao.estimators.look_ups import LookUps, check_perspective
from lfssao.ao.estimators.oriented import cast_length
from lfssao.ao.formulas import ZENITH, folded
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import PI, sincospi
from lfssao.core.functions import crude_root
from lfssao.core.jit import formula
from lfssao.core.numbers import (
    alternatives,
    by_squaring,
    larger,
    least,
    most,
    number,
    power,
    rounded,
    select,
    smaller,
    within,
)
from lfssao.core.places import image_place
from lfssao.core.vectors import dot

_GOLDEN = 0.6180339887498948  # stepBaseNoise
LEAST = 0.03  # visibility
_PI, _SLOPE = 3.141593, -0.156583  # XeGTAO_FastACos
ROOTS = "bits", "exact"


@dataclass(frozen=True)
class XeOptions(LookUps):
    """Options of ``xegtao``."""

    slices: int = option(3, "sliceCount", limits=(1, 64))
    steps: int = option(3, "stepsPerSlice, of each side", limits=(1, 256))
    multiplier: float = option(1.457, "RadiusMultiplier", limits=(0.3, 3.0))
    falloff: float = option(0.615, "EffectFalloffRange, part of R over which a step counts less", limits=(0.001, 1.0))
    squared: bool = option(True, "whether SampleDistributionPower, of a step's part of R, is 2, or 1")
    thin: float = option(0.0, "ThinOccluderCompensation", limits=(0.0, 0.7))
    power: float = option(2.2, "FinalValuePower, power of the visibility", limits=(0.5, 5.0))
    nearest: float = option(1.3, "pixelTooCloseThreshold, texels by which steps lie further out", limits=(0.0, 16.0))
    nearer: float = option(0.99999, "factor of the depth of the texel's own point", limits=(0.9, 1.0))
    longer: float = option(0.05, "part by which the projected normal's length is drawn towards 1", limits=(0.0, 1.0))
    root: str = option("bits", "square root of the arc cosine: of half a float's bits, or exact", choices=ROOTS)
    snap: bool = option(True, "whether a step looks at the nearest centre of a texel")


class Steps(NamedTuple):
    """Steps, (n, 5): cosine and sine of the slice, side (1, -1), step, and what is added to its noise.

    Each step is a direction of one step, and ``sides`` of these keep a state, so that its place may be any.
    """

    points: Any
    steps: int
    sides: int
    slices: Any
    each: Any  # steps along a side
    reach: Any  # R at distance 1, texels
    slope: Any  # 1 over the falloff's range
    stretch: Any  # (1 + thin)^2 - 1, of depth
    nearest: Any
    nearer: Any
    longer: Any
    share: Any  # of the fading in a side
    exponent: float
    squared: bool
    bits: bool
    snap: bool

    def start(self, view: Any, texel: Any) -> Any:
        """P, w, n, its z, R in texels, the texel's place, cosine and sine of the first slice, and the steps' noise."""
        z = rounded(self.nearer, 0, view.surface(texel)) * view.surface(texel)
        column, row = number(view.column(texel), z), number(view.row(texel), z)
        p = view.point_at(column + 0.5, row + 0.5, z)
        reach = rounded(self.reach, 3, z, 2) / z
        turn, moved = view.turn(texel)
        first = view.cosine_and_sine(turn * PI / rounded(self.slices, 0, turn))
        return p, view.direction(texel), view.normal(texel), z, reach, (column, row), (first, moved)

    def counts(self, view: Any, here: Any) -> Any:
        """Whether there is a radius."""
        return self.reach > 0

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The centre of the texel that a step looks at."""
        return image_place(*_tap(self, view, here, s))

    def begin(self, view: Any, here: Any, s: Any) -> Any:
        """The cosine of the tangent plane's angle, n + pi / 2."""
        _, sine = view.cosine_and_sine(_tilt(self, view, here, s)[0])
        return within(-sine, -ZENITH, ZENITH)

    def part(self, view: Any, texel: Any, k: Any) -> Any:
        """All of the way."""
        return number(1, k)

    def step(self, view: Any, here: Any, s: Any, k: Any, state: Any, texel: Any, seen: Any) -> Any:
        """Nothing, and the largest cosine so far, each between the tangent plane's and its own by the falloff."""
        p, w, _, z, _, _, _ = here
        u, v = _tap(self, view, here, s)
        deep = view.surface(seen)
        away, ahead = view.apart(view.point_at(u, v, deep), p), deep - z
        square = dot(away, away)
        cosine, low = within(-dot(away, w) / np.sqrt(square), -ZENITH, ZENITH), self.begin(view, here, s)
        length = np.sqrt(square + self.stretch * (ahead * ahead))
        rest = alternatives((1 - length * self.slope[0]) + self.slope[1], (self.slope[1] + 1) - length * self.slope[0])
        weight = within(smaller(1, larger(0, rest)), 0, 1)
        horizon = alternatives(low + weight * (cosine - low), (1 - weight) * low + weight * cosine)
        return 0, select(square > 0, larger(state, within(horizon, -ZENITH, ZENITH)), state)

    def leave(self, view: Any, here: Any, s: Any, state: Any) -> Any:
        """A side's part of the integral by angles, and of the fading."""
        n, cosine, length = _tilt(self, view, here, s)
        h, faded = _angle(self, state), within(smaller(1, larger(0, (10 - here[4]) / 100)), 0, 1)
        (_, sine), (turned, _) = view.cosine_and_sine(n), view.cosine_and_sine(2 * h - n)
        longer = length + self.longer * (1 - length)
        return longer * ((cosine + 2 * h * sine - turned) / 4) + faded * rounded(self.share, 2, faded)

    def end(self, total: Any) -> Any:
        """1 - visibility^power, of the mean over the slices."""
        visibility = smaller(1, larger(0, total / rounded(self.slices, 0, total)))
        return 1 - larger(LEAST, power(visibility, self.exponent))


@formula
def fraction(view: Any, x: Any) -> Any:
    """Return x - floor(x), where floor may be in doubt, of either."""
    low, high = np.floor(least(x)), np.floor(most(x))
    return x - select(view.fork(x >= high), high, low)


@formula
def towards(steps: Any, first: Any, s: Any) -> Any:
    """Return cosine and sine of a slice's angle on the screen; first: those of the first one."""
    cosine, sine = first
    x, y = steps.points[s, 0], steps.points[s, 1]
    return x * cosine - y * sine, y * cosine + x * sine


@formula
def part_of_radius(steps: Any, view: Any, noise: Any, s: Any) -> Any:
    """Return the part of R at which a step lies, before its power."""
    moved = fraction(view, noise + rounded(steps.points[s, 4], 2, noise))
    return within((moved + steps.points[s, 3]) / rounded(steps.each, 0, moved), 0, 1)


@formula
def _tap(steps: Any, view: Any, here: Any, s: Any) -> Any:
    """The image point of a step."""
    reach, (column, row), (first, noise) = here[4:]
    (cosine, sine), even = towards(steps, first, s), part_of_radius(steps, view, noise, s)
    part = select(steps.squared, by_squaring(even, 1), even)
    way = (part + rounded(steps.nearest, 0, reach) / reach) * (reach * steps.points[s, 2])
    x, y = way * cosine, way * -sine
    x = select(steps.snap, np.floor(x + 0.5), x)
    y = select(steps.snap, np.floor(y + 0.5), y)
    return column + (x + 0.5), row + (y + 0.5)


@formula
def in_slice(view: Any, w: Any, n: Any, cosine: Any, sine: Any) -> Any:
    """Return the normal's part along a slice of this angle, the cosine of its angle there, and its length there."""
    d = cosine * view.rightward() + sine * view.upward()
    e = d - dot(d, w) * w
    along, ahead = dot(n, e) / np.sqrt(dot(e, e)), -dot(n, w)
    length = np.sqrt(along * along + ahead * ahead)
    return along, smaller(1, larger(0, ahead / length)), length


@formula
def _tilt(steps: Any, view: Any, here: Any, s: Any) -> Any:
    """The normal's angle in a slice, on the side of s, its cosine, and the length of its part there."""
    cosine, sine = towards(steps, here[6][0], s)
    along, facing, length = in_slice(view, here[1], here[2], cosine, sine)
    angle = _angle(steps, facing)
    signed = select(along > 0, angle, select(along < 0, -angle, 0))
    return steps.points[s, 2] * signed, facing, length


@formula
def _angle(steps: Any, cosine: Any) -> Any:
    """The angle of a cosine by Lagarde's polynomial."""
    size = abs(cosine)
    left = larger(0, 1 - size)
    near = (0.5 * _PI + _SLOPE * size) * select(steps.bits, crude_root(left), np.sqrt(left))
    return select(cosine < 0, _PI - near, near)


def table_of_steps(slices: int, steps: int) -> FloatArray:
    """Return cosine and sine, side, step and the noise's addend of all steps, sides of slices in turn."""
    every = [(i, side, k) for i in range(slices) for side in (1, -1) for k in range(steps)]
    return np.array([[*sincospi(i / slices)[::-1], side, k, (i + k * steps) * _GOLDEN] for i, side, k in every])


def xegtao(buffers: Buffers, radius: float, points: None, weights: None, options: XeOptions) -> Steps:
    """Return the formulas' numbers, in the textures' dtype; it takes no samples."""
    check_perspective("xegtao", buffers.view)
    kind, reach = buffers.depth.dtype.type, options.multiplier * float(radius)
    unit = cast_length(buffers.view, 1.0)
    with np.errstate(over="ignore", divide="ignore"):
        slope = 1 / np.float64(options.falloff * reach)
        return Steps(
            points=table_of_steps(options.slices, options.steps).astype(kind),
            steps=1,
            sides=options.steps,
            slices=kind(options.slices),
            each=kind(options.steps),
            reach=kind(reach * unit * float(buffers.view.lens[0])),
            slope=np.array([slope, (1 - options.falloff) / options.falloff]).astype(kind),
            stretch=kind(((1 + options.thin) ** 2 - 1) / unit**2),
            nearest=kind(options.nearest),
            nearer=kind(options.nearer),
            longer=kind(options.longer),
            share=kind(0.25 / options.slices),
            exponent=options.power,
            squared=options.squared,
            bits=options.root == "bits",
            snap=options.snap,
        )


ENTRIES = (
    folded(
        "xegtao",
        xegtao,
        title="horizons in slices that noise turns, by angles of a polynomial",
        source="Intel XeGTAO 1.30, XeGTAO_MainPass",
        formula="ao = 1 - max(0.03, ((1 / slices) sum of N' (a(h_1, -n) + a(h_2, n)))^power), a as of gtao",
        options=XeOptions,
        count=18,
        normals=True,
        texel_bytes=24,
        turns=True,
        rotation="tiles",
    ),
)
