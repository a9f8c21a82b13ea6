"""Numbers of other renderers inside and outside the bounds of a case."""

from collections.abc import Mapping

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from lfssao.verify.bounds.bounds import Bounds
from lfssao.viz.panels import draw_texture, draw_visibility, texture_panels

Texture = NDArray[np.float32]

EQUAL, INSIDE, OUTSIDE = range(3)
_NAMES = ("equal bits", "inside", "outside")


def inside_bounds(texture: Texture, reference: Texture, bounds: Bounds) -> NDArray[np.int64]:
    """Return EQUAL (to the reference), INSIDE the bounds or OUTSIDE them (NaN too) for each number of a texture."""
    return np.where(texture == reference, EQUAL, np.where(bounds.outside(texture), OUTSIDE, INSIDE))


def draw_inside(textures: Mapping[str, Texture], reference: Texture, bounds: Bounds) -> Figure:
    """Return a figure of the reference's occlusion, and of each texture's verdicts; arguments as above."""
    everywhere = np.ones(reference.shape, np.bool_)
    figure, (panels,) = texture_panels(1, 1 + len(textures), everywhere)
    draw_visibility(panels[0], reference, everywhere, "reference, visibility 1 - ao")
    colors = ["tab:green", "palegreen", "tab:red"]
    for axes, (name, texture) in zip(panels[1:], textures.items(), strict=True):
        verdicts = inside_bounds(texture, reference, bounds)
        title = f"{name}: {np.mean(verdicts == OUTSIDE):.0%} outside"
        draw_texture(axes, verdicts, title, cmap=ListedColormap(colors), vmin=0, vmax=2)
    handles = [Patch(color=color, label=name) for color, name in zip(colors, _NAMES, strict=True)]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize="small")
    return figure
