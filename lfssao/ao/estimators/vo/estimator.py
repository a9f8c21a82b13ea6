"""Volumetric Obscurance (VO, Loos and Sloan 2010) by points, lines and areas.

VO's V(P) is the open volume around P, not normalised. Occlusion here is 1 - V / V_0, V_0 the volume of the ball, or of
half of it where the tangent plane bounds it (4.4).

The limit for many samples that fill the ball (or disk) evenly, in parallel projection, is the fraction of the ball
behind the surface. In units of R, with c(a) = (1 - a)^2 (2 + a) / 4 the fraction of the unit ball beyond a plane at the
distance a from its middle:

- plane through P: 1/2. The half ball: 0.
- concave right-angle crease at the distance a <= 1 from P along one wall: 1/2 + c(a) / 2, as the other wall cuts a cap
  off of which half lies before the first wall: 3/4 in the crease. The half ball, of half the volume: c(a); 1/2 in the
  crease, 0 from a = 1 on.
- convex right-angle crease likewise: 1/2 - c(a) / 2, 1/4 on the edge. The half ball: 0.
- floor at the distance a before a step up of at least R: 1/2 + c(a) / 2, the half ball c(a).
- top of a sphere of radius s >= 1: 1/2 - 3 / (16 s), the half ball 0.

All are independent of the surface's slant to the viewer as long as the view sees all of the surface within R. For dual
radii (section 6) V is the product V_1 V_2 or the minimum min(V_1, V_2).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import inf, sqrt
from typing import Any

import numpy as np

from lfssao.ao import post
from lfssao.ao.estimators.estimator import Estimator, FloatArray, Options, Run, option, turns_of
from lfssao.ao.estimators.vo.kernels import moments as kernels
from lfssao.ao.estimators.vo.kernels.disks import FAR, area_occlusion, line_occlusion
from lfssao.ao.estimators.vo.kernels.local_frame import Disk
from lfssao.ao.estimators.vo.kernels.points import Ball, point_occlusion
from lfssao.ao.estimators.vo.local_frame import ball_mirrors, disk_mirrors, seen_surface
from lfssao.ao.ssao import Occlusion, run_kernel
from lfssao.ao.textures import Buffers, Texture
from lfssao.core.affine import sum_in_order
from lfssao.core.elementary import log2
from lfssao.errors import InputError
from lfssao.samples import repulsion_table

Weights = FloatArray | None
_AVERAGE, _BLUR = (0.0, 0.5), (0.125, 0.375)  # taps of a step of the pyramid of moments


@dataclass(frozen=True)
class VolumeOptions(Options):
    """Options of VO by points and by lines."""

    thickness: float = option(
        0.0, "how far behind its depth a surface hides, along the view, world units; 0: without end", limits=(0.0, inf)
    )
    second: float = option(0.0, "another radius, in radii (VO section 6); 0: none", limits=(0.0, 1e6), power=1)
    combine: str = option("product", "two radii by the product or minimum of V", choices=("product", "minimum"))
    randomize: bool = option(True, "whether the samples are reflected differently over tiles of 4 x 4 texels")
    seed: int = option(0, "of those reflections", limits=(0, 2**53))


@dataclass(frozen=True)
class AreaOptions(VolumeOptions):
    """Options of VO by areas; VO's footnote wants the variance of the box, sqrt(3), its a and b imply 1."""

    half_width: float = option(
        sqrt(3.0), "half-width of the box of depths that an area sees, in standard deviations", limits=(0.0, 100.0)
    )
    prefilter: bool = option(False, "whether each level is blurred by [1 2 1] / 4, against visible squares")


def by_points(
    buffers: Buffers, radius: float, points: FloatArray, weights: Weights, options: VolumeOptions, tangent: bool
) -> Occlusion:
    """Return occlusion by points (VO sections 3 and 4, after Crytek and Blizzard).

    points: (n, 3), offsets in the unit ball, world axes. weights: volumes of the points' cells (4.5), by default all
    the same. tangent: whether points below the tangent plane are reflected by it (4.4). Raises InputError if a weight
    is negative or none is positive.
    """
    dtype = buffers.depth.dtype
    fractions = _normalised(np.ones(len(points)) if weights is None else np.asarray(weights, np.float64))
    mirrors = ball_mirrors(options.randomize, options.seed, dtype)
    ball = Ball(np.ascontiguousarray(points, dtype), fractions.astype(dtype), mirrors, tangent)
    return _at_radii(point_occlusion, buffers, radius, options, seen_surface(buffers), ball)


def on_disk(
    buffers: Buffers, radius: float, points: FloatArray, weights: Weights, options: VolumeOptions, tangent: bool
) -> Occlusion:
    """Return occlusion by lines (VO section 4.1), with ``AreaOptions`` by areas (4.2).

    points: (n, 2), places of the lines or middles of the areas in the unit disk. weights: integrals of the ball's
    extent in z over the disk's cells (4.5), by default z_s; an area is in proportion to its weight over z_s there.
    tangent: whether lines end at the tangent plane (4.4). Raises as ``by_points``.
    """
    seen, disk = seen_surface(buffers), make_disk(points, weights, options, tangent, buffers.depth.dtype)
    if not isinstance(options, AreaOptions):
        return _at_radii(line_occlusion, buffers, radius, options, seen, disk)
    pyramid = moment_pyramid(seen.depth.reshape(buffers.depth.shape), options.prefilter)
    view = seen, disk, pyramid, options.half_width
    return _at_radii(area_occlusion, buffers, radius, options, *view, most=4 * FAR)


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


