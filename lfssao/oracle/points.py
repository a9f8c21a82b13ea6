"""Bounds of the estimators that, as Algorithms 1 and 2, count decisions about points of a ball: one outcome a point.

``point``, ``hemisphere``, ``vo-points`` and ``vo-points-normal``. Each point is occluded, clear or open as in
``lfssao.kernels.outcomes``; what these estimators decide beside the depth has outcomes of its own:

- The half ball's turn, offset . normal < 0. Where rounding may change the sign both sides are taken: the point is
  occluded if both are, clear if both are, else open. (VO's reflection by the tangent plane is no decision: its lift
  min(above, 0) has no jump, so an error of ``above`` is one of the place.)
- The range check, distance^2 <= reach, or distance <= R; and VO's thickness, z - z_Q <= reach. A point is occluded for
  sure if it lies behind and in range for sure, and may be if it may be both.
- Line 7's other form, and VO on cameras: the surface's depth is made from a position and has an error itself.

Shares grow with each decision, the remap 2 max(0, share - 1/2) with the share, and both ways of VO to make one of two
radii with each of the two: bounds go through. VO's points have weights, whose sum takes the place of the count.

The other estimators are no counts: they sum distances, horizons and areas that jump where a look-up falls into another
texel, by as much as the surface there differs. No interval of them is known; they must have equal bits.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.estimators.estimator import Value
from lfssao.matrix import Matrix
from lfssao.oracle.bounds import Bounds, FloatArray, Texture
from lfssao.oracle.error_model import ErrorModel, find_model
from lfssao.oracle.sampling import Sampling
from lfssao.oracle.shares import shares_behind
from lfssao.oracle.texels import Surfaces
from lfssao.oracle.volumes import hidden_volume
from lfssao.view import WorldToImage


@dataclass(frozen=True, eq=False)
class Estimate:
    """How another estimator than LF's was run.

    Attributes
    ----------
    name : str
        Of the estimator.
    points, weights : (n, 3), (n,) float64, or None
        Its samples.
    options : mapping
        All of its parameters.
    cast_from_world : (3, 4)
        Of the view.
    """

    name: str
    points: FloatArray | None
    weights: FloatArray | None
    options: Mapping[str, Value]
    cast_from_world: Matrix

    @property
    def is_bounded(self) -> bool:
        """Whether intervals are known, of a view whose directions are not."""
        return self.name in BOUNDED and not float(self.options.get("thickness", 0.0)) > 0

    def bounds(
        self,
        depth: Texture,
        positions: Texture,
        normals: Texture | None,
        world_to_image: WorldToImage,
        radius: float,
        model: ErrorModel,
    ) -> Bounds | None:
        """Bounds of its occlusion of these textures, None where there is none; arguments as of ``point_bounds``."""
        if self.points is None:
            return None
        given = Surfaces(depth, positions, world_to_image, self.cast_from_world, normals)
        return point_bounds(self.name, given, radius, self.points, self.weights, self.options, model)


def point_bounds(
    name: str,
    surfaces: Surfaces,
    radius: float,
    points: NDArray[np.floating[Any]],
    weights: NDArray[np.floating[Any]] | None,
    options: Mapping[str, Value],
    model: str | ErrorModel = "shader",
) -> Bounds | None:
    """Bounds of an estimator's occlusion.

    Parameters
    ----------
    name : str
        Of the estimator.
    surfaces : Surfaces
        What it is given.
    radius : float
        R, world units.
    points : (n, 3)
        Offsets in the unit ball.
    weights : (n,) or None
        Their weights, read by VO's.
    options : mapping
        All of the estimator's parameters.
    model : str or ErrorModel
        What float32 arithmetic may do; not an exact one, under which there is one right value.

    Returns
    -------
    Bounds or None
        None where no interval is known: of another estimator, or where a texture that it reads is not given.

    Raises
    ------
    InputError
        If there is no such model, or weights are wrong.
    """
    if name not in _BOUNDS or (name in NORMALS and surfaces.normals is None):
        return None
    if float(options.get("thickness", 0.0)) > 0 and surfaces.directions is None:
        return None
    table = np.asarray(points, np.float64)
    return _BOUNDS[name](Sampling(surfaces, radius, table, weights, options, find_model(model)))


_BOUNDS: dict[str, Callable[[Sampling], Bounds]] = {
    "point": partial(shares_behind, False),
    "hemisphere": partial(shares_behind, True),
    "vo-points": partial(hidden_volume, False),
    "vo-points-normal": partial(hidden_volume, True),
}

# Those of them that read normals.
NORMALS = ("hemisphere", "vo-points-normal")

# The estimators of which intervals are known.
BOUNDED = tuple(_BOUNDS)
