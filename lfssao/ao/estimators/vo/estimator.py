"""Volumetric Obscurance (VO, Loos and Sloan 2010) by points, lines and areas.

VO's V(P) is the open volume around P, not normalised. Occlusion here is 1 - V / V_0, V_0 the volume of the ball, or of
half of it where the tangent plane bounds what counts (4.4). So a surface that is plane within R gives 1/2 by the ball
and 0 by the half ball.

What every sample set tends to for n -> infinity, where it fills the ball (or disk) evenly and the view is parallel, is
the share of the ball behind the surface. In units of R, with c(a) = (1 - a)^2 (2 + a) / 4 the share of the unit ball
beyond a plane at the distance a from its middle:

- plane through P: 1/2. The half ball: 0.
- concave right-angle crease at the distance a <= 1 from P along one wall: 1/2 + c(a) / 2, as the other wall cuts a cap
  off of which half lies before the first wall: 3/4 in the crease. The half ball, of half the volume: c(a); 1/2 in the
  crease, 0 from a = 1 on.
- convex right-angle crease likewise: 1/2 - c(a) / 2, 1/4 on the edge. The half ball: 0.
- floor at the distance a before a step up of at least R: 1/2 + c(a) / 2, the half ball c(a). A half-space whose surface
  is a distance a before P, which is not on it: 1 - c(a).
- top of a sphere of radius s >= 1: 1/2 - 3 / (16 s), the half ball 0. Beside a sphere on a plane the share behind, the
  sphere's shadow along the view being a solid, has no shorter form.

All are independent of the surface's slant to the viewer as long as the view sees all of the surface within R. Dual
radii (section 6) are made of two such values: V of the product is V_1 V_2, of the minimum min(V_1, V_2).
"""

from collections.abc import Callable
from math import inf, sqrt
from typing import Any

import numpy as np

from lfssao.ao import passes
from lfssao.ao.estimators.estimator import Estimator, FloatArray, Run, Value
from lfssao.ao.estimators.vo.kernels import area as volumetric_area
from lfssao.ao.estimators.vo.kernels import lines as volumetric_lines
from lfssao.ao.estimators.vo.kernels import points as volumetric_points
from lfssao.ao.estimators.vo.local_frame import Surroundings, ball_mirrors, disk_turns
from lfssao.ao.estimators.vo.pyramid import moment_pyramid
from lfssao.ao.kernels.merge import merge_product
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import log2
from lfssao.core.sums import sum_in_order
from lfssao.errors import InputError
from lfssao.samples import repulsion_table


def points_run(tangent: bool) -> Run:
    """Point sampling (VO sections 3 and 4, after Crytek and Blizzard), above the tangent plane or in the whole ball.

    Parameters
    ----------
    tangent : bool
        Whether points below the tangent plane are reflected by it (4.4).

    Returns
    -------
    run(buffers, radius, points, weights, thickness, second, combine, randomize, seed)
        points: (n, 3), offsets in the unit ball, world axes. weights: volumes of the points' cells (4.5), by default
        all the same. thickness: how far behind its depth a surface hides (4.3), along the viewing direction, world
        units; 0: without end. second: another radius in units of R (section 6); 0: none. combine: two radii by the
        'product' of their V, or the 'minimum' of them, which is the larger occlusion. randomize: whether the offsets
        are reflected about directions that differ between the texels of tiles of 4 x 4 (4.5). seed: of those.
        It raises InputError if a weight is negative or none is positive.
    """

    def run(
        buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None,
        thickness: float, second: float, combine: str, randomize: bool, seed: int,
    ) -> passes.Occlusion:  # fmt: skip
        """Point sampling; ``points_run`` says what is what."""
        near, dtype = Surroundings.of(buffers), buffers.depth.dtype
        ball = np.ascontiguousarray(points, dtype)
        shares = _normalised(np.ones(len(points)) if weights is None else np.asarray(weights, np.float64))
        mirrors = ball_mirrors(randomize, seed, dtype)

        def at(r: float) -> passes.Occlusion:
            occlusion, outside = np.empty_like(near.depth), np.empty(near.depth.shape[0], np.int64)
            volumetric_points.point_occlusion(
                near.depth, near.positions, near.directions, near.normals, tangent, near.kind, near.rows, near.lens,
                dtype.type(r), mirrors, ball, shares.astype(dtype), dtype.type(_in_radii(thickness, r)),
                occlusion, outside,
            )  # fmt: skip
            return passes.Occlusion(occlusion, int(outside.sum()))

        return _dual(at, radius, second, combine)

    return run


