"""Acceptance intervals of the passes after the occlusion: the maximum over radii, the blur and the shading."""

from collections.abc import Sequence
from itertools import permutations, product
from typing import Any

import numpy as np

from lfssao.ao.kernels import post as post_kernels
from lfssao.ao.post import Light, blur, blur_weights, gaussian_kernel, merge, shade
from lfssao.core import elementary
from lfssao.core.balls import SAFETY
from lfssao.errors import InputError
from lfssao.verify.bounds.bounds import (
    Bounds,
    FloatArray,
    Texture,
    check_single,
    down_to_single,
    exact_bounds,
    up_to_single,
)
from lfssao.verify.bounds.error_model import ErrorModel, find_model
from lfssao.verify.bounds.kernels.light_bounds import bound_lit


def merge_bounds(layers: Sequence[Bounds]) -> Bounds:
    """Bounds of the maximum over radii, which does not round: the maxima of lower and of upper ends (InputError)."""
    lower = merge([layer.lower for layer in layers])
    upper = merge([layer.upper for layer in layers])
    counts = [layer.undecided for layer in layers if layer.undecided is not None]
    return Bounds(lower, upper, sum(counts[1:], counts[0]) if len(counts) == len(layers) else None)


def union_ends(first: FloatArray, second: FloatArray, model: ErrorModel) -> FloatArray:
    """Ends of a + b (1 - a), or of 1 - (1 - a) (1 - b), (2, H, W), from the ends of a and of b, (2, H, W) each.

    Both expressions are linear in a and in b, so their extremes lie at the ends. They round four times, on numbers up
    to 1 or up to the larger of a and b; zeros give exactly zero.
    """
    ends = []
    for a, b in product(first, second):
        union = a + b * (1 - a)
        rounding = 4 * model.operation * SAFETY * (union > 0) * np.maximum(1, a) * np.maximum(1, b)
        ends.append((union - rounding, union + rounding))
    low, high = zip(*ends, strict=True)
    return np.stack([np.maximum(np.min(low, axis=0), 0), np.max(high, axis=0)])


def blur_bounds(occlusion: Bounds, sigma: float, model: str | ErrorModel = "shader") -> Bounds:
    """Bounds of the Gaussian blur, horizontal then vertical, each pass rounded to a float32 texture.

    A pass sums n products w a and increases with each a, as weights are positive. Each term is rounded at most n times:
    as a product and in n - 1 sums, in any order. ``weight_errors`` bounds the error of its weight. So the sum is off by
    at most the sum of ((w + weight error) (1 + r)^n - w) max(abs(a)), which widens the pass over the bounds.

    A renderer may blur v = 1 - a instead. The table's sum is 1, so 1 - (sum of w v) is the sum of w a, but the errors
    scale with abs(v). The larger of both sizes counts, and the roundings of 1 - a before the passes and of 1 - v after
    them are added. Both passes' textures are float32 as a or as v, so only the result is rounded to float32.

    ``sigma`` is in texels; 0 means no passes. InputError if sigma or the model is wrong.
    """
    error_model = find_model(model)
    weights = blur_weights(sigma).astype(np.float64)
    if error_model.exact:
        return Bounds(blur(occlusion.lower, sigma), blur(occlusion.upper, sigma))
    n = len(weights)
    # The product goes from the first to the last: equal bits anywhere.
    sum_factor = float(np.cumprod(np.full(n, 1 + error_model.operation))[-1])
    errors = weight_errors(sigma, error_model) if n > 1 else np.zeros(1)
    flushed = error_model.smallest * (errors > 0)  # small weights may be flushed
    margin = ((weights + errors) * sum_factor - weights) * SAFETY + flushed
    lower, upper = _complement_ends(occlusion.lower.astype(np.float64), occlusion.upper.astype(np.float64), error_model)
    for blur_pass in (post_kernels.blur_horizontal, post_kernels.blur_vertical) if n > 1 else ():
        low = np.empty_like(lower)
        high = np.empty_like(lower)
        error = np.empty_like(lower)
        blur_pass(lower, weights, low)
        blur_pass(upper, weights, high)
        blur_pass(_largest_size(lower, upper), margin, error)
        error += (2 * n + 2) * error_model.smallest
        lower = low - error
        upper = high + error
    lower, upper = _complement_ends(lower, upper, error_model)
    return Bounds(up_to_single(lower), down_to_single(upper))


def _complement_ends(lower: FloatArray, upper: FloatArray, model: ErrorModel) -> tuple[FloatArray, FloatArray]:
    """The ends, widened by the rounding of 1 - a in float32."""
    error = _largest_size(lower, upper) * (model.operation * SAFETY) + model.smallest
    return lower - error, upper + error


