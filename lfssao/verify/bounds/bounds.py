"""Acceptance intervals: between which values every conforming float32 renderer must fall.

``ssao`` makes them of Algorithms 1 and 2, ``points`` of other estimators, ``post`` of the merge, the blur and the
shading, ``depth`` of the G-buffer. ``error_model`` lists what a renderer may do.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.textures import check_texture
from lfssao.errors import InputError
from lfssao.optics.view import without_guard

Texture = NDArray[np.float32]
FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Bounds:
    """The values that a stage's texture may have."""

    lower: Texture  # (H, W) or (H, W, 3) float32: the smallest value, admitted
    upper: Texture  # the largest, likewise
    # (H, W) int32: number of samples that rounding decides, over all radii that went in; None behind the blur
    undecided: NDArray[np.int32] | None = None
    outliers: int = 0  # number of texels of a right texture that may leave the bounds
    # Smallest and largest values of K ranges, (K, H, W): a value must lie in one of them, not just between their ends.
    ranges: tuple[Texture, Texture] | None = None

    def outside(self, texture: Texture) -> NDArray[np.bool_]:
        """Whether each number of a texture leaves the bounds, as NaN does. InputError if its shape is another."""
        if texture.shape != self.lower.shape:
            raise InputError(f"a texture has shape {texture.shape}, its bounds have {self.lower.shape}")
        if self.ranges is not None:
            inside: NDArray[np.bool_] = np.any((texture >= self.ranges[0]) & (texture <= self.ranges[1]), axis=0)
            return ~inside
        return ~((texture >= self.lower) & (texture <= self.upper))

    def crop(self, guard: int) -> "Bounds":
        """Bounds of an occlusion without a guard band of that width, texels."""
        undecided = None if self.undecided is None else without_guard(self.undecided, guard)
        return Bounds(without_guard(self.lower, guard), without_guard(self.upper, guard), undecided)


def exact_bounds(texture: Texture) -> Bounds:
    """The bounds of a texture that is given, a point each."""
    return Bounds(texture, texture)


def up_to_single(values: FloatArray) -> Texture:
    """The smallest float32 that is not below each value: the least that a float32 above it can be."""
    single = values.astype(np.float32)
    return np.where(single < values, np.nextafter(single, np.float32(np.inf)), single)


def down_to_single(values: FloatArray) -> Texture:
    """The largest float32 that is not above each value."""
    single = values.astype(np.float32)
    return np.where(single > values, np.nextafter(single, np.float32(-np.inf)), single)


def check_single(name: str, texture: Texture, dimensions: int) -> None:
    """Refuse a texture that is not float32 or has other dimensions."""
    check_texture(name, texture, dimensions)
    if texture.dtype != np.float32:
        raise InputError(f"{name} is of {texture.dtype}, the oracle judges float32")
