"""All estimators by name, and the one call that runs any of them on any view."""

from typing import Any

import numpy as np

from lfssao.errors import InputError
from lfssao.estimators import point
from lfssao.estimators.buffers import Buffers
from lfssao.estimators.estimator import Estimator, FloatArray, Value
from lfssao.passes import Occlusion, check_radius

ESTIMATORS: dict[str, Estimator] = {entry.name: entry for family in (point,) for entry in family.ENTRIES}


def find_estimator(name: str) -> Estimator:
    """The estimator of a name.

    Raises
    ------
    InputError
        If there is none.
    """
    if name not in ESTIMATORS:
        raise InputError(f"there is no estimator '{name}': choose one of {', '.join(ESTIMATORS)}")
    return ESTIMATORS[name]


def estimate(
    name: str,
    buffers: Buffers,
    radius: float,
    points: FloatArray | None = None,
    weights: FloatArray | None = None,
    **parameters: Value,
) -> Occlusion:
    """Ambient occlusion of one view by the estimator of a name.

    Parameters
    ----------
    name : str
        One of ``ESTIMATORS``.
    buffers : Buffers
        The view's textures; their dtype is the arithmetic's.
    radius : float
        R, world units.
    points : (n, d) float64, optional
        Samples in the unit ball (d = 3) or disk (d = 2); the estimator's own set of its paper's size otherwise.
    weights : (n,) float64, optional
        What each sample weighs, for estimators that weigh samples; they need not sum to 1.
    parameters : numbers or str
        The estimator's parameters by name, in place of their defaults.

    Returns
    -------
    Occlusion
        Texture (H, W) in depth's dtype, 0 open to 1 covered, 0 where there is no surface.

    Raises
    ------
    InputError
        If the name, a sample set, a parameter or the radius is wrong, or normals are needed and not there.
    """
    estimator = find_estimator(name)
    check_radius(radius)
    unknown = sorted(set(parameters) - set(estimator.parameters))
    if unknown:
        known = ", ".join(estimator.parameters) or "none"
        raise InputError(f"estimator {name} has no parameter '{unknown[0]}': it has {known}")
    if estimator.normals and buffers.normals is None:
        raise InputError(f"estimator {name} reads normals, and there is no normals texture")
    if points is None:
        points, weights = estimator.default_samples()
    else:
        _check_samples(estimator, points, weights)
    return estimator.run(buffers, radius, points, weights, **{**estimator.parameters, **parameters})


def _check_samples(estimator: Estimator, points: Any, weights: Any) -> None:
    shape, d = np.shape(points), estimator.dimensions
    if d == 0:
        raise InputError(f"estimator {estimator.name} takes no samples")
    if len(shape) != 2 or shape[1] != d or shape[0] == 0:
        raise InputError(f"estimator {estimator.name}: samples have shape {shape}, expected (n, {d}) with n at least 1")
    if not np.isfinite(points).all():
        raise InputError(f"estimator {estimator.name}: a sample is not finite")
    if weights is not None and (np.shape(weights) != shape[:1] or not np.isfinite(weights).all()):
        raise InputError(f"estimator {estimator.name}: weights must be {shape[0]} finite numbers")
