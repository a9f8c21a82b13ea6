"""Alchemy AO (McGuire et al. 2011, as SAO equation 1 gives it).

    A(C) = max(0, 1 - 2 sigma / s  sum_i max(0, v_i . n + z_C beta) / (v_i . v_i + epsilon))^k,  v_i = Q_i - C

and occlusion is 1 - A. SAO says 's points distributed on a ball about C' and no more. The readings taken here:

- The taps are points of a disk of radius R around C that faces the viewer, at right angles to the texel's ray. Each is
  mapped into the image, and Q_i is the positions texture's point at the texel it lands in. On a camera that is the disk
  of SAO equation 5, r' = R S' / -z_C texels, up to perspective's slant; on a module, where horizontally and vertically
  another denominator holds, it is an ellipse.
- The disk's points are SAO's spiral (equations 6 and 7). Its radii are uniform, not its area. The registry turns it by
  equation 8 unless another rotation is asked for, as SAO says that this is Alchemy's hash.
- -z_C is the distance from the viewers along the axis of depth (``View.viewer_distance``). A normal of 0 occludes
  nothing.
- sigma and epsilon are given in units of R and R^2: v . n / (v . v) is one over a length, and what looks right in a
  scene in metres should in one in millimetres.
- Taps outside the texture and on background add 0, as does a tap that lands on C itself (0 / 0 for epsilon = 0).

The limit for many taps, texels that shrink and beta = 0, of a surface z = h(x, y) seen from straight above, is the mean
over taps of uniform radius alpha R and uniform angle theta, each at v = (alpha R cos(theta), alpha R sin(theta), rise
of h):

    1 - A = 2 sigma / (2 pi) integral_0^1 integral_0^2pi max(0, v . n) / (v . v + epsilon) dtheta dalpha

as long as it is at most 1 (sigma in units of R, k = 1). It is 0 on a plane, on a convex crease and on top of a sphere,
where nothing rises above the tangent plane.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import Estimator, FloatArray, option
from lfssao.ao.estimators.look_ups import LookUps
from lfssao.ao.formulas import sum_formulas
from lfssao.ao.textures import Buffers
from lfssao.core.numbers import is_finite, larger, number, power, rounded, select
from lfssao.core.vectors import Vector, disk_axes, dot
from lfssao.samples import sample_set


@dataclass(frozen=True)
class AlchemyOptions(LookUps):
    """Options of ``alchemy``."""

    sigma: float = option(1.0, "strength, in radii", limits=(0, 1e6), power=1)
    beta: float = option(
        1e-4, "how steeply a surface must rise to occlude, a fraction of the distance from the viewers", limits=(0, 1)
    )
    epsilon: float = option(0.01, "guards the division, in squared radii", limits=(0, 1e6), power=2)
    k: float = option(1.0, "contrast: the exponent of A", limits=(0, 100))


class Alchemy(NamedTuple):
    """Numbers of equation 1, of the arithmetic's dtype.

    points: (s, 2), taps in the unit disk. away: (4,), -z_C as an affine function of C. radius: R. scale: 2 sigma / s.
    """

    points: Any
    away: Any
    radius: Any
    beta: Any
    epsilon: Any
    scale: Any
    k: float

    def start(self, view: Any, texel: Any) -> Any:
        """C, its normal, z_C beta, the texel's turn, and the images of C and of R times the disk's axes."""
        c, n, a = view.position(texel), view.normal(texel), self.away
        far = dot(Vector(number(a[0], c.x), number(a[1], c.x), number(a[2], c.x)), c) + a[3]
        w = view.direction(texel)
        e, f = disk_axes(w, view.fork(w.z >= 0))
        image = view.at(c), view.along(self.radius * e), view.along(self.radius * f)
        return c, n, self.beta * larger(0, far), view.turn_by_angle(texel), image

    def counts(self, view: Any, here: Any) -> Any:
        """Every texel with a surface has samples."""
        return True

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of tap s, turned."""
        _, _, _, (cosine, sine), (p, e, f) = here
        x, y = self.points[s, 0], self.points[s, 1]
        return p + ((x * cosine - y * sine) * e + (x * sine + y * cosine) * f)

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """max(0, v . n + z_C beta) / (v . v + epsilon); 0 where it is no number, and too far away to occlude."""
        c, n, less, _, _ = here
        v = view.position(seen) - c
        above, square = dot(v, n) - less, dot(v, v) + rounded(self.epsilon, 4, z)
        return select((above > 0) & (square > 0) & is_finite(square), above / square, 0)

    def background(self) -> Any:
        """The term of a tap on background."""
        return 0

    def end(self, total: Any) -> Any:
        """1 - max(0, 1 - 2 sigma / s sum)^k."""
        light = select(total > 0, 1 - rounded(self.scale, 3, total, 1) * total, 1)
        return 1 - power(larger(0, light), self.k)


def alchemy(
    buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None, options: AlchemyOptions
) -> Alchemy:
    """Return the formulas' numbers, in the textures' dtype; points: (s, 2) in the unit disk; weights are not read."""
    dtype = buffers.depth.dtype.type
    with np.errstate(over="ignore"):  # a very large epsilon or sigma is infinite
        return Alchemy(
            points=np.ascontiguousarray(points, dtype),
            away=np.ascontiguousarray(buffers.view.viewer_distance(), dtype),
            radius=dtype(radius),
            beta=dtype(options.beta),
            epsilon=dtype(options.epsilon * float(radius) * float(radius)),
            scale=dtype(2 * options.sigma * float(radius) / len(points)),
            k=options.k,
        )


ENTRIES = (
    Estimator(
        name="alchemy",
        title="obscurance by points of the surface above the tangent plane",
        source="SAO equation 1, after McGuire et al. 2011",
        formula=(
            "ao = 1 - max(0, 1 - (2 sigma R / taps) sum max(0, v.n - beta d) / (v.v + epsilon R^2))^k, v = Q - C, d "
            "the distance of C from the viewer"
        ),
        run=partial(sum_formulas, alchemy),
        formulas=alchemy,
        options=AlchemyOptions,
        samples=lambda n: (sample_set("disk", "spiral", n).points, None),  # with the most even number of turns
        dimensions=2,
        integrand=("uniform", "linear"),
        count=12,
        normals=True,
        texel_bytes=24,
        turns=True,
        rotation="sao-hash",
    ),
)
