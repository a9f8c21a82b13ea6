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
from typing import Any

import numpy as np

from lfssao.ao.estimators.estimator import BACKGROUNDS, FloatArray, Options, option, turns_of
from lfssao.ao.estimators.lf import LF
from lfssao.ao.ssao import Occlusion, run_kernel
from lfssao.ao.textures import Buffers

SURFACES = ("depth", "positions")


@dataclass(frozen=True)
class _Remap(Options):
    remap: bool = option(False, "2 max(0, ao - 1/2) in place of ao, so that a flat surface is open")


@dataclass(frozen=True)
class HemisphereOptions(Options):
    """Options of ``hemisphere``."""

    range_check: bool = option(False, "whether a surface point farther than R in world space does not occlude")
    surface: str = option(
        "depth", "LF Algorithm 2's line 7: the depth texture, or the mapped positions texture", choices=SURFACES
    )
    background: str = option(
        "open", "whether background occludes no sample, or all, but by the range check none", choices=BACKGROUNDS
    )


@dataclass(frozen=True)
class PointOptions(HemisphereOptions, _Remap):
    """Options of ``point``."""


def in_ball(
    buffers: Buffers, radius: float, points: FloatArray, weights: Any, options: HemisphereOptions, half: bool
) -> Occlusion:
    """Return LF Algorithm 2's occlusion on every view, cameras included, with options; points as of ``lf.lf_radii``.

    With ``half``, it is that of the half ball above the surface: samples below it move to the other side of the point.
    VO section 4.4 says 'reflecting the points that are underneath'. An offset o is replaced by -o here, which keeps its
    bits, and not mirrored in the surface; both send a ball's uniform points to the half ball's. A texel whose normal is
    0 keeps its ball.
    """
    from lfssao.ao.estimators.kernels import point as kernels  # late: 'lf', the default, does not need it

    depth, dtype = buffers.view.image_z(buffers.depth), buffers.depth.dtype.type
    with np.errstate(over="ignore"):  # the square of a very large radius is infinite: all is in reach
        offsets = np.ascontiguousarray(radius * np.asarray(points, np.float64), dtype)
        reach = dtype(float(radius) * float(radius)) if options.range_check else dtype(np.inf)
    looked = depth if options.background == "open" else np.where(depth < np.inf, depth, -dtype(np.inf))
    seen = kernels.Seen(*(np.ascontiguousarray(texture).ravel() for texture in (depth, buffers.positions, looked)))
    above = np.ascontiguousarray(buffers.normals).ravel() if half else None
    remap = isinstance(options, PointOptions) and options.remap
    choices = kernels.Choices(reach, options.surface == "positions", remap)
    projection = buffers.view.world_to_image.as_type(dtype)
    turns = turns_of(buffers).reshape(2, *depth.shape)
    return run_kernel(kernels.occluded_fraction, depth, seen, above, offsets, projection, choices, turns)


ENTRIES = (
    replace(
        LF,
        name="point",
        title="share of samples in the ball behind the surface, positions from a texture on every view",
        source="LF Algorithm 2, Mittring 2007",
        formula="ao = (number of samples with surDepth < smp.z) / (number of samples); with remap 2 max(0, ao - 1/2)",
        run=partial(in_ball, half=False),
        run_radii=None,
        options=PointOptions,
    ),
    replace(
        LF,
        name="hemisphere",
        title="share of samples in the half ball above the surface behind it",
        source="VO section 4.4",
        formula="ao = (number of samples with surDepth < smp.z) / (number of samples), at C - o where o.n < 0",
        run=partial(in_ball, half=True),
        run_radii=None,
        options=HemisphereOptions,
        normals=True,
        whole_ball=False,
    ),
)
