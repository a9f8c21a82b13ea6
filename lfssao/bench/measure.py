"""One stiff case on both paths: what the kernels make of it, what is exact, and what rounding may do in between."""

from dataclasses import dataclass
from fractions import Fraction
from math import floor, inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao import passes
from lfssao.bench.exact import Point, flat_image, rational, to_physical
from lfssao.bench.running_error import Arithmetic, Tracked
from lfssao.bench.slits import EXACT, SlitsAnalysis
from lfssao.display import Display
from lfssao.kernels import mapping
from lfssao.matrix import Matrix

PATHS = ("float32", "float64")

# Beyond 2^-8 texel a path counts as degraded: what the texture samplers of GPUs resolve.
FINE = 2.0**-8


@dataclass(frozen=True, eq=False)
class Stiff:
    """Points, one sample each, and the texture they are looked up in.

    Attributes
    ----------
    display : Display
        Flat, linear diffuser, one module.
    physical_from_world : (3, 4) float64
        World -> physical.
    positions : (H, W, 3) float64
        World points, one a texel of the module.
    offset : (3,) float64
        The sample's offset from each, world units.
    depth : (H, W) float32
        Surface that the samples are compared with, image z; +infinity: none.
    stored : (H, W) float32 or None
        The same as a file of less depth holds it, which the kernels get instead.
    step : float
        How far the two can be apart.
    """

    display: Display
    physical_from_world: Matrix
    positions: NDArray[np.float64]
    offset: NDArray[np.float64]
    depth: NDArray[np.float32]
    stored: NDArray[np.float32] | None = None
    step: float = 0.0


@dataclass(frozen=True)
class Measured:
    """What one path does to a case.

    Attributes
    ----------
    condition : float
        Condition number of the mapping, the largest over the points.
    ulp, texels : float
        Largest error of an image coordinate; in ulp of the coordinate, or of one texel where that is more.
    bound : float
        The largest bound of such an error by error analysis, texels; infinity where it knows none.
    exceeded : int
        Points whose error is larger than their bound, or whose decision is wrong and not open.
    flipped, open, decisions : int
        Decisions occluded or not that differ from exact ones; that rounding can change; all.
    """

    condition: float
    ulp: float
    texels: float
    bound: float
    exceeded: int
    flipped: int
    open: int
    decisions: int


def measure(case: Stiff, path: str) -> Measured:
    """Errors and decisions of a case in 'float32' or 'float64', against rational arithmetic."""
    dtype = np.dtype(path)
    analysis = SlitsAnalysis(case.display, case.physical_from_world, Arithmetic.of(dtype))
    probe = SlitsAnalysis(case.display, case.physical_from_world, EXACT, probe=True)
    image, occluded = computed(case, dtype)
    offset = rational(case.offset)
    depth = [[_depth(float(d)) for d in row] for row in case.depth]
    conditions, ulps, texels, bounds = [0.0], [0.0], [0.0], [0.0]
    exceeded = flipped = unsure = 0
    for texel in np.ndindex(case.depth.shape):
        if np.isinf(case.depth[texel]):  # no surface, no samples
            exceeded += bool(occluded[texel])
            continue
        point = rational(case.positions[texel])
        there: Point = tuple(a + b for a, b in zip(point, offset, strict=True))  # type: ignore[assignment]
        exact = flat_image(case.display, 0, to_physical(case.physical_from_world, there))
        tracked = analysis.image(point, offset)
        in_domain = analysis.in_domain(tracked[2])
        is_open = _is_open(tracked, in_domain, depth, case.step)
        wrong = bool(occluded[texel]) != _is_occluded(exact, depth)
        flipped, unsure = flipped + wrong, unsure + is_open
        over = wrong and not is_open
        if in_domain is None:
            bounds.append(inf)
        if exact is not None and in_domain:
            conditions.append(probe.condition(point, offset))
            for ours, right, bound in zip(image[texel], exact[:2], tracked[:2], strict=True):
                error = abs(float(Fraction(float(ours)) - right)) if np.isfinite(ours) else inf
                over = over or not error <= bound.error
                texels.append(error)
                ulps.append(error / float(np.spacing(dtype.type(max(abs(float(right)), 1.0)))))
                bounds.append(bound.error)
        exceeded += over
    return Measured(
        max(conditions), max(ulps), max(texels), max(bounds), exceeded, flipped, unsure, case.depth.size
    )  # fmt: skip


def computed(case: Stiff, dtype: np.dtype[Any]) -> tuple[NDArray[np.floating[Any]], NDArray[np.bool_]]:
    """Image coordinates (H, W, 2) and decisions (H, W) of the kernels; Algorithm 2 of one sample decides 0 or 1."""
    to_image = case.display.view(0, case.physical_from_world).world_to_image
    surface = case.depth if case.stored is None else case.stored
    positions, depth = case.positions.astype(dtype), surface.astype(dtype)
    samples, radius = case.offset[None, :], 1.0
    decided = passes.algorithm2(depth, positions, to_image, samples, radius).texture
    m, offset = to_image.as_type(dtype), case.offset.astype(dtype)
    rows = [
        mapping.affine_row.py_func(m, row, *np.moveaxis(positions, -1, 0)) + mapping.linear_row.py_func(m, row, *offset)
        for row in range(3)
    ]  # the kernels' own lines, on arrays
    with np.errstate(all="ignore"):  # outside the domain
        u, v, *_ = mapping.project_crossed_slits.py_func(*rows, *m[12:16])
    return np.stack([u, v], axis=-1), decided > 0


def _depth(number: float) -> Fraction:
    """A depth as what it is; one far beyond all others for infinity, which is beyond all samples."""
    return Fraction(number) if number < inf else Fraction(2) ** 900


def _is_occluded(exact: Point | None, depth: list[list[Fraction]]) -> bool:
    if exact is None:
        return False
    u, v, z = exact
    inside = 0 <= u < len(depth[0]) and 0 <= v < len(depth)
    return inside and depth[floor(v)][floor(u)] < z


def _is_open(
    tracked: tuple[Tracked, Tracked, Tracked], in_domain: bool | None, depth: list[list[Fraction]], step: float
) -> bool:
    """Whether rounding can move the sample into another texel, across its surface or out of the domain."""
    if in_domain is False:
        return False
    u, v, z = tracked
    if in_domain is None:
        return True
    columns, rows = _reach(u, len(depth[0])), _reach(v, len(depth))
    if columns is None or rows is None:
        return True
    outcomes = {
        Tracked(depth[j][i], step).surely(z) if 0 <= i < len(depth[0]) and 0 <= j < len(depth) else False
        for j in rows
        for i in columns
    }
    return None in outcomes or len(outcomes) > 1


def _reach(coordinate: Tracked, size: int) -> range | None:
    """The texels that a coordinate can be rounded into, -1 and size beside the texture; None where all."""
    if coordinate.error > size:
        return None
    error = Fraction(coordinate.error)
    low, high = floor(coordinate.value - error), floor(coordinate.value + error)
    return range(min(max(low, -1), size), min(max(high, -1), size) + 1)
