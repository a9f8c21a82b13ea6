"""Ground-truth AO (Jimenez, Wu, Pesce and Jarabo 2016), horizons whose cosine-weighted integral is a closed form.

On each side of a slice (``slices``) h is the least angle of a sample to the viewer, within the hemisphere around the
normal, h <= n + pi / 2. Visibility of directions is the mean over the slices of

    N (a(h_1, -n) + a(h_2, n)),   a(h, n) = (cos n - cos(2 h - n) + 2 h sin n) / 4

which is (sin^2 h cos n + (h - sin h cos h) sin n) / 2, with no sine of an angle; N cos n and N sin n are parts of the
normal. The uniform one is (2 - cos h_1 - cos h_2) / 2 in place of it, and needs no angle. Occlusion is 1 -
visibility^power. Shipped code (XeGTAO) differs in this: it takes sines of angles, those of its polynomial too; falloff
and thin occluders measure depth along the camera's axis, here along w; it keeps visibility above 0.03, and denoises.

The limit for many slices and steps, where the view is parallel and sees the whole surface within R, without falloff:

===============================================  ==========================================  =====================
surface, from P                                  cosine                                      uniform
===============================================  ==========================================  =====================
plane, convex crease, top of a step or a sphere  0                                           0, of any slices
right-angle crease at 45 degrees to the view     1/2 at the edge                             1/2 at the edge
floor at d before a wall higher than R           (arccos c - c sqrt(1 - c^2)) / pi, c = d/R  (1 - c) / 2
floor at d before a wall of height h, R = inf    (1 - d / sqrt(d^2 + h^2)) / 2               arctan(h / d) / pi
===============================================  ==========================================  =====================

They are those of rays with constant falloff (``ao.ground_truth``), as no light passes below a horizon there. Few slices
make a tilted plane hide or show too much: tilted by 60 degrees up to 0.5 of one slice, 0.05 of two and 0.002 of four.

The bent normal has a closed form, too (as in the paper), of c = cos h, s = sin h and no angle: a side e adds

    (N cos n s^3 + N sin n (1 - c)^2 (2 + c)) / 3 e  +  (N cos n (1 - c^3) + N sin n s^3) / 3 (-w)

and a uniform one (h - s c) / 2 e + s^2 / 2 (-w).
"""

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import Estimator, option
from lfssao.ao.estimators.horizon import disk_around, on_disk
from lfssao.ao.estimators.slices import (
    SliceOptions,
    arc,
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
from lfssao.core.jit import formula
from lfssao.core.numbers import alternatives, larger, least, most, rounded, select, smaller, unless_none, within
from lfssao.core.vectors import dot

_STEEP = 2.0**40  # 1 over a falloff's range of none: any sample within R has weight 1


@dataclass(frozen=True)
class ArcOptions(SliceOptions):
    """Options of ``gtao``."""

    falloff: float = option(
        0.0, "part of R over which a sample's horizon sinks to the tangent plane's (XeGTAO 0.615)", limits=(0.0, 1.0)
    )
    thin: float = option(
        0.0, "how much longer distances along w are to that falloff, against thin occluders", limits=(0.0, 4.0)
    )


class Arcs(NamedTuple):
    """Slices, weighting and falloff, as of ``slices.in_common``.

    sides: 1, as sides add up apart. slope: 1 over the falloff's range. stretch: added to the square of a distance, as a
    multiple of its part along w. cosine: whether directions are weighted so.
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
    slope: Any
    stretch: Any
    cosine: bool
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
        """The cosine of the tangent plane's angle, n + pi / 2."""
        e, length = tilt(self, here[3], s)
        return within(-e / length, -ZENITH, ZENITH)

    def part(self, view: Any, texel: Any, k: Any) -> Any:
        """The texel's part of the way."""
        return part_of_step(self, view, texel, k)

    def step(self, view: Any, here: Any, s: Any, k: Any, state: Any, texel: Any, seen: Any) -> Any:
        """Nothing, and the largest cosine so far, which is the horizon's."""
        d, w = view.position(seen) - here[0], here[1]
        along, square = dot(d, w), dot(d, d)
        cosine = within(-along / np.sqrt(square), -ZENITH, ZENITH)
        r = np.sqrt(square + self.stretch * (along * along)) / rounded(self.radius, 4, along)
        weight, low = within(smaller(1, (1 - r) * self.slope), 0, 1), self.begin(view, here, s)
        sunk = low + weight * (cosine - low)
        blended = alternatives(sunk, (1 - weight) * low + weight * cosine)
        horizon = alternatives(select(weight < 1, sunk, cosine), blended)
        near = (r < 1) & view.other(seen, texel)
        return 0, select(near, larger(state, within(horizon, -ZENITH, ZENITH)), state)

    def leave(self, view: Any, here: Any, s: Any, state: Any) -> Any:
        """The visible part of a side, which falls with the cosine: of a ball both ends. Along an axis, of B."""
        cosine, towards, (e, _) = smaller(1, larger(-1, state)), here[3][2], tilt(self, here[3], s)
        low, high = least(cosine), most(cosine)
        exact = alternatives(arc(low, view.arc_cosine(low), towards, e), arc(high, view.arc_cosine(high), towards, e))
        weighted = select(self.exact, exact, arc(cosine, polynomial_angle(cosine), towards, e))
        made = rounded(select(self.cosine, weighted, 0.5 - 0.5 * cosine), 4, weighted)
        return unless_none(self.axis, made, _open, (self, view, here, s, cosine))

    def end(self, total: Any) -> Any:
        """1 - visibility^power, of the mean over the slices."""
        return occlusion_of(self, total)


@formula
def _open(axis: Any, arcs: Any, view: Any, here: Any, s: Any, cosine: Any) -> Any:
    """The part of B of a side: of a ball both ends, as its part along e falls with the cosine.

    That along -w is largest at a cosine of 0.
    """
    (across, ahead), low, high = in_side(arcs, here, s), least(cosine), most(cosine)
    first, last = _parts(arcs, view, here, s, low), _parts(arcs, view, here, s, high)
    level = _parts(arcs, view, here, s, larger(low, smaller(0, high)))
    forward = alternatives(alternatives(first[1], last[1]), level[1])
    return alternatives(first[0], last[0]) * across + forward * ahead


@formula
def _parts(arcs: Any, view: Any, here: Any, s: Any, cosine: Any) -> Any:
    """The parts of B of a side up to a horizon, along e and -w."""
    (e, _), towards, square, rest = tilt(arcs, here[3], s), here[3][2], larger(0, 1 - cosine * cosine), 1 - cosine
    sine, third = np.sqrt(square), 1 / 3
    cube, near, far = square * sine, (rest * rest) * (2 + cosine), rest * (1 + cosine * (1 + cosine))
    angle = select(arcs.exact, view.arc_cosine(cosine), polynomial_angle(cosine))
    across = third * (rounded(cube * towards, 4, sine) + rounded(near * e, 4, sine))
    ahead = third * (rounded(far * towards, 4, sine) + rounded(cube * e, 4, sine))
    even = rounded(0.5 * (angle - cosine * sine), 4, sine), rounded(0.5 * square, 4, sine)
    return select(arcs.cosine, across, even[0]), select(arcs.cosine, ahead, even[1])


def arcs(buffers: Buffers, radius: float, points: None, weights: None, options: ArcOptions) -> Arcs:
    """Return the formulas' numbers, in the textures' dtype; gtao takes no samples."""
    dtype = buffers.depth.dtype
    return Arcs(
        **in_common(radius, options, dtype),
        sides=1,
        slope=dtype.type(1 / options.falloff if options.falloff > 1 / _STEEP else _STEEP),
        stretch=dtype.type((1 + options.thin) ** 2 - 1),
        cosine=options.weighting == "cosine",
    )


ENTRIES = (
    Estimator(
        name="gtao",
        title="horizons in slices, weighted by the cosine in closed form",
        source="Jimenez et al. 2016, its cosine-weighted inner integral",
        formula="ao = 1 - ((1 / slices) sum of N (a(h_1, -n) + a(h_2, n)))^power",
        run=partial(fold_formulas, arcs),
        formulas=arcs,
        options=ArcOptions,
        dimensions=0,
        integrand=("cosine", "constant"),
        count=64,
        bent=True,
        normals=True,
        texel_bytes=24,
        turns=True,
    ),
)
