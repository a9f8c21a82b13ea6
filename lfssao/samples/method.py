"""The registry's entry of a sampling method, and the two calls that its files make tables with."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lfssao.samples.sets import FloatArray, SampleSet

Value = float | int | bool | None


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
