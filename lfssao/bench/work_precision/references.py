"""The texture that an estimator tends to with many samples, and the error of that texture itself."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Texture = NDArray[np.float64]

# A reference serves an error that is at least this many times its own.
MARGIN = 10.0


@dataclass(frozen=True, eq=False)
class Reference:
    """The texture that an estimator tends to."""

    texture: Texture  # (t,) float64: mean of the independent references, occlusion of the surface texels
    error: float  # its own RMSE, estimated from how far the references lie apart


def rms(errors: ArrayLike) -> float:
    """Root mean square; 0 of nothing."""
    numbers: NDArray[Any] = np.asarray(errors, np.float64)
    return float(np.sqrt(np.mean(np.square(numbers)))) if numbers.size else 0.0


def combine_others(textures: Mapping[str, Texture], sampler: str) -> Reference:
    """Return a sampler's reference from the independent textures, (t,) float64 by sampler, of two or more others.

    The sample variance of k independent textures of equal error, over k, is the variance of their mean. A bias that
    they share does not show.
    """
    stack = np.stack([texture for name, texture in textures.items() if name != sampler])
    variance = stack.var(axis=0, ddof=1).mean() / len(stack) if stack.size else 0.0
    return Reference(stack.mean(axis=0), float(np.sqrt(variance)))
