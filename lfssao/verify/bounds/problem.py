"""What bounds of an estimator are made of: textures and mapping, samples, options and the error model."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Value
from lfssao.core.affine import Matrix
from lfssao.optics.view import WorldToImage
from lfssao.verify.bounds.bounds import FloatArray, Texture
from lfssao.verify.bounds.error_model import ErrorModel

Options = Mapping[str, Value]
Weights = NDArray[np.floating[Any]] | None
NOTHING = np.empty((0, 0, 3), np.float32)


@dataclass(frozen=True, eq=False)
class Surfaces:
    """The float32 textures and the mapping that an estimator's points are decided by.

    Renderers have the mapping's numbers, and those of ``cast_from_world`` that VO reads, rounded to float32.
    """

    depth: Texture  # (H, W): image z, +infinity where there is no surface
    positions: Texture  # (H, W, 3): world coordinates
    world_to_image: WorldToImage
    cast_from_world: Matrix  # (3, 4)
    normals: Texture | None = None  # (H, W, 3): unit normals, for estimators that read them
    directions: Texture | None = None  # (H, W, 3): unit viewing directions, for VO's lines and thickness
    turns: Texture | None = None  # (2, H, W): cosine and sine by which each texel's points are turned
    right: FloatArray | None = None  # (3,): the view's rightward direction in the world, for VO's lines


class Problem(NamedTuple):
    """The arguments of ``point_bounds``, checked, but for the radius."""

    surfaces: Surfaces
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
