"""Volumetric Obscurance (VO, Loos and Sloan 2010): its limits, options and two radii.

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
from dataclasses import dataclass
from functools import partial
from math import inf
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao import post
from lfssao.ao.estimators.estimator import Estimator, FloatArray, Options, option
from lfssao.ao.estimators.look_ups import LookUps
from lfssao.ao.estimators.vo.local_frame import disk_mirrors
from lfssao.ao.formulas import float_view, words_of
from lfssao.ao.kernels.moments import Pyramid
from lfssao.ao.kernels.sums import sum_samples
from lfssao.ao.ssao import Occlusion, run_kernel
from lfssao.ao.textures import Buffers
from lfssao.core.affine import sum_in_order
from lfssao.core.distinct import distinct
from lfssao.core.elementary import log2
from lfssao.errors import InputError
from lfssao.samples import repulsion_table

Weights = FloatArray | None


@dataclass(frozen=True)
class VolumeOptions(Options):
    """Options of VO."""

    thickness: float = option(
        0.0, "how far behind its depth a surface hides, along the view, world units; 0: without end", limits=(0.0, inf)
    )
    second: float = option(0.0, "another radius, in radii (VO section 6); 0: none", limits=(0.0, 1e6), power=1)
    combine: str = option("product", "two radii by the product or minimum of V", choices=("product", "minimum"))
    randomize: bool = option(True, "whether the samples are reflected differently over tiles of 4 x 4 texels")
    seed: int = option(0, "of those reflections", limits=(0, 2**53))


@dataclass(frozen=True)
class SampleOptions(LookUps, VolumeOptions):
    """Options of VO by points and by lines."""


def thickness_in_radii(options: VolumeOptions, radius: float) -> float:
    """Return the thickness over a radius, infinite where surfaces hide all that is behind them."""
    return options.thickness / radius if options.thickness > 0 < radius else inf


def at_radii(occlusion: Callable[[float], Occlusion], radius: float, options: VolumeOptions) -> Occlusion:
    """Return occlusion at R, by a function of it, or at R and a second radius together (VO section 6)."""
    if options.second == 0:
        return occlusion(radius)
    made = occlusion(radius), occlusion(options.second * radius)
    first, second = (each.texture for each in made)
    # 1 - (1 - a) (1 - b), from the product of two open fractions, is a + b (1 - a).
    texture = post.merge([first, second]) if options.combine == "minimum" else first + second * (1 - first)
    return Occlusion(texture, sum(each.outside for each in made))


def sum_at_radii(
    formulas: Callable[..., Any],
    buffers: Buffers,
    radius: float,
    points: FloatArray,
    weights: Weights,
    options: VolumeOptions,
    moments: Pyramid | None = None,
) -> Occlusion:
    """Return occlusion of a view by formulas, ``Estimator.run`` of them; moments: of its depth, if they are read."""
    view = float_view(buffers, words_of(formulas(buffers, radius, points, weights, options)), options)
    view = view._replace(moments_of=moments)

    def occlusion(r: float) -> Occlusion:
        numbers = distinct(formulas(buffers, r, points, weights, options))
        return run_kernel(sum_samples, buffers.depth, view, numbers)

    return at_radii(occlusion, radius, options)


def normalised(weights: FloatArray) -> FloatArray:
    """Return weights over their sum, added from the first to the last.

    Raises InputError if a weight is negative or their sum is not positive and finite.
    """
    if not (weights >= 0).all():
        raise InputError("weights: one is negative")
    total = sum_in_order(weights.tolist())
    if not 0 < total < inf:
        raise InputError(f"weights: their sum is {total}, it must be positive and finite")
    fractions: FloatArray = weights / total
    return fractions


class Disk(NamedTuple):
    """Samples of the unit disk, arrays of the arithmetic's dtype.

    places: (n, 2), x and y. half: (n,), z_s = sqrt(1 - x^2 - y^2). weights: (n,), of a unit of hidden length, so that a
    ball hidden whole (or half a ball, with the tangent plane) gives 1. finer: (n,) float64, half the log2 of each
    sample's fraction of the disk's area. mirrors: (2, TILE, CHUNK), c and s of the reflections of a tile.
    """

    places: Any
    half: Any
    weights: Any
    finer: Any
    mirrors: Any


def make_disk(points: Any, weights: Any, options: VolumeOptions, tangent: bool, dtype: np.dtype[Any]) -> Disk:
    """Return samples of the disk as kernels take them, made in float64."""
    disk = np.ascontiguousarray(points, np.float64)
    half = np.sqrt(np.maximum(1 - (disk[:, 0] * disk[:, 0] + disk[:, 1] * disk[:, 1]), 0))
    extents = half if weights is None else np.asarray(weights, np.float64)
    there = half > 0
    if there.any():
        fractions = normalised(np.where(there, extents, 0))
        by_length = np.divide(fractions, 2 * half, out=np.zeros_like(fractions), where=there)
        areas = np.maximum(normalised(by_length), 2.0**-100)
    else:  # all lines touch the ball in a point
        by_length, areas = np.zeros(len(disk)), np.full(len(disk), 1 / len(disk))
    return Disk(
        places=disk.astype(dtype),
        half=half.astype(dtype),
        weights=(2 * by_length if tangent else by_length).astype(dtype),
        finer=np.array([0.5 * log2(area) for area in areas.tolist()]),
        mirrors=disk_mirrors(options.randomize, options.seed, dtype),
    )


def sample_set(domain: str, n: int, middle: bool = False) -> tuple[FloatArray, Weights]:
    """Return n samples of a domain and their weights; middle: whether a single one stands in the middle."""
    made = repulsion_table(domain, n, centre=True if middle and n == 1 else None)
    return made.points, made.weights


def by_formulas(formulas: Callable[..., Any], tangent: bool) -> dict[str, Any]:
    """Return the functions of an estimator by formulas, whose last parameter is ``tangent``."""
    own = partial(formulas, tangent=tangent)
    return {"run": partial(sum_at_radii, own), "formulas": own, "at_radii": at_radii}


def pair_of(
    name: str, title: str, section: str, formula: str, functions: Callable[[bool], dict[str, Any]], **more: Any
) -> tuple[Estimator, Estimator]:
    """Return an estimator of the whole ball, and the same above the tangent plane (4.4), which reads normals.

    ``functions(tangent)`` has those of either.
    """
    more |= {"turns": True, "formula": formula}
    above, source = f"{title}, above the tangent plane", f"VO {section} and 4.4"
    return (
        Estimator(name=name, title=title, source=f"VO {section}", whole_ball=True, **functions(False), **more),
        Estimator(name=f"{name}-normal", title=above, source=source, normals=True, **functions(True), **more),
    )
