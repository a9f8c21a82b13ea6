"""The normal-oriented hemisphere as renderers ship it (LearnOpenGL's tutorial 'SSAO', after Chapman 2013).

C is a texel's point, n its normal, (c, s) the cosine and sine of its turn (tutorials tile 4 x 4 of them), and a point
(x, y, z) of the sample set lies at

    S = C + R (x t + y b + |z| n),   t = normalize(r - n (n.r)),   b = n x t,   r = c right + s up

right and up are the view's, in world space; a noise vector (x, y, z) of one's own is r = x right + y up + z towards the
viewer. Depth z is that along the view's axis, linear. S is hidden by the surface
that the texel of its image shows, at z_Q, if z_S - z_Q >= bias; the range check, the weight of what is hidden, compares
z_C with z_Q, which in a module is no distance along a ray. Differences to the tutorials:

- A point outside the texture, or without image, is not hidden; a sampler would clamp or repeat the border's texels.
- Background hides nothing by default. In a buffer of positions that is cleared to 0 it lies at the eye and hides all
  (``background`` 'occludes'); its distance from C is taken as infinite, so that range checks give it weight 0.
- There is no frame if n is along r, and then no point has an image. Tiles of whole multiples of pi / 8 have that on
  floors and walls along the view's axes, in a texel of 8: the default is a turn of each texel's own.

The limit for many points that fill the ball evenly, texels that shrink, bias 0 and range check 'none', is the fraction
of the half ball above the tangent plane that lies behind the surface, as of ``hemisphere``: with
cap(a) = (1 - a)^2 (2 + a) / 4 it is 0 on a plane, on a convex crease and on top of a sphere, and cap(a) at the distance
a R <= R from the wall of a concave right-angle crease, or before a step up of at least R: 1/2 in the crease.
"""

from dataclasses import dataclass
from functools import partial
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import Estimator, FloatArray, option
from lfssao.ao.estimators.look_ups import BACKGROUNDS, LookUps
from lfssao.ao.formulas import sum_formulas
from lfssao.ao.textures import Buffers
from lfssao.core.jit import formula
from lfssao.core.numbers import alternatives, larger, number, rounded, select, smaller, smoothstep
from lfssao.core.vectors import cross, dot
from lfssao.optics.view import View
from lfssao.samples import make_samples

ANY, NEAR, SMOOTH = 0, 1, 2
RANGE_CHECKS = {"none": ANY, "distance": NEAR, "smoothstep": SMOOTH}


@dataclass(frozen=True)
class OrientedOptions(LookUps):
    """Options of ``oriented-hemisphere``; the defaults are LearnOpenGL's, whose R is 0.5 and bias 0.025."""

    bias: float = option(
        0.05, "by how much a surface must be nearer than a point to hide it, in radii", limits=(0.0, 4.0), power=1
    )
    range_check: str = option(
        "smoothstep",
        "weight of what is hidden, d = |z_C - z_Q|: 1; 1 if d < R, else 0; smoothstep(0, 1, R / d)",
        choices=tuple(RANGE_CHECKS),
    )
    background: str = option(
        "open",
        "whether background hides nothing, or all, with weight 1 by range check none, else 0, or is cleared to a place",
        choices=BACKGROUNDS,
    )


@formula
def tangent_frame(kernel: Any, view: Any, texel: Any) -> Any:
    """z_C, and the images of C and of R t, R b and R n."""
    n, r = view.normal(texel), view.noise(texel)
    t = r - dot(n, r) * n
    t = (1 / np.sqrt(dot(t, t))) * t
    p, radius = view.at(view.position(texel)), kernel.radius
    return view.depth_at(p), p, radius * view.along(t), radius * view.along(cross(n, t)), radius * view.along(n)


@formula
def in_frame(kernel: Any, here: Any, s: Any) -> Any:
    """The image of C + R (x t + y b + z n)."""
    _, p, t, b, n = here
    return p + kernel.points[s, 0] * t + kernel.points[s, 1] * b + kernel.points[s, 2] * n


class Hemisphere(NamedTuple):
    """Points of the upper half ball, arrays and scalars of the arithmetic's dtype.

    points: (n, 3), in the frame (t, b, n), z >= 0. radius: world units. reach, bias: R, and by how much a surface must
    be nearer than a point, in units of cast z. beyond: the weight of a point that looks at background.
    """

    points: Any
    radius: Any
    reach: Any
    bias: Any
    range_check: int
    beyond: Any

    def start(self, view: Any, texel: Any) -> Any:
        """z_C, and the images of C and of R t, R b and R n."""
        return tangent_frame(self, view, texel)

    def counts(self, view: Any, here: Any) -> Any:
        """Every texel with a surface has samples."""
        return True

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of C + R (x t + y b + z n)."""
        return in_frame(self, here, s)

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """The weight of what is hidden, by the range check."""
        z_q, weight = view.surface(seen), number(1, z)
        d, reach, bias = abs(here[0] - z_q), rounded(self.reach, 4, z), rounded(self.bias, 8, z)
        if self.range_check == NEAR:
            weight = select(d < reach, weight, 0)
        if self.range_check == SMOOTH:
            weight = smoothstep(select(d > reach, reach / d, 1))
        hidden = alternatives(z - z_q >= bias, alternatives(z - bias >= z_q, z >= z_q + bias))
        return select(hidden, weight, 0)

    def background(self) -> Any:
        """The weight of a point that looks at background."""
        return self.beyond

    def end(self, total: Any) -> Any:
        """The mean weight."""
        return smaller(1, larger(0, total / self.points.shape[0]))


def cast_length(view: View, length: float) -> float:
    """Return a length of world space in units of cast z."""
    a, b, c, _ = view.cast_from_world[2].tolist()
    return float(length) * sqrt((a * a + b * b) + c * c)


def hemisphere(
    buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None, options: OrientedOptions
) -> Hemisphere:
    """Return the formulas' numbers, in the textures' dtype; points: (n, 3) in the unit ball; weights are not read."""
    dtype, reach = buffers.depth.dtype.type, cast_length(buffers.view, radius)
    table = np.ascontiguousarray(points, dtype)
    return Hemisphere(
        points=np.concatenate([table[:, :2], np.abs(table[:, 2:])], axis=1),
        radius=dtype(radius),
        reach=dtype(reach),
        bias=dtype(options.bias * reach),
        range_check=RANGE_CHECKS[options.range_check],
        beyond=dtype(options.background == "occludes" and options.range_check == "none"),
    )


ENTRIES = (
    Estimator(
        name="oriented-hemisphere",
        title="share of points in the half ball around the normal that are hidden, with bias and range check",
        source="LearnOpenGL 'SSAO', Chapman 2013",
        formula=(
            "ao = (sum of weights of hidden points) / (number of points), S = C + R (x t + y b + |z| n) hidden where "
            "z_S - z_Q >= bias R, its weight 1, or by the range check of d = |z_C - z_Q|"
        ),
        run=partial(sum_formulas, hemisphere),
        formulas=hemisphere,
        options=OrientedOptions,
        samples=lambda n: (make_samples("latin", n, r_min=0.0), None),
        count=64,
        normals=True,
        texel_bytes=16,
        turns=True,
        vectors=True,
        rotation="hash",
    ),
)
