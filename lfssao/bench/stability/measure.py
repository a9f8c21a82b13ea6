"""Errors of the kernels on one stiff case in float32 or float64, against exact arithmetic and error bounds."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import floor, inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao import ssao
from lfssao.ao.kernels import ssao as kernels
from lfssao.bench.stability.exact import Image, Mapping
from lfssao.bench.stability.running_error import EXACT, PROBED, Arithmetic, Tracked
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.view import WorldToImage

Texture = NDArray[np.floating[Any]]

PATHS = ("float32", "float64")

# A path counts as degraded beyond 2^-8 texel, the resolution of the texture samplers of GPUs.
FINE = 2.0**-8


@dataclass(frozen=True, eq=False)
class Stiff:
    """Points, one sample each, and the texture they are looked up in."""

    mapping: Mapping  # one module or camera
    # (H, W, 3) float64: world points, one a texel of the module; for a camera its texels' u, v and depth
    positions: NDArray[np.float64]
    offset: NDArray[np.float64]  # (3,) float64: the sample's offset from each, world units
    depth: NDArray[np.float32]  # (H, W) float32: surface that the samples are compared with, image z; +infinity: none
    # (H, W) float32 or None: the same in a format of fewer bits, which the kernels get instead
    stored: NDArray[np.float32] | None = None
    step: float = 0.0  # largest distance between the two
    texels: Sequence[tuple[int, int]] | None = None  # rows and columns of the texels to measure; None: all


@dataclass(frozen=True)
class Measured:
    """Errors of one path on a case, of image coordinates in texels or of occlusion."""

    condition: float | None  # condition number of the mapping, the largest over the points
    ulp: float | None  # the largest error in ulp of the coordinate or of one texel, whichever is more
    error: float  # the largest
    bound: float  # of it by error analysis, infinity if there is none; of an occlusion's RMS error as stated
    exceeded: int  # points whose error is larger than their bound, or whose decision is wrong and not undecided
    flipped: int  # decisions (occluded or not) that differ from exact ones
    undecided: int  # decisions that rounding can change
    decisions: int
    rms: float | None = None  # RMS error of an occlusion


def measure(case: Stiff, path: str) -> Measured:
    """Measure errors and decisions of a case in 'float32' or 'float64'."""
    dtype = np.dtype(path)
    works = Arithmetic.of(dtype), EXACT, PROBED
    bounded, exactly, probed = (case.mapping.steps(work) for work in works)
    image, occluded = computed(case, dtype)
    texels = list(np.ndindex(case.depth.shape)) if case.texels is None else case.texels
    found = [(0.0, 0.0, 0.0, 0.0)]  # condition, ulp, error and bound of each coordinate
    exceeded = flipped = undecided = 0
    for texel in texels:
        if np.isinf(case.depth[texel]):  # no surface, no samples
            exceeded += bool(occluded[texel])
            continue
        sample = case.positions[texel], case.offset
        exact, rounded = exactly(*sample), bounded(*sample)
        right, possible = _decisions(exact, case.depth, 0.0), _decisions(rounded, case.depth, case.step)
        wrong, doubtful = right != {bool(occluded[texel])}, None in possible or len(possible) > 1
        flipped, undecided = flipped + wrong, undecided + doubtful
        over = wrong and not doubtful
        if rounded[3] is None:
            found.append((0.0, 0.0, 0.0, inf))
        if exact[3] and rounded[3]:
            for ours, a, bound, off in zip(image[texel], exact[:2], rounded[:2], probed(*sample)[:2], strict=True):
                error, ulp = error_of(ours, a.value, dtype)
                over = over or not error <= bound.error
                # Relative to the coordinate or to a texel, whichever is more: 0 is no harder than another coordinate.
                condition = off.error / (PROBED.probe * max(abs(float(a.value)), 1.0))
                found.append((condition, ulp, error, bound.error))
        exceeded += over
    conditions, ulps, errors, bounds = zip(*found, strict=True)
    return Measured(max(conditions), max(ulps), max(errors), max(bounds), exceeded, flipped, undecided, len(texels))


def error_of(ours: Any, exact: Fraction, dtype: np.dtype[Any], least: float = 1.0) -> tuple[float, float]:
    """Error of a number, absolute and in ulp of the exact one, or of ``least`` if that is more."""
    error = abs(float(Fraction(float(ours)) - exact)) if np.isfinite(ours) else inf
    return error, error / float(np.spacing(dtype.type(max(abs(float(exact)), least))))


def computed(case: Stiff, dtype: np.dtype[Any]) -> tuple[Texture, NDArray[np.bool_]]:
    """Image coordinates (H, W, 2) and decisions (H, W) of the kernels; AO of one sample is 0 or 1."""
    view, turn = case.mapping.view, case.mapping.turn
    surface = case.depth if case.stored is None else case.stored
    positions, depth = case.positions.astype(dtype), surface.astype(dtype)
    if view.screen_to_world is not None:  # Algorithm 1
        positions = ssao.unprojected(depth, view.screen_to_world)
    turns = np.full((*depth.shape, 2), turn, dtype).transpose(2, 0, 1) if turn else None
    decided = ssao.algorithm2(depth, positions, view.world_to_image, case.offset[None, :], 1.0, turns).texture
    return _kernel_image(view.world_to_image, positions, case.offset.astype(dtype), turn), decided > 0


def _kernel_image(to_image: WorldToImage, positions: Texture, offset: Texture, turn: Sequence[float]) -> Texture:
    """U and v of points + offset, (H, W, 2), by the kernels' own lines, on arrays; any numbers outside the domain."""
    projection = to_image.as_type(positions.dtype)
    kind, m = projection
    if kind == mapping.DISPLAY:
        points = np.ascontiguousarray((positions + offset).reshape(-1, 3))
        image = np.empty_like(points)
        mapping.land(projection, points, image)
        return image[:, :2].reshape(*positions.shape[:-1], 2)
    affine, way = mapping.affine_row.py_func, kernels.offset_row.py_func
    places: Any = np.moveaxis(positions, -1, 0)
    with np.errstate(all="ignore"):  # outside the domain
        turns = np.array(turn, m.dtype)[:, None] if turn else None
        ways = kernels.transform_offsets.py_func(offset[None, :], projection, turns)
        rows = (affine(m, row, *places) + way(ways, 0, row, turns, turns, 0) for row in range(4))
        if kind == mapping.MATRIX:
            u, v, *_ = mapping.project_matrix.py_func(*rows)
        else:
            a, b, c, _ = rows
            u, v, *_ = mapping.project_crossed_slits.py_func(mapping.slits_of.py_func(m), a, b, c)
    return np.stack([u, v], axis=-1)


def _decisions(image: Image, depth: Texture, step: float) -> set[bool | None]:
    """Whether a sample is occluded: all answers that errors of its image and of depths, up to a step, can lead to.

    None stands for both: where rounding may move it out of the domain, over the whole texture or past a surface.
    """
    u, v, z, in_domain = image
    if not in_domain:
        return {in_domain}
    height, width = depth.shape
    columns, rows = _reach(u, width), _reach(v, height)
    if columns is None or rows is None:
        return {None}
    surfaces = (depth[j, i] if 0 <= i < width and 0 <= j < height else inf for j in rows for i in columns)
    return {d < inf and Tracked(Fraction(float(d)), step, z.arithmetic).is_less(z) for d in surfaces}


def _reach(coordinate: Tracked, size: int) -> range | None:
    """The texels that a coordinate can be rounded into, -1 and size outside the texture; None if all."""
    if coordinate.error > size:
        return None
    error = Fraction(coordinate.error)
    low, high = floor(coordinate.value - error), floor(coordinate.value + error)
    return range(min(max(low, -1), size), min(max(high, -1), size) + 1)
