"""Bounds of ``sao`` and ``sao-equation-1``, pass by pass.

The formulas give the bounds of the sampling pass (``kernels.sums``). Averages increase with their operands, and packed
bytes with the numbers in them. At a depth edge in doubt a renderer may average or not; weights of the bilateral passes
have ends.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.sao.estimator import (
    STRIDE,
    TAPS_RADIUS,
    AnyOptions,
    AppendixOptions,
    Equation1Options,
    SaoOptions,
    sao_numbers,
    scale_of,
)
from lfssao.ao.estimators.sao.hierarchy import z_hierarchy
from lfssao.ao.estimators.sao.texel_rays import texel_rays
from lfssao.ao.kernels.texel_rays import TexelRays
from lfssao.ao.reference import gaussian_weights
from lfssao.core.balls import SAFETY
from lfssao.core.distinct import distinct
from lfssao.core.elementary import power
from lfssao.verify.bounds.bounds import Bounds, FloatArray, down_to_single, exact_bounds, up_to_single
from lfssao.verify.bounds.depth import distance_ends
from lfssao.verify.bounds.error_model import ULP, ErrorModel
from lfssao.verify.bounds.kernels.ball_view import BallLevels
from lfssao.verify.bounds.kernels.sums import LIMITLESS, NO_STORY, bound_sums
from lfssao.verify.bounds.problem import Ends, Problem, ball_view, to_double
from lfssao.verify.bounds.ssao import distance_error, rounded_to_single


def sao(problem: Problem, radius: float) -> Bounds:
    """Bounds of ``sao`` and ``sao-equation-1``."""
    buffers = problem.buffers
    model = problem.model
    options: AnyOptions = (AppendixOptions if "intensity" in problem.options else Equation1Options)(**problem.options)  # type: ignore[arg-type]
    if radius == 0:
        return exact_bounds(np.zeros_like(buffers.depth))
    rays = texel_rays(buffers.view, np.dtype(np.float32))
    z = _linear_z(problem)
    sums, undecided, counts = _sampled(problem, options, rays, radius, z)
    visibility = visibility_of_sum(sums, float(scale_of(options, np.dtype(np.float32))), counts, model)
    visibility = _averaged(visibility, z, options.quad_edge * radius / float(rays.units[2]), model)
    if options.gauss > 0:
        weights = gaussian_weights(options.gauss, TAPS_RADIUS)
        keys = _keys(z, rays.origin, options.z_min, model)
        visibility = _reconstructed(visibility, keys, rounded_to_single(weights), options, model)
    return occlusion_of_visibility(
        visibility, options.k if isinstance(options, Equation1Options) else 1.0, undecided, model
    )


def _sampled(
    problem: Problem, options: AnyOptions, rays: TexelRays, radius: float, z: Ends
) -> tuple[Ends, NDArray[np.int32], FloatArray]:
    """Ends of each texel's sum of terms, the number of its taps in doubt, and the number of terms that may not be 0.

    The sum is unknown where a texel or a neighbour may or may not show a surface.
    """
    surface = problem.surface(0.0, False)
    has_surface = z[1] < np.inf
    low, high, first = _hierarchy(z, rays.origin, options, problem.model)
    view = ball_view(problem.buffers, surface._replace(low=z[0], high=z[1]), problem.model, (), options)._replace(
        depth=np.where(has_surface, 0, np.inf).astype(np.float32).ravel(),
        turned=True,  # renderers make taps by cosine and sine
        rays=to_double(rays),
        levels=BallLevels(low, high, first.astype(np.int32)),
        remade=problem.buffers.view.screen_to_world is not None,
        faces=options.normals == "face",
    )
    numbers = distinct(to_double(sao_numbers(options, rays, radius, problem.buffers.depth)))
    sums = np.zeros((4, *has_surface.shape))
    bound_sums(surface, view, numbers, LIMITLESS, False, True, sums, *NO_STORY)
    doubtful = np.pad((z[0] < np.inf) & ~has_surface, 1)
    near_doubt = (
        doubtful[1:-1, 1:-1] | doubtful[:-2, 1:-1] | doubtful[2:, 1:-1] | doubtful[1:-1, :-2] | doubtful[1:-1, 2:]
    )
    unknown = near_doubt & (z[0] < np.inf)
    sums[0][unknown] = 0
    sums[1][unknown] = LIMITLESS
    sums[2][unknown] = options.taps
    sums[3][unknown] = options.taps
    return (sums[0], sums[1]), sums[2].astype(np.int32), sums[3]


def _linear_z(problem: Problem) -> Ends:
    """Ends of linear z: the depth of a module or a linear camera, else the quotient of a camera's division."""
    view = problem.buffers.view
    depth = problem.buffers.depth.astype(np.float64)
    if view.linear:
        return depth * (1 - distance_error(problem.model)), depth * (1 + distance_error(problem.model))
    return (depth, depth) if view.screen_to_world is None else distance_ends(view, depth, depth, problem.model)


