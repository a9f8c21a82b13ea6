"""Agreement of the modules: the occlusion that each gives the same surface point.

Screen-space AO depends on what a module sees, so a surface point gets other values from other modules, and shimmers for
a viewer who walks along the display. Points come from one module's positions texture; the others' textures are read at
the nearest texel, as they are shown. A view-independent texture, such as ray-cast occlusion, read in the same way,
shows how much of the spread is due to the reading itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.gbuffer.caster import GBuffer
from lfssao.optics.view import View
from lfssao.rendering.points import Points, Texture, Values, places_of, read_at, spread_points
from lfssao.viz.panels import texture_panels


@dataclass(frozen=True)
class Spread:
    """Difference of the values that the modules give to points."""

    points: int  # number of points that are seen at least twice; all else is over these
    views: float  # number of textures in which a point is seen, mean
    deviation: float  # standard deviation of a point's values, mean over the points
    deviation_95: float  # its 95th percentile
    range: float  # largest less smallest of a point's values, mean


def surface_points(gbuffer: GBuffer, most: int = 20_000) -> Points:
    """Return world coordinates of at most ``most`` visible surface points, spread evenly over a texture."""
    assert gbuffer.positions is not None
    return spread_points(gbuffer.positions, most)


def over_modules(
    points: Points, views: Sequence[View], gbuffers: Sequence[GBuffer], textures: Sequence[Texture], same: float
) -> Values:
    """Return all modules' values at each point, (n, modules) float64, NaN where a module does not see it.

    A view, G-buffer and texture a module, without guard bands; same: as of ``places_of``.
    """
    read = []
    for view, gbuffer, texture in zip(views, gbuffers, textures, strict=True):
        assert gbuffer.positions is not None
        read.append(read_at(places_of(points, view, gbuffer.positions, same), texture))
    return np.stack(read, axis=1)


def point_deviations(values: Values) -> NDArray[np.float64]:
    """Standard deviation of each point's values by ``over_modules``, (n,); NaN if fewer than two views see it."""
    often = np.isfinite(values).sum(axis=1) >= 2
    out = np.full(len(values), np.nan)
    out[often] = np.nanstd(values[often], axis=1)
    return out


def spread(values: Values) -> Spread:
    """Return how much points' values differ over the views, (n, views) with NaN where a view does not see a point.

    InputError if no point is seen twice.
    """
    deviations = point_deviations(values)
    kept = values[np.isfinite(deviations)]
    deviation = deviations[np.isfinite(deviations)]
    if not len(kept):
        raise InputError("no point is seen by two views")
    return Spread(
        points=len(kept),
        views=float(np.isfinite(kept).sum(axis=1).mean()),
        deviation=float(deviation.mean()),
        deviation_95=float(np.percentile(deviation, 95)),
        range=float((np.nanmax(kept, axis=1) - np.nanmin(kept, axis=1)).mean()),
    )


def draw_disagreement(view: View, points: Points, values: Mapping[str, Values]) -> Figure:
    """Return a figure of points, (n, 3), in one module's view, coloured by the disagreement of the modules.

    Values are results of ``over_modules`` by the name of a way to compute AO.
    """
    image = view.world_to_image(points)
    surface = np.zeros((view.height, view.width), np.bool_)
    surface[image[:, 1].astype(int), image[:, 0].astype(int)] = True
    figure, (panels,) = texture_panels(1, len(values), surface)
    for axes, (name, found) in zip(panels, values.items(), strict=True):
        deviations = point_deviations(found)
        order = np.argsort(np.nan_to_num(deviations, nan=-1.0))
        shown = axes.scatter(*image[order, :2].T, c=deviations[order], s=4, cmap="magma_r", vmin=0, vmax=0.1)
        part = np.mean(deviations[np.isfinite(deviations)] > 0.05)
        axes.set_title(f"{name}: mean {np.nanmean(deviations):.3f}\nabove 0.05: {part:.1%}", fontsize="medium")
    label = "standard deviation of ao\nover the views"
    figure.colorbar(shown, ax=panels, shrink=0.8, label=label, extend="max")
    return figure
