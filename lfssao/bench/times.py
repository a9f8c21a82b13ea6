"""Run times: medians of warm runs in turn, the first call, which may compile, kept apart."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np


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
    first = {name: _milliseconds(run) for name, run in variants.items()}
    warm: dict[str, list[float]] = {name: [] for name in variants}
    for _ in range(repeats):
        for name, run in variants.items():
            warm[name].append(_milliseconds(run))
    out = {}
    for name, values in warm.items():
        low, median, high = np.percentile(values, [25, 50, 75]).tolist()
        out[name] = Times(median, low, high, first[name])
    return out


def _milliseconds(run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    return 1e3 * (time.perf_counter() - start)
