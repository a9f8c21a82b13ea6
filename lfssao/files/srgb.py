"""sRGB codes to linear light and back (IEC 61966-2-1), by tables with equal bits on every machine."""

import functools
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
from numpy.typing import NDArray

_STEPS = 10  # nine do for all values above 0.04045


def _decode(code: Decimal) -> float:
    """Linear value of an sRGB code, 0 to 255; the power of decimals, unlike the C library's, is the same everywhere."""
    with localcontext(prec=28):
        value = code / 255
        if value <= Decimal("0.04045"):
            return float(value / Decimal("12.92"))
        return float(((value + Decimal("0.055")) / Decimal("1.055")) ** Decimal("2.4"))


@functools.cache
def decode_table() -> NDArray[np.float32]:
    """Linear value of each 8-bit sRGB code, (256,) float32, 0 to 1."""
    return np.array([_decode(Decimal(code)) for code in range(256)], np.float32)


@functools.cache
def code_edges() -> NDArray[np.float64]:
    """Linear values halfway, in sRGB, between neighbouring codes, (255,) float64."""
    return np.array([_decode(code + Decimal("0.5")) for code in range(255)])


def to_linear(codes: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Linear light, float32 0 to 1, of 8-bit sRGB codes of any shape."""
    return decode_table()[codes]


def decode(values: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
    """Linear light, float32, of sRGB values of any shape, 0 to 1, that are no whole codes."""
    value = np.asarray(values, np.float64)
    base = (value + 0.055) / 1.055
    square = base * base
    root = np.ones_like(base)
    for _ in range(_STEPS):  # Newton's method for the fifth root: the C library's power differs between machines
        root = root - (root - square / (root * root * root * root)) / 5
    return np.where(value <= 0.04045, value / 12.92, square * root).astype(np.float32)


def to_codes(linear: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    """Nearest 8-bit sRGB codes of linear light of any shape; values outside 0 to 1 are clamped."""
    return np.searchsorted(code_edges(), linear, side="right").astype(np.uint8)
