"""Whether AO is the same from module to module: what one surface point is given by all modules that see it.

Screen-space AO depends on what a module sees, so a surface point gets other values from other modules, and to a viewer
who walks along the display it shimmers. Points are taken from one module's positions texture and followed into the
others' textures, or into the photographs of a walking eye, where they are read at the nearest texel, as they are shown.
A view-independent texture, such as ray-cast occlusion, read in the same way, tells how much of the spread is due to the
reading itself.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfssao.display import Display
from lfssao.errors import InputError
from lfssao.raycast import GBuffer, RayCaster
from lfssao.scene.mesh import Mesh
from lfssao.view import View
from lfssao.viewer import LightField, eye_view

Points = NDArray[np.float64]
Values = NDArray[np.float64]
Texture = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Spread:
    """How much the values that points were given differ.

    Attributes
    ----------
    points : int
        How many points were seen at least twice; all else is over these.
    views : float
        In how many textures a point is seen, mean.
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
    """World coordinates of visible surface points of a texture, at most so many, evenly spread over its texels."""
    found = gbuffer.positions[gbuffer.triangle >= 0].astype(np.float64)
    step = max(1, -(-len(found) // most))
    return np.ascontiguousarray(found[::step])


def read_at(points: Points, view: View, gbuffer: GBuffer, texture: Texture, same: float) -> Values:
    """What a texture holds for each point, (n,) float64: of the texel it lands in, NaN where the view does not see it.

    Parameters
    ----------
    points : (n, 3) float64
        World coordinates.
    view : View
        Whose texture.
    gbuffer : GBuffer
        What it sees.
    texture : (H, W)
        What to read.
    same : float
        The view sees a point if the surface at that texel is no farther than this from it, world units.
    """
    image = view.world_to_image(points)
    inside = (image[:, 0] >= 0) & (image[:, 0] < view.width) & (image[:, 1] >= 0) & (image[:, 1] < view.height)
    u, v = (np.where(inside, image[:, axis], 0).astype(np.int64) for axis in (0, 1))
    away = gbuffer.positions[v, u].astype(np.float64) - points
    near = np.where(np.isfinite(away).all(axis=1), (away * away).sum(axis=1), np.inf) <= same * same
    return np.where(inside & near, texture[v, u].astype(np.float64), np.nan)


def over_modules(
    points: Points, views: Sequence[View], gbuffers: Sequence[GBuffer], textures: Sequence[Texture], same: float
) -> Values:
    """What each module gives each point, (n, modules) float64; arguments as of ``read_at``, one a module."""
    read = [read_at(points, *module, same) for module in zip(views, gbuffers, textures, strict=True)]
    return np.stack(read, axis=1)


class Stop(NamedTuple):
    """A place on a viewer's path and what is seen from there: metres along the observer line, view and G-buffer."""

    eye: float
    view: View
    gbuffer: GBuffer


def path(display: Display, mesh: Mesh, world: NDArray[np.float64], eyes: Iterable[float], width: int) -> list[Stop]:
    """What an eye that walks along the observer line sees of the surface itself.

    Parameters
    ----------
    display : Display
        A display with the linear diffuser and a flat screen.
    mesh : Mesh
        The scene.
    world : (3, 4) float64
        World -> physical.
    eyes : floats
        Places along the observer line, metres.
    width : int
        Texels of each view.

    Raises
    ------
    InputError
        As ``eye_view``.
    """
    stops = []
    for eye in eyes:
        view = eye_view(display, world, eye, width)
        stops.append(Stop(eye, view, RayCaster(mesh, view.cast_from_world).gbuffer(view, color=None)))
    return stops


def along_path(
    points: Points,
    display: Display,
    textures: dict[int, Texture],
    stops: Iterable[Stop],
    same: float,
    blend: str = "linear",
) -> Values:
    """What an eye that walks along the observer line sees at each point, (n, eyes) float64, NaN where it sees it not.

    Parameters
    ----------
    points : (n, 3) float64
        World coordinates.
    display : Display
        A display with the linear diffuser and a flat screen, of at least two modules.
    textures : dict of (H, W) float32
        What each module shows; values outside surfaces are shown as they are.
    stops : iterable of Stop
        The path (``path``).
    same : float
        As for ``read_at``.
    blend : str
        As for ``LightField.photograph``.

    Raises
    ------
    InputError
        As ``LightField``.
    """
    shown = LightField(display, textures, channels=1)
    for index, texture in textures.items():
        shown.put(index, np.ascontiguousarray(texture[..., None], np.float32))
    read = [
        read_at(points, view, seen, shown.photograph(eye, view.width, blend).image[..., 0], same)
        for eye, view, seen in stops
    ]
    return np.stack(read, axis=1)


def spread(values: Values) -> Spread:
    """How much points' values differ over the views, (n, views) with NaN where a view does not see a point.

    Raises
    ------
    InputError
        If no point is seen twice.
    """
    seen = np.isfinite(values)
    count = seen.sum(axis=1)
    often = count >= 2
    if not often.any():
        raise InputError("no point is seen by two views")
    kept, there, count = np.where(seen, values, 0.0)[often], seen[often], count[often]
    mean = kept.sum(axis=1) / count
    square = np.where(there, (kept - mean[:, None]) ** 2, 0.0).sum(axis=1) / count
    deviation = np.sqrt(square)
    low, high = np.where(there, kept, np.inf).min(axis=1), np.where(there, kept, -np.inf).max(axis=1)
    return Spread(
        points=int(often.sum()),
        views=float(count.mean()),
        deviation=float(deviation.mean()),
        deviation_95=float(np.percentile(deviation, 95)),
        range=float((high - low).mean()),
    )
