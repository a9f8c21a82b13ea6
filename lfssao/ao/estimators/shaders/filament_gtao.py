"""GTAO of Filament: filament/src/materials/ssao/gtaoImpl.fs and PostProcessManager.cpp, 2025, in 32 bits.

It is ``gtao`` but for these: a texel's noise, two numbers from 0 to 1, turns the slices and moves the steps; a step is
at least as many texels away as its number, and reads a level of depth by its distance; its point is rebuilt where it
lands. A horizon begins behind the surface. A higher step raises it, and less the farther it is, by the square of its
distance; a lower one takes it down by a small part, the thickness. Only the last horizon is held in the hemisphere.
Angles come of Lagarde's polynomial, and formulas take sines and cosines of them.

Half resolution, the visibility bitmask, bent normals, cone-traced shadows and the blur stay out.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import option
from lfssao.ao.estimators.look_ups import LookUps, check_perspective
from lfssao.ao.estimators.oriented import cast_length
from lfssao.ao.estimators.shaders.xegtao import in_slice, table_of_steps, towards
from lfssao.ao.formulas import ZENITH, folded
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import PI
from lfssao.core.jit import formula
from lfssao.core.numbers import alternatives, larger, least, most, number, power, rounded, select, smaller, within
from lfssao.core.places import image_place
from lfssao.core.vectors import dot
from lfssao.errors import InputError

_HALF_PI, _SLOPE = 1.570796, 0.1565827  # acosFast
_LOG_RATE = 3  # kLog2LodRate


@dataclass(frozen=True)
class FilamentOptions(LookUps):
    """Options of ``filament-gtao``."""

    slices: int = option(4, "sampleSliceCount", limits=(1, 64))
    steps: int = option(3, "sampleStepsPerSlice, of each side", limits=(1, 255))
    thickness: float = option(
        0.004, "thicknessHeuristic, part by which a lower step sinks a horizon", limits=(0.0, 1.0)
    )
    power: float = option(1.0, "power of the visibility", limits=(0.0, 8.0))
    intensity: float = option(1.0, "intensity, part of the occlusion", limits=(0.0, 1.0))
    max_level: int = option(7, "maxLevel, of levels of depth", limits=(0, 15))


class Steps(NamedTuple):
    """Steps, (n, 5), as of ``xegtao``; numbers of the formulas."""

    points: Any
    steps: int
    sides: int  # steps along a side, which keep a horizon
    slices: Any
    share: Any  # 1 / slices
    between: Any  # texels between steps at distance 1
    inverse: Any  # 2 / R^2
    thickness: Any
    intensity: Any
    rest: Any  # 1 - intensity
    exponent: float

    def start(self, view: Any, texel: Any) -> Any:
        """P, w, n, texels between steps, the texel's place, the first slice's cosine and sine, and the steps' noise."""
        z, (turn, moved) = view.surface(texel), view.turn(texel)
        place = number(view.column(texel), z), number(view.row(texel), z)
        first = view.cosine_and_sine(turn * PI / rounded(self.slices, 0, turn))
        between = rounded(self.between, 3, z, 1) / z
        return view.position(texel), view.direction(texel), view.normal(texel), between, place, first, moved

    def counts(self, view: Any, here: Any) -> Any:
        """Whether there is a radius."""
        return self.between > 0

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image point of a step."""
        u, v, _ = _tap(self, here, s)
        return image_place(u, v)

    def begin(self, view: Any, here: Any, s: Any) -> Any:
        """The cosine of a horizon behind the surface."""
        return number(-1, here[3])

    def part(self, view: Any, texel: Any, k: Any) -> Any:
        """All of the way."""
        return number(1, k)

    def step(self, view: Any, here: Any, s: Any, k: Any, state: Any, texel: Any, seen: Any) -> Any:
        """Nothing, and the horizon's cosine after a step: raised by a part of the difference, or taken down."""
        u, v, length = _tap(self, here, s)
        deep, there = view.coarse_z(seen, rounded(length, 8, length), _LOG_RATE)
        away = view.apart(view.point_at(u, v, deep), here[0])
        square = dot(away, away)
        cosine = within(-dot(away, here[1]) / np.sqrt(square), -ZENITH, ZENITH)
        faded = smaller(1, square * rounded(self.inverse, 3, square, 1))
        low = _moved(self, least(state), cosine, faded)
        return 0, select(there & (square > 0), alternatives(low, _moved(self, most(state), cosine, faded)), state)

    def leave(self, view: Any, here: Any, s: Any, state: Any) -> Any:
        """A side's part of the integral by angles."""
        (cosine, sine), side = towards(self, here[5], s), self.points[s, 2]
        along, facing, length = in_slice(view, here[1], here[2], cosine, sine)
        angle = _angle(facing)
        n = side * select(along > 0, angle, select(along < 0, -angle, 0))
        h = n + smaller(0.5 * PI, _angle(smaller(1, larger(-1, state))) - n)
        (cosine, sine), (turned, _) = view.cosine_and_sine(n), view.cosine_and_sine(2 * h - n)
        return length * ((cosine - turned + 2 * h * sine) / 4)

    def end(self, total: Any) -> Any:
        """A part of 1 - visibility^power, of the mean over the slices."""
        open_part = power(smaller(1, larger(0, total * rounded(self.share, 0, total, 1))), self.exponent)
        whole = rounded(self.intensity, 0, total)
        return 1 - _mixed(number(1, total), open_part, whole, rounded(self.rest, 1, total))