def lines_run(tangent: bool) -> Run:
    """Line sampling (VO section 4.1), above the tangent plane or in the whole ball.

    Parameters
    ----------
    tangent : bool
        Whether lines end at the tangent plane (4.4).

    Returns
    -------
    run(buffers, radius, points, weights, thickness, second, combine, randomize, seed)
        points: (n, 2), places of the lines in the unit disk. weights: integrals of the ball's extent in z over the
        lines' cells (4.5), of which each line's hidden *fraction* is taken (its hidden length times such a weight
        would count z_s twice); by default z_s at the line, for cells of equal area. A line of no length weighs
        nothing. randomize: whether the disk is reflected. All else as for ``points_run``.
    """

    def run(
        buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None,
        thickness: float, second: float, combine: str, randomize: bool, seed: int,
    ) -> passes.Occlusion:  # fmt: skip
        """Line sampling; ``lines_run`` says what is what."""
        near, dtype = Surroundings.of(buffers), buffers.depth.dtype
        disk, half, _, hidden = _disk(points, weights, tangent)
        turns = disk_turns(randomize, seed, dtype)

        def at(r: float) -> passes.Occlusion:
            occlusion, outside = np.empty_like(near.depth), np.empty(near.depth.shape[0], np.int64)
            volumetric_lines.line_occlusion(
                near.depth, near.positions, near.directions, near.normals, tangent, near.kind, near.rows, near.lens,
                near.right, dtype.type(r), turns, disk.astype(dtype), half.astype(dtype), hidden.astype(dtype),
                dtype.type(_in_radii(thickness, r)), occlusion, outside,
            )  # fmt: skip
            return passes.Occlusion(occlusion, int(outside.sum()))

        return _dual(at, radius, second, combine)

    return run


def area_run(tangent: bool) -> Run:
    """Area sampling (VO section 4.2), above the tangent plane or in the whole ball.

    Parameters
    ----------
    tangent : bool
        Whether lines end at the tangent plane (4.4).

    Returns
    -------
    run(buffers, radius, points, weights, thickness, second, combine, randomize, seed, half_width, prefilter)
        points: (n, 2), the middles of the areas in the unit disk; an area is in proportion to the sample's weight over
        z_s at its place. half_width: of the box that stands for the distribution of depth, in units of its standard
        deviation; VO's footnote wants the same variance, sqrt(3), the a and b that it prints imply 1. prefilter:
        whether the pyramid's steps blur by [1 2 1] / 4 before they average, VO's remedy for visible squares, which
        makes the deviation larger. All else as for ``lines_run``.
    """

    def run(
        buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None,
        thickness: float, second: float, combine: str, randomize: bool, seed: int, half_width: float, prefilter: bool,
    ) -> passes.Occlusion:  # fmt: skip
        """Area sampling; ``area_run`` says what is what."""
        near, dtype = Surroundings.of(buffers), buffers.depth.dtype
        disk, half, areas, hidden = _disk(points, weights, tangent)
        finer = np.array([0.5 * log2(area) for area in areas.tolist()])
        turns, pyramid = disk_turns(randomize, seed, dtype), moment_pyramid(near.depth, prefilter)

        def at(r: float) -> passes.Occlusion:
            occlusion, outside = np.empty_like(near.depth), np.empty(near.depth.shape[0], np.int64)
            reach = min(_in_radii(thickness, r), 4 * volumetric_area.FAR)
            volumetric_area.area_occlusion(
                near.depth, near.positions, near.directions, near.normals, tangent, near.kind, near.rows, near.lens,
                near.right, dtype.type(r), turns, disk.astype(dtype), half.astype(dtype), hidden.astype(dtype), finer,
                pyramid.moments, pyramid.starts, pyramid.pitches, half_width, dtype.type(reach), occlusion, outside,
            )  # fmt: skip
            return passes.Occlusion(occlusion, int(outside.sum()))

        return _dual(at, radius, second, combine)

    return run


def _in_radii(thickness: float, radius: float) -> float:
    """A thickness in units of R; infinite for none, and where R is 0."""
    return thickness / radius if thickness > 0 < radius else inf


