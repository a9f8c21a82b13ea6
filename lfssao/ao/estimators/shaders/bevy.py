"""SSAO of Bevy: crates/bevy_pbr/src/ssao/ssao.wesl and maths.wesl, 2026, in 32 bits.

It is ``visibility-bitmask`` but for these: a texel's noise turns slices and moves steps as XeGTAO's does; a slice has
as many sectors as steps; angles come of Lagarde's polynomial; the axis by which the normal is projected keeps its
length, which is below 1 away from the middle; the texel's own point moves by 0.00001 of reversed window depth; a step
goes as far up as across in parts of the texture; depth is read between texels, as window depth; R ends no horizon.

Levels of depth stay out: the text reads the first one. So do depths of 16 bits, the noise of frames, and the denoiser.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import option
from lfssao.ao.estimators.look_ups import LookUps, check_perspective
from lfssao.ao.estimators.oriented import cast_length
from lfssao.ao.estimators.shaders.xegtao import LEAST, part_of_radius, table_of_steps, towards
from lfssao.ao.estimators.slices import polynomial_angle
from lfssao.ao.formulas import ZENITH, folded
from lfssao.ao.textures import Buffers
from lfssao.core.corners import blended, by_corners
from lfssao.core.elementary import PI
from lfssao.core.jit import formula
from lfssao.core.numbers import by_squaring, larger, number, rounded, select, smaller, within
from lfssao.core.places import image_place
from lfssao.core.sectors import joined, no_sectors, sector_count, sectors_between
from lfssao.core.vectors import cross, dot


@dataclass(frozen=True)
class BevyOptions(LookUps):
    """Options of ``bevy-ssao``."""

    slices: int = option(3, "slice_count", limits=(1, 64))
    steps: int = option(3, "samples_per_slice_side", limits=(1, 15))
    thickness: float = option(0.34, "constant_object_thickness, radii", limits=(0.0, 1e6), power=1)
    nearer: float = option(1e-5, "what is added to the reversed window depth of the texel's point", limits=(0.0, 1.0))
    unit: bool = option(False, "whether the axis by which the normal is projected has unit length")
    square: bool = option(False, "whether steps go as many texels up as across")


class Steps(NamedTuple):
    """Steps, (n, 5), as of ``xegtao``; numbers of the formulas.

    sides: the steps of a slice, which share its sectors, as many. reach: (2,), R at distance 1, texels across and up.
    """

    points: Any
    steps: int
    sides: int
    slices: Any
    each: Any  # steps along a side
    reach: Any
    thickness: Any
    nearer: Any
    unit: bool

    def start(self, view: Any, texel: Any) -> Any:
        """P, w, n, the texel's place, R in texels, and turn and noise as of ``xegtao``."""
        z = view.surface(texel)
        z = z / (1 + rounded(self.nearer, 1, z, 1) * z)
        column, row = number(view.column(texel), z), number(view.row(texel), z)
        p = view.point_at(column + 0.5, row + 0.5, z)
        reach = rounded(self.reach[0], 3, z, 1) / z, rounded(self.reach[1], 3, z, 1) / z
        turn, moved = view.turn(texel)
        first = view.cosine_and_sine(turn * PI / rounded(self.slices, 0, turn))
        return p, view.direction(texel), view.normal(texel), (column, row), reach, (first, moved)

    def counts(self, view: Any, here: Any) -> Any:
        """Whether there is a radius."""
        return self.reach[0] > 0

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image point that a step looks at."""
        return image_place(*_tap(self, view, here, s))

    def begin(self, view: Any, here: Any, s: Any) -> Any:
        """No sector is set."""
        return no_sectors(here[4][0])

    def part(self, view: Any, texel: Any, k: Any) -> Any:
        """All of the way."""
        return number(1, k)

    def step(self, view: Any, here: Any, s: Any, k: Any, state: Any, texel: Any, seen: Any) -> Any:
        """Nothing, and the sectors with those between the front and the back of a surface."""
        p, w = here[:2]
        u, v = _tap(self, view, here, s)
        away = view.apart(view.point_at(u, v, by_corners(seen, _surface, _surface_between, (view,))), p)
        behind, middle, side = away + self.thickness * w, _middle(self, view, here, s), self.points[s, 2]
        front, back = _part_of_angle(away, w), _part_of_angle(behind, w)
        low = smaller(1, larger(0, middle + side * select(side > 0, front, back)))
        high = smaller(1, larger(0, middle + side * select(side > 0, back, front)))
        first = np.floor(low * self.sides)
        added = sectors_between(first, smaller(32, first - np.floor((low - high) * self.sides)))
        return 0, select(view.shows(seen), joined(state, added), state)

    def leave(self, view: Any, here: Any, s: Any, state: Any) -> Any:
        """The part of a slice's sectors that are set."""
        return sector_count(state, here[4][0]) / self.sides

    def end(self, total: Any) -> Any:
        """The mean over the slices."""
        return smaller(1 - LEAST, larger(0, total / rounded(self.slices, 0, total)))


