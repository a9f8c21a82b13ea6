"""Rules of textures' borders: the texels that stand for those beyond."""

import numpy as np
from numpy.typing import NDArray

Places = NDArray[np.int64]

# Texels beyond the border are no texels, or some texel inside.
INSIDE = ("clamp", "mirror", "wrap")


def hold(places: Places, size: int, border: str) -> Places:
    """Columns or rows inside 0 to size - 1 for any, by a rule of ``INSIDE``; by any other rule those of 'clamp'."""
    if border == "wrap":
        return np.asarray(places % size)
    if border == "mirror":
        folded = places % (2 * size)
        return np.where(folded < size, folded, 2 * size - 1 - folded)
    return np.clip(places, 0, size - 1)
