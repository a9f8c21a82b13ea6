"""Windows of textures, and which rows of one can see a box."""

from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from lfssao.kernels.rays import DISPLAY
from lfssao.view import View

# Image coordinates beyond this many texels belong to points near a singular plane, where rounding is not small.
_FAR = 1e6


class Window(NamedTuple):
    """Columns left to right - 1 and rows top to bottom - 1 of a texture; empty where there are none."""

    left: int
    top: int
    right: int
    bottom: int

    @classmethod
    def whole(cls, view: View) -> "Window":
        """All of a view's texels."""
        return cls(0, 0, view.width, view.height)

    @property
    def width(self) -> int:
        """Number of columns."""
        return max(self.right - self.left, 0)

    @property
    def height(self) -> int:
        """Number of rows."""
        return max(self.bottom - self.top, 0)

    @property
    def texels(self) -> int:
        """Number of texels."""
        return self.width * self.height

    def texture(self, background: float, shape: tuple[int, ...], dtype: DTypeLike = np.float32) -> NDArray[Any]:
        """A texture of that shape with ``background`` above and below the window's rows, anything in them."""
        texture = np.empty(shape, dtype)
        texture[: self.top], texture[self.bottom :] = background, background
        return texture


def seen_rows(view: View, bounds: NDArray[np.float64]) -> Window:
    """Whole rows of texels that hold the image of a box, and one more on each side; empty where it misses the texture.

    On flat displays and in cameras u and v are quotients of affine functions of the point, whose divisors have one sign
    over the box, so they are largest and smallest in its corners. All rows where that does not hold, and on other
    displays.

    Parameters
    ----------
    view : View
        Whose texels.
    bounds : (2, 3) float64
        Lower and upper corner of the box, world units.
    """
    whole = Window.whole(view)
    image = view.world_to_image(np.array(list(product(*bounds.T))))[:, :2]
    if view.ray_kind == DISPLAY or not np.abs(image).max() < _FAR:  # NaN where a corner has no image
        return whole
    left, top = np.floor(image.min(axis=0)).astype(int) - 1
    right, bottom = np.ceil(image.max(axis=0)).astype(int) + 1
    if right <= 0 or bottom <= 0 or left >= view.width or top >= view.height:
        return Window(0, 0, 0, 0)
    return Window(0, max(int(top), 0), view.width, min(int(bottom), view.height))