@formula
def _surface(seen: Any, view: Any) -> Any:
    return view.surface(seen)


@formula
def _surface_between(four: Any, view: Any) -> Any:
    """Cast z between four texels, whose window depths are blended, multiples of 1 / z."""
    a, b = 1 / view.surface(four.texel), 1 / view.surface(four.right)
    c, d = 1 / view.surface(four.below), 1 / view.surface(four.across)
    return 1 / blended(four, a, b, c, d)


@formula
def _tap(steps: Any, view: Any, here: Any, s: Any) -> Any:
    """The image point of a step."""
    (column, row), (across, up), (first, noise) = here[3:]
    cosine, sine = towards(steps, first, s)
    way = by_squaring(part_of_radius(steps, view, noise, s), 1) * steps.points[s, 2]
    return column + (way * cosine * across + 0.5), row + (0.5 - way * sine * up)


@formula
def _middle(steps: Any, view: Any, here: Any, s: Any) -> Any:
    """1/2 - n / pi, n the angle of the normal in a slice."""
    w, n, (cosine, sine) = here[1], here[2], towards(steps, here[5][0], s)
    d = cosine * view.rightward() + sine * view.upward()
    axis = cross(w, d)
    length = select(steps.unit, np.sqrt(dot(axis, axis)), 1)
    axis = (1 / length) * axis
    part = n - dot(n, axis) * axis
    along = dot(d - dot(d, w) * w, part)
    angle = polynomial_angle(smaller(1, larger(0, -dot(part, w) / np.sqrt(dot(part, part)))))
    return (0.5 * PI - select(along > 0, angle, select(along < 0, -angle, 0))) / PI


@formula
def _part_of_angle(away: Any, w: Any) -> Any:
    """The angle to the viewer over pi."""
    return polynomial_angle(within(-dot(away, w) / np.sqrt(dot(away, away)), -ZENITH, ZENITH)) / PI


def bevy_ssao(buffers: Buffers, radius: float, points: None, weights: None, options: BevyOptions) -> Steps:
    """Return the formulas' numbers, in the textures' dtype; it takes no samples."""
    check_perspective("bevy-ssao", buffers.view)
    kind, (height, width) = buffers.depth.dtype.type, buffers.depth.shape
    across = cast_length(buffers.view, float(radius)) * float(buffers.view.lens[0])
    reach = np.array([across, across if options.square else across * height / width])
    with np.errstate(over="ignore"):
        return Steps(
            points=table_of_steps(options.slices, options.steps).astype(kind),
            steps=1,
            sides=2 * options.steps,
            slices=kind(options.slices),
            each=kind(options.steps),
            reach=reach.astype(kind),
            thickness=kind(options.thickness * float(radius)),
            nearer=kind(options.nearer / float(buffers.view.lens[4])),
            unit=options.unit,
        )


ENTRIES = (
    folded(
        "bevy-ssao",
        bevy_ssao,
        title="sectors of slices that noise turns, which surfaces of a constant thickness hide",
        source="Bevy, crates/bevy_pbr/src/ssao/ssao.wesl",
        formula="ao = min(0.97, (1 / slices) sum of the part of sectors that are set)",
        options=BevyOptions,
        converges=False,
        count=18,
        normals=True,
        texel_bytes=24,
        turns=True,
        rotation="tiles",
    ),
)
