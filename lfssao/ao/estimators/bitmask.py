"""Visibility bitmask (Therrien, Levesque and Gilet 2023): surfaces of a constant thickness in slices, by sectors.

A slice (``slices``) has a half circle of directions around the normal's part in it. It is cut into up to 32 sectors. A
step's surface begins at the texel's point and ends a thickness further along w: both are seen from P at angles to the
viewer, and the sectors between these are set in the bits of a number, which both sides of the slice share. Visibility
is the mean over the slices of the part of sectors that are not set; occlusion is 1 - visibility^power.

Uniform sectors are equal angles. Those of the cosine are equal parts of the angle's sine from the normal, as public
implementations have them, made of sines and cosines of directions: (1 + sin(h - n)) / 2. Neither weighs a slice by
the solid angle that it stands for, nor by the normal's part N in it, as ``gtao`` does. The rule 'middle' sets sectors
whose middle lies between the angles. 'touched' is the published code's: from the first sector that is touched, and so
many as the angles' difference fills or begins to fill; a plane's rounding may set its last sector.

The limit for many slices, steps and sectors, where the view is parallel, sees the whole surface within R and the
thickness is large, is the mean over the slices of the part of directions below the horizon, each of its half circle:

===============================================  ==========================================
plane, convex crease, top of a step or a sphere  0 of any number of slices
a horizon at the angle h on all sides, n = 0     1 - 2 h / pi uniform, 1 - sin h cosine
===============================================  ==========================================

The bent normal sums the directions of the middles of open sectors, each weighted by N (uniform: 1) and by the solid
angle that it stands for: without that a tilted plane's would lean to the viewer. One sector alone has none of a plane
that faces the viewer.

A thickness of 0 hides nothing. Each sector's bit is the same in all renderers but for angles within rounding of a
sector's edge: there intervals are as wide as the sectors are.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import Estimator, FloatArray, option
from lfssao.ao.estimators.horizon import disk_around, on_disk
from lfssao.ao.estimators.slices import (
    SliceOptions,
    in_common,
    in_side,
    occlusion_of,
    part_of_step,
    polynomial_angle,
    tilt,
    with_axes,
)
from lfssao.ao.formulas import ZENITH, fold_formulas
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import PI, sincospi
from lfssao.core.jit import formula
from lfssao.core.numbers import larger, number, rounded, select, smaller, spread_of, unless_none, where_none, within
from lfssao.core.sectors import MOST, joined, no_sectors, sector_count, sector_is_set, sectors_between
from lfssao.core.vectors import dot


@dataclass(frozen=True)
class BitmaskOptions(SliceOptions):
    """Options of ``visibility-bitmask``."""

    thickness: float = option(0.25, "how far a surface goes on along w, radii", limits=(0.0, 1e6), power=1)
    sectors: int = option(32, "sectors of a slice", limits=(1, MOST))
    rule: str = option(
        "middle", "sectors between two angles: 'middle' by theirs, or 'touched'", choices=("middle", "touched")
    )


class Bitmask(NamedTuple):
    """Slices and sectors, as of ``slices.in_common``.

    sides: 2, which share a slice's bits. thickness: world units. angles: True for sectors of equal angles, None for
    those of equal sines. touched: whether sectors are set by that rule. middles: (sectors, 2), cosine and sine of the
    angles of sectors' middles from the normal's part in the slice.
    """

    points: Any
    steps: int
    sides: int
    radius: Any
    mirrors: Any
    first: Any
    quarter: Any
    linear: Any
    quadratic: Any
    thickness: Any
    sectors: int
    angles: Any
    touched: bool
    middles: Any
    exact: bool
    exponent: float
    axis: Any = None

    def start(self, view: Any, texel: Any) -> Any:
        """P, w, the images of P, R e and R f, and the normal along e, f and -w."""
        return with_axes(self, view, texel, disk_around(self, view, texel))

    def counts(self, view: Any, here: Any) -> Any:
        """Whether there is a radius."""
        return self.radius > 0

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of P + R (x e + y f)."""
        return on_disk(self, here[2], s)

    def begin(self, view: Any, here: Any, s: Any) -> Any:
        """No sector is set."""
        return no_sectors(here[3][2])

    def part(self, view: Any, texel: Any, k: Any) -> Any:
        """The texel's part of the way."""
        return part_of_step(self, view, texel, k)

    def step(self, view: Any, here: Any, s: Any, k: Any, state: Any, texel: Any, seen: Any) -> Any:
        """Nothing, and the sectors with those between the front and the back of a surface."""
        d, w, (e, length) = view.position(seen) - here[0], here[1], tilt(self, here[3], s)
        square, behind, normal = dot(d, d), d + self.thickness * w, (here[3][2] / length, e / length)
        front = _along(self, view, normal, -dot(d, w) / np.sqrt(square))
        back = _along(self, view, normal, -dot(behind, w) / np.sqrt(dot(behind, behind)))
        low = self.sectors * select(s % 2 == 0, front, 1 - back)
        high = self.sectors * select(s % 2 == 0, back, 1 - front)
        first = np.floor(select(self.touched, low, low + 0.5))
        last = select(self.touched, first - np.floor(low - high), np.floor(high + 0.5))
        added = sectors_between(first, smaller(self.sectors, last))
        near = (np.sqrt(square) / rounded(self.radius, 4, square) < 1) & view.other(seen, texel)
        return 0, select(near, joined(state, added), state)

    def leave(self, view: Any, here: Any, s: Any, state: Any) -> Any:
        """The part of a slice's sectors that are not set. Along an axis, of B."""
        return unless_none(self.axis, 1 - sector_count(state, here[3][2]) / self.sectors, _open, (self, here, s, state))

    def end(self, total: Any) -> Any:
        """1 - visibility^power, of the mean over the slices."""
        return occlusion_of(self, total)


