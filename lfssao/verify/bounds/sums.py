"""Bounds of ``alchemy`` and ``hbao``, which sum terms of the surface around a point.

Each term of ``alchemy`` lies between those that any texel gives where its tap may land (``kernels.obscurance_bounds``);
occlusion, a power of 1 less the sum, grows with each. ``hbao`` sums rises of horizons (``kernels.horizon_bounds``).
"""

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.horizon import HorizonOptions, fan_of
from lfssao.core.elementary import power
from lfssao.verify.bounds.bounds import Bounds, FloatArray, down_to_single, up_to_single
from lfssao.verify.bounds.error_model import ULP, ErrorModel
from lfssao.verify.bounds.kernels import horizon_bounds as horizon_kernels
from lfssao.verify.bounds.kernels import obscurance_bounds as kernels
from lfssao.verify.bounds.kernels.pairs import SAFETY
from lfssao.verify.bounds.problem import Problem, contiguous, single
from lfssao.verify.bounds.ssao import sample_inputs

Ends = tuple[FloatArray, FloatArray]


def alchemy(given: Problem, radius: float) -> Bounds:
    """Bounds of ``alchemy``."""
    seen, options, model = given.seen, given.options, given.model
    normals, ways, n = contiguous(seen.normals), contiguous(seen.directions), len(given.points)
    inputs = sample_inputs(seen.depth, seen.positions, seen.view.world_to_image, np.zeros((1, 3)), radius)
    beta, epsilon = float(single(options["beta"])), float(options["epsilon"]) * radius * radius
    mirrors, away = np.array([[[1.0]], [[0.0]]]), single(seen.view.viewer_distance())
    taps = kernels.Taps(single(given.points), mirrors, normals, ways, away, float(radius), beta, epsilon)
    low, high, undecided = (np.empty(seen.depth.shape, dtype) for dtype in ("f8", "f8", "i4"))
    kernels.sum_terms(inputs, taps, model.errors, seen.turns, low, high, undecided)
    light = left_of((low, high), 2 * float(options["sigma"]) * radius / n, n, model)
    return lacking(light, float(options["k"]), undecided, model)


def hbao(given: Problem, radius: float) -> Bounds:
    """Bounds of ``hbao``."""
    seen, model, options = given.seen, given.model, HorizonOptions(**given.options)  # type: ignore[arg-type]
    inputs = sample_inputs(seen.depth, seen.positions, seen.view.world_to_image, np.zeros((1, 3)), radius)
    around, mirrors, steps, *numbers = fan_of(options, np.dtype(np.float32))
    vectors = contiguous(seen.normals), contiguous(seen.directions)
    axes = single(seen.view.cast_from_world[2]), single(seen.view.world_from_cast[:, 0])
    parts = [single(around), single(mirrors), steps, *map(float, numbers), *vectors, *axes, float(radius)]
    low, high, undecided = (np.empty(seen.depth.shape, dtype) for dtype in ("f8", "f8", "i4"))
    horizon_kernels.sum_rises(inputs, horizon_kernels.Fan._make(parts), model.errors, seen.turns, low, high, undecided)
    n = options.directions * options.steps
    relative = ((n + 2) * model.operation * (1 + n * model.operation) + model.quotient) * SAFETY
    low, high = low / options.directions * (1 - relative), high / options.directions * (1 + relative)
    return Bounds(up_to_single(np.minimum(low, 1)), down_to_single(np.minimum(high, 1)), undecided)


def left_of(sums: Ends, scale: float, n: int, model: ErrorModel) -> Ends:
    """Ends of max(0, 1 - scale sum), of n terms added in any order and a scale made by a quotient and products."""
    relative = ((n + 4) * model.operation * (1 + n * model.operation) + model.quotient) * SAFETY
    low, high = scale * sums[0] * (1 - relative), scale * sums[1] * (1 + relative)
    least = np.where(high > 0, np.maximum(1 - high, 0) * (1 - model.operation * SAFETY), 1.0)
    return least, np.minimum(np.maximum(1 - low, 0) * (1 + model.operation * SAFETY), 1)


def lacking(light: Ends, k: float, undecided: NDArray[np.int32], model: ErrorModel) -> Bounds:
    """Bounds of 1 - A^k, A between ends, 1 but for rounding at most."""
    low, high = 1 - _raised(light[1], k, 1, model), 1 - _raised(light[0], k, -1, model)
    off = model.operation * SAFETY
    return Bounds(up_to_single(low - off * np.abs(low)), down_to_single(np.minimum(high * (1 + off), 1)), undecided)


def _raised(light: FloatArray, k: float, sign: int, model: ErrorModel) -> FloatArray:
    """Lower (sign -1) or upper (1) ends of A^k, exp2(k log2 A): log2 is off by 2^-21, and by 3 ulp below 1/2 (Vulkan).

    k = 1 takes no power.
    """
    if k == 1:
        return light
    constant, slope = model.exponential
    steps = k * (1 - np.frexp(light)[1])  # k |log2 A| at most
    relative = constant + k * 2.0**-21 + steps * (slope + 5 * ULP) + 2 * k * np.maximum(light - 1, 0)
    made = np.array([power(min(a, 1.0), k) for a in light.ravel().tolist()]).reshape(light.shape)
    return np.maximum(made * (1 + sign * relative), 0) if k else made
