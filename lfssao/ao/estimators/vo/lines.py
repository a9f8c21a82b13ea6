"""VO by lines along the viewing direction, ``vo-lines`` (Loos and Sloan 2010, section 4.1, with 4.3 to 4.5).

P is a texel's point, w its viewing direction, e and f the axes of its disk: the view's rightward direction made
orthogonal to w, and w x that, reflected by the texel's mirror, one of a tile of 4 x 4 texels (4.5), and turned with it
(``vo.local_frame``). The ball holds t from -z_s to z_s of the line P + R (x e + y f + t w) at
(x, y) of the unit disk, z_s = sqrt(1 - x^2 - y^2). The surface that the texel of t = 0 shows is met at

    d = (z_Q - z_S) / (R w_z),   S = P + R (x e + y f)

and hides what lies behind it, as far as its thickness T reaches (4.3). For ``vo-lines-normal`` the tangent plane of the
normal n cuts off what lies behind itself (4.4), t > p = -(n . (x e + y f)) / (n . w); it stays 2^-20 from edge-on, so
that its slope is finite. Hidden are

    max(min(min(z_s, p), d + T) - max(-z_s, d), 0)

the complement in 2 z_s of VO's max(min(z_s, d_r) + z_s, 0), and of the sum of two such integrals with thickness.
Differences to VO, which leaves them open: a line outside the texture, without image or before background is open, and
a texel whose viewing direction does not lead away from the viewer has occlusion 0.

The limits are those of ``lfssao.ao.estimators.vo.volume``.
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray
from lfssao.ao.estimators.vo.local_frame import disk_frame, line_end
from lfssao.ao.estimators.vo.volume import (
    SampleOptions,
    VolumeOptions,
    Weights,
    by_formulas,
    make_disk,
    pair_of,
    sample_set,
    thickness_in_radii,
)
from lfssao.ao.textures import Buffers
from lfssao.core.numbers import larger, number, rounded, select, smaller


class Lines(NamedTuple):
    """Lines of the unit disk, arrays and scalars of the arithmetic's dtype.

    points: (n, 2), x and y. half: (n,), z_s. weights: (n,), of a unit of hidden length, so that a ball hidden whole (or
    half a ball, with the tangent plane) gives 1. mirrors: (2, TILE, ..), cosines and sines. tangent: whether lines end
    at the tangent plane. radius: R, world units. thickness: T, in radii, infinite where surfaces hide all that is
    behind them.
    """

    points: Any
    half: Any
    weights: Any
    mirrors: Any
    tangent: bool
    radius: Any
    thickness: Any

    def start(self, view: Any, texel: Any) -> Any:
        """Images of P, R e and R f; R w_z and what is one over it; the slopes of the tangent plane."""
        return disk_frame(view, texel, self.radius, self.mirrors)

    def counts(self, view: Any, here: Any) -> Any:
        """Whether the texel looks away from the viewer."""
        return here[1] > 0

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of P + R (x e + y f)."""
        p, e, f = here[0]
        return p + self.points[s, 0] * e + self.points[s, 1] * f

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """The hidden length, weighted."""
        d, half = (view.surface(seen) - z) * here[2], number(self.half[s], z)
        top = line_end(here[3], self.points[s, 0], self.points[s, 1], half, self.tangent)
        back = select(self.thickness < np.inf, smaller(top, d + rounded(self.thickness, 6, z)), top)
        return rounded(self.weights[s], 5, z) * larger(0, back - larger(d, -half))

    def background(self) -> Any:
        """The term of a line before background."""
        return 0

    def end(self, total: Any) -> Any:
        """The hidden share."""
        return smaller(1, larger(0, total))


def lines_of(
    buffers: Buffers, radius: float, points: FloatArray, weights: Weights, options: VolumeOptions, tangent: bool
) -> Lines:
    """Return the formulas' numbers, in the textures' dtype.

    points: (n, 2), places of the lines in the unit disk. weights: integrals of the ball's extent in z over the disk's
    cells (4.5), by default z_s. tangent: whether lines end at the tangent plane. Raises InputError if a weight is
    negative or none is positive.
    """
    number_of, disk = buffers.depth.dtype.type, make_disk(points, weights, options, tangent, buffers.depth.dtype)
    return Lines(
        points=disk.places,
        half=disk.half,
        weights=disk.weights,
        mirrors=disk.mirrors,
        tangent=tangent,
        radius=number_of(radius),
        thickness=number_of(thickness_in_radii(options, radius)),
    )


ENTRIES = pair_of(
    "vo-lines",
    "hidden share of the ball, by lines",
    "section 4.1",
    "ao = sum w max(0, min(z_s, d + T) - max(-z_s, d)) / (2 z_s), d = (z_Q - z_S) / (R w_z), sum of w: 1",
    partial(by_formulas, lines_of),
    options=SampleOptions,
    samples=partial(sample_set, "disk"),
    dimensions=2,
    count=5,
    texel_bytes=40,
)
