"""Surface points over the modules: what each gives the same point, and where they disagree."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lfssao.figures.agreement import Points, Values
from lfssao.view import View

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def point_deviations(values: Values) -> NDArray[np.float64]:
    """Standard deviation of each point's values, (n,), NaN where fewer than two views see it.

    Parameters
    ----------
    values : (n, views) float64
        ``lfssao.figures.agreement.over_modules``: NaN where a view does not see a point.
    """
    seen = np.isfinite(values)
    count = seen.sum(axis=1)
    often = count >= 2
    share = np.where(often, count, 1)
    mean = np.where(seen, values, 0).sum(axis=1) / share
    square = np.where(seen, (values - mean[:, None]) ** 2, 0).sum(axis=1) / share
    return np.where(often, np.sqrt(square), np.nan)


def draw_disagreement(view: View, points: Points, values: Mapping[str, Values]) -> "Figure":
    """A figure: for each way to compute AO, the points in one module's texture by how much the modules disagree there.

    Parameters
    ----------
    view : View
        The module whose texture the points are drawn in.
    points : (n, 3) float64
        World coordinates.
    values : mapping of (n, views) float64
        By name, what the modules give the points.
    """
    from matplotlib.figure import Figure  # late: takes a second to import

    image = view.world_to_image(points)
    columns = len(values) + 1
    figure = Figure(figsize=(3.6 * columns, 3.2), layout="constrained")
    panels = figure.subplots(1, columns, squeeze=False)[0]
    for axes, (name, found) in zip(panels, values.items(), strict=False):
        deviations = point_deviations(found)
        order = np.argsort(np.nan_to_num(deviations, nan=-1.0))
        axes.scatter(*image[order, :2].T, c=deviations[order], s=4, cmap="magma_r", vmin=0, vmax=0.15)
        axes.set(aspect="equal", xticks=[], yticks=[], xlim=(0, view.width), ylim=(view.height, 0))
        axes.set_title(f"{name}: mean {np.nanmean(deviations):.3f}", fontsize="medium")
    figure.colorbar(panels[0].collections[0], ax=panels[-2], shrink=0.8, label="sd over the modules", extend="max")
    for name, found in values.items():
        deviations = point_deviations(found)
        known = np.sort(deviations[np.isfinite(deviations)])
        panels[-1].plot(known, np.linspace(0, 1, len(known)), label=name)
    panels[-1].set(title="share of the points", xlabel="sd over the modules, at most", xlim=(0, 0.15), ylim=(0, 1.02))
    panels[-1].grid(alpha=0.3)
    panels[-1].legend(fontsize="small", loc="lower right")
    return figure
