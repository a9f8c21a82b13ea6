"""What the registry knows of an estimator."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.passes import Occlusion

FloatArray = NDArray[np.float64]
Value = float | int | str | bool

# run(buffers, radius, points, weights, **parameters)
Run = Callable[..., Occlusion]


@dataclass(frozen=True)
class Estimator:
    """One way to estimate ambient occlusion from a view's textures.

    Attributes
    ----------
    name : str
        What the registry and the command line call it.
    title : str
        One line for lists.
    source : str
        Paper and numbers of the equations, 'LF Algorithm 2' for example.
    run : callable
        ``run(buffers, radius, points, weights, **parameters) -> Occlusion``. The registry checks all arguments before;
        of the parameters it checks names, types, ``limits`` and ``choices``.
    run_radii : callable or None
        ``run_radii(buffers, radii, points, weights, **parameters) -> list of Occlusion``: what ``run`` makes of each
        radius, the same bits in less time; None where it makes one after the other.
    samples : callable or None
        ``samples(n) -> (points, weights or None)``: its own sample set of n points, float64; None where it takes none.
    dimensions : int
        Coordinates of a sample: 3 in the ball, 2 in the disk, 0 where it takes none.
    count : int
        The paper's number of samples, the default n.
    normals : bool
        Whether it reads the normals texture.
    parameters : mapping
        Names and default values of its parameters.
    limits : mapping
        Least and greatest value of a parameter that is a number, where it has them; the registry checks them.
    choices : mapping
        The values of a parameter that is a str; the registry checks them.
    texel_bytes : int
        Bytes a texel of the float32 textures that it has in memory at once: what it makes, what it returns and what is
        kept with the view, the most over all views and parameters.
    sampling : str or None
        The method of ``make_samples`` whose points of seed 0 are its own sample set; None where it has another set.
    """

    name: str
    title: str
    source: str
    run: Run
    run_radii: Callable[..., list[Occlusion]] | None = None
    samples: Callable[[int], tuple[FloatArray, FloatArray | None]] | None = None
    dimensions: int = 3
    count: int = 8
    normals: bool = False
    parameters: Mapping[str, Value] = field(default_factory=dict)
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    choices: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    texel_bytes: int = 4
    sampling: str | None = None

    def default_samples(self, n: int | None = None) -> tuple[FloatArray | None, FloatArray | None]:
        """Points and weights (None where all weigh the same) of its own sample set, n or ``count`` of them."""
        return (None, None) if self.samples is None else self.samples(self.count if n is None else n)
