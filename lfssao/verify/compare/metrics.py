"""Distances between two textures: bits, ulp, mean, RMSE, PSNR, SSIM, and numbers that are finite in only one."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from lfssao.verify.verdict import Flags, Plane, Planes, equal_bits, equal_values


@dataclass(frozen=True)
class Metrics:
    """Distances between two textures of one type and size, over the numbers that are finite in both."""

    texels: int  # number of texels
    differing: int  # number of texels that differ in a bit of any channel
    # Greatest distance in representable numbers; -0 and +0 are 0 apart. None for integers, above 2^20, and if one of
    # the two numbers is 0 or subnormal or has another sign.
    max_ulp: int | None = 0
    max_error: float = 0.0  # figures of the absolute difference, in the texture's unit
    mean_error: float = 0.0
    rmse: float = 0.0
    # Peak signal-to-noise ratio, dB; the peak is 1 if the reference lies within 0 to 1, the largest code of integers,
    # else the reference's range. None if nothing differs or the range is 0.
    psnr: float | None = None
    # Mean structural similarity (Wang et al. 2004) over the channels, with uniform windows of at most 7 texels. None
    # for images less than 3 texels wide or high and if the range is 0.
    ssim: float | None = 1.0
    nan_mismatches: int = 0  # numbers that are NaN in one only
    infinity_mismatches: int = 0  # infinite in one only, or with another sign


def ulp_distance(a: Plane, b: Plane) -> NDArray[np.uint64]:
    """Number of representable numbers from a to b, finite ones of one type."""
    x = _ordered_integers(a)
    y = _ordered_integers(b)
    # A distance of float64 may exceed int64; the wrapped difference is right as an unsigned number.
    return np.where(x < y, y - x, x - y).view(np.uint64)


def _ordered_integers(a: Plane) -> NDArray[np.int64]:
    """Integers in the order of the numbers, neighbours 1 apart."""
    if a.dtype.kind != "f":
        return a.astype(np.int64)
    bits = np.ascontiguousarray(a).view(f"i{a.dtype.itemsize}").astype(np.int64)
    sign = np.int64(-(2 ** (8 * a.dtype.itemsize - 1)))
    return np.where(bits < 0, sign - bits, bits)


def _max_ulp(x: Plane, y: Plane) -> int | None:
    """Greatest distance of finite numbers, (n,), in ulp; None where it is undefined (``Metrics.max_ulp``)."""
    distances = ulp_distance(x, y)
    most = int(distances.max(initial=0))
    if most == 0:
        return 0
    a, b = (side[distances.argmax()] for side in (x, y))
    tiny = np.finfo(x.dtype).tiny if x.dtype.kind == "f" else np.inf
    return most if most <= 2**20 and (min(a, b) >= tiny or max(a, b) <= -tiny) else None


def measure(mine: Planes, reference: Planes) -> Metrics:
    """All distances of two textures, whose channels (H, W) are equal in number, type and size."""
    a = np.stack(mine)
    b = np.stack(reference)
    differing = np.any(~equal_bits(a, b), axis=0)
    count = int(differing.sum())
    if count == 0:
        return Metrics(differing.size, 0)
    finite = np.isfinite(a) & np.isfinite(b)
    x = a[finite]
    y = b[finite]
    error = np.abs(x.astype(np.float64) - y.astype(np.float64)) if finite.any() else np.zeros(1)
    rmse = sqrt(float((error * error).mean()))
    nan_a = np.isnan(a)
    nan_b = np.isnan(b)
    low, high = span(b)
    peak = high - low
    infinities = (np.isinf(a) | np.isinf(b)) & ~nan_a & ~nan_b & (a != b)
    return Metrics(
        texels=differing.size,
        differing=count,
        max_ulp=_max_ulp(x, y),
        max_error=float(error.max()),
        mean_error=float(error.mean()),
        rmse=rmse,
        psnr=float(20 * np.log10(peak / rmse)) if rmse > 0 and peak > 0 else None,
        ssim=_ssim(a, b, finite, peak),
        nan_mismatches=int((nan_a != nan_b).sum()),
        infinity_mismatches=int(infinities.sum()),
    )


def span(texture: Plane) -> tuple[float, float]:
    """Ends of a signal: 0 and 1 if all values lie between, as AO and colours do; 0 and the largest code of integers."""
    if texture.dtype.kind != "f":
        return 0.0, float(np.iinfo(texture.dtype).max)
    finite = texture[np.isfinite(texture)]
    low = float(finite.min(initial=np.inf))
    high = float(finite.max(initial=-np.inf))
    return (0.0, 1.0) if low >= 0 and high <= 1 else (low, high)


def difference(mine: Planes, reference: Planes) -> NDArray[np.float64]:
    """Largest absolute difference of a texel's channels, (H, W); infinite where only one of the two is finite."""
    a = np.stack(mine)
    b = np.stack(reference)
    with np.errstate(all="ignore"):
        error = np.abs(a.astype(np.float64) - b.astype(np.float64))
    error[equal_values(a, b)] = 0
    most: NDArray[np.float64] = np.max(np.where(np.isnan(error), np.inf, error), axis=0)
    return most


def _ssim(a: Plane, b: Plane, finite: Flags, peak: float) -> float | None:
    """SSIM of scikit-image; one value replaces numbers that are not finite in both."""
    side = min(7, *a.shape[1:])
    side -= 1 - side % 2
    if side < 3 or not 0 < peak < np.inf:
        return None
    from skimage.metrics import structural_similarity  # late: only what differs needs it

    values = []
    for x, y, known in zip(a, b, finite, strict=True):
        fill = float(y[known].mean(dtype=np.float64)) if known.any() else 0.0
        images = (np.where(known, image, fill).astype(np.float64) for image in (x, y))
        values.append(float(structural_similarity(*images, win_size=side, data_range=peak)))
    return sum(values) / len(values)
