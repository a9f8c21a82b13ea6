"""Occlusion by each radius, and the radius that the merge shows."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lfssao.ao.post import merge
from lfssao.errors import InputError
from lfssao.rendering.textures import Textures
from lfssao.viz.panels import draw_texture, draw_visibility, texture_panels


def deciding_radius(layers: Sequence[NDArray[np.floating[Any]]]) -> NDArray[np.int64]:
    """The first layer that gives each texel its maximum, (H, W) int64; -1 where all are 0; InputError as ``merge``."""
    merge(layers)
    stack = np.stack(layers)
    return np.where(stack.max(axis=0) > 0, stack.argmax(axis=0), -1)


def draw_radii(textures: Textures, radii: Sequence[float]) -> Figure:
    """Return a figure of the visibility by each radius, merged, blurred, and of the radius that decides each texel.

    The textures are those that ``render_view`` made with these radii, world units. InputError if it was by others, or a
    layer that is shown was not kept.
    """
    if textures.merged is None or textures.blurred is None or not textures.ao:
        raise InputError("the figure shows the layers ao, merged and blurred: not all are kept")
    if not np.array_equal(radii, textures.settings.radii):
        raise InputError(f"radii are {list(radii)}, the textures were made with {list(textures.settings.radii)}")
    surface = np.isfinite(textures.gbuffer.depth)
    pictures = [*textures.ao, textures.merged, textures.blurred]
    titles = [*(f"R = {radius:.3g}" for radius in radii), "merged: maximum", "blurred"]
    columns = -(-(len(pictures) + 1) // 2)
    figure, grid = texture_panels(2, columns, surface)
    panels = grid.ravel()
    for axes in panels[len(pictures) + 1 :]:
        axes.set_visible(False)
    for axes, picture, title in zip(panels, pictures, titles, strict=False):
        shown = draw_visibility(axes, picture, surface, title)
    figure.colorbar(shown, ax=grid[0], shrink=0.8, label="visibility, 1 - ao")
    decided = np.ma.masked_less(deciding_radius(textures.ao), 0)
    norm = BoundaryNorm(np.arange(len(radii) + 1) - 0.5, len(radii))
    colors = {"cmap": colormaps["viridis"].resampled(len(radii)), "norm": norm}
    shown = draw_texture(panels[len(pictures)], decided, "the radius that decides", **colors)
    bar = figure.colorbar(shown, ax=grid[1], shrink=0.8, ticks=range(len(radii)), label="R, scene units")
    bar.ax.set_yticklabels([f"{radius:.3g}" for radius in radii])
    return figure
