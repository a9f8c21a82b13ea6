"""VO by points in the ball, ``vo-points`` (Loos and Sloan 2010, sections 3, 4, 4.1 and 4.5, after Crytek and Blizzard).

P is a texel's point, (c, s) the cosine and sine of its turn. An offset (x, y, z) of the unit ball, world axes, turns
about world z into o and is reflected twice: about the direction m of the texel's mirror, one of a tile of 4 x 4 texels
(4.5), and, for ``vo-points-normal``, by the tangent plane of the normal n where it lies below it (4.4):

    o' = o - 2 (o . m) m        o'' = o' - 2 min(o' . n, 0) n        S = P + R o''

S is hidden by the surface that the texel of its image shows, at z_Q, if 0 < z_S - z_Q, and with a thickness T (4.3) if
z_S - z_Q <= T w_z, w_z the change of cast z along the texel's viewing direction. Differences to VO, which leaves them
open: a point outside the texture, without image or before background is not hidden.

The limits are those of ``lfssao.ao.estimators.vo.volume``.
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray
from lfssao.ao.estimators.vo.local_frame import TILE, ball_mirrors
from lfssao.ao.estimators.vo.volume import (
    SampleOptions,
    VolumeOptions,
    Weights,
    by_formulas,
    normalised,
    pair_of,
    sample_set,
    thickness_in_radii,
)
from lfssao.ao.textures import Buffers
from lfssao.core.numbers import alternatives, larger, number, rounded, select, smaller
from lfssao.core.vectors import Vector, dot


class Points(NamedTuple):
    """Samples of the unit ball, arrays and scalars of the arithmetic's dtype.

    points: (n, 3), world axes. weights: (n,), their sum is 1. mirrors: (3, TILE, ..), unit directions by which points
    are reflected, or 0 for none. tangent: whether those below the tangent plane are reflected by it. radius, thick:
    R and T, world units; T is infinite where surfaces hide all that is behind them.
    """

    points: Any
    weights: Any
    mirrors: Any
    tangent: bool
    radius: Any
    thick: Any

    def start(self, view: Any, texel: Any) -> Any:
        """Images of P, and of R m and R n; m, n and m . n; the turn; how far in cast z a surface hides."""
        turn, radius = view.turn(texel), self.radius
        none, row, column = number(0, turn[0]), view.row(texel) % TILE, view.column(texel) % TILE
        mirror = Vector(
            number(self.mirrors[0, row, column], none),
            number(self.mirrors[1, row, column], none),
            number(self.mirrors[2, row, column], none),
        )
        n = view.normal(texel)
        n = Vector(select(self.tangent, n.x, 0), select(self.tangent, n.y, 0), select(self.tangent, n.z, 0))
        reach = rounded(self.thick, 8, none) * view.depth_along(view.direction(texel))
        reach = select(self.thick < np.inf, reach, np.inf)
        images = view.at(view.position(texel)), radius * view.along(mirror), radius * view.along(n)
        return images, (mirror, n, dot(mirror, n)), turn, reach

    def counts(self, view: Any, here: Any) -> Any:
        """Every texel with a surface has samples."""
        return True

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of P + R o''."""
        (p, mirrored, lifted), (m, n, across), (cosine, sine), _ = here
        x, y, z = rounded(self.points[s, 0], 3, cosine), rounded(self.points[s, 1], 3, cosine), self.points[s, 2]
        none, z = number(0, cosine), rounded(z, 3, cosine)
        turned = cosine * view.along(Vector(x, y, none)) + sine * view.along(Vector(-y, x, none))
        o = Vector(x * cosine - y * sine, x * sine + y * cosine, z)
        along = dot(o, m)
        twice = along + along
        above = alternatives(dot(o, n) - along * (across + across), dot(o - twice * m, n))
        lift = smaller(0, above)
        image = (p + self.radius * (turned + view.along(Vector(none, none, z)))) - twice * mirrored
        return image - (lift + lift) * lifted

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """The weight of a point that is hidden."""
        before = z - view.surface(seen)
        return select((before > 0) & (before <= here[3]), rounded(self.weights[s], 5, z), 0)

    def background(self) -> Any:
        """The term of a point before background."""
        return 0

    def end(self, total: Any) -> Any:
        """The hidden weight."""
        return smaller(1, larger(0, total))


def points_of(
    buffers: Buffers, radius: float, points: FloatArray, weights: Weights, options: VolumeOptions, tangent: bool
) -> Points:
    """Return the formulas' numbers, in the textures' dtype.

    points: (n, 3), offsets in the unit ball, world axes. weights: volumes of the points' cells (4.5), by default all
    the same. tangent: whether points below the tangent plane are reflected by it. Raises InputError if a weight is
    negative or none is positive.
    """
    dtype = buffers.depth.dtype
    fractions = normalised(np.ones(len(points)) if weights is None else np.asarray(weights, np.float64))
    thickness = thickness_in_radii(options, radius)
    return Points(
        points=np.ascontiguousarray(points, dtype),
        weights=fractions.astype(dtype),
        mirrors=ball_mirrors(options.randomize, options.seed, dtype),
        tangent=tangent,
        radius=dtype.type(radius),
        thick=dtype.type(thickness) * dtype.type(radius) if thickness < np.inf else dtype.type(np.inf),
    )


ENTRIES = pair_of(
    "vo-points",
    "hidden share of the ball, by points",
    "sections 3, 4",
    "ao = sum of the weights of hidden points / sum of weights",
    partial(by_formulas, points_of),
    options=SampleOptions,
    samples=partial(sample_set, "ball"),
    count=12,
    texel_bytes=40,
)
