"""Bounds of the estimators that, as Algorithms 1 and 2, count decisions about points of a ball: one outcome a point.

``point``, ``hemisphere``, ``vo-points`` and ``vo-points-normal``. Each point is occluded, clear or undecided as in
``lfssao.kernels.outcomes``. These estimators decide more than the depth:

- The half ball's turn, offset . normal < 0. Where rounding may change the sign both sides are taken: the point is
  occluded if both are, clear if both are, else undecided. (VO's reflection by the tangent plane is no decision: its
  lift min(above, 0) has no jump, so an error of ``above`` is one of the place.)
- The range check, distance^2 <= reach, or distance <= R; and VO's thickness, z - z_Q <= reach. A point is occluded for
  sure if it lies behind and in range for sure, and may be if it may be both.
- Line 7's other form, and VO on cameras: the surface's depth is made from a position and has an error itself.

Occlusion grows with each decision, the remap 2 max(0, occlusion - 1/2) with the occlusion, and both ways of VO to make
one of two radii with each of the two: bounds go through. VO's points have weights, whose sum takes the place of the
count.

The other estimators are no counts: they sum distances, horizons and areas that jump where a look-up falls into another
texel, by as much as the surface there differs. No interval of them is known; they must have equal bits.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.estimators.estimator import Value
from lfssao.oracle.bounds import Bounds
from lfssao.oracle.error_model import ErrorModel, find_model
from lfssao.oracle.shares import fraction_behind
from lfssao.oracle.texels import Sampling, Surfaces
from lfssao.oracle.volumes import hidden_volume


def point_bounds(
    name: str,
    surfaces: Surfaces,
    radius: float,
    points: NDArray[np.floating[Any]] | None,
    weights: NDArray[np.floating[Any]] | None,
    options: Mapping[str, Value],
    model: str | ErrorModel = "shader",
) -> Bounds | None:
    """Bounds of an estimator's occlusion.

    Parameters
    ----------
    name : str
        Name of the estimator.
    surfaces : Surfaces
        What it is given.
    radius : float
        R, world units.
    points : (n, 3) or None
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
        None where no interval is known: the estimator counts no points, or a texture that it reads is missing.

    Raises
    ------
    InputError
        If there is no such model, or weights are wrong.
    """
    if not is_bounded(name, options, surfaces.directions is not None) or points is None:
        return None
    if name in NORMALS and surfaces.normals is None:
        return None
    table = np.asarray(points, np.float64)
    return _BOUNDS[name](Sampling(surfaces, radius, table, weights, options, find_model(model)))


def is_bounded(name: str, options: Mapping[str, Value], directions: bool = False) -> bool:
    """Whether intervals of an estimator's occlusion are known; with a thickness those of known directions only."""
    return name in BOUNDED and (directions or not float(options.get("thickness", 0.0)) > 0)


_BOUNDS: dict[str, Callable[[Sampling], Bounds]] = {
    "point": partial(fraction_behind, False),
    "hemisphere": partial(fraction_behind, True),
    "vo-points": partial(hidden_volume, False),
    "vo-points-normal": partial(hidden_volume, True),
}

# Those of them that read normals.
NORMALS = ("hemisphere", "vo-points-normal")

# The estimators of which intervals are known.
BOUNDED = tuple(_BOUNDS)
