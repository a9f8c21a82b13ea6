"""Point sampling of the ball around each visible point (LF sections 4 and 5, after Mittring 2007).

Limits for many samples and small texels, seen from straight above by an orthographic camera (an occluder's shadow
along the view counts as solid, which is the papers' meaning). V(A) is the fraction of the shell's volume in A, and
cap(r) = (1 - d/r)^2 (2 + d/r) / 4 for d < r, else 0, the fraction of a ball of radius r beyond a plane at distance d.

==============================================  ===========================  =====================================
surface                                         ``lf``, ``point``            ``hemisphere``; ``point`` with remap
==============================================  ===========================  =====================================
plane                                           1/2                          0
concave right-angle crease, d from its wall     1/2 + C/2                    C
convex right-angle crease, d from its edge      1/2 - C/2                    0
step up of at least R (a half-space), at d      1/2 + C/2                    C
anything                                        V(behind the depth texture)  fraction of the half shell behind it
==============================================  ===========================  =====================================

C = (R^3 cap(R) - r_min^3 cap(r_min)) / (R^3 - r_min^3) is the shell's fraction beyond a plane at d. (The full ball lies
half below its own surface; the wall of a crease cuts off a cap, half of it above that surface.) On top of a sphere of
radius s a ball of radius r <= s lies by 1/2 - 3 r / (16 s) in the sphere, a half ball not at all.

The range check measures distances in world space; the classical one compares depths, which in a module are none. LF
Algorithm 2's line 7 reads the depth texture, or maps the positions texture's point to the image. The two differ where
rounding of a position moves its depth past a sample's; the depth texture's is rounded once, not twice.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray, Options, option
from lfssao.ao.estimators.lf import LF
from lfssao.ao.estimators.look_ups import BACKGROUNDS, LookUps
from lfssao.ao.formulas import sum_formulas
from lfssao.ao.textures import Buffers
from lfssao.core.numbers import alternatives, larger, number, select, twice
from lfssao.core.vectors import Vector, dot

SURFACES = ("depth", "positions")


@dataclass(frozen=True)
class _Remap(Options):
    remap: bool = option(False, "2 max(0, ao - 1/2) in place of ao, so that a flat surface is open")


@dataclass(frozen=True)
class HemisphereOptions(LookUps):
    """Options of ``hemisphere``."""

    range_check: bool = option(False, "whether a surface point farther than R in world space does not occlude")
    surface: str = option(
        "depth", "LF Algorithm 2's line 7: the depth texture, or the mapped positions texture", choices=SURFACES
    )
    background: str = option(
        "open",
        "whether background occludes no sample, or all, but by the range check none, or is cleared to a place",
        choices=BACKGROUNDS,
    )


@dataclass(frozen=True)
class PointOptions(HemisphereOptions, _Remap):
    """Options of ``point``."""


class Points(NamedTuple):
    """Points of the ball, or of its upper half, arrays and scalars of the arithmetic's dtype.

    points: (n, 3), offsets R s, world units. turns: whether they turn. half: not None if one below the surface moves to
    the other side of C. positions: not None if surfaces' positions decide, too: their depths if forward, and their
    distances, up to radius, whose square is square. beyond: whether a point that looks at background is hidden, 1 or 0.
    """

    points: Any
    turns: bool
    half: Any
    positions: Any
    forward: bool
    radius: Any
    square: Any
    beyond: Any
    remap: bool

    def start(self, view: Any, texel: Any) -> Any:
        """The image of C, the texel's turn and its normal."""
        return view.at(view.position(texel)), view.turn(texel), view.normal(texel)

    def counts(self, view: Any, here: Any) -> Any:
        """Every texel with a surface has samples."""
        return True

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """LF Algorithm 2, lines 5 and 6: the image of C + o, o = R s turned, or of C - o where o.n < 0."""
        image, (c, d), n = here
        x, y, z = (
            view.sample_offset(self.points[s, 0]),
            view.sample_offset(self.points[s, 1]),
            view.sample_offset(self.points[s, 2]),
        )
        none = number(0, c)
        if self.turns:
            flat = c * view.along(Vector(x, y, none)) + d * view.along(Vector(-y, x, none))
            offset = flat + view.along(Vector(none, none, z))
        else:
            offset = view.along(Vector(x, y, z))
        if self.half is not None:
            below = view.fork(dot(Vector(x * c - y * d, x * d + y * c, z), n) < 0)
            offset = select(below, number(-1, c), 1) * offset
        return image + offset

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """Lines 7 to 9: 1 where the surface is nearer than the sample, and in range, else 0."""
        surface, weight = view.image_z(seen), number(1, z)
        if self.positions is not None:
            there = view.position(seen)
            surface = select(self.forward, view.depth_at(view.at(there)), surface)
            away = there - view.position(texel)
            square = dot(away, away)
            near = alternatives(square <= view.sample_offset(self.square), np.sqrt(square) <= self.radius)
            weight = select(near, weight, 0)
        return select(surface < z, weight, 0)

    def background(self) -> Any:
        """Whether a point that looks at background is hidden."""
        return self.beyond

    def end(self, total: Any) -> Any:
        """The fraction of hidden points, or 2 max(0, fraction - 1/2)."""
        fraction = total / self.points.shape[0]
        return twice(larger(0, fraction - 0.5)) if self.remap else fraction


def points_in_ball(
    buffers: Buffers, radius: float, points: FloatArray, weights: Any, options: HemisphereOptions, half: bool
) -> Points:
    """Return the formulas' numbers of LF Algorithm 2 on every view, cameras included.

    points: (n, 3), offsets in the unit ball; weights are not read. With ``half``, those of the half ball above the
    surface: samples below it move to the other side of the point. VO section 4.4 says 'reflecting the points that are
    underneath'. An offset o is replaced by -o here, which keeps its
    bits, and not mirrored in the surface; both send a ball's uniform points to the half ball's. A texel whose normal is
    0 keeps its ball.
    """
    dtype, forward = buffers.depth.dtype.type, options.surface == "positions"
    reach = float(radius) if options.range_check else np.inf
    with np.errstate(over="ignore"):  # the square of a very large radius is infinite: all is in reach
        return Points(
            points=np.ascontiguousarray(radius * np.asarray(points, np.float64), dtype),
            turns=buffers.turns is not None,
            half=True if half else None,
            positions=True if forward or options.range_check else None,
            forward=forward,
            radius=dtype(reach),
            square=dtype(reach * reach),
            beyond=dtype(options.background == "occludes" and not options.range_check),
            remap=isinstance(options, PointOptions) and options.remap,
        )


_in_ball, _in_half_ball = (partial(points_in_ball, half=half) for half in (False, True))

ENTRIES = (
    replace(
        LF,
        name="point",
        title="share of samples in the ball behind the surface, positions from a texture on every view",
        source="LF Algorithm 2, Mittring 2007",
        formula="ao = (number of samples with surDepth < smp.z) / (number of samples); with remap 2 max(0, ao - 1/2)",
        run=partial(sum_formulas, _in_ball),
        formulas=_in_ball,
        run_radii=None,
        options=PointOptions,
        texel_bytes=12,
    ),
    replace(
        LF,
        name="hemisphere",
        title="share of samples in the half ball above the surface behind it",
        source="VO section 4.4",
        formula="ao = (number of samples with surDepth < smp.z) / (number of samples), at C - o where o.n < 0",
        run=partial(sum_formulas, _in_half_ball),
        formulas=_in_half_ball,
        run_radii=None,
        options=HemisphereOptions,
        texel_bytes=12,
        normals=True,
        whole_ball=False,
    ),
)