def _at_radii(
    kernel: Callable[..., None], buffers: Buffers, radius: float, options: VolumeOptions, *view: Any, most: float = inf
) -> Occlusion:
    """Occlusion at R, or at R and a second radius together (VO section 6); most: thickness without end, in radii."""
    one, turns = buffers.depth.dtype.type, turns_of(buffers)
    radii = [radius] if options.second == 0 else [radius, options.second * radius]
    thick = [options.thickness / r if options.thickness > 0 < r else inf for r in radii]
    made = [
        run_kernel(kernel, buffers.depth, *view, turns, one(r), one(min(t, most)))
        for r, t in zip(radii, thick, strict=True)
    ]
    if len(made) == 1:
        return made[0]
    first, second = (each.texture for each in made)
    # 1 - (1 - a) (1 - b), from the product of two open fractions, is a + b (1 - a).
    texture = post.merge([first, second]) if options.combine == "minimum" else first + second * (1 - first)
    return Occlusion(texture, sum(each.outside for each in made))


def _normalised(weights: FloatArray) -> FloatArray:
    """Weights over their sum, added from the first to the last."""
    if not (weights >= 0).all():
        raise InputError("weights: one is negative")
    total = sum_in_order(weights.tolist())
    if not 0 < total < inf:
        raise InputError(f"weights: their sum is {total}, it must be positive and finite")
    fractions: FloatArray = weights / total
    return fractions


def make_disk(points: Any, weights: Any, options: VolumeOptions, tangent: bool, dtype: np.dtype[Any]) -> Disk:
    """Samples of the disk as kernels take them, made in float64."""
    disk = np.ascontiguousarray(points, np.float64)
    half = np.sqrt(np.maximum(1 - (disk[:, 0] * disk[:, 0] + disk[:, 1] * disk[:, 1]), 0))
    extents = half if weights is None else np.asarray(weights, np.float64)
    there = half > 0
    if there.any():
        fractions = _normalised(np.where(there, extents, 0))
        by_length = np.divide(fractions, 2 * half, out=np.zeros_like(fractions), where=there)
        areas = np.maximum(_normalised(by_length), 2.0**-100)
    else:  # all lines touch the ball in a point
        by_length, areas = np.zeros(len(disk)), np.full(len(disk), 1 / len(disk))
    return Disk(
        places=disk.astype(dtype),
        half=half.astype(dtype),
        weights=(2 * by_length if tangent else by_length).astype(dtype),
        finer=np.array([0.5 * log2(area) for area in areas.tolist()]),
        mirrors=disk_mirrors(options.randomize, options.seed, dtype),
        tangent=tangent,
    )


def _samples(domain: str, n: int, middle: bool = False) -> tuple[FloatArray, FloatArray | None]:
    """Return n samples of a domain and their weights; middle: whether a single one stands in the middle."""
    made = repulsion_table(domain, n, centre=True if middle and n == 1 else None)
    return made.points, made.weights


def _pair(name: str, title: str, section: str, formula: str, run: Run, **more: Any) -> tuple[Estimator, ...]:
    """An estimator, and the same above the tangent plane (4.4), which reads normals."""
    plain = Estimator(
        name, title, f"VO {section}", formula, partial(run, tangent=False), turns=True, whole_ball=True, **more
    )
    name, title, source = f"{name}-normal", f"{title}, above the tangent plane", f"VO {section} and 4.4"
    return plain, replace(
        plain, name=name, title=title, source=source, run=partial(run, tangent=True), normals=True, whole_ball=False
    )


ENTRIES = (
    *_pair(
        "vo-points",
        "hidden share of the ball, by points",
        "sections 3, 4",
        "ao = sum of the weights of hidden points / sum of weights",
        by_points,
        options=VolumeOptions,
        samples=partial(_samples, "ball"),
        count=12,
        texel_bytes=40,
    ),
    *_pair(
        "vo-lines",
        "hidden share of the ball, by lines",
        "section 4.1",
        "ao = sum w max(0, min(z_s, d + T) - max(-z_s, d)) / (2 z_s), d = (z_Q - z_S) / (R w_z), sum of w: 1",
        on_disk,
        options=VolumeOptions,
        samples=partial(_samples, "disk"),
        dimensions=2,
        count=5,
        texel_bytes=40,
    ),
    *_pair(
        "vo-area",
        "hidden share of the ball, by mean and variance of depth",
        "section 4.2",
        "ao as of vo-lines, depths z_Q spread evenly over mean +- half_width sigma of an area",
        on_disk,
        options=AreaOptions,
        samples=partial(_samples, "disk", middle=True),
        dimensions=2,
        count=1,
        texel_bytes=73,
    ),
)
