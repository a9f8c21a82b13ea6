"""Bounds of a bilateral pass, which is not monotone in its depths: from how far its weights may be off.

A pass is a mean M = sum w_k a_k / sum w_k with w_k = g_k max(0, 1 - c abs(z_k - z)) (``lfssao.kernels.bilateral``). As
sum w_k (a_k - M) = 0, other weights w'_k, off by at most d_k, move it by

    M' - M = sum (w'_k - w_k) (a_k - M) / sum w'_k,   so   abs(M' - M) <= sum d_k abs(a_k - M) / sum (w_k - d_k).

With t = c abs(z_k - z), which is rounded twice, and max, which lets no error grow: d_k = g_k (3 r t + r) + w_k (r +
2^-24), up to squares of r. The middle tap has t = 0, so the divisor is positive. M grows with each a_k. The two sums of
n taps and their quotient round M by 2 n r + q more, of the mean of abs(a_k).
"""

import numpy as np
from numpy.typing import NDArray

from lfssao.oracle.bounds import Bounds, FloatArray, Texture, down_to_single, up_to_single
from lfssao.oracle.error_model import ErrorModel, find_model

_SQUARES = 1 + 2.0**-10  # outweighs the squares of errors below 2^-17


def bilateral_bounds(
    values: Bounds,
    keys: Texture,
    weights: NDArray[np.float64],
    stride: int,
    sharpness: float,
    axis: int,
    model: str | ErrorModel = "shader",
) -> Bounds:
    """Bounds of one bilateral pass.

    Parameters
    ----------
    values : Bounds
        What is filtered, (H, W).
    keys : (H, W) float32
        Depths between 0 and 1, given, +infinity where there is no surface.
    weights : (taps,)
        Gaussian weights, an odd number, positive.
    stride : int
        Distance between taps, texels.
    sharpness : float
        The constant c, rounded to float32.
    axis : int
        0: along the columns, 1: along the rows.
    model : str or ErrorModel
        What float32 arithmetic may do; an exact one is taken for 'nearest'.

    Returns
    -------
    Bounds
        1 where there is no surface.

    Raises
    ------
    InputError
        If there is no such model.
    """
    chosen = find_model(model)
    chosen = find_model("nearest") if chosen.exact else chosen
    table, constant = weights.astype(np.float32).astype(np.float64), float(np.float32(sharpness))
    shifts = [(k - len(table) // 2) * stride for k in range(len(table))]
    depth = [_shifted(keys.astype(np.float64), shift, axis, np.inf) for shift in shifts]
    with np.errstate(invalid="ignore"):  # between two texels without surface
        off = [constant * np.abs(d - keys) for d in depth]
    r = chosen.operation
    heights, doubts = [], []
    for gauss, t in zip(table, off, strict=True):
        near = np.where(np.isfinite(t), np.maximum(1 - t, 0.0), 0.0)
        # Beyond t = 2 no rounding brings 1 - t up to 0.
        room = np.where(t < 2, gauss * (3 * r * np.minimum(t, 2.0) + r) + gauss * near * (r + 2.0**-24), 0.0)
        heights.append(gauss * near)
        doubts.append(room * _SQUARES + chosen.smallest * (room > 0))
    surface = keys < np.inf
    rounding = (2 * len(table) * r + chosen.quotient) * _SQUARES
    ends = []
    for end, sign in ((values.lower, -1.0), (values.upper, 1.0)):
        taps = [_shifted(end.astype(np.float64), shift, axis, 0.0) for shift in shifts]
        moved = _mean_and_doubt(taps, heights, doubts, surface, rounding)
        ends.append(np.where(surface, moved[0] + sign * (moved[1] + chosen.smallest), 1.0))
    return Bounds(up_to_single(ends[0]), down_to_single(ends[1]))


def _mean_and_doubt(
    taps: list[FloatArray],
    heights: list[FloatArray],
    doubts: list[FloatArray],
    surface: NDArray[np.bool_],
    rounding: float,
) -> tuple[FloatArray, FloatArray]:
    """The weighted mean of taps, and how far weights and sums may move it."""
    total, least = np.zeros(surface.shape), np.zeros(surface.shape)
    for w, d in zip(heights, doubts, strict=True):
        total, least = total + w, least + (w - d)
    total, least = np.where(surface, total, 1.0), np.where(surface, least, 1.0)
    mean, size, moved = (np.zeros(surface.shape) for _ in range(3))
    for a, w in zip(taps, heights, strict=True):
        mean = mean + w * a
    mean = mean / total
    for a, w, d in zip(taps, heights, doubts, strict=True):
        moved = moved + d * np.abs(a - mean)
        size = size + (w + d) * np.abs(a)
    return mean, (moved + rounding * size) / least * _SQUARES


def _shifted(texture: FloatArray, shift: int, axis: int, beyond: float) -> FloatArray:
    """The texture's texels so many places on along an axis, and what is beyond the border."""
    out = np.full(texture.shape, beyond)
    size = texture.shape[axis]
    if abs(shift) < size:
        to: list[slice] = [slice(None), slice(None)]
        of: list[slice] = [slice(None), slice(None)]
        to[axis] = slice(max(0, -shift), size - max(0, shift))
        of[axis] = slice(max(0, shift), size - max(0, -shift))
        out[tuple(to)] = texture[tuple(of)]
    return out
