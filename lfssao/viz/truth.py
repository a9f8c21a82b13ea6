"""Error of screen-space occlusion against ray-cast occlusion."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

Texture = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Deviation:
    """Difference of occlusion from the truth over the surface texels."""

    bias: float  # mean of occlusion less the truth
    rmse: float  # root mean square of it
    correlation: float  # Pearson's; NaN if either is constant


def half_space(occlusion: Texture) -> Texture:
    """Occlusion of the half space from that of LF's whole ball, in which a flat surface has 1/2: 2 max(0, ao - 1/2)."""
    half: Texture = 2 * np.maximum(0, occlusion - 0.5)
    return half


def deviation(occlusion: Texture, truth: Texture, surface: NDArray[np.bool_]) -> Deviation:
    """Return the difference of occlusion from the truth, (H, W) of the half space each, over the surface texels."""
    mine, exact = occlusion[surface].astype(np.float64), truth[surface].astype(np.float64)
    error = mine - exact
    a, b = mine - mine.mean(), exact - exact.mean()
    spread = float(np.sqrt((a * a).sum() * (b * b).sum()))
    correlation = float((a * b).sum()) / spread if spread > 0 else float("nan")
    return Deviation(float(error.mean()), float(np.sqrt((error * error).mean())), correlation)


def draw_against_truth(
    textures: Mapping[str, Texture], truth: Texture, surface: NDArray[np.bool_], limit: float = 0.5, name: str = "rays"
) -> Figure:
    """Return a figure of two rows: the visibility of the truth and of each texture, and the errors below them.

    Textures, (H, W) by name, and truth, of a name, are occlusion of the half space; colours end at errors of limit.
    """
    height, width = truth.shape
    columns = 1 + len(textures)
    figure = Figure(figsize=(3 * columns, 2 * (3 * height / width + 0.35)), layout="constrained")
    panels = figure.subplots(2, columns, squeeze=False)
    for axes in panels.ravel():
        axes.set_axis_off()
    for axes, (title, texture) in zip(panels[0], {name: truth, **textures}.items(), strict=True):
        axes.imshow(np.where(surface, 1 - texture, 1), cmap="gray", vmin=0, vmax=1)
        axes.set_title(title, fontsize="medium")
    for axes, texture in zip(panels[1, 1:], textures.values(), strict=True):
        error = np.ma.masked_where(~surface, texture - truth)
        shown = axes.imshow(error, cmap="RdBu_r", vmin=-limit, vmax=limit)
        found = deviation(texture, truth, surface)
        axes.set_title(f"RMSE {found.rmse:.3f}, bias {found.bias:+.3f}", fontsize="medium")
    bar = figure.colorbar(shown, ax=panels[1, 0], shrink=0.8, location="left", extend="both", fraction=0.5)
    bar.set_label("ao less the truth (red: too dark)")
    return figure