def _hierarchy(
    z: Ends, origin: float, options: SaoOptions, model: ErrorModel
) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """Ends of all levels of z in one array, and the index of each level's first texel.

    A level increases with the one before. Harmonic means of distances that may not be positive are the exception: they
    may be any number between the four. Means round; sums of inverse distances round most.
    """
    mip = options.mip
    ends = []
    mixed = mip == "harmonic" and not (z[0] > origin).all()
    size = max(float(np.max(np.abs(end), initial=0, where=end < np.inf)) for end in z) + abs(origin)
    rounding = (2 * model.quotient + 8 * model.operation) * size if mip in ("arithmetic", "harmonic") else 0.0
    for end, sign, extreme in zip(z, (-1, 1), ("max", "min"), strict=True):
        levels = z_hierarchy(np.ascontiguousarray(end), extreme if mixed else mip, options.max_level, origin)
        ends.append(np.concatenate([(level + sign * k * rounding).ravel() for k, level in enumerate(levels)]))
    return ends[0], ends[1], np.cumsum([0, *(level.size for level in levels[:-1])])


@np.errstate(invalid="ignore")  # of two texels without a surface
def _averaged(visibility: Ends, z: Ends, edge: float, model: ErrorModel) -> Ends:
    """Ends of the 2x2 average, over pairs in rows, then over pairs in columns."""
    averaged = (visibility[0].copy(), visibility[1].copy())
    r = 4 * model.operation
    for axis in (1, 0):
        (a, b), (c, d) = (_texel_pairs(end, axis) for end in averaged)
        (p, q), (s, t) = (_texel_pairs(end, axis) for end in z)
        may = np.maximum(np.maximum(q - s, p - t), 0) * (1 - r) < edge * (1 + r)
        must = np.maximum(s - q, t - p) * (1 + r) < edge * (1 - r)
        least = (a + b) * (0.5 - r)
        most = np.minimum((c + d) * (0.5 + r), 1)
        for low, high in ((a, c), (b, d)):
            low[...] = np.where(must, least, np.where(may, np.minimum(low, least), low))
            high[...] = np.where(must, most, np.where(may, np.maximum(high, most), high))
    return averaged


