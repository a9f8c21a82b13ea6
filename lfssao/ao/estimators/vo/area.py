"""VO by areas of the disk, ``vo-area`` (Loos and Sloan 2010, section 4.2); the limits are those of ``vo.volume``."""

from dataclasses import dataclass
from functools import partial
from math import sqrt
from typing import Any

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray, option
from lfssao.ao.estimators.vo.kernels.disks import FAR, area_occlusion
from lfssao.ao.estimators.vo.local_frame import seen_surface
from lfssao.ao.estimators.vo.volume import (
    VolumeOptions,
    Weights,
    at_radii,
    make_disk,
    pair_of,
    sample_set,
    thickness_in_radii,
)
from lfssao.ao.formulas import float_view
from lfssao.ao.kernels import moments as kernels
from lfssao.ao.ssao import Occlusion, run_kernel
from lfssao.ao.textures import Buffers, Texture

_AVERAGE, _BLUR = (0.0, 0.5), (0.125, 0.375)  # taps of a step of the pyramid of moments


@dataclass(frozen=True)
class AreaOptions(VolumeOptions):
    """Options of VO by areas; VO's footnote wants the variance of the box, sqrt(3), its a and b imply 1."""

    half_width: float = option(
        sqrt(3.0), "half-width of the box of depths that an area sees, in standard deviations", limits=(0.0, 100.0)
    )
    prefilter: bool = option(False, "whether each level is blurred by [1 2 1] / 4, against visible squares")


def by_areas(
    buffers: Buffers, radius: float, points: FloatArray, weights: Weights, options: AreaOptions, tangent: bool
) -> Occlusion:
    """Return occlusion by areas (VO section 4.2).

    points: (n, 2), middles of the areas in the unit disk. weights: integrals of the ball's extent in z over the areas
    (4.5), by default z_s; an area is in proportion to its weight over z_s there. tangent: whether it ends at the
    tangent plane (4.4). Raises InputError if a weight is negative or none is positive.
    """
    number, view = buffers.depth.dtype.type, float_view(buffers, ("surface", "direction"))
    seen, disk = seen_surface(view), make_disk(points, weights, options, tangent, buffers.depth.dtype)
    pyramid = moment_pyramid(seen.depth.reshape(buffers.depth.shape), options.prefilter)

    def occlusion(r: float) -> Occlusion:
        thickness = number(min(thickness_in_radii(options, r), 4 * FAR))
        given = seen, disk, pyramid, options.half_width, view.turns, number(r), thickness
        return run_kernel(area_occlusion, buffers.depth, *given)

    return at_radii(occlusion, radius, options)


def moment_pyramid(depth: Texture, prefilter: bool) -> kernels.Pyramid:
    """Return the pyramid of a texture of cast z, (H, W), +infinity where there is no surface, down to one texel.

    With ``prefilter`` each step blurs by [1 2 1] / 4 before it averages two texels.
    """
    height, width = depth.shape
    sizes = [(height, width)]
    while max(sizes[-1]) > 1:
        sizes.append(((sizes[-1][0] + 1) // 2, (sizes[-1][1] + 1) // 2))
    pitches = [w + kernels.BORDER for _, w in sizes]
    lengths = [(h + kernels.BORDER) * pitch for (h, _), pitch in zip(sizes, pitches, strict=True)]
    starts = [sum(lengths[:level]) for level in range(len(sizes))]
    moments = np.zeros((sum(lengths), 3))
    kernels.write_base(depth, moments)
    for level, (_, w) in enumerate(sizes[:-1]):
        taps = _BLUR if prefilter else _AVERAGE
        kernels.write_half(moments, starts[level], w, sizes[level + 1][0], starts[level + 1], *taps)
    return kernels.Pyramid(moments.reshape(-1), np.array(starts), np.array(pitches))


def _functions(tangent: bool) -> dict[str, Any]:
    return {"run": partial(by_areas, tangent=tangent)}


ENTRIES = pair_of(
    "vo-area",
    "hidden share of the ball, by mean and variance of depth",
    "section 4.2",
    "ao as of vo-lines, depths z_Q spread evenly over mean +- half_width sigma of an area",
    _functions,
    options=AreaOptions,
    samples=partial(sample_set, "disk", middle=True),
    dimensions=2,
    count=1,
    texel_bytes=73,
)
