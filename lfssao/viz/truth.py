"""Error of screen-space occlusion against ray-cast occlusion."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lfssao.ao.textures import check_texture
from lfssao.errors import InputError
from lfssao.viz.panels import draw_texture, draw_visibility, texture_panels

Texture = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Deviation:
    """Difference of occlusion from the truth over the surface texels."""

    bias: float  # mean of occlusion less the truth
    rmse: float  # root mean square of it
    correlation: float  # Pearson's; NaN if either is constant


def half_space(occlusion: Texture) -> Texture:
    """Occlusion of the half space from that of LF's whole ball, in which a flat surface has 1/2: 2 max(0, ao - 1/2)."""
    return np.asarray(2 * np.maximum(0, occlusion - 0.5))


def deviation(occlusion: Texture, truth: Texture, surface: NDArray[np.bool_]) -> Deviation:
    """Return the difference of occlusion from the truth, (H, W) of the half space each, over the surface texels.

    InputError if shapes differ, a number is NaN, an array is masked, or no texel has a surface.
    """
    for name, texture in (("occlusion", occlusion), ("truth", truth)):
        check_texture(name, texture, 2)
    shapes = occlusion.shape, truth.shape, np.shape(surface)
    if len(set(shapes)) > 1 or surface.dtype != np.bool_ or not surface.any():
        raise InputError(f"occlusion, truth and surface have shapes {shapes}, expected one, and a texel with a surface")
    rendered = occlusion[surface].astype(np.float64)
    exact = truth[surface].astype(np.float64)
    error = rendered - exact
    a = rendered - rendered.mean()
    b = exact - exact.mean()
    spread = float(np.sqrt((a * a).sum() * (b * b).sum()))
    correlation = float((a * b).sum()) / spread if spread > 0 else float("nan")
    return Deviation(float(error.mean()), float(np.sqrt((error * error).mean())), correlation)


def draw_against_truth(
    textures: Mapping[str, Texture], truth: Texture, surface: NDArray[np.bool_], limit: float = 0.5, name: str = "rays"
) -> Figure:
    """Return a figure of two rows: the visibility of the truth and of each texture, and the errors below them.

    Textures, (H, W) by name, and truth, of a name, are occlusion of the half space; colours end at errors of limit.
    """
    figure, panels = texture_panels(2, 1 + len(textures), surface)
    for axes, (title, texture) in zip(panels[0], {name: truth, **textures}.items(), strict=True):
        shown = draw_visibility(axes, texture, surface, title)
    figure.colorbar(shown, ax=panels[0], shrink=0.8, label="visibility, 1 - ao")
    panels[1, 0].set_visible(False)
    panels[0, 0].tick_params(labelbottom=True)
    for axes, texture in zip(panels[1, 1:], textures.values(), strict=True):
        error = np.ma.masked_where(~surface, texture - truth)
        found = deviation(texture, truth, surface)
        title = f"RMSE {found.rmse:.3f}\nbias {found.bias:+.3f}"
        shown = draw_texture(axes, error, title, cmap="RdBu_r", vmin=-limit, vmax=limit)
    figure.colorbar(shown, ax=panels[1], shrink=0.8, extend="both", label="ao less the truth\n(red: too dark)")
    return figure
