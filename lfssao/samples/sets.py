"""The sample set, and the method that makes it, as the registry knows it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.summary import Arrayed, Summary

FloatArray = NDArray[np.float64]
Value = float | int | bool | None  # of a method's option

# Coordinates of a point on the square [-1, 1]^2, the unit sphere, in the unit ball or its shell, and on the unit disk.
DIMENSIONS = {"square": 2, "sphere": 3, "ball": 3, "disk": 2}


@dataclass(frozen=True, eq=False, repr=False)
class SampleSet(Arrayed, Summary):
    """Points of a domain, and the method that made them; NumPy takes it for its points, unless these have weights.

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

    Examples
    --------
    >>> lfssao.samples.sample_set("disk", "spiral", 9).method
    'spiral'
    """

    points: FloatArray
    weights: FloatArray | None
    domain: str
    method: str
    seed: int
    promises: tuple[str, ...]

    def _array(self) -> FloatArray:
        if self.weights is not None:  # they would be lost without a word
            raise InputError(f"samples of {self.method} have weights: hand over .points, and .weights where they count")
        return self.points

    def __len__(self) -> int:
        return len(self.points)

    def _facts(self) -> dict[str, object]:
        return {"method": self.method, "domain": self.domain, "points": len(self.points), "seed": self.seed}


@dataclass(frozen=True)
class Method:
    """One way to make a point set on one domain."""

    name: str  # its name in the registry and on the command line
    title: str  # one line for lists
    source: str  # the publication that describes it
    domain: str  # 'square', 'sphere', 'ball' or 'disk'
    # ``make(n, seed, **options)``, n and seed checked before: the points, or a whole set that was made before
    make: Callable[..., FloatArray | SampleSet]
    promises: tuple[str, ...]  # names of ``lfssao.testing.PROMISES`` that hold of every set
    options: Mapping[str, Value] = field(default_factory=dict)  # names and default values of its options
    prefix: bool = False  # whether the set of n points begins every longer one of that seed
    seeded: bool = True  # whether the seed matters
    most: int | None = None  # the most points there are; None where any number is


# The shell of every method of the ball, by default the whole ball; LF found one from 0.8 suitable.
SHELL: Mapping[str, Value] = {"r_min": 0.0, "r_max": 1.0}


def fill(kernel: Callable[..., Any], shape: tuple[int, int], *arguments: Any) -> FloatArray:
    """Return the float64 array of a shape that a kernel fills as its last argument."""
    out = np.empty(shape)
    kernel(*arguments, out)
    return out


@cache
def read_table(name: str) -> NDArray[Any]:
    """Return an array of the package; not to write to."""
    with resources.files("lfssao.samples").joinpath("tables", f"{name}.npy").open("rb") as stream:
        table: NDArray[Any] = np.load(stream, allow_pickle=False)
    return table
