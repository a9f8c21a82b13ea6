"""Points of the surface, read in the textures of views."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.gbuffer.caster import GBuffer
from lfssao.optics.view import View

Points = NDArray[np.float64]
Values = NDArray[np.float64]
Texture = NDArray[np.floating[Any]]


def read_at(points: Points, view: View, gbuffer: GBuffer, texture: Texture, same: float) -> Values:
    """Return a texture's values at the texel of each point, (n,) float64; NaN where the view does not see it.

    Points are (n, 3) world coordinates, and gbuffer is the view's. It sees a point if the surface at that texel is no
    farther than ``same`` from it, world units.
    """
    image = view.world_to_image(points)
    inside = (image[:, 0] >= 0) & (image[:, 0] < view.width) & (image[:, 1] >= 0) & (image[:, 1] < view.height)
    u, v = (np.where(inside, image[:, axis], 0).astype(np.int64) for axis in (0, 1))
    assert gbuffer.positions is not None
    away = gbuffer.positions[v, u].astype(np.float64) - points
    near = np.where(np.isfinite(away).all(axis=1), (away * away).sum(axis=1), np.inf) <= same * same
    return np.where(inside & near, texture[v, u].astype(np.float64), np.nan)
