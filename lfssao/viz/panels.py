"""Panels of a figure that show textures of one view: the part with a surface, on axes of texels."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

_MARGIN = 3  # texels about the surface
_WIDTH = 10.0  # of a figure, inches: what a page shows without making the letters smaller
_PANEL = 3.4  # the longer side of a panel, inches, at most


def texture_panels(rows: int, columns: int, surface: NDArray[np.bool_]) -> tuple[Figure, Any]:
    """Return a figure and its panels, (rows, columns), whose window holds the surface, (H, W) of one view."""
    box = []
    for axis in (0, 1):
        occupied = np.nonzero(surface.any(axis=axis))[0]
        low, high = (occupied[0], occupied[-1] + 1) if len(occupied) else (0, surface.shape[1 - axis])
        box.append((max(0, low - _MARGIN), min(surface.shape[1 - axis], high + _MARGIN)))
    (left, right), (top, bottom) = box
    aspect = (bottom - top) / (right - left)
    width = min(_PANEL / max(1.0, aspect), (_WIDTH - 1.8) / columns)
    figure = Figure(figsize=(columns * width + 1.8, rows * (0.4 + width * aspect) + 0.5), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    panels[0, 0].set(xlim=(left, right), ylim=(bottom, top))
    for axes in panels.flat:
        axes.set(aspect="equal", xlabel="u, texels", ylabel="v, texels")
        axes.label_outer()
    return figure, panels


def draw_texture(axes: Any, texture: NDArray[Any], title: str, **colors: Any) -> Any:
    """Draw a texture, (H, W), in a panel, a texel from its number to the next, with ``imshow``'s colours."""
    axes.set_title(title, fontsize="medium")
    return axes.imshow(texture, extent=(0, texture.shape[1], texture.shape[0], 0), **colors)


def draw_visibility(axes: Any, occlusion: NDArray[Any], surface: NDArray[np.bool_], title: str) -> Any:
    """Draw visibility, 1 - ao, (H, W), in a panel: 0 black and 1 white, as where there is no surface."""
    return draw_texture(axes, np.where(surface, 1 - occlusion, 1), title, cmap="gray", vmin=0, vmax=1)


def mark_decades(axes: Any, names: str) -> None:
    """Mark 1, 2 and 5 times the powers of ten, in plain numbers, on logarithmic axes of names, 'x', 'y' or 'xy'."""
    axes.minorticks_off()
    for name in names:
        low, high = getattr(axes, f"get_{name}lim")()
        marks = [m * 10.0**k for k in range(-5, 5) for m in (1, 2, 5) if low <= m * 10.0**k <= high]
        getattr(axes, f"set_{name}ticks")(marks, [f"{mark:g}" for mark in marks])
