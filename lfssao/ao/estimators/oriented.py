"""The normal-oriented hemisphere as renderers ship it (LearnOpenGL's tutorial 'SSAO', after Chapman 2013).

C is a texel's point, n its normal, (c, s) the cosine and sine of its turn (tutorials tile 4 x 4 of them), and a point
(x, y, z) of the sample set lies at

    S = C + R (x t + y b + |z| n),   t = normalize(r - n (n.r)),   b = n x t,   r = c right + s up

right and up are the view's, in world space. Depth z is that along the view's axis, linear. S is hidden by the surface
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
from math import sqrt

import numpy as np

from lfssao.ao.estimators.estimator import BACKGROUNDS, Estimator, FloatArray, Options, option, turns_of
from lfssao.ao.estimators.kernels.oriented import ANY, NEAR, SMOOTH, Hemisphere, oriented_occlusion
from lfssao.ao.estimators.vo.local_frame import seen_surface
from lfssao.ao.ssao import Occlusion, run_kernel
from lfssao.ao.textures import Buffers
from lfssao.samples import make_samples

RANGE_CHECKS = {"none": ANY, "distance": NEAR, "smoothstep": SMOOTH}


@dataclass(frozen=True)
class OrientedOptions(Options):
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
        "open", "whether background hides nothing, or all, with weight 1 by range check none, else 0",
        choices=BACKGROUNDS,
    )  # fmt: skip


def oriented_hemisphere(
    buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None, options: OrientedOptions
) -> Occlusion:
    """Return the mean weight of hidden points; points: (n, 3) in the unit ball; weights are not read."""
    seen, half = seen_surface(buffers), half_ball(buffers, radius, points, options)
    surface = seen.depth
    if options.background == "occludes":
        surface = np.where(surface < np.inf, surface, half.reach.dtype.type(-np.inf))
    return run_kernel(oriented_occlusion, buffers.depth, seen, surface, half, turns_of(buffers))


def half_ball(buffers: Buffers, radius: float, points: FloatArray, options: OrientedOptions) -> Hemisphere:
    """Return the points and lengths that the kernel takes, in the textures' dtype."""
    view, dtype = buffers.view, buffers.depth.dtype.type
    a, b, c, _ = view.cast_from_world[2].tolist()
    reach = float(radius) * sqrt((a * a + b * b) + c * c)
    table = np.ascontiguousarray(points, dtype)
    return Hemisphere(
        points=np.concatenate([table[:, :2], np.abs(table[:, 2:])], axis=1),
        up=np.ascontiguousarray(view.world_from_cast[:, 1], dtype),
        radius=dtype(radius),
        reach=dtype(reach),
        bias=dtype(options.bias * reach),
        range_check=RANGE_CHECKS[options.range_check],
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
        run=oriented_hemisphere,
        options=OrientedOptions,
        samples=lambda n: (make_samples("latin", n, r_min=0.0), None),
        count=64,
        normals=True,
        texel_bytes=32,
        turns=True,
        rotation="hash",
    ),
)