def _dual(at: Callable[[float], passes.Occlusion], radius: float, second: float, combine: str) -> passes.Occlusion:
    """Occlusion at R, or at R and a second radius together (VO section 6)."""
    first = at(radius)
    if second == 0:
        return first
    other = at(second * radius)
    if combine == "minimum":
        texture = passes.merge([first.texture, other.texture])
    else:
        texture = np.empty_like(first.texture)
        merge_product(first.texture, other.texture, texture)
    return passes.Occlusion(texture, first.outside + other.outside)


def _normalised(weights: FloatArray) -> FloatArray:
    """Weights over their sum, added from the first to the last."""
    if not (weights >= 0).all():
        raise InputError("weights: one is negative")
    total = sum_in_order(weights.tolist())
    if not 0 < total < inf:
        raise InputError(f"weights: their sum is {total}, it must be positive and finite")
    shares: FloatArray = weights / total
    return shares


def _disk(points: Any, weights: Any, tangent: bool) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Places in the disk, z_s, shares of the disk's area, and what a unit of hidden length weighs; float64."""
    disk = np.ascontiguousarray(points, np.float64)
    half = np.sqrt(np.maximum(1 - (disk[:, 0] * disk[:, 0] + disk[:, 1] * disk[:, 1]), 0))
    extents = half if weights is None else np.asarray(weights, np.float64)
    there = half > 0
    if not there.any():  # all lines touch the ball in a point
        return disk, half, np.full(len(disk), 1 / len(disk)), np.zeros(len(disk))
    shares = _normalised(np.where(there, extents, 0))
    by_length = np.divide(shares, 2 * half, out=np.zeros_like(shares), where=there)
    areas = np.maximum(_normalised(by_length), 2.0**-100)
    return disk, half, areas, 2 * by_length if tangent else by_length


def _ball_samples(n: int) -> tuple[FloatArray, FloatArray | None]:
    made = repulsion_table("ball", n)
    return made.points, made.weights


def _disk_samples(n: int) -> tuple[FloatArray, FloatArray | None]:
    made = repulsion_table("disk", n)
    return made.points, made.weights


def _area_samples(n: int) -> tuple[FloatArray, FloatArray | None]:
    """One sample stands in the middle."""
    made = repulsion_table("disk", n, centre=True if n == 1 else None)
    return made.points, made.weights


# A thickness of 0 stands for surfaces that hide all that is behind them, a second radius of 0 for none.
_PARAMETERS: dict[str, Value] = {"thickness": 0.0, "second": 0.0, "combine": "product", "randomize": True, "seed": 0}
_LIMITS = {"thickness": (0.0, inf), "second": (0.0, 1e6), "seed": (0, 2**32 - 1)}
_CHOICES = {"combine": ("product", "minimum")}


def _pair(name: str, title: str, section: str, run: Callable[[bool], Run], **fields: Any) -> tuple[Estimator, ...]:
    """An estimator, and the same above the tangent plane (4.4), which reads normals."""
    common: dict[str, Any] = {"parameters": _PARAMETERS, "limits": _LIMITS, "choices": _CHOICES, **fields}
    return (
        Estimator(name=name, title=title, source=f"VO {section}", run=run(False), **common),
        Estimator(
            name=f"{name}-normal",
            title=f"{title}, above the tangent plane",
            source=f"VO {section} and 4.4",
            run=run(True),
            normals=True,
            **common,
        ),
    )


ENTRIES = (
    *_pair(
        "vo-points",
        "hidden share of the ball, by points",
        "sections 3, 4",
        points_run,
        samples=_ball_samples,
        count=12,
        texel_bytes=28,
    ),
    *_pair(
        "vo-lines",
        "hidden share of the ball, by lines",
        "section 4.1",
        lines_run,
        samples=_disk_samples,
        dimensions=2,
        count=5,
        texel_bytes=28,
    ),
    *_pair(
        "vo-area",
        "hidden share of the ball, by mean and variance of depth",
        "section 4.2",
        area_run,
        samples=_area_samples,
        dimensions=2,
        count=1,
        texel_bytes=61,
        parameters={**_PARAMETERS, "half_width": sqrt(3.0), "prefilter": False},
        limits={**_LIMITS, "half_width": (0.0, 100.0)},
    ),
)
