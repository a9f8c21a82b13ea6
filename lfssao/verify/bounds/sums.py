"""Bounds of ``alchemy`` and ``hbao``, which sum terms of the surface around a point.

Occlusion of ``alchemy``, a power of 1 less the sum, grows with each term. ``hbao`` sums rises of horizons.
"""

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.horizon import HorizonOptions, fan_of
from lfssao.ao.estimators.kernels.alchemy import Strength
from lfssao.core.elementary import power
from lfssao.verify.bounds.bounds import Bounds, FloatArray, down_to_single, up_to_single
from lfssao.verify.bounds.error_model import ULP, ErrorModel
from lfssao.verify.bounds.kernels.disk_bounds import sum_rises, sum_terms
from lfssao.verify.bounds.kernels.pairs import SAFETY
from lfssao.verify.bounds.problem import Ends, Problem, held
from lfssao.verify.bounds.ssao import single


def alchemy(given: Problem, radius: float) -> Bounds:
    """Bounds of ``alchemy``."""
    options, model, n = given.options, given.model, len(given.points)
    scale, epsilon = 2 * float(options["sigma"]) * radius / n, float(options["epsilon"]) * radius * radius
    strength = Strength._make([radius, float(single(options["beta"])), epsilon, scale, float(options["k"])])
    away = single(given.seen.view.viewer_distance())
    sums, undecided = given.sums(sum_terms, given.surface(radius), single(given.points), away, strength)
    return lacking(left_of(sums, scale, n, model), strength.k, undecided, model)


def hbao(given: Problem, radius: float) -> Bounds:
    """Bounds of ``hbao``."""
    model, options = given.model, HorizonOptions(**given.options)  # type: ignore[arg-type]
    fan = held(fan_of(options, np.dtype(np.float32)))
    (low, high), undecided = given.sums(sum_rises, given.surface(radius), fan)
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
