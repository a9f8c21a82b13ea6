"""Depth and positions textures of a wall and balls, made by basic operations alone: no mesh and no Embree is needed."""

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from lfssao.optics.kernels.projection import affine_row
from lfssao.optics.kernels.rays import image_depth, texel_ray
from lfssao.optics.view import View

FloatTexture = NDArray[np.float32]
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Scene:
    """A wall with balls before it, in cast space: physical space of a display, eye space of a camera.

    The wall is z = a + b x + c y, seen where abs(x) is at most the half-width; beyond there is no surface.
    """

    wall: tuple[float, float, float, float]  # a, b, c and the half-width
    balls: tuple[tuple[Vector, float], ...]  # centres and radii


# For screens about 1 m wide: a slanted wall behind the screen's plane, a ball through it and one before it.
SCENE = Scene((0.16, 0.2, -0.1, 0.36), (((-0.12, 0.05, 0.05), 0.14), ((0.2, -0.1, -0.12), 0.11)))
NOTHING = Scene((0.0, 0.0, 0.0, -1.0), ())


def textures(view: View, scene: Scene) -> tuple[FloatTexture, FloatTexture]:
    """Depth, (H, W), and positions, (H, W, 3), of a scene in a view; +infinity where there is no surface."""
    depth = np.full((view.height, view.width), np.inf, np.float32)
    positions = np.full((view.height, view.width, 3), np.inf, np.float32)
    world = np.ravel(view.world_from_cast)
    for row, column in np.ndindex(depth.shape):
        ray = texel_ray(view.rays, column + 0.5, row + 0.5)
        z = _first_hit(ray, scene)
        if z < inf:
            depth[row, column] = image_depth(view.rays, z)
            x = ray[0] + z * ray[3]
            y = ray[1] + z * ray[4]
            positions[row, column] = [affine_row(world, k, x, y, z) for k in range(3)]
    return depth, positions


def _first_hit(ray: tuple[float, ...], scene: Scene) -> float:
    """The z at which a ray first meets the scene, or infinity; rays have direction z = 1, origin z = 0."""
    ox, oy, _, dx, dy, _, near, far = ray
    if not near < far:
        return inf
    a, b, c, half = scene.wall
    z = ((a + b * ox) + c * oy) / (1.0 - (b * dx + c * dy))
    hits = [z] if abs(ox + z * dx) <= half else []
    for (x, y, w), radius in scene.balls:
        px = ox - x
        py = oy - y
        square = (dx * dx + dy * dy) + 1.0
        middle = (px * dx + py * dy) - w
        discriminant = middle * middle - square * (((px * px + py * py) + w * w) - radius * radius)
        if discriminant > 0.0:
            hits.append((-middle - sqrt(discriminant)) / square)
    return min((z for z in hits if near < z < far), default=inf)
