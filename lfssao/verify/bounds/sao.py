"""Bounds of ``sao`` and ``sao-equation-1``, pass by pass.

The sampling pass is that of its formulas (``kernels.sums``). Averages grow with the numbers that go in, and bytes with
those packed into them. An average over a depth edge in doubt may be made or not; weights of bilateral passes have ends.
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
from lfssao.verify.bounds.bounds import Bounds, FloatArray, down_to_single, exactly, up_to_single
from lfssao.verify.bounds.depth import distance_ends
from lfssao.verify.bounds.error_model import ULP, ErrorModel
from lfssao.verify.bounds.kernels.ball_view import BallLevels
from lfssao.verify.bounds.kernels.sums import LIMITLESS, NO_STORY, bound_sums
from lfssao.verify.bounds.problem import Ends, Problem, ball_view, held
from lfssao.verify.bounds.ssao import distance_error, single


def sao(given: Problem, radius: float) -> Bounds:
    """Bounds of ``sao`` and ``sao-equation-1``."""
    seen, model = given.seen, given.model
    options: AnyOptions = (AppendixOptions if "intensity" in given.options else Equation1Options)(**given.options)  # type: ignore[arg-type]
    if radius == 0:
        return exactly(np.zeros_like(seen.depth))
    rays, z = texel_rays(seen.view, np.dtype(np.float32)), _linear_z(given)
    sums, undecided, terms = _sampled(given, options, rays, radius, z)
    light = left_of(sums, float(scale_of(options, np.dtype(np.float32))), terms, model)
    light = _averaged(light, z, options.quad_edge * radius / float(rays.units[2]), model)
    if options.gauss > 0:
        weights = gaussian_weights(options.gauss, TAPS_RADIUS)
        keys = _keys(z, rays.origin, options.z_min, model)
        light = _reconstructed(light, keys, single(weights), options, model)
    return lacking(light, options.k if isinstance(options, Equation1Options) else 1.0, undecided, model)


def _sampled(
    given: Problem, options: AnyOptions, rays: TexelRays, radius: float, z: Ends
) -> tuple[Ends, NDArray[np.int32], FloatArray]:
    """Ends of each texel's sum of terms, its taps in doubt, and how many terms may not be 0.

    Nothing is known where it is in doubt whether a texel, or the next one, shows a surface.
    """
    seen, there = given.surface(0.0, False), z[1] < np.inf
    low, high, first = _hierarchy(z, rays.origin, options, given.model)
    view = ball_view(given.seen, seen._replace(low=z[0], high=z[1]), given.model, (), options)._replace(
        depth=np.where(there, 0, np.inf).astype(np.float32).ravel(),
        turned=True,  # renderers make taps by cosine and sine
        rays=held(rays),
        levels=BallLevels(low, high, first.astype(np.int32)),
        remade=given.seen.view.screen_to_world is not None,
        faces=options.normals == "face",
    )
    numbers = distinct(held(sao_numbers(options, rays, radius, given.seen.depth)))
    sums = np.zeros((4, *there.shape))
    bound_sums(seen, view, numbers, LIMITLESS, False, True, sums, *NO_STORY)
    doubt = np.pad((z[0] < np.inf) & ~there, 1)
    around = doubt[1:-1, 1:-1] | doubt[:-2, 1:-1] | doubt[2:, 1:-1] | doubt[1:-1, :-2] | doubt[1:-1, 2:]
    unknown = around & (z[0] < np.inf)
    sums[0][unknown], sums[1][unknown], sums[2][unknown], sums[3][unknown] = 0, LIMITLESS, options.taps, options.taps
    return (sums[0], sums[1]), sums[2].astype(np.int32), sums[3]


def _linear_z(given: Problem) -> Ends:
    """Ends of linear z: the depth of a module or a linear camera, or what a camera's division makes of it."""
    view, depth = given.seen.view, given.seen.depth.astype(np.float64)
    if view.linear:
        return depth * (1 - distance_error(given.model)), depth * (1 + distance_error(given.model))
    return (depth, depth) if view.screen_to_world is None else distance_ends(view, depth, depth, given.model)


