"""What the registry knows of a sampling method."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from lfssao.samples.sets import FloatArray, SampleSet

Value = float | int | bool | None

# fill(n, seed, columns) -> (n, columns): xi_1, xi_2 and, with three columns, t on (0, 1)
Fill = Callable[[int, int, int], FloatArray]
# make(n, seed, **options): the points, or a whole set that was made before
Make = Callable[..., FloatArray | SampleSet]


@dataclass(frozen=True)
class Method:
    """One way to make a point set on one domain.

    Attributes
    ----------
    name : str
        What the registry and the command line call it.
    title : str
        One line for lists.
    source : str
        Where it is described.
    domain : str
        'square', 'sphere', 'ball' or 'disk'.
    make : callable
        ``make(n, seed, **options)``, n and seed checked before.
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
    make: Make
    promises: tuple[str, ...]
    options: Mapping[str, Value] = field(default_factory=dict)
    prefix: bool = False
    seeded: bool = True
    most: int | None = None
