"""Windows of textures: which texels can see a box at all."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from lfssao.kernels.rays import DISPLAY, FLAT_LINEAR, PERSPECTIVE
from lfssao.matrix import Matrix
from lfssao.view import View

# Rounding of a ray's and a corner's place in the image, in units of the largest numbers they are made of, as
# lfssao.kernels.rasterize has it, and how near to the singular planes that holds.
_ULPS = 64 * 2.0**-53
_NEAREST = 2.0**-8


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

    def rows(self, view: View) -> "Window":
        """All columns of the window's rows; empty for an empty one."""
        return Window(0, self.top, view.width, self.bottom) if self.texels else Window(0, 0, 0, 0)

    def texture(self, background: float, shape: tuple[int, ...], dtype: DTypeLike = np.float32) -> NDArray[Any]:
        """A texture of that shape with ``background`` all around the window, anything inside."""
        texture = np.empty(shape, dtype)
        texture[: self.top], texture[self.bottom :] = background, background
        texture[:, : self.left], texture[:, self.right :] = background, background
        return texture


def cast_box(cast_from_world: Matrix, bounds: NDArray[np.float64]) -> NDArray[np.float64]:
    """The box in cast space around a box of the world, (2, 3) float64 both.

    It holds what ``lfssao.kernels.rays.transform_points`` makes of any point of the box, to the last bit: rounding
    keeps the order of numbers, so corners mapped by the same operations bound what lies between them.
    """
    out = np.empty((2, 3))
    for row in range(3):
        a, b, c, d = cast_from_world[row].tolist()
        corners = [((a * x + b * y) + c * z) + d for x in bounds[:, 0] for y in bounds[:, 1] for z in bounds[:, 2]]
        out[0, row], out[1, row] = min(corners), max(corners)
    return out


def seen_window(view: View, box: NDArray[np.float64]) -> Window:
    """The texels whose rays may hit a triangle inside a box.

    On flat screens with the linear diffuser and in cameras u and v are quotients of affine functions with one sign in
    the divisor, so over a box they are largest and smallest in its corners, and a ray hits a triangle only between the
    images of the triangle's corners, up to the rounding that ``lfssao.kernels.rasterize`` bounds; a texel is added for
    it on each side. Where that does not hold, and of other displays, it is the whole texture.

    Parameters
    ----------
    view : View
        Whose texels.
    box : (2, 3) float64
        Lower and upper corner, cast space.

    Returns
    -------
    Window
    """
    whole = Window.whole(view)
    if view.ray_kind == DISPLAY:
        return whole
    error_x, error_y = ray_errors(view, box).tolist()
    us, vs = [], []
    for x in box[:, 0].tolist():
        for y in box[:, 1].tolist():
            for z in box[:, 2].tolist():
                place = _image(view, x, y, z)
                if place is None:
                    return whole
                u, v, slope_u, slope_v = place
                if not (error_x < 0.5 * slope_u and error_y < 0.5 * slope_v):
                    return whole
                us.append(u)
                vs.append(v)
    return _around(view, min(us), max(us), min(vs), max(vs))


def _around(view: View, u_low: float, u_high: float, v_low: float, v_high: float) -> Window:
    """The texels of a range of image points, and one more on each side."""
    left, right = _between(u_low, u_high, view.width)
    top, bottom = _between(v_low, v_high, view.height)
    window = Window(left, top, right, bottom)
    return window if window.texels else Window(0, 0, 0, 0)


def _image(view: View, x: float, y: float, z: float) -> tuple[float, float, float, float] | None:
    """Where a corner appears, u and v, and by how much x and y change a texel there; None near singular planes."""
    lens = view.lens.tolist()
    if view.ray_kind == FLAT_LINEAR:
        m_x, m_z, y_o, z_o = lens[:4]
        a, b = 1.0 - z / m_z, 1.0 - z / z_o
        if not min(a, b) > _NEAREST:
            return None
        u = lens[4] * (m_x + (x - m_x) / a) + lens[5]
        v = lens[6] * (y_o + (y - y_o) / b) + lens[7]
        return u, v, a / abs(lens[4]), b / abs(lens[6])
    depth = z if view.ray_kind == PERSPECTIVE else 1.0
    if not depth > 0.0:
        return None
    u, v = lens[0] * (x / depth) + lens[2], lens[3] - lens[1] * (y / depth)
    return u, v, depth / abs(lens[0]), depth / abs(lens[1])


def ray_errors(view: View, box: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far, (2,) float64, rounding may move x and y of rays and corners in a box of cast space; no DISPLAY's."""
    return _ULPS * np.array(_scales(view, box))


def _scales(view: View, box: NDArray[np.float64]) -> tuple[float, float]:
    """Bounds of the numbers that x and y of corners and rays are made of."""
    lens = view.lens.tolist()
    x, y, z = np.abs(box).max(axis=0).tolist()
    if view.ray_kind == FLAT_LINEAR:
        m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 = lens
        s_x = max(abs(u_0), abs(view.width - u_0)) / abs(u_scale)
        s_y = max(abs(v_0), abs(view.height - v_0)) / abs(v_scale)
        far = max(abs(m_z), abs(z_o))
        steep_x, steep_y = (abs(m_x) + s_x) / abs(m_z), (abs(y_o) + s_y) / abs(z_o)
        return x + 2 * (s_x + abs(m_x) + steep_x * (z + far)), y + 2 * (s_y + abs(y_o) + steep_y * (z + far))
    s_x = max(abs(lens[2]), abs(view.width - lens[2])) / abs(lens[0])
    s_y = max(abs(lens[3]), abs(view.height - lens[3])) / abs(lens[1])
    reach = z + lens[5] if view.ray_kind == PERSPECTIVE else 1.0
    return x + 2 * s_x * reach, y + 2 * s_y * reach


def _between(low: float, high: float, size: int) -> tuple[int, int]:
    """First of the texels that reach from ``low`` - 1 to ``high`` + 1, and the one behind the last."""
    first = int(min(max(np.floor(low) - 1.0, 0.0), size))
    last = int(max(min(np.ceil(high) + 1.0, size), 0.0))
    return first, last