def _hierarchy(
    z: Ends, origin: float, options: SaoOptions, model: ErrorModel
) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """Ends of the levels of z, one after the other, and the place of each level's first texel.

    A level grows with the one before, but for harmonic means where a distance may not be positive: these are any number
    between the four. Means round, sums of inverse distances most.
    """
    mip, made = options.mip, []
    mixed = mip == "harmonic" and not (z[0] > origin).all()
    size = max(float(np.max(np.abs(end), initial=0, where=end < np.inf)) for end in z) + abs(origin)
    off = (2 * model.quotient + 8 * model.operation) * size if mip in ("arithmetic", "harmonic") else 0.0
    for end, sign, extreme in zip(z, (-1, 1), ("max", "min"), strict=True):
        levels = z_hierarchy(np.ascontiguousarray(end), extreme if mixed else mip, options.max_level, origin)
        made.append(np.concatenate([(level + sign * k * off).ravel() for k, level in enumerate(levels)]))
    return made[0], made[1], np.cumsum([0, *(level.size for level in levels[:-1])])


@np.errstate(invalid="ignore")  # of two texels without a surface
def _averaged(light: Ends, z: Ends, edge: float, model: ErrorModel) -> Ends:
    """Ends of the 2x2 average: of pairs in rows, then in columns."""
    made, r = (light[0].copy(), light[1].copy()), 4 * model.operation
    for axis in (1, 0):
        (a, b), (c, d) = (_halves(end, axis) for end in made)
        (p, q), (s, t) = (_halves(end, axis) for end in z)
        may = np.maximum(np.maximum(q - s, p - t), 0) * (1 - r) < edge * (1 + r)
        must = np.maximum(s - q, t - p) * (1 + r) < edge * (1 - r)
        least, most = (a + b) * (0.5 - r), np.minimum((c + d) * (0.5 + r), 1)
        for low, high in ((a, c), (b, d)):
            low[...] = np.where(must, least, np.where(may, np.minimum(low, least), low))
            high[...] = np.where(must, most, np.where(may, np.maximum(high, most), high))
    return made


