"""Multi-resolution ambient occlusion, coarse to fine (after Hoang and Low 2010, 2012).

LF merges several radii by their maximum (``post.merge``); Hoang and Low keep a small square of taps and let the
texels grow. LF and SAO cite them: AO is measured for different radii and merged (LF), or computed at different output
scales and upsampled with a joint bilateral filter before compositing (SAO 1.1). The forms below are the usual ones of
that method as far as they are known, and ours:

- Coarse textures: level l + 1 has one texel for 2 x 2 of level l, the lower median by depth of those that see a
  surface; a mean would lie between surfaces.
- Occlusion of a level: the mean over the (2 kernel + 1)^2 - 1 texels Q around P of (1 - t^2 / R^2) max(0, cos), where
  t = |Q - P| < R and cos = (Q - P) . n / t: VO section 3's obscurance with a square falloff, by points of the surface.
- Upsampling: of the four coarse texels around, weights 9, 3, 3, 1 times ((1 + n . m) / 2)^8 times (R / (R + s))^16, s
  the distance of the coarse point from the fine one's tangent plane.
- Combination: 1 - (1 - maximum) (1 - average) over the levels, so that an occluder that one level alone sees is not
  averaged away and one that all see is darker; or one of the two. Both are carried from level to level.

A square of texels is the same on a module and on a camera, and no mapping is evaluated.

The limit for a kernel of many texels that shrink, one level, square of half-width a, from straight above, is the mean m
of (1 - t^2 / R^2) max(0, cos) over the square, t < R, as 1 - (1 - m)^2 where both combine: 0 on planes, on convex
creases and on top of a sphere.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator, Options, option
from lfssao.ao.estimators.kernels import multiresolution as kernels
from lfssao.ao.ssao import Occlusion
from lfssao.ao.textures import Buffers, Texture

COMBINATIONS = ("both", "maximum", "average")


@dataclass(frozen=True)
class MultiresolutionOptions(Options):
    """Options of ``multiresolution``."""

    levels: int = option(4, "resolutions, each half the one before", limits=(1, 16))
    kernel: int = option(2, "texels from the middle of the square to its edge", limits=(1, 64))
    combine: str = option("both", "how the levels are combined", choices=COMBINATIONS)


def level_pyramid(depth: Texture, levels: int) -> list[NDArray[np.int32]]:
    """Return which texels, by number, stand for those of each level, the finest first; -1 is none."""
    surface = np.ascontiguousarray(depth)
    pyramid: list[NDArray[np.int32]] = [np.empty(depth.shape, np.int32)]
    kernels.first_level(surface, pyramid[0])
    for _ in range(levels - 1):
        height, width = pyramid[-1].shape
        pyramid.append(np.empty(((height + 1) // 2, (width + 1) // 2), np.int32))
        kernels.halve(surface, pyramid[-2], pyramid[-1])
    return pyramid


def multiresolution(
    buffers: Buffers, radius: float, points: None, weights: None, options: MultiresolutionOptions
) -> Occlusion:
    """Return occlusion from a small square of texels at several resolutions; it takes no samples."""
    assert buffers.normals is not None  # the registry has seen to it
    dtype, pyramid = buffers.depth.dtype, level_pyramid(buffers.depth, options.levels)
    places = np.ascontiguousarray(buffers.positions).reshape(-1, 3)
    facing = np.ascontiguousarray(buffers.normals).reshape(-1, 3)
    with np.errstate(over="ignore"):  # the square of a very large radius is infinite
        squared = dtype.type(float(radius) * float(radius))
    outside, most, total = 0, np.empty((0, 0), dtype), np.empty((0, 0), dtype)
    for number in reversed(range(options.levels)):
        coarser, level = (most, total), pyramid[number]
        most, missed = np.empty(level.shape, dtype), np.empty(level.shape[0], np.int64)
        kernels.level_occlusion(level, places, facing, options.kernel, dtype.type(radius), squared, most, missed)
        total, outside = most.copy(), outside + int(missed.sum())
        if number + 1 < options.levels:
            kernels.refine(level, pyramid[number + 1], places, facing, dtype.type(radius), *coarser, most, total)
    with np.errstate(all="ignore"):  # of normals far from unit length; NaN is not above 0
        combined = most if options.combine == "maximum" else total / dtype.type(options.levels)
        if options.combine == "both":
            combined = 1 - (1 - most) * (1 - combined)
    return Occlusion(np.where(combined > 0, np.minimum(combined, 1), 0), outside)


ENTRIES = (
    Estimator(
        name="multiresolution",
        title="obscurance by a small square of texels at several resolutions",
        source="Hoang and Low 2010, 2012, as LF and SAO cite them",
        formula=(
            "of a level ao = sum of max(0, 1 - v.v / R^2) max(0, v.n) / |v| over the square / ((2 kernel + 1)^2 - 1), "
            "v = Q - C; levels by combine"
        ),
        run=multiresolution,
        options=MultiresolutionOptions,
        dimensions=0,
        integrand=("cosine", "linear"),
        count=0,
        normals=True,
        texel_bytes=32,
    ),
)
