"""Merge, Gaussian blur and shading of arrays from any source, in their dtype (LF section 7, passes 4 to 6)."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from lfssao.ao import reference
from lfssao.ao.kernels import post as post_kernels
from lfssao.ao.textures import Texture, check_fit, check_texture, plain
from lfssao.core.arguments import as_number, as_numbers
from lfssao.errors import InputError, check_choice, check_type, errors_of, shown

# Roundings of the other weights cannot use up the centre's: 3 sigma 2^-24 at most, and it is about 0.4 / sigma.
MAX_SIGMA = 1024.0
OCCLUDED = ("ambient", "all")
_LENGTHS = 1e-15, 1e15  # the square of each is of normal size in float32


def merge(layers: Sequence[Texture] | Texture) -> Texture:
    """Multi-resolution merge: the maximum over (K, H, W), or K textures (H, W), of several radii (LF section 6).

    An ``Occlusion`` stands for its texture, here and in ``blur`` and ``shade``.
    InputError if there is no texture, their sizes or dtypes differ, a number is NaN, or one is masked.

    >>> lfssao.merge([np.float32([[0.2, 0.5]]), np.float32([[0.4, 0.1]])]).tolist()
    [[0.4000000059604645, 0.5]]
    """
    check_type("layers", layers, Sequence | np.ndarray)
    if len(layers) == 0:
        raise InputError("merge needs at least one texture")
    layers = [plain(layer) for layer in layers]
    check_texture("layer 0", layers[0], 2)
    for number, layer in enumerate(layers[1:], 1):
        check_fit(f"layer {number}", layer, layers[0])
    merged = np.array(layers[0])
    for layer in layers[1:]:
        np.copyto(merged, layer, where=layer > merged)
    return merged


def gaussian_kernel(sigma: float) -> NDArray[np.float64]:
    """The normalised Gaussian, float64, 2 ceil(3 sigma) + 1 weights; InputError unless sigma is 0 to MAX_SIGMA."""
    if not 0 <= as_number(sigma) <= MAX_SIGMA:
        raise InputError(f"blur is {shown(sigma)}, it must be a sigma between 0 and {MAX_SIGMA:g} texels")
    return reference.gaussian_weights(float(sigma))


def blur_weights(sigma: float, dtype: DTypeLike = np.float32) -> Texture:
    """The Gaussian as the blur of textures of a dtype takes it: multiples of 2^-24, in float64 of 2^-53, of sum 1.

    Each weight is rounded to the nearest multiple, ties to even, and the centre takes the rest. Sums of such weights
    are exact in any order, so a blur of ones is 1. Rounding is monotone, so no sum of weights times numbers from 0 to 1
    leaves 0 to 1: a clamp would change nothing. Sigma and errors are those of ``gaussian_kernel``.
    """
    quantum = np.finfo(dtype).epsneg
    weights: NDArray[np.float64] = np.rint(gaussian_kernel(sigma) / quantum) * quantum
    centre = len(weights) // 2
    weights[centre] = 0
    weights[centre] = 1 - weights.sum()
    return weights.astype(dtype)


def blur(occlusion: Texture, sigma: float) -> Texture:
    """Gaussian blur in two passes, horizontal then vertical (LF section 7, passes 4 and 5).

    Occlusion is (H, W) float32 or float64; texels beyond the border have the border's value. ``sigma`` is the standard
    deviation, texels, 0 to MAX_SIGMA: the kernel reaches ceil(3 sigma) texels to each side, and 0 returns a copy.
    InputError if the texture or sigma is wrong, a number is NaN, or the texture is masked.

    >>> lfssao.blur(np.array([[0, 1, 0]], np.float32), sigma=1.0).round(3).tolist()
    [[0.24199999868869781, 0.39899998903274536, 0.24199999868869781]]
    """
    occlusion = plain(occlusion)
    check_texture("occlusion", occlusion, 2)
    weights = blur_weights(sigma, occlusion.dtype)
    if len(weights) == 1:
        return occlusion.copy()
    half = np.empty(occlusion.shape, occlusion.dtype)
    blurred = np.empty(occlusion.shape, occlusion.dtype)
    post_kernels.blur_horizontal(np.ascontiguousarray(occlusion), weights, half)
    post_kernels.blur_vertical(half, weights, blurred)
    return blurred


@dataclass(frozen=True)
class Light:
    """A directional light and an ambient term, both white.

    With l, the direction over its length, and f = max(n . l, 0) of a texel's normal n, the post pass makes

    - rgb (ambient (1 - ao) + (1 - ambient) f) where AO is on the ambient term,
    - rgb ((ambient + (1 - ambient) f) (1 - ao)) where it is on all.

    A surface that faces the light and has no AO keeps its colour. A normal of 0, where there is no surface, has f = 0.
    Nothing casts a shadow. InputError if a value is out of its range.

    Attributes
    ----------
    direction : tuple of 3 floats
        A vector in world space towards the light, of a length from 1e-15 to 1e15.
    ambient : float
        Share of the ambient term, 0 to 1.
    occlude : str
        The term that AO is on, 'ambient' or 'all'.

    Examples
    --------
    >>> lfssao.Light((0, 3, 4), ambient=0.25).unit
    (0.0, 0.6, 0.8)
    """

    direction: tuple[float, float, float]
    ambient: float = 0.5
    occlude: str = "ambient"

    def __post_init__(self) -> None:
        numbers = as_numbers("direction", self.direction)
        if numbers.shape != (3,) or not _LENGTHS[0] <= _length(*numbers.tolist()) <= _LENGTHS[1]:
            wanted = "expected X, Y, Z, a vector of a length from {:g} to {:g}".format(*_LENGTHS)
            raise InputError(f"direction is {shown(self.direction)}, {wanted}")
        object.__setattr__(self, "direction", tuple(map(float, numbers)))
        if not 0 <= as_number(self.ambient) <= 1:
            raise InputError(f"ambient is {shown(self.ambient)}, it must be a share from 0 to 1")
        object.__setattr__(self, "ambient", float(self.ambient))
        with errors_of("occlude"):
            check_choice("term", self.occlude, OCCLUDED)

    @property
    def unit(self) -> tuple[float, float, float]:
        """The direction over its length."""
        x, y, z = self.direction
        length = _length(x, y, z)
        return x / length, y / length, z / length


def _length(x: float, y: float, z: float) -> float:
    return sqrt((x * x + y * y) + z * z)


def shade(rgb: Texture, occlusion: Texture, normals: Texture | None = None, light: Light | None = None) -> Texture:
    """Post pass: rgb (1 - occlusion), or what a light makes of it (LF sections 4 and 7).

    ``rgb`` is linear colour, (H, W, 3) float32 or float64, and occlusion (H, W) of that dtype, 0 to 1. A light reads
    ``normals``, in world space, 0 where there is no surface, of the shape and dtype of ``rgb``. InputError if sizes or
    dtypes do not fit, a number is NaN, an array is masked, or a light has no normals.

    >>> lfssao.shade(np.ones((1, 1, 3), np.float32), np.float32([[0.25]])).tolist()
    [[[0.75, 0.75, 0.75]]]
    """
    occlusion = plain(occlusion)
    check_texture("occlusion", occlusion, 2)
    check_fit("rgb", rgb, occlusion, 3)
    shaded = np.empty(rgb.shape, rgb.dtype)
    colors = np.ascontiguousarray(rgb)
    hidden = np.ascontiguousarray(occlusion)
    if light is None:
        post_kernels.apply_occlusion(colors, hidden, shaded)
        return shaded
    check_type("light", light, Light)
    if normals is None:
        raise InputError("a light reads normals, and none are given")
    check_fit("normals", normals, occlusion, 3)
    numbers = np.array([*light.unit, light.ambient]).astype(rgb.dtype)
    post_kernels.apply_light(colors, hidden, np.ascontiguousarray(normals), numbers, light.occlude == "all", shaded)
    return shaded


def shade_white(depth: Texture, occlusion: Texture, *lit: Any) -> Texture:
    """The post pass of a scene without colour: ``shade`` of 1 where depth, (H, W), is finite, and of 0 elsewhere."""
    check_texture("depth", depth, 2)
    return shade(np.repeat((depth < np.inf).astype(depth.dtype)[..., None], 3, axis=2), occlusion, *lit)