def _halves(texture: FloatArray, axis: int) -> Iterator[FloatArray]:
    """The first and the second of each pair of texels along an axis, as parts of the texture."""
    lines = np.moveaxis(texture, axis, 0)
    return (lines[k : len(lines) // 2 * 2 : 2] for k in (0, 1))


def _keys(z: Ends, origin: float, z_min: float, model: ErrorModel) -> Ends:
    """Ends of the bilateral passes' keys: 0 at the origin to 1 at z_min or the farthest surface, +infinity for none."""
    r, away = model.quotient + 6 * model.operation, [np.maximum(end - float(single(origin)), 0) for end in z]
    far = [z_min or float(np.max(end, initial=origin, where=end < np.inf)) - origin for end in z]
    far = [each if each > 0 and 1 / each < np.inf else 1.0 for each in far]
    low, high = away[0] / far[1] * (1 - r), away[1] / far[0] * (1 + r)
    return np.where(z[0] < np.inf, np.minimum(low, 1), np.inf), np.where(z[1] < np.inf, np.minimum(high, 1), np.inf)


def _stored(light: Ends, keys: Ends, model: ErrorModel) -> tuple[Ends, Ends]:
    """Ends of A and keys after their three bytes."""
    r, made = model.quotient + 4 * model.operation, []
    for a, key, sign in zip(light, keys, (-1, 1), strict=True):
        byte = np.floor(np.clip(a * 255 + 0.5 + sign * 256 * r, 0, 255))
        moved = np.clip(np.where(key < np.inf, key, 0) + sign * r / 64, 0, 1) * 256
        high = np.minimum(np.floor(moved), 255)
        low = np.minimum(np.floor((moved - high) * 255 + 0.5), np.where(high == 255, 254, 255))
        stored = np.where(key < np.inf, (high + low / 255) / 256 * (1 + sign * r), np.inf)
        made.append((byte / 255 * (1 + sign * r), stored))
    (a, p), (b, q) = made
    return (a, b), (p, q)


@np.errstate(invalid="ignore")  # of texels without a surface
def _reconstructed(light: Ends, keys: Ends, weights: FloatArray, options: SaoOptions, model: ErrorModel) -> Ends:
    """Ends of A after both passes: the largest mean has largest numbers with their largest weights, others' least."""
    r, sharpness = 4 * model.operation, float(single(options.sharpness))
    for axis in (1, 0):
        if options.packed:
            light, keys = _stored(light, keys, model)
        least, most = [], []
        for tap, weight in enumerate(weights.tolist()):
            off = STRIDE * (tap - TAPS_RADIUS)
            low, high = (_shifted(end, off, axis) for end in keys)
            near = np.fmax(np.fmax(low - keys[1], keys[0] - high), 0) * (off != 0)
            far = np.fmax(high - keys[0], keys[1] - low) if off else near
            most.append(weight * np.maximum(1 - sharpness * near * (1 - r) + r, 0))
            least.append(weight * np.maximum(1 - sharpness * far * (1 + r) - r, 0))
        ends = []
        for sign, end in zip((-1, 1), light, strict=True):
            numbers = np.array([_shifted(end, STRIDE * k, axis, 1.0) for k in range(-TAPS_RADIUS, TAPS_RADIUS + 1)])
            means = [_mean(numbers, np.where(sign * (numbers - edge) >= 0, most, least)) for edge in numbers]
            mean = sign * np.max(sign * np.array(means), axis=0) * (1 + sign * (model.quotient + 24 * model.operation))
            ends.append(np.where(keys[0] < np.inf, np.maximum(mean, 0), 1.0))
        light = ends[0], ends[1]
    return light


def _mean(numbers: FloatArray, weights: FloatArray) -> FloatArray:
    """Weighted mean of layers, (L, H, W), added from the first to the last: equal bits anywhere."""
    return np.asarray(np.cumsum(weights * numbers, axis=0)[-1] / np.cumsum(weights, axis=0)[-1])


def _shifted(texture: FloatArray, off: int, axis: int, beyond: float = np.inf) -> FloatArray:
    """The texels so many places on along an axis, and a number beyond the border."""
    room = [(abs(off), abs(off)) if k == axis else (0, 0) for k in range(2)]
    wide = np.pad(texture, room, constant_values=beyond)
    return np.take(wide, abs(off) + off + np.arange(texture.shape[axis]), axis)


def growth(n: Any, model: ErrorModel) -> Any:
    """Relative error of a sum of n terms added in any order, times a number made by a quotient and four products."""
    return ((n + 3) * model.operation * (1 + (n + 3) * model.operation) + model.quotient) * SAFETY


def left_of(sums: Ends, scale: float, n: Any, model: ErrorModel) -> Ends:
    """Ends of max(0, 1 - scale sum), of n terms."""
    relative = growth(n, model)
    low, high = scale * sums[0] * (1 - relative), scale * sums[1] * (1 + relative)
    least = np.where(high > 0, np.maximum(1 - high, 0) * (1 - model.operation * SAFETY), 1.0)
    return least, np.minimum(np.maximum(1 - low, 0) * (1 + model.operation * SAFETY), 1)


def lacking(light: Ends, k: float, undecided: NDArray[np.int32], model: ErrorModel) -> Bounds:
    """Bounds of 1 - A^k, A between ends, 1 but for rounding at most."""
    low, high = 1 - _raised(light[1], k, 1, model), 1 - _raised(light[0], k, -1, model)
    off = model.operation * SAFETY
    return Bounds(up_to_single(low - off * np.abs(low)), down_to_single(np.minimum(high * (1 + off), 1)), undecided)


def _raised(light: FloatArray, k: float, sign: int, model: ErrorModel) -> FloatArray:
    """Lower (sign -1) or upper (1) ends of A^k by exp2(k log2 A), log2 off by 2^-21, below 1/2 by 3 ulp (Vulkan)."""
    if k == 1:
        return light
    constant, slope = model.exponential
    steps = k * (1 - np.frexp(light)[1])  # k |log2 A| at most
    relative = constant + k * 2.0**-21 + steps * (slope + 5 * ULP) + 2 * k * np.maximum(light - 1, 0)
    made = np.array([power(min(a, 1.0), k) for a in light.ravel().tolist()]).reshape(light.shape)
    return np.maximum(made * (1 + sign * relative), 0) if k else made
