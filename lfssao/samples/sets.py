"""The sample set: points of a domain, their weights, and the promises of the method that made them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfssao.core.pictures import figure_png

FloatArray = NDArray[np.float64]

# Coordinates of a point on the square [-1, 1]^2, the unit sphere, in the unit ball or its shell, and on the unit disk.
DIMENSIONS = {"square": 2, "sphere": 3, "ball": 3, "disk": 2}


@dataclass(frozen=True, eq=False)
class SampleSet:
    """Points of a domain, and the method that made them.

    Attributes
    ----------
    points : (n, d) float64
        In units of the domain's radius; d = 2 on the square and the disk, 3 on the sphere and in the ball.
    weights : (n,) float64 or None
        The volume of the unit ball that each point stands for, 4/3 pi in all; None where all weigh the same.
    domain : str
        'square', 'sphere', 'ball' or 'disk'.
    method : str
        The method's name, or a file's.
    seed : int
        The seed they were made with.
    promises : tuple of str
        What the method promises of every set, by the names of ``lfssao.testing.PROMISES``.
    """

    points: FloatArray
    weights: FloatArray | None
    domain: str
    method: str
    seed: int
    promises: tuple[str, ...]

    def _repr_png_(self) -> bytes:
        from lfssao.samples.plot import draw_samples  # late: only notebooks show it

        return figure_png(draw_samples([self]))
