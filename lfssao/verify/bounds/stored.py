"""Formats of stored textures: how their numbers are read, and the intervals of the numbers after storing.

Storing rounds to the nearest number of the format and clamps to its range; both keep the order. So the ends of an
interval are stored as well, and it widens by at most half a step of the format. An integer depth has no infinity: its
largest code, to which depth buffers are cleared, means no surface. Distances along a camera's axis are a depth, too.

The next pass may read the stored texture or use the numbers in registers, from before they were stored. Shared memory
may hold both kinds. ``before_or_after`` allows for either.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.files.srgb import code_edges, to_codes, to_linear
from lfssao.verify.bounds.bounds import Bounds, FloatArray, Texture, down_to_single, up_to_single
from lfssao.verify.bounds.error_model import ErrorModel

LINEAR = "linear"  # the name of a format: distances along the axis of a camera, whose depth is screen z

# Types in files, the code of 1 (0 for floats), and the relative error of conversions, which covers ties, too.
FORMATS: dict[str, tuple[type[np.generic], int, float]] = {
    "float": (np.float32, 0, 0.0),
    "half": (np.float16, 0, 2.0**-30),
    "unorm8": (np.uint8, 255, 2.0**-18),
    "unorm16": (np.uint16, 65535, 2.0**-21),
    "srgb8": (np.uint8, 255, 2.0**-18),
}


@dataclass(frozen=True)
class TextureFormat:
    """The format of a stored texture, and whether it holds 1 - occlusion, a depth, or distances."""

    format: str
    visibility: bool = False
    depth: bool = False
    linear: bool = False

    def __str__(self) -> str:
        stored = [f"stored as {self.format}"] * (self.format != "float")
        return ", ".join(["1 - visibility"] * self.visibility + [LINEAR] * self.linear + stored)

    def read(self, codes: NDArray[Any]) -> Texture:
        """The float32 values that a texture unit reads from codes, as occlusion; float32 codes are values already."""
        _, largest, _ = FORMATS[self.format]
        with np.errstate(invalid="ignore"):  # of a NaN that signals
            values = codes.astype(np.float64) / (largest if largest and codes.dtype.kind == "u" else 1)
        single = to_linear(codes) if self.format == "srgb8" and codes.dtype == np.uint8 else values.astype(np.float32)
        single = self._with_infinity(single)
        return np.float32(1) - single if self.visibility else single

    def round_trip(self, texture: Texture) -> Texture:
        """The float32 values that are read after a texture is stored."""
        values = texture.astype(np.float64)
        single = self._nearest(1 - values if self.visibility else values).astype(np.float32)
        return np.float32(1) - single if self.visibility else single

    def bounds(self, bounds: Bounds, model: ErrorModel) -> Bounds:
        """Bounds after storing, for values within bounds; visibility rounds once more."""
        lower, upper = self.ends(bounds.lower, bounds.upper, model)
        ranges = None if bounds.ranges is None else self.ends(*bounds.ranges, model)
        return replace(bounds, lower=lower, upper=upper, ranges=ranges)

    def before_or_after(self, bounds: Bounds, model: ErrorModel, read: Texture | None = None) -> Bounds:
        """Bounds before or after storing, for values within bounds; with ``read``, for those that are stored as it.

        A texture is wrong before storing if no value within bounds is stored as ``read``. Then all values that are
        stored as ``read`` count, but none beyond the format's range.
        """
        lower = bounds.lower
        upper = bounds.upper
        if read is None:
            low, high = self.ends(lower, upper, model)
        else:
            low, high = self._stored_from(read, model)
            disjoint = np.maximum(lower, low) > np.minimum(upper, high)
            lower = np.where(disjoint, np.where(np.isfinite(low), low, read), np.maximum(lower, low))
            upper = np.where(disjoint, np.where(np.isfinite(high), high, read), np.minimum(upper, high))
            low = high = read
        return Bounds(np.minimum(lower, low), np.maximum(upper, high))

    def _stored_from(self, read: Texture, model: ErrorModel) -> tuple[Texture, Texture]:
        """Smallest and largest values that may be stored as ``read``; infinite at the ends of the format's range.

        This inverts ``ends``: the conversion changes a value, which then rounds. 1 - ``read`` is off by the rounding of
        a float32 number near 1.
        """
        values = read.astype(np.float64)
        conversion_error = FORMATS[self.format][2]
        if self.visibility:
            values = 1 - values
            conversion_error = conversion_error + (0.0 if model.exact else model.quotient)
        low, high = (
            _widened(end, sign * conversion_error * (1 + conversion_error))
            for end, sign in zip(self._rounding_interval(values), (-1, 1), strict=True)
        )
        if self.visibility:
            low, high = 1 - high - 2.0**-24, 1 - low + 2.0**-24
        return up_to_single(low), down_to_single(high)

    def _rounding_interval(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The ends of the values whose nearest number of the format is the same."""
        _, largest, _ = FORMATS[self.format]
        if self.format == "float":
            return values, values
        if self.format == "srgb8":
            edges = np.concatenate([[-np.inf], code_edges(), [np.inf]])
            codes = to_codes(values).astype(np.intp)
            return edges[codes], edges[codes + 1]
        if largest:
            code = np.rint(np.clip(values, 0, 1) * largest)
            low = (code - 0.5) / largest
            high = (code + 0.5) / largest
            return np.where(code > 0, low, -np.inf), np.where(code < largest, high, np.inf)
        with np.errstate(over="ignore"):
            nearest = values.astype(np.float16)
            ends = [np.nextafter(nearest, np.float16(direction)).astype(np.float64) for direction in (-np.inf, np.inf)]
        low, high = (
            0.5 * (np.clip(end, -65536, 65536) + np.clip(nearest.astype(np.float64), -65536, 65536)) for end in ends
        )
        return np.where(nearest > -np.inf, low, -np.inf), np.where(nearest < np.inf, high, np.inf)

    def half_steps(self, depth: Texture) -> FloatArray:
        """The largest distance of each depth from its stored value: half a step of the format."""
        dtype, largest, _ = FORMATS[self.format]
        with np.errstate(invalid="ignore", over="ignore"):  # infinity has no neighbours
            steps = np.abs(np.spacing(depth.astype(dtype))) if not largest else np.full(depth.shape, 1 / largest)
        return steps.astype(np.float64) / 2

    @property
    def has_codes(self) -> bool:
        """Whether values are stored as codes of equal steps."""
        return FORMATS[self.format][1] > 0 and self.format != "srgb8"

    def ends(
        self, lower: NDArray[Any], upper: NDArray[Any], model: ErrorModel, floor: bool = False
    ) -> tuple[Texture, Texture]:
        """Smallest and largest stored values for an interval, of any shape; ``floor`` truncates codes."""
        low = lower.astype(np.float64)
        high = upper.astype(np.float64)
        conversion_error = FORMATS[self.format][2]
        # Visibility is a difference, or (N - k) / N.
        complement_error = 0.0 if model.exact or not self.visibility else model.quotient
        low, high = (1 - high, 1 - low) if self.visibility else (low, high)
        ends = []
        for end, sign in ((low, -1), (high, 1)):
            code = self._nearest(_widened(end, sign * (conversion_error + complement_error)), floor)
            ends.append(_widened(code, sign * conversion_error))
        low, high = ends
        low, high = (1 - high, 1 - low) if self.visibility else (low, high)
        return low.astype(np.float32), high.astype(np.float32)

    def _nearest(self, values: FloatArray, floor: bool = False) -> FloatArray:
        dtype, largest, _ = FORMATS[self.format]
        if self.format == "srgb8":
            return to_linear(to_codes(values)).astype(np.float64)
        if largest:
            return np.asarray(
                self._with_infinity((np.floor if floor else np.rint)(np.clip(values, 0, 1) * largest) / largest)
            )
        with np.errstate(over="ignore"):  # beyond the largest number is infinity
            return values.astype(dtype).astype(np.float64)

    def _with_infinity(self, values: NDArray[Any]) -> NDArray[Any]:
        clears = self.depth and FORMATS[self.format][1] > 0
        return np.where(values >= 1, values.dtype.type(np.inf), values) if clears else values


def _widened(values: FloatArray, share: float) -> FloatArray:
    """The values plus a share of their size; infinite values stay."""
    return values + share * np.abs(values, where=np.isfinite(values), out=np.zeros_like(values))
