"""Methods of the square as engines of ``scipy.stats.qmc``."""

import warnings

import numpy as np
from scipy.stats import qmc

from lfssao.errors import InputError
from lfssao.samples.registry import find_method, square_points
from lfssao.samples.sets import FloatArray


class Sampler(qmc.QMCEngine):  # type: ignore[misc]  # scipy has no types
    """A method of the square with the calls of ``scipy.stats.qmc``'s engines; points are in [0, 1)^2, (n, 2) float64.

    Name and seed are those of ``square_points``. InputError if there is no such method, and where points are to follow
    those of a method whose longer sets do not begin with the shorter ones. UserWarning, as of qmc.Sobol, if the first
    points of 'sobol' are no power of two.

    >>> engine = Sampler("sobol", seed=7)
    >>> engine.random(4).shape, engine.fast_forward(4).num_generated
    ((4, 2), 8)
    """

    def __init__(self, method: str, seed: int = 0) -> None:
        super().__init__(2)
        self._method = find_method("square", method)
        self._seed = seed

    def _random(self, n: int = 1, *, workers: int = 1) -> FloatArray:
        name = self._method.name
        start = self.num_generated
        if start and not self._method.prefix:
            raise InputError(f"{name}: its longer sets do not begin with the shorter ones; call reset() first")
        if name in ("sobol", "owen-burley") and not start and n & (n - 1):
            warnings.warn(f"{name}: sets of 2^m points are balanced, {n} points are not", stacklevel=3)
        cube = (square_points(name, start + n, self._seed)[start:] + 1) / 2
        return np.minimum(cube, np.nextafter(1, 0))