def _texel_pairs(texture: FloatArray, axis: int) -> Iterator[FloatArray]:
    """Views of the first and of the second texel of each pair along an axis."""
    lines = np.moveaxis(texture, axis, 0)
    return (lines[k : len(lines) // 2 * 2 : 2] for k in (0, 1))


def _keys(z: Ends, origin: float, z_min: float, model: ErrorModel) -> Ends:
    """Ends of the bilateral keys: 0 at the origin to 1 at z_min or the farthest surface; infinity without a surface."""
    r = model.quotient + 6 * model.operation
    distances = [np.maximum(end - float(rounded_to_single(origin)), 0) for end in z]
    ranges = [z_min or float(np.max(end, initial=origin, where=end < np.inf)) - origin for end in z]
    ranges = [size if size > 0 and 1 / size < np.inf else 1.0 for size in ranges]
    low = distances[0] / ranges[1] * (1 - r)
    high = distances[1] / ranges[0] * (1 + r)
    return np.where(z[0] < np.inf, np.minimum(low, 1), np.inf), np.where(z[1] < np.inf, np.minimum(high, 1), np.inf)


def _stored(visibility: Ends, keys: Ends, model: ErrorModel) -> tuple[Ends, Ends]:
    """Ends of A and of the keys after packing into three bytes."""
    r = model.quotient + 4 * model.operation
    ends = []
    for a, key, sign in zip(visibility, keys, (-1, 1), strict=True):
        byte = np.floor(np.clip(a * 255 + 0.5 + sign * 256 * r, 0, 255))
        moved = np.clip(np.where(key < np.inf, key, 0) + sign * r / 64, 0, 1) * 256
        high = np.minimum(np.floor(moved), 255)
        low = np.minimum(np.floor((moved - high) * 255 + 0.5), np.where(high == 255, 254, 255))
        stored = np.where(key < np.inf, (high + low / 255) / 256 * (1 + sign * r), np.inf)
        ends.append((byte / 255 * (1 + sign * r), stored))
    (a, p), (b, q) = ends
    return (a, b), (p, q)


@np.errstate(invalid="ignore")  # of texels without a surface
def _reconstructed(visibility: Ends, keys: Ends, weights: FloatArray, options: SaoOptions, model: ErrorModel) -> Ends:
    """Ends of A after both passes: in the largest mean, values above a pivot have largest weights, the others least."""
    r = 4 * model.operation
    sharpness = float(rounded_to_single(options.sharpness))
    for axis in (1, 0):
        if options.packed:
            visibility, keys = _stored(visibility, keys, model)
        least = []
        most = []
        for tap, weight in enumerate(weights.tolist()):
            offset = STRIDE * (tap - TAPS_RADIUS)
            low, high = (_shifted(end, offset, axis) for end in keys)
            least_difference = np.fmax(np.fmax(low - keys[1], keys[0] - high), 0) * (offset != 0)
            largest_difference = np.fmax(high - keys[0], keys[1] - low) if offset else least_difference
            most.append(weight * np.maximum(1 - sharpness * least_difference * (1 - r) + r, 0))
            least.append(weight * np.maximum(1 - sharpness * largest_difference * (1 + r) - r, 0))
        ends = []
        for sign, end in zip((-1, 1), visibility, strict=True):
            values = np.array([_shifted(end, STRIDE * k, axis, 1.0) for k in range(-TAPS_RADIUS, TAPS_RADIUS + 1)])
            means = [_mean(values, np.where(sign * (values - pivot) >= 0, most, least)) for pivot in values]
            mean = sign * np.max(sign * np.array(means), axis=0) * (1 + sign * (model.quotient + 24 * model.operation))
            ends.append(np.where(keys[0] < np.inf, np.maximum(mean, 0), 1.0))
        visibility = ends[0], ends[1]
    return visibility


def _mean(layers: FloatArray, weights: FloatArray) -> FloatArray:
    """Weighted mean of layers, (L, H, W), added from the first to the last, so that bits are equal everywhere."""
    return np.asarray(np.cumsum(weights * layers, axis=0)[-1] / np.cumsum(weights, axis=0)[-1])


def _shifted(texture: FloatArray, offset: int, axis: int, fill: float = np.inf) -> FloatArray:
    """The texture shifted by ``offset`` texels along an axis; ``fill`` stands beyond the border."""
    padding = [(abs(offset), abs(offset)) if k == axis else (0, 0) for k in range(2)]
    padded = np.pad(texture, padding, constant_values=fill)
    return np.take(padded, abs(offset) + offset + np.arange(texture.shape[axis]), axis)


def sum_error(n: Any, model: ErrorModel) -> Any:
    """Relative error of a sum of n terms, added in any order, times a factor from a quotient and four products."""
    return ((n + 3) * model.operation * (1 + (n + 3) * model.operation) + model.quotient) * SAFETY


def visibility_of_sum(sums: Ends, scale: float, n: Any, model: ErrorModel) -> Ends:
    """Ends of max(0, 1 - scale sum) for sums of n terms."""
    relative_error = sum_error(n, model)
    low = scale * sums[0] * (1 - relative_error)
    high = scale * sums[1] * (1 + relative_error)
    least = np.where(high > 0, np.maximum(1 - high, 0) * (1 - model.operation * SAFETY), 1.0)
    return least, np.minimum(np.maximum(1 - low, 0) * (1 + model.operation * SAFETY), 1)


def occlusion_of_visibility(visibility: Ends, k: float, undecided: NDArray[np.int32], model: ErrorModel) -> Bounds:
    """Bounds of 1 - A^k; A lies between its ends and exceeds 1 only by rounding."""
    low = 1 - _power_end(visibility[1], k, 1, model)
    high = 1 - _power_end(visibility[0], k, -1, model)
    rounding = model.operation * SAFETY
    upper = np.minimum(high * (1 + rounding), 1)
    return Bounds(up_to_single(low - rounding * np.abs(low)), down_to_single(upper), undecided)


def _power_end(visibility: FloatArray, k: float, sign: int, model: ErrorModel) -> FloatArray:
    """Lower (sign -1) or upper (1) ends of exp2(k log2 A); log2 is off by 2^-21, below 1/2 by 3 ulp (Vulkan)."""
    if k == 1:
        return visibility
    constant, slope = model.exponential
    steps = k * (1 - np.frexp(visibility)[1])  # k |log2 A| at most
    relative_error = constant + k * 2.0**-21 + steps * (slope + 5 * ULP) + 2 * k * np.maximum(visibility - 1, 0)
    powers = np.array([power(min(a, 1.0), k) for a in visibility.ravel().tolist()]).reshape(visibility.shape)
    return np.maximum(powers * (1 + sign * relative_error), 0) if k else powers
