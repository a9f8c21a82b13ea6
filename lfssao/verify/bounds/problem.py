"""The arguments that bounds of an estimator are made of: textures and mapping, samples, options and the error model."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Value
from lfssao.ao.textures import Buffers
from lfssao.verify.bounds.bounds import FloatArray, Texture
from lfssao.verify.bounds.error_model import ErrorModel

Options = Mapping[str, Value]
Weights = NDArray[np.floating[Any]] | None
NOTHING = np.empty((0, 0, 3), np.float32)


class Problem(NamedTuple):
    """The arguments of ``point_bounds``, checked, but for the radius."""

    seen: Buffers  # float32
    points: FloatArray
    weights: Weights
    options: Options
    model: ErrorModel


def single(numbers: Any) -> FloatArray:
    """Numbers as a renderer has them: rounded to float32, held as float64."""
    return np.asarray(numbers).astype(np.float32).astype(np.float64)


def contiguous(texture: Texture | None) -> Texture:
    """A texture of vectors as kernels take it, of no texels for None."""
    return NOTHING if texture is None else np.ascontiguousarray(texture)
