"""Screen space against ray-cast occlusion: how far off, and where."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Texture = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Deviation:
    """How far occlusion is from the truth, over the surface texels.

    Attributes
    ----------
    bias : float
        Mean of occlusion less the truth.
    rmse : float
        Root mean square of it.
    correlation : float
        Pearson's; NaN where either is the same everywhere.
    """

    bias: float
    rmse: float
    correlation: float


def half_space(occlusion: Texture) -> Texture:
    """Occlusion of the half space from that of LF's whole ball, in which a flat surface has 1/2: 2 max(0, ao - 1/2)."""
    share: Texture = 2 * np.maximum(0, occlusion - 0.5)
    return share


def deviation(occlusion: Texture, truth: Texture, surface: NDArray[np.bool_]) -> Deviation:
    """How far a texture is from the truth.

    Parameters
    ----------
    occlusion, truth : (H, W)
        0 open to 1 covered, of the half space.
    surface : (H, W) bool
        Texels that count.
    """
    mine, exact = occlusion[surface].astype(np.float64), truth[surface].astype(np.float64)
    error = mine - exact
    a, b = mine - mine.mean(), exact - exact.mean()
    spread = float(np.sqrt((a * a).sum() * (b * b).sum()))
    correlation = float((a * b).sum()) / spread if spread > 0 else float("nan")
    return Deviation(float(error.mean()), float(np.sqrt((error * error).mean())), correlation)


def draw_against_truth(
    textures: Mapping[str, Texture], truth: Texture, surface: NDArray[np.bool_], limit: float = 0.5
) -> "Figure":
    """A figure of two rows: the visibility of the truth and of each texture; below them what each is off.

    Parameters
    ----------
    textures : mapping of (H, W)
        Occlusion of the half space by name, at least one.
    truth : (H, W)
        Ray-cast occlusion.
    surface : (H, W) bool
        Texels with a surface.
    limit : float
        Error at which the colours end.
    """
    from matplotlib.figure import Figure  # late: takes a second to import

    height, width = truth.shape
    columns = 1 + len(textures)
    figure = Figure(figsize=(3 * columns, 2 * (3 * height / width + 0.35)), layout="constrained")
    panels = figure.subplots(2, columns, squeeze=False)
    for axes in panels.ravel():
        axes.set_axis_off()
    for axes, (name, texture) in zip(panels[0], {"ray cast": truth, **textures}.items(), strict=True):
        axes.imshow(np.where(surface, 1 - texture, 1), cmap="gray", vmin=0, vmax=1)
        axes.set_title(name, fontsize="medium")
    for axes, texture in zip(panels[1, 1:], textures.values(), strict=True):
        error = np.ma.masked_where(~surface, texture - truth)
        shown = axes.imshow(error, cmap="RdBu_r", vmin=-limit, vmax=limit)
        found = deviation(texture, truth, surface)
        axes.set_title(f"RMSE {found.rmse:.3f}, bias {found.bias:+.3f}", fontsize="medium")
    figure.colorbar(shown, ax=panels[1, 0], shrink=0.8, location="left", label="ao less the truth (red: too dark)",
                    extend="both", fraction=0.5)  # fmt: skip
    return figure
