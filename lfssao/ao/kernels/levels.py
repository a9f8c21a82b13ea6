"""Levels of depth one after the other, and which of them a sample is looked up in (SAO section 2.3, equation 9)."""

from typing import Any, NamedTuple

import numpy as np

from lfssao.core.jit import formula


class Levels(NamedTuple):
    """Levels of z one after the other, level l (W + 2**l - 1) >> l wide; first, int32: where each begins."""

    z: np.ndarray
    first: np.ndarray


@formula
def mip_level(h: Any, log_q: Any, top: Any) -> Any:
    """Equation 9: clamp(findMSB(int(h)) - log_q, 0, top), int32, 0 <= h <= 2**21, by the exponent of a float32."""
    level = (np.float32(np.int32(h)).view(np.int32) >> np.int32(23)) - np.int32(127) - log_q
    return min(top, max(np.int32(0), level))


@formula
def level_texel(first, level, column, row, width):
    """The place in ``Levels`` of the texel of a level that texel (column, row) of the texture lies in, uint32."""
    span = np.int32(np.int32(width + np.int32(np.int32(1) << level)) - np.int32(1)) >> level
    place = np.int32(np.int32(np.int32(row >> level) * np.int32(span)) + np.int32(column >> level))
    return np.uint32(first[np.uint32(level)] + place) & np.uint32(0x7FFFFFFF)
