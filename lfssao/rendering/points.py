"""Points of the surface, found in the textures of other views than the one that they come from."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.optics.view import View

Points = NDArray[np.float64]
Values = NDArray[np.float64]
Places = NDArray[np.int64]
Texture = NDArray[np.floating[Any]]


def spread_points(positions: Texture, most: int) -> Points:
    """Return world coordinates, (n, 3), of at most ``most`` surface texels of positions, (H, W, 3), spread evenly."""
    found = positions[np.isfinite(positions).all(axis=2)].astype(np.float64)
    step = max(1, -(-len(found) // most))
    return np.ascontiguousarray(found[::step])


def places_of(points: Points, view: View, positions: Texture, same: float) -> Places:
    """Return the texel of each point in a view, (n,) int64: row times width plus column, -1 where it is not seen.

    Points are (n, 3) world coordinates; positions are the view's, (H, W, 3), without guard band. It sees a point if the
    surface at the nearest texel is no farther than ``same`` from it, world units.
    """
    height, width = positions.shape[:2]
    image = view.world_to_image(points)[:, :2] - view.guard
    inside = np.asarray(((image >= 0) & (image < (width, height))).all(axis=1))  # not where it is NaN
    u, v = np.where(inside[:, None], image, 0).astype(np.int64).T
    x, y, z = (positions[v, u].astype(np.float64) - points).T  # infinite where there is no surface
    return np.where(inside & ((x * x + y * y) + z * z <= same * same), v * width + u, -1)


def read_at(places: Places, texture: Texture) -> Values:
    """Return a texture's values, (H, W), at the places of points, (n,) float64; NaN where the view does not see one."""
    return np.where(places >= 0, texture.reshape(-1)[places].astype(np.float64), np.nan)
