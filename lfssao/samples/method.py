"""The registry's entry of a sampling method, and the two calls that its files make tables with."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lfssao.samples.sets import FloatArray, SampleSet

Value = float | int | bool | None


@dataclass(frozen=True)
class Method:
    """One way to make a point set on one domain.

    Attributes
    ----------
    name : str
        Its name in the registry and on the command line.
    title : str
        One line for lists.
    source : str
        The publication that describes it.
    domain : str
        'square', 'sphere', 'ball' or 'disk'.
    make : callable
        ``make(n, seed, **options)``, n and seed checked before: the points, or a whole set that was made before.
    promises : tuple of str
        Names of ``lfssao.testing.PROMISES`` that hold of every set.
    options : mapping
        Names and default values of its options.
    prefix : bool
        Whether the set of n points begins every longer one of that seed.
    seeded : bool
        Whether the seed matters.
    most : int or None
        The most points there are; None where any number is.
    """

    name: str
    title: str
    source: str
    domain: str
    make: Callable[..., FloatArray | SampleSet]
    promises: tuple[str, ...]
    options: Mapping[str, Value] = field(default_factory=dict)
    prefix: bool = False
    seeded: bool = True
    most: int | None = None


# The shell of every method of the ball, by default the whole ball; LF found one from 0.8 suitable.
SHELL: Mapping[str, Value] = {"r_min": 0.0, "r_max": 1.0}


def fill(kernel: Callable[..., Any], shape: tuple[int, int], *arguments: Any) -> FloatArray:
    """Return the float64 array of a shape that a kernel fills as its last argument."""
    out = np.empty(shape)
    kernel(*arguments, out)
    return out
