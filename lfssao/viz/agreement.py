"""Agreement of the modules: the occlusion that each gives the same surface point, and where they disagree.

Screen-space AO depends on what a module sees, so a surface point gets other values from other modules, and shimmers for
a viewer who walks along the display. Points are taken from one module's positions texture and followed into the others'
textures, where they are read at the nearest texel, as they are shown. A view-independent texture, such as ray-cast
occlusion, read in the same way, shows how much of the spread is due to the reading itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.gbuffer.caster import GBuffer
from lfssao.optics.view import View

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Points = NDArray[np.float64]
Values = NDArray[np.float64]
Texture = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Spread:
    """How much the values that points were given differ.

    Attributes
    ----------
    points : int
        Points that were seen at least twice; all else is over these.
    views : float
        Number of textures in which a point is seen, mean.
    deviation : float
        Standard deviation of a point's values, mean over the points.
    deviation_95 : float
        Its 95th percentile.
    range : float
        Largest less smallest of a point's values, mean.
    """

    points: int
    views: float
    deviation: float
    deviation_95: float
    range: float


def surface_points(gbuffer: GBuffer, most: int = 20_000) -> Points:
    """World coordinates of at most ``most`` visible surface points of a texture, evenly spread over its texels."""
    assert gbuffer.positions is not None  # where points are compared they are kept
    found = gbuffer.positions[gbuffer.triangle >= 0].astype(np.float64)
    step = max(1, -(-len(found) // most))
    return np.ascontiguousarray(found[::step])


def read_at(points: Points, view: View, gbuffer: GBuffer, texture: Texture, same: float) -> Values:
    """Read a texture at the texel of each point, (n,) float64; NaN where the view does not see the point.

    Parameters
    ----------
    points : (n, 3) float64
        World coordinates.
    view : View
        Whose texture.
    gbuffer : GBuffer
        Its depth and positions.
    texture : (H, W)
        The texture.
    same : float
        The view sees a point if the surface at that texel is no farther than this from it, world units.
    """
    image = view.world_to_image(points)
    inside = (image[:, 0] >= 0) & (image[:, 0] < view.width) & (image[:, 1] >= 0) & (image[:, 1] < view.height)
    u, v = (np.where(inside, image[:, axis], 0).astype(np.int64) for axis in (0, 1))
    assert gbuffer.positions is not None
    away = gbuffer.positions[v, u].astype(np.float64) - points
    near = np.where(np.isfinite(away).all(axis=1), (away * away).sum(axis=1), np.inf) <= same * same
    return np.where(inside & near, texture[v, u].astype(np.float64), np.nan)


def over_modules(
    points: Points, views: Sequence[View], gbuffers: Sequence[GBuffer], textures: Sequence[Texture], same: float
) -> Values:
    """Read all modules' textures at each point, (n, modules) float64; arguments as of ``read_at``, one a module."""
    read = [read_at(points, *module, same) for module in zip(views, gbuffers, textures, strict=True)]
    return np.stack(read, axis=1)


def point_deviations(values: Values) -> NDArray[np.float64]:
    """Standard deviation of each point's values, (n,), NaN where fewer than two views see it.

    Parameters
    ----------
    values : (n, views) float64
        ``over_modules``: NaN where a view does not see a point.
    """
    seen = np.isfinite(values)
    count = seen.sum(axis=1)
    often = count >= 2
    share = np.where(often, count, 1)
    mean = np.where(seen, values, 0).sum(axis=1) / share
    square = np.where(seen, (values - mean[:, None]) ** 2, 0).sum(axis=1) / share
    return np.where(often, np.sqrt(square), np.nan)


def spread(values: Values) -> Spread:
    """How much points' values differ over the views, (n, views) with NaN where a view does not see a point.

    Raises
    ------
    InputError
        If no point is seen twice.
    """
    kept = values[np.isfinite(values).sum(axis=1) >= 2]
    if not len(kept):
        raise InputError("no point is seen by two views")
    deviation = point_deviations(kept)
    return Spread(
        points=len(kept),
        views=float(np.isfinite(kept).sum(axis=1).mean()),
        deviation=float(deviation.mean()),
        deviation_95=float(np.percentile(deviation, 95)),
        range=float((np.nanmax(kept, axis=1) - np.nanmin(kept, axis=1)).mean()),
    )


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