@formula
def _tap(steps: Any, here: Any, s: Any) -> Any:
    """The image point of a step, and how many texels it is away."""
    between, (column, row), first, noise = here[3:]
    (cosine, sine), k = towards(steps, first, s), steps.points[s, 3]
    length = larger(k + 1, (k + noise) * between)
    way = length * steps.points[s, 2]
    return column + (way * cosine + 0.5), row + (0.5 - way * sine), length


@formula
def _moved(steps: Any, state: Any, cosine: Any, faded: Any) -> Any:
    """A horizon's cosine after a step."""
    raised = _mixed(cosine, state, faded, 1 - faded)
    thin = rounded(steps.thickness, 0, state)
    return select(cosine > state, raised, _mixed(state, cosine, thin, 1 - thin))


@formula
def _mixed(x: Any, y: Any, part: Any, rest: Any) -> Any:
    """A part of the way from x to y; rest: 1 - part."""
    return alternatives(x * rest + y * part, x + part * (y - x))


@formula
def _angle(cosine: Any) -> Any:
    """The angle of a cosine by Lagarde's polynomial."""
    size = abs(cosine)
    near = (_HALF_PI - _SLOPE * size) * np.sqrt(larger(0, 1 - size))
    return select(cosine < 0, PI - near, near)


def filament_gtao(buffers: Buffers, radius: float, points: None, weights: None, options: FilamentOptions) -> Steps:
    """Return the formulas' numbers, in the textures' dtype; it takes no samples."""
    check_perspective("filament-gtao", buffers.view)
    if options.filter != "nearest":
        raise InputError("estimator filament-gtao reads levels of depth, whose filter is nearest, not linear")
    kind, lens = buffers.depth.dtype.type, buffers.view.lens
    reach = radius * cast_length(buffers.view, 1.0) * min(float(lens[0]), float(lens[1]))
    with np.errstate(over="ignore", divide="ignore"):
        return Steps(
            points=table_of_steps(options.slices, options.steps).astype(kind),
            steps=1,
            sides=options.steps,
            slices=kind(options.slices),
            share=kind(1 / options.slices),
            between=kind(reach / (options.steps + 1)),
            inverse=kind(2 / np.float64(radius) ** 2),
            thickness=kind(options.thickness),
            intensity=kind(options.intensity),
            rest=kind(1 - options.intensity),
            exponent=options.power,
        )


ENTRIES = (
    folded(
        "filament-gtao",
        filament_gtao,
        title="horizons in slices, raised by near steps and taken down by lower ones",
        source="Filament, materials/ssao/gtaoImpl.fs",
        formula="ao = intensity (1 - ((1 / slices) sum of N (a(h_1, -n) + a(h_2, n)))^power), a as of gtao",
        options=FilamentOptions,
        converges=False,
        count=24,
        normals=True,
        texel_bytes=24,
        turns=True,
        rotation="tiles",
    ),
)
