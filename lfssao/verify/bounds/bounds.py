"""Acceptance intervals: every conforming float32 renderer's value lies inside.

``ssao`` computes the intervals of Algorithms 1 and 2, ``points`` those of other estimators, ``post`` those of the
merge, the blur and the shading, ``depth`` those of the G-buffer. ``error_model`` lists the freedoms of a renderer.
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
    # (H, W) int32: number of samples that rounding decides, over all merged radii; None after the blur
    undecided: NDArray[np.int32] | None = None
    outliers: int = 0  # largest number of texels outside that a right texture may have
    # Smallest and largest values of K ranges, (K, H, W): a value must lie in one range, not just between their ends.
    ranges: tuple[Texture, Texture] | None = None

    def outside(self, texture: Texture) -> NDArray[np.bool_]:
        """Whether each number of a texture is outside; NaN is. InputError if the texture has another shape."""
        if texture.shape != self.lower.shape:
            raise InputError(f"a texture has shape {texture.shape}, its bounds have {self.lower.shape}")
        if self.ranges is not None:
            inside: NDArray[np.bool_] = np.any((texture >= self.ranges[0]) & (texture <= self.ranges[1]), axis=0)
            return ~inside
        return ~((texture >= self.lower) & (texture <= self.upper))

    def crop(self, guard: int) -> "Bounds":
        """The bounds without a guard band of ``guard`` texels."""
        undecided = None if self.undecided is None else without_guard(self.undecided, guard)
        return Bounds(without_guard(self.lower, guard), without_guard(self.upper, guard), undecided)


def exact_bounds(texture: Texture) -> Bounds:
    """Bounds whose both ends are the texture."""
    return Bounds(texture, texture)


def up_to_single(values: FloatArray) -> Texture:
    """The smallest float32 that is not below each value: the lower end of float32 values that are not below it."""
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
