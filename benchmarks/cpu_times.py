"""Processor time of one thread, which other programs on the machine may lengthen but not bend."""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from typing import TypeVar

import numba
import numpy as np
from turns import turns

Name = TypeVar("Name", bound=Hashable)

# Keeps a core and the memory busy.
_LOAD = "a = bytearray(1 << 26)\nwhile True:\n    b = bytes(a)\n    sum(range(1_000_000))\n"


def least(runs: Mapping[Name, Callable[[], object]], repeats: int) -> dict[Name, dict[str, float]]:
    """Milliseconds of each run: the least of all turns, and how far the median lies above it, a share of it.

    The first call of each, which may compile, is left out. Other programs only ever add to a run's time, by what they
    take from its caches, so the least is nearest to what the run takes alone.
    """
    numba.set_num_threads(1)
    times = {name: warm for name, (_, warm) in turns(runs, repeats, time.process_time).items()}
    return {n: {"ms": float(t.min()), "spread": float(np.median(t) / t.min() - 1)} for n, t in times.items()}


@contextmanager
def loaded_machine() -> Iterator[None]:
    """As many other processes as there are cores, each of which never rests."""
    others = [subprocess.Popen([sys.executable, "-c", _LOAD]) for _ in range(os.cpu_count() or 1)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()
