"""Error that an estimator makes by the number of its samples alone, against references whose own error is known."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Texture = NDArray[np.float64]

# A reference serves an error that is at least this many times its own.
MARGIN = 10.0


@dataclass(frozen=True, eq=False)
class Reference:
    """The texture that an estimator tends to.

    Attributes
    ----------
    texture : (t,) float64
        Mean of the independent references, occlusion of the surface texels.
    error : float
        Its own RMSE, estimated from how far the references lie apart.
    """

    texture: Texture
    error: float

    def serves(self, error: float) -> bool:
        """Whether an error is so far above the reference's own that it is known."""
        return error >= MARGIN * self.error


def rmse(a: Texture, b: Texture) -> float:
    """Root mean square of a difference; 0 where there are no texels."""
    return float(np.sqrt(np.mean(np.square(a - b)))) if a.size else 0.0


def combine(references: Sequence[Texture]) -> Reference:
    """One reference of two or more independent ones.

    The sample variance of k independent textures of equal error, over k, is the variance of their mean. A bias that
    they share does not show.

    Parameters
    ----------
    references : sequence of (t,) float64
        The same texels by different samplers.
    """
    stack = np.stack(references)
    variance = stack.var(axis=0, ddof=1).mean() / len(stack) if stack.size else 0.0
    return Reference(stack.mean(axis=0), float(np.sqrt(variance)))
