"""sRGB codes to linear light and back (IEC 61966-2-1), by tables with equal bits on every machine."""

import functools
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
from numpy.typing import NDArray


def _decode(code: Decimal) -> Decimal:
    """Linear value of an sRGB value, 0 to 1, in decimal arithmetic (which no processor does differently)."""
    if code <= Decimal("0.04045"):
        return code / Decimal("12.92")
    return ((code + Decimal("0.055")) / Decimal("1.055")) ** Decimal("2.4")


@functools.cache
def decode_table() -> NDArray[np.float32]:
    """Linear value of each 8-bit sRGB code, (256,) float32, 0 to 1."""
    with localcontext() as context:
        context.prec = 30
        return np.array([float(_decode(Decimal(k) / 255)) for k in range(256)], np.float32)


@functools.cache
def _code_edges() -> NDArray[np.float64]:
    """Linear values halfway, in sRGB, between neighbouring codes, (255,) float64."""
    with localcontext() as context:
        context.prec = 30
        return np.array([float(_decode((Decimal(k) + Decimal("0.5")) / 255)) for k in range(255)])


def to_linear(codes: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Linear light, float32 0 to 1, of 8-bit sRGB codes of any shape."""
    return decode_table()[codes]


def to_codes(linear: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    """Nearest 8-bit sRGB codes of linear light of any shape; values outside 0 to 1 are clamped."""
    return np.searchsorted(_code_edges(), linear, side="right").astype(np.uint8)
