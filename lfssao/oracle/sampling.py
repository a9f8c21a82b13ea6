"""What an estimator of points is asked for: its textures, radius, samples and options, and what arithmetic may do."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.estimators.estimator import Value
from lfssao.oracle.bounds import FloatArray
from lfssao.oracle.error_model import ErrorModel
from lfssao.oracle.texels import Surfaces


@dataclass(frozen=True, eq=False)
class Sampling:
    """One call of an estimator.

    Attributes
    ----------
    surfaces : Surfaces
        What it is given.
    radius : float
        R, world units.
    points : (n, 3) float64
        Offsets in the unit ball.
    weights : (n,) or None
        Their weights, read by VO's.
    options : mapping
        All of the estimator's parameters.
    model : ErrorModel
        What float32 arithmetic may do.
    """

    surfaces: Surfaces
    radius: float
    points: FloatArray
    weights: NDArray[np.floating[Any]] | None
    options: Mapping[str, Value]
    model: ErrorModel
