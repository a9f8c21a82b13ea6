"""Formats that textures are stored in: how their numbers are read, and the intervals of what is read.

Storing rounds to the format's nearest number and holds within its range, which keeps the order. So an interval's ends
are stored as well, and it widens by half a step of the format at most. A depth of whole numbers has no infinity: its
largest code, to which depth buffers are cleared, is no surface. Distances along a camera's axis are a depth, too.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.srgb import to_codes, to_linear
from lfssao.verify.bounds.bounds import Bounds, FloatArray, Texture
from lfssao.verify.bounds.error_model import ErrorModel

LINEAR = "linear"  # a format's word: distances along the axis of a camera, whose depth is screen z

# Types in files, codes of 1 (0 for floats), and how far conversions may be off, relative; it decides ties, too.
FORMATS: dict[str, tuple[type[np.generic], int, float]] = {
    "float": (np.float32, 0, 0.0),
    "half": (np.float16, 0, 2.0**-30),
    "unorm8": (np.uint8, 255, 2.0**-18),
    "unorm16": (np.uint16, 65535, 2.0**-21),
    "srgb8": (np.uint8, 255, 2.0**-18),
}


@dataclass(frozen=True)
class Stored:
    """How a renderer stores a texture: its format, whether it is 1 - occlusion, a depth, or distances."""

    format: str
    visibility: bool = False
    depth: bool = False
    linear: bool = False

    def __str__(self) -> str:
        stored = [f"stored as {self.format}"] * (self.format != "float")
        return ", ".join(["1 - visibility"] * self.visibility + [LINEAR] * self.linear + stored)

    def read(self, codes: NDArray[Any]) -> Texture:
        """The float32 values that a texture unit reads, as occlusion; float32 ones were read before."""
        _, largest, _ = FORMATS[self.format]
        with np.errstate(invalid="ignore"):  # of a NaN that signals
            values = codes.astype(np.float64) / (largest if largest and codes.dtype.kind == "u" else 1)
        single = to_linear(codes) if self.format == "srgb8" and codes.dtype == np.uint8 else values.astype(np.float32)
        single = self._cleared(single)
        return np.float32(1) - single if self.visibility else single

    def bounds(self, bounds: Bounds, model: ErrorModel) -> Bounds:
        """Bounds of what is read of values within bounds; as visibility they are rounded once more."""
        lower, upper = self.ends(bounds.lower, bounds.upper, model)
        ranges = None if bounds.ranges is None else self.ends(*bounds.ranges, model)
        return replace(bounds, lower=lower, upper=upper, ranges=ranges)

    def half_steps(self, depth: Texture) -> FloatArray:
        """How far each depth may have been from what is read of it."""
        dtype, largest, _ = FORMATS[self.format]
        with np.errstate(invalid="ignore", over="ignore"):  # infinity has no neighbours
            steps = np.abs(np.spacing(depth.astype(dtype))) if not largest else np.full(depth.shape, 1 / largest)
        return steps.astype(np.float64) / 2

    def ends(self, lower: NDArray[Any], upper: NDArray[Any], model: ErrorModel) -> tuple[Texture, Texture]:
        """Smallest and largest of what is read of values between two, of any shape."""
        low, high, room = lower.astype(np.float64), upper.astype(np.float64), FORMATS[self.format][2]
        turned = 0.0 if model.exact or not self.visibility else model.quotient  # a subtraction, or (N - k) / N
        low, high = (1 - high, 1 - low) if self.visibility else (low, high)
        low, high = (
            _moved(self._nearest(_moved(end, sign * (room + turned))), sign * room)
            for end, sign in ((low, -1), (high, 1))
        )
        low, high = (1 - high, 1 - low) if self.visibility else (low, high)
        return low.astype(np.float32), high.astype(np.float32)

    def _nearest(self, values: FloatArray) -> FloatArray:
        dtype, largest, _ = FORMATS[self.format]
        if self.format == "srgb8":
            return to_linear(to_codes(values)).astype(np.float64)
        if largest:
            return np.asarray(self._cleared(np.rint(np.clip(values, 0, 1) * largest) / largest))
        with np.errstate(over="ignore"):  # beyond the largest number is infinity
            return values.astype(dtype).astype(np.float64)

    def _cleared(self, values: NDArray[Any]) -> NDArray[Any]:
        far = self.depth and FORMATS[self.format][1] > 0
        return np.where(values >= 1, values.dtype.type(np.inf), values) if far else values


def _moved(values: FloatArray, by: float) -> FloatArray:
    """Finite values, more by a part of their size."""
    return values + by * np.abs(values, where=np.isfinite(values), out=np.zeros_like(values))
