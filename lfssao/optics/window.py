"""Rows of a texture that can see a box."""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from lfssao.optics.kernels.projection import DISPLAY
from lfssao.optics.view import View

# Image coordinates beyond this many texels belong to points near a singular plane, where rounding is not small.
_FAR = 1e6


def seen_rows(view: View, bounds: NDArray[np.float64]) -> range:
    """Rows of texels that hold the image of a box, and one more on each side; empty where it misses the texture.

    On flat displays and in cameras u and v are quotients of affine functions of the point, whose divisors have one sign
    over the box, so they are largest and smallest in its corners. All rows where that does not hold, and on other
    displays. The box is (2, 3) float64, its lower and upper corner, world units.
    """
    image = view.world_to_image(np.array(list(product(*bounds.T))))[:, :2]
    if view.world_to_image.kind == DISPLAY or not np.abs(image).max() < _FAR:  # NaN where a corner has no image
        return range(view.height)
    left, top = np.floor(image.min(axis=0)).astype(int) - 1
    right, bottom = np.ceil(image.max(axis=0)).astype(int) + 1
    if right <= 0 or bottom <= 0 or left >= view.width or top >= view.height:
        return range(0)
    return range(max(int(top), 0), min(int(bottom), view.height))
