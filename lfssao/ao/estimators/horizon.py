"""Horizon-based AO (Bavoil, Sainz and Dimitrov 2008), which VO's table 1 calls HSAO.

Occlusion is the fraction of the hemisphere's directions, not weighted by the cosine, between the tangent plane and the
horizon. The limit for many directions and steps, without bias, where the view is parallel and sees all of the surface
within R, is

    (1 / 2 pi) integral_0^2pi integral W dM d theta

with M the sine of the horizon so far on the way out, which starts at the tangent plane's: 0 on a plane, at a convex
crease and on top of a sphere; 1/2 in a concave right-angle crease, as the nearest step sees the whole wall rise.

At finite resolution the texels that are read lie off the line of the march, where a slanted tangent plane is higher or
lower: a sloping plane hides a little of itself (up to about 0.1 near an edge), unless a bias forbids it. The paper
jitters the steps too; that is left out. Elevations are compared and subtracted as sines.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from lfssao.ao.estimators.estimator import Estimator, Options, option, turns_of
from lfssao.ao.estimators.kernels.horizon import Horizons, horizon_occlusion
from lfssao.ao.estimators.vo.local_frame import disk_mirrors, seen_surface
from lfssao.ao.ssao import Occlusion, run_kernel
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import sincospi

# Linear and quadratic part of 1 - W, W the attenuation.
_ATTENUATION = {"quadratic": (0.0, 1.0), "linear": (1.0, 0.0), "none": (0.0, 0.0)}


@dataclass(frozen=True)
class HorizonOptions(Options):
    """Options of ``hbao``; the paper leaves W open, and its authors' shader has the quadratic one."""

    directions: int = option(8, "directions of the disk", limits=(1, 1024))
    steps: int = option(8, "steps along each direction", limits=(1, 1024))
    bias: float = option(
        0.0, "angle, degrees, by which a horizon must exceed the tangent plane, against facets", limits=(0.0, 90.0)
    )
    attenuation: str = option(
        "quadratic", "W of a horizon at the distance r R: 1 - r^2, 1 - r or 1", choices=tuple(_ATTENUATION)
    )
    randomize: bool = option(True, "whether the directions are reflected differently over tiles of 4 x 4 texels")
    seed: int = option(0, "of those reflections", limits=(0, 2**53))


def hbao(buffers: Buffers, radius: float, points: None, weights: None, options: HorizonOptions) -> Occlusion:
    """Return horizon-based AO; it takes no samples."""
    dtype = buffers.depth.dtype
    fan, turns = fan_of(options, dtype), turns_of(buffers)
    return run_kernel(horizon_occlusion, buffers.depth, seen_surface(buffers), fan, turns, dtype.type(radius))


def fan_of(options: HorizonOptions, dtype: np.dtype[Any]) -> Horizons:
    """Return directions and attenuation in the arithmetic's dtype."""
    around = np.array([sincospi((2 * k + 1) / options.directions)[::-1] for k in range(options.directions)])
    mirrors = disk_mirrors(options.randomize, options.seed, dtype)
    scalars = (*sincospi(options.bias / 180.0), *_ATTENUATION[options.attenuation])
    return Horizons(around.astype(dtype), mirrors, options.steps, *(dtype.type(number) for number in scalars))


ENTRIES = (
    Estimator(
        name="hbao",
        title="horizons above the tangent plane",
        source="Bavoil, Sainz and Dimitrov 2008, equations 1 and 2",
        formula="ao = (1 / directions) sum of W(|Q - C| / R) (sin of a horizon - sin of the one before)",
        run=hbao,
        options=HorizonOptions,
        dimensions=0,
        integrand=("uniform", "quadratic"),
        count=64,
        normals=True,
        texel_bytes=28,
        turns=True,
    ),
)
