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
    """Run times of one thing, milliseconds."""

    median: float  # of the warm runs
    low: float  # quartiles of the warm runs
    high: float
    first: float  # the first call, which compiles or loads what is not compiled yet

    @classmethod
    def of(cls, warm: Milliseconds, first: float) -> "Times":
        """From all warm runs, (repeats,), and the first."""
        low, median, high = np.percentile(warm, [25, 50, 75]).tolist()
        return cls(median, low, high, first)


def in_turn(variants: Mapping[str, Callable[[], object]], repeats: int) -> dict[str, Times]:
    """Return times of variants, each run once a turn so that a slow moment of the machine meets all of them."""
    return {name: Times.of(warm, first) for name, (first, warm) in turns(variants, repeats).items()}


def turns(
    variants: Mapping[Key, Callable[[], object]], repeats: int, clock: Callable[[], float] = time.perf_counter
) -> dict[Key, tuple[float, Milliseconds]]:
    """Return the milliseconds of each variant's first call and of its warm runs, (repeats,), turn by turn.

    The clock returns seconds.
    """

    def milliseconds(run: Callable[[], object]) -> float:
        start = clock()
        run()
        return 1e3 * (clock() - start)

    first = {name: milliseconds(run) for name, run in variants.items()}
    warm = {name: np.empty(repeats) for name in variants}
    names = list(variants)
    orders = balanced_orders(len(variants))
    for turn in range(repeats):
        for place in orders[turn % len(orders)]:
            warm[names[place]][turn] = milliseconds(variants[names[place]])
    return {name: (first[name], warm[name]) for name in variants}


def balanced_orders(n: int) -> list[list[int]]:
    """Return orders of 0 .. n - 1 in which each follows each other one equally often (Williams 1949).

    A run meets the state that the one before has left: textures in the caches, or a processor that takes a moment to
    power up its widest vectors. One order for all turns would slow the same variant every time.
    """
    zigzag = [k // 2 + 1 if k % 2 else -(k // 2) % n for k in range(n)]
    rows = [[(place + shift) % n for place in zigzag] for shift in range(n)]
    return rows if n % 2 == 0 else rows + [row[::-1] for row in rows]
