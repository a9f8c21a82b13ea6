"""Run times that other work on the machine lengthens, and does not bend: the least of many runs."""

import time
from collections.abc import Callable, Hashable, Mapping
from typing import TypeVar

Key = TypeVar("Key", bound=Hashable)
_AGREE = 3  # runs that have to agree


def least_times(
    runs: Mapping[Key, Callable[[], object]],
    spread: float = 0.03,
    most: int = 60,
    clock: Callable[[], float] = time.process_time,
) -> dict[Key, tuple[float, float]]:
    """Return the least milliseconds of each run, and by which fraction the third least is above it.

    All run once, which may compile, and then turn by turn, each second turn in reverse, until the fraction is at most
    ``spread``, or ``most`` times. The clock returns seconds: of this process's work, by default.
    """
    for run in runs.values():
        run()
    taken: dict[Key, list[float]] = {name: [] for name in runs}
    for turn in range(most):
        left = [name for name in runs if turn < _AGREE or _spread(taken[name]) > spread]
        for name in left if turn % 2 else reversed(left):
            start = clock()
            runs[name]()
            taken[name].append(1e3 * (clock() - start))
    return {name: (min(times), _spread(times)) for name, times in taken.items()}


def _spread(times: list[float]) -> float:
    least = sorted(times)[:_AGREE]
    return least[-1] / least[0] - 1 if least[0] > 0 else 0.0
