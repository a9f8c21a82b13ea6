"""Run times: medians of warm runs in turn, the first call, which may compile, kept apart."""

import time
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Milliseconds = NDArray[np.float64]
Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True)
class Times:
    """How long something takes, milliseconds.

    Attributes
    ----------
    median, low, high : float
        Median and quartiles of the warm runs.
    first : float
        The first call, which compiles or loads what is not compiled yet.
    """

    median: float
    low: float
    high: float
    first: float

    @classmethod
    def of(cls, warm: Milliseconds, first: float) -> "Times":
        """Of all warm runs, (repeats,), and the first."""
        low, median, high = np.percentile(warm, [25, 50, 75]).tolist()
        return cls(median, low, high, first)


def in_turn(variants: Mapping[str, Callable[[], object]], repeats: int) -> dict[str, Times]:
    """Times of some variants, each run once a turn, so that a slow moment of the machine meets all of them.

    Parameters
    ----------
    variants : mapping of callables
        What is run, by name.
    repeats : int
        Number of turns after the first call of each.

    Returns
    -------
    dict of Times
    """
    return {name: Times.of(warm, first) for name, (first, warm) in turns(variants, repeats).items()}


def turns(variants: Mapping[Key, Callable[[], object]], repeats: int) -> dict[Key, tuple[float, Milliseconds]]:
    """Milliseconds of the first call of each variant, and of its warm runs, (repeats,), turn by turn."""
    first = {name: _milliseconds(run) for name, run in variants.items()}
    warm = {name: np.empty(repeats) for name in variants}
    for turn in range(repeats):
        for name, run in variants.items():
            warm[name][turn] = _milliseconds(run)
    return {name: (first[name], warm[name]) for name in variants}


def _milliseconds(run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    return 1e3 * (time.perf_counter() - start)