def _largest_size(lower: FloatArray, upper: FloatArray) -> FloatArray:
    """The largest size of an occlusion and of its visibility."""
    return np.maximum(np.maximum(np.abs(lower), np.abs(upper)), np.maximum(np.abs(1 - lower), np.abs(1 - upper)))


def weight_errors(sigma: float, model: ErrorModel) -> FloatArray:
    """Largest errors of the weights of a renderer's blur, against the table.

    The table itself has no error. A renderer that evaluates the Gaussian differs by the quantisation of the table, at
    most half a quantum a weight and n / 2 at the centre, and by its rounding. It computes x = -k^2 / (2 sigma^2) with
    up to five roundings and a quotient (sigma rounded, k / sigma, its square, the half). So exp(x) is off by abs(x)
    times these errors, and by its own. The division by the sum adds the mean error of the weights and n - 1 roundings.
    ``sigma`` is positive, the model not an exact one.
    """
    weights = gaussian_kernel(sigma)
    r = model.operation
    radius = len(weights) // 2
    x = 0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2
    x = np.where(weights > 0, x, 0.0)  # exp that is 0 in float64 stays 0 with any error
    argument_error = x * (2 * model.quotient + 6 * r)
    constant, slope = model.exponential
    exp_error = (1 + constant + slope * x) * np.array([elementary.exp(a) for a in argument_error], np.float64) - 1
    # The total is off by the mean of its terms' errors, and by its sums.
    total = float(np.cumsum(weights * exp_error)[-1]) + (2 * radius) * r * (1 + 2 * radius * r)
    relative_error = (1 + exp_error) * (1 + total / (1 - total)) * (1 + model.quotient) - 1
    return np.abs(weights - blur_weights(sigma)) + weights * relative_error


def shade_bounds(
    rgb: Texture | Bounds,
    occlusion: Bounds,
    model: str | ErrorModel = "shader",
    normals: Bounds | None = None,
    light: Light | None = None,
) -> Bounds:
    """Bounds of rgb (1 - ao), (H, W, 3), for a linear colour or bounds of it; InputError if sizes or model are wrong.

    With a light, and bounds of the normals, those of what it makes (``kernels.light_bounds``).
    For rgb >= 0 the product decreases with ao. (1 - ao) rgb rounds twice. rgb - rgb ao rounds rgb ao and the
    difference, by r abs(rgb ao) + r abs(rgb (1 - ao)) at most. Both errors are within
    r abs(rgb) (abs(ao) + 2 abs(1 - ao)) (1 + r). The product less this error is concave in either factor, so its least
    value lies at ends of both factors; so does the largest value of their sum.
    """
    error_model = find_model(model)
    image_bounds = rgb if isinstance(rgb, Bounds) else exact_bounds(rgb)
    if error_model.exact:
        facing: Any = [None]
        if normals is not None and light is not None:  # those that face the light least and most
            towards = np.array(light.unit) >= 0
            facing = [np.where(towards, *ends) for ends in permutations((normals.lower, normals.upper))]
        ends = [shade(*end, light) for end in product(_ends(image_bounds), _ends(occlusion), facing)]
        return Bounds(np.min(ends, axis=0), np.max(ends, axis=0))
    check_single("rgb", image_bounds.lower, 3)
    if image_bounds.lower.shape != (*occlusion.lower.shape, 3):
        raise InputError(f"rgb has shape {image_bounds.lower.shape}, expected {(*occlusion.lower.shape, 3)}")
    if normals is not None and light is not None:
        least = np.empty(image_bounds.lower.shape)
        largest = np.empty(image_bounds.lower.shape)
        numbers = np.array([*light.unit, light.ambient], np.float32)
        textures = [np.stack(_ends(each)) for each in (image_bounds, occlusion, normals)]
        bound_lit(*textures, numbers, light.occlude == "all", error_model.errors, least, largest)
        return Bounds(up_to_single(least), down_to_single(largest))
    r = error_model.operation
    low: Any = np.inf
    high: Any = -np.inf
    for color, ao in product(_ends(image_bounds), _ends(occlusion)):
        c = color.astype(np.float64)
        a = ao.astype(np.float64)[..., None]
        exact = c * (1 - a)
        error = np.abs(c) * (np.abs(a) + 2 * np.abs(1 - a)) * (r * (1 + 4 * r)) + 4 * error_model.smallest * (c != 0)
        low = np.minimum(low, exact - error)
        high = np.maximum(high, exact + error)
    return Bounds(up_to_single(low), down_to_single(high))


def _ends(bounds: Bounds) -> tuple[Texture, ...]:
    """Both ends of bounds, or one of them if they are equal."""
    return (bounds.lower,) if np.array_equal(bounds.lower, bounds.upper) else (bounds.lower, bounds.upper)
