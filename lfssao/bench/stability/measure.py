"""Errors of the kernels on one stiff case in float32 or float64, against exact arithmetic and error bounds."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import floor, inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao import ssao
from lfssao.bench.stability.exact import CrossedSlits, Mapping, Point, exact_image, rational
from lfssao.bench.stability.running_error import EXACT, PROBE, Arithmetic, Tracked

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
    bounded, exactly, probed = (
        case.mapping.steps(*arithmetic) for arithmetic in ((Arithmetic.of(dtype),), (EXACT,), (EXACT, PROBE))
    )
    image, occluded = computed(case, dtype)
    offset = rational(case.offset)
    texels = list(np.ndindex(case.depth.shape)) if case.texels is None else case.texels
    conditions, ulps, errors, bounds = [0.0], [0.0], [0.0], [0.0]
    exceeded = flipped = undecided = 0
    for texel in texels:
        if np.isinf(case.depth[texel]):  # no surface, no samples
            exceeded += bool(occluded[texel])
            continue
        point = rational(case.positions[texel])
        exact = exact_image(exactly, point, offset)
        u, v, z, in_domain = bounded(point, offset)
        doubtful = _is_undecided((u, v, z), in_domain, case.depth, case.step)
        wrong = bool(occluded[texel]) != _is_occluded(exact, case.depth)
        flipped, undecided = flipped + wrong, undecided + doubtful
        over = wrong and not doubtful
        if in_domain is None:
            bounds.append(inf)
        if exact is not None and in_domain:
            # Relative to the coordinate or to one texel, whichever is more: 0 is no harder than another coordinate.
            conditions += [a.error / (PROBE * max(abs(float(a.value)), 1.0)) for a in probed(point, offset)[:2]]
            for ours, right, bound in zip(image[texel], exact[:2], (u, v), strict=True):
                error, in_ulp = error_of(ours, right, dtype)
                over = over or not error <= bound.error
                errors.append(error)
                ulps.append(in_ulp)
                bounds.append(bound.error)
        exceeded += over
    return Measured(max(conditions), max(ulps), max(errors), max(bounds), exceeded, flipped, undecided, len(texels))


def error_of(ours: Any, exact: Fraction, dtype: np.dtype[Any], least: float = 1.0) -> tuple[float, float]:
    """Error of a number, absolute and in ulp of the exact one, or of ``least`` if that is more."""
    error = abs(float(Fraction(float(ours)) - exact)) if np.isfinite(ours) else inf
    return error, error / float(np.spacing(dtype.type(max(abs(float(exact)), least))))


def computed(case: Stiff, dtype: np.dtype[Any]) -> tuple[NDArray[np.floating[Any]], NDArray[np.bool_]]:
    """Image coordinates (H, W, 2) and decisions (H, W) of the kernels; AO of one sample is 0 or 1."""
    to_image, back = case.mapping.to_image, case.mapping.back
    surface = case.depth if case.stored is None else case.stored
    positions, depth = case.positions.astype(dtype), surface.astype(dtype)
    samples, radius = case.offset[None, :], 1.0
    if back is None:
        turn = case.mapping.turn if isinstance(case.mapping, CrossedSlits) else ()
        turns = np.full((*depth.shape, 2), turn, dtype).transpose(2, 0, 1) if turn else None
        decided = ssao.algorithm2(depth, positions, to_image, samples, radius, turns).texture
    else:
        decided = ssao.algorithm1(depth, back, to_image.numbers.reshape(4, 4), samples, radius).texture
    return case.mapping.kernel_image(positions, case.offset.astype(dtype)), decided > 0


def _depth(number: float) -> Fraction:
    """A depth as a fraction; infinity becomes one beyond all samples."""
    return Fraction(float(number)) if number < inf else Fraction(2) ** 900


def _is_occluded(exact: Point | None, depth: NDArray[np.float32]) -> bool:
    if exact is None:
        return False
    u, v, z = exact
    inside = 0 <= u < depth.shape[1] and 0 <= v < depth.shape[0]
    return inside and _depth(depth[floor(v), floor(u)]) < z


def _is_undecided(
    image: tuple[Tracked, Tracked, Tracked], in_domain: bool | None, depth: NDArray[np.float32], step: float
) -> bool:
    """Whether rounding can move the sample into another texel, across its surface or out of the domain."""
    if not in_domain:
        return in_domain is None
    u, v, z = image
    height, width = depth.shape
    columns, rows = _reach(u, width), _reach(v, height)
    if columns is None or rows is None:
        return True
    surfaces = (depth[j, i] if 0 <= i < width and 0 <= j < height else inf for j in rows for i in columns)
    outcomes = {Tracked(_depth(d), step, z.arithmetic).is_less(z) for d in surfaces}
    return None in outcomes or len(outcomes) > 1


def _reach(coordinate: Tracked, size: int) -> range | None:
    """The texels that a coordinate can be rounded into, -1 and size outside the texture; None if all."""
    if coordinate.error > size:
        return None
    error = Fraction(coordinate.error)
    low, high = floor(coordinate.value - error), floor(coordinate.value + error)
    return range(min(max(low, -1), size), min(max(high, -1), size) + 1)
