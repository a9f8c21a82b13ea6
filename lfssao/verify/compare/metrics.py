"""Distances of two textures: bits, ulp, mean, RMSE, PSNR, SSIM, and numbers that are finite in one only."""

from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.sums import sum_in_order
from lfssao.verify.verdict import Plane, Planes, equal_bits


@dataclass(frozen=True)
class Metrics:
    """Distances of two textures of one type and size, over the texels and channels that are finite in both.

    Attributes
    ----------
    texels : int
        Number of texels.
    differing : int
        Number of texels that differ in a bit of any channel.
    max_ulp : int
        Greatest distance in representable numbers (for integers: in codes); -0 and +0 are 0 apart.
    max_error, mean_error, rmse : float
        Figures of the absolute difference, in the texture's unit.
    psnr : float or None
        Peak signal-to-noise ratio, dB; the peak is 1 where the reference lies within 0 to 1, the largest code of
        integers, else the reference's range. None where nothing differs or the range is 0.
    ssim : float or None
        Mean structural similarity (Wang et al. 2004) over the channels, uniform windows of 7 texels or what fits.
        None for images less than 3 texels wide or high and where the range is 0.
    nan_mismatches, infinity_mismatches : int
        Numbers that are NaN in one only; infinite in one only, or with another sign.
    """

    texels: int
    differing: int
    max_ulp: int = 0
    max_error: float = 0.0
    mean_error: float = 0.0
    rmse: float = 0.0
    psnr: float | None = None
    ssim: float | None = 1.0
    nan_mismatches: int = 0
    infinity_mismatches: int = 0


def ulp_distance(a: Plane, b: Plane) -> NDArray[np.uint64]:
    """Number of representable numbers from a to b, finite ones of one type."""
    x, y = _ordered(a), _ordered(b)
    # A distance of float64 may exceed int64; the wrapped difference is right as an unsigned number.
    return np.where(x < y, y - x, x - y).view(np.uint64)


def _ordered(a: Plane) -> NDArray[np.int64]:
    """Integers in the order of the numbers, neighbours 1 apart."""
    if a.dtype.kind != "f":
        return a.astype(np.int64)
    bits = np.ascontiguousarray(a).view(f"i{a.dtype.itemsize}").astype(np.int64)
    sign = np.int64(-(2 ** (8 * a.dtype.itemsize - 1)))
    return np.where(bits < 0, sign - bits, bits)


def measure(mine: Planes, reference: Planes) -> Metrics:
    """All distances of two textures, whose channels (H, W) are equal in number, type and size."""
    differing = np.zeros(mine[0].shape, np.bool_)
    for a, b in zip(mine, reference, strict=True):
        differing |= ~equal_bits(a, b)
    count = int(differing.sum())
    if count == 0:
        return Metrics(differing.size, 0)
    sums = [_plane_sums(a, b) for a, b in zip(mine, reference, strict=True)]
    finite = sum(s["finite"] for s in sums)
    square = sum_in_order(s["square"] for s in sums)
    peak = _peak(reference)
    rmse = sqrt(square / finite) if finite else 0.0
    return Metrics(
        texels=differing.size,
        differing=count,
        max_ulp=max(s["ulp"] for s in sums),
        max_error=max(s["most"] for s in sums),
        mean_error=sum_in_order(s["sum"] for s in sums) / finite if finite else 0.0,
        rmse=rmse,
        psnr=float(20 * np.log10(peak / rmse)) if rmse > 0 and peak > 0 else None,
        ssim=_ssim(mine, reference, peak),
        nan_mismatches=sum(s["nan"] for s in sums),
        infinity_mismatches=sum(s["infinity"] for s in sums),
    )


def _plane_sums(a: Plane, b: Plane) -> dict[str, Any]:
    nan_a, nan_b, both = np.isnan(a), np.isnan(b), np.isfinite(a) & np.isfinite(b)
    infinite = (np.isinf(a) | np.isinf(b)) & ~nan_a & ~nan_b & (a != b)
    x, y = a[both], b[both]
    error = np.abs(_wide(x) - _wide(y))
    return {
        "finite": x.size,
        "ulp": int(ulp_distance(x, y).max(initial=0)),
        "most": float(error.max(initial=0)),
        "sum": float(error.sum()),
        "square": float((error * error).sum()),
        "nan": int((nan_a != nan_b).sum()),
        "infinity": int(infinite.sum()),
    }


def _wide(a: Plane) -> NDArray[np.float64]:
    return a.astype(np.float64)


def _peak(reference: Planes) -> float:
    if reference[0].dtype.kind != "f":
        return float(np.iinfo(reference[0].dtype).max)
    ends = [(float(b[ok].min()), float(b[ok].max())) for b in reference if (ok := np.isfinite(b)).any()]
    low, high = min((e[0] for e in ends), default=0.0), max((e[1] for e in ends), default=0.0)
    return 1.0 if low >= 0 and high <= 1 else high - low


def _ssim(mine: Planes, reference: Planes, peak: float) -> float | None:
    """SSIM of scikit-image; texels that are not finite in both are given one value in both."""
    side = min(7, *mine[0].shape)
    side -= 1 - side % 2
    if side < 3 or not 0 < peak < np.inf:
        return None
    from skimage.metrics import structural_similarity  # late: only what differs needs it

    values = []
    for a, b in zip(mine, reference, strict=True):
        both = np.isfinite(a) & np.isfinite(b)
        fill = float(_wide(b[both]).mean()) if both.any() else 0.0
        x, y = np.where(both, a, fill).astype(np.float64), np.where(both, b, fill).astype(np.float64)
        values.append(float(structural_similarity(x, y, win_size=side, data_range=peak)))
    return sum_in_order(values) / len(values)