@formula
def _open(axis: Any, slices: Any, here: Any, s: Any, state: Any) -> Any:
    """The part of B of a slice, over its width; s: its second side, from which sectors are counted backwards.

    The middle of a sector at the angle a from the normal has |sin t| = |cos a sin n - sin a cos n|. Renderers may sum
    sectors in any order.
    """
    (across, ahead), towards, (e, length) = in_side(slices, here, s), here[3][2], tilt(slices, here[3], s)
    upward, aside = (towards * ahead + e * across) / length, (towards * across - e * ahead) / length
    total, size = number(0, length), number(0, length)
    for k in range(slices.sectors):
        c, d = slices.middles[k, 0], slices.middles[k, 1]
        made = rounded(abs(c * e - d * towards) * (c * upward - d * aside), 4, length)
        term = select(sector_is_set(state, k), 0, made)
        total, size = total + term, size + abs(term)
    total = total + spread_of(rounded(size, slices.sectors, length))
    return where_none(slices.angles, total, total / length) / slices.sectors


@formula
def _along(slices: Any, view: Any, normal: Any, cosine: Any) -> Any:
    """Return the part of a side's half circle up to an angle of this cosine, 1 below the tangent plane.

    normal: cos n and sin n. NaN, of a surface at P, counts as below.
    """
    held = within(cosine, -ZENITH, ZENITH)
    sine = np.sqrt(larger(0, 1 - held * held))
    ahead, across = held * normal[0] + sine * normal[1], sine * normal[0] - held * normal[1]
    found = select(ahead > 0, 0.5 + 0.5 * across, 1)
    made = unless_none(slices.angles, found, _part_of_angle, (slices.exact, view, normal[1], held))
    return larger(0, smaller(1, made))


@formula
def _part_of_angle(angles: Any, exact: Any, view: Any, sine: Any, cosine: Any) -> Any:
    """Return (h - n) / pi + 1/2, which is (h + acos(sin n)) / pi."""
    cosine, sine = smaller(1, larger(-1, cosine)), smaller(1, larger(-1, sine))
    return (_angle_of(exact, view, cosine) + _angle_of(exact, view, sine)) / PI


@formula
def _angle_of(exact: Any, view: Any, cosine: Any) -> Any:
    return select(exact, view.arc_cosine(cosine), polynomial_angle(cosine))


def sector_middles(sectors: int, uniform: bool) -> FloatArray:
    """Return cosine and sine of the angles of sectors' middles from the middle of their half circle, (sectors, 2)."""
    sines = (2 * np.arange(sectors) + 1) / sectors - 1
    if uniform:
        return np.array([sincospi(0.5 * part)[::-1] for part in sines.tolist()])
    return np.stack([np.sqrt(1 - sines * sines), sines], axis=1)


def bitmask(buffers: Buffers, radius: float, points: None, weights: None, options: BitmaskOptions) -> Bitmask:
    """Return the formulas' numbers, in the textures' dtype; visibility-bitmask takes no samples."""
    dtype = buffers.depth.dtype
    return Bitmask(
        **in_common(radius, options, dtype),
        sides=2,
        thickness=dtype.type(options.thickness * radius),
        sectors=options.sectors,
        angles=True if options.weighting == "uniform" else None,
        touched=options.rule == "touched",
        middles=sector_middles(options.sectors, options.weighting == "uniform").astype(dtype),
    )


ENTRIES = (
    Estimator(
        name="visibility-bitmask",
        title="sectors of slices that surfaces of a constant thickness hide",
        source="Therrien, Levesque and Gilet 2023",
        formula="ao = 1 - ((1 / slices) sum of the part of sectors that are not set)^power",
        run=partial(fold_formulas, bitmask),
        formulas=bitmask,
        options=BitmaskOptions,
        dimensions=0,
        integrand=("cosine", "constant"),
        converges=False,  # each slice weighs alike
        count=64,
        bent=True,
        normals=True,
        texel_bytes=24,
        turns=True,
    ),
)
