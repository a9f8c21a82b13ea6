"""Kernel calls of public functions, recorded, and the same loops in C on copies of the same arrays."""

import ctypes
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import wraps
from pkgutil import resolve_name
from typing import Any
from unittest.mock import patch

import numpy as np
from turns import balanced_orders

Run = Callable[[], None]


@dataclass(frozen=True)
class Baseline:
    """A kernel's baseline in C.

    Attributes
    ----------
    where : str
        Module and name by which the library calls the kernel.
    label : str
        The stage that it belongs to.
    name : str
        The C function's name.
    arguments : callable
        The C function's arguments from the kernel's.
    outputs : tuple of int
        Which of the kernel's arguments both write.
    of : str
        The type of the formulas, the kernel's second argument, that it is a baseline of; empty for a kernel without.
    """

    where: str
    label: str
    name: str
    arguments: Callable[[Sequence[Any]], list[Any]]
    outputs: tuple[int, ...]
    of: str = ""


@dataclass(frozen=True)
class Call:
    """A recorded call: its baseline, kernel and arguments, copies of the outputs from before it, seconds it took."""

    baseline: Baseline
    kernel: Callable[..., Any]
    arguments: tuple[Any, ...]
    before: tuple[np.ndarray, ...]
    seconds: float


@contextmanager
def recorded(baselines: Sequence[Baseline]) -> Iterator[list[Call]]:
    """Record the calls of the baselines' kernels that the library makes inside."""
    calls: list[Call] = []

    def recorder(baseline: Baseline, kernel: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(kernel)
        def call(*arguments: Any) -> Any:
            if baseline.of and type(arguments[1]).__name__ != baseline.of:
                return kernel(*arguments)
            before = tuple(arguments[k].copy() for k in baseline.outputs)
            start = time.perf_counter()
            result = kernel(*arguments)
            calls.append(Call(baseline, kernel, arguments, before, time.perf_counter() - start))
            return result

        return call

    with ExitStack() as stack:
        for baseline in baselines:
            module, attribute = baseline.where.rsplit(".", 1)
            kernel = getattr(resolve_name(module), attribute)
            stack.enter_context(patch(f"{module}.{attribute}", recorder(baseline, kernel)))
        yield calls


class Arrays:
    """Outputs of calls on copies, so that two programs work on the same inputs without meeting."""

    def __init__(self, calls: Sequence[Call]) -> None:
        self.copies: dict[int, np.ndarray] = {}
        for call in calls:
            for k, before in zip(call.baseline.outputs, call.before, strict=True):
                self.copies.setdefault(id(call.arguments[k]), before.copy())

    def of(self, call: Call) -> list[Any]:
        """The call's arguments, each array that one of the calls writes replaced by its copy."""
        return [self._own(a) for a in call.arguments]

    def _own(self, a: Any) -> Any:
        if isinstance(a, tuple) and hasattr(a, "_make"):
            return a._make(self._own(each) for each in a)
        return self.copies.get(id(a), a) if isinstance(a, np.ndarray) else a


def ours(calls: Sequence[Call], arrays: Arrays) -> Run:
    bound = [(call.kernel, arrays.of(call)) for call in calls]

    def run() -> None:
        for kernel, arguments in bound:
            kernel(*arguments)

    return run


def in_c(calls: Sequence[Call], arrays: Arrays, library: ctypes.CDLL) -> Run:
    bound = [
        (getattr(library, call.baseline.name), [_converted(a) for a in call.baseline.arguments(arrays.of(call))])
        for call in calls
    ]

    def run(kept: Arrays = arrays) -> None:
        for function, arguments in bound:
            function(*arguments)

    return run


def _converted(a: Any) -> Any:
    if isinstance(a, np.ndarray):
        assert a.flags.c_contiguous
        return a.ctypes.data_as(ctypes.c_void_p)
    kinds = {np.float32: ctypes.c_float, float: ctypes.c_double, np.float64: ctypes.c_double}
    return kinds.get(type(a), ctypes.c_int)(a)


def differing(calls: Sequence[Call], library: ctypes.CDLL) -> list[str]:
    """Baselines whose outputs differ in a bit from the kernels'."""
    one = Arrays(calls)
    other = Arrays(calls)
    ours(calls, one)()
    in_c(calls, other, library)()
    same = {key: one.copies[key].tobytes() == other.copies[key].tobytes() for key in one.copies}
    return sorted(
        {call.baseline.name for call in calls for k in call.baseline.outputs if not same[id(call.arguments[k])]}
    )


def bytes_moved(calls: Sequence[Call]) -> int:
    """Bytes of all arrays that the calls read or write, each once: the least that must pass between memory and core."""
    arrays = {id(a): a.nbytes for call in calls for a in _arrays(call.arguments)}
    return sum(arrays.values())


def _arrays(arguments: Sequence[Any]) -> Iterator[np.ndarray]:
    """All arrays among arguments, those of named tuples too."""
    for a in arguments:
        if isinstance(a, np.ndarray):
            yield a
        elif isinstance(a, tuple):
            yield from _arrays(a)


def copying(size: int, library: ctypes.CDLL) -> Run:
    """Reading and writing so many bytes in all, half each, by memcpy on all threads."""
    source, target = (np.ones(size // 2, np.uint8) for _ in range(2))
    pointers = [_converted(a) for a in (source, target)]

    def run(kept: tuple[np.ndarray, ...] = (source, target)) -> None:
        library.copy(*pointers, ctypes.c_int64(len(kept[0])))

    return run


# How long a run is timed in each turn, milliseconds, and how many calls of it at most.
_LEAST_MS = 2.0
_MOST_CALLS = 20


def interleaved(runs: dict[str, Run], repeats: int, clock: Callable[[], float]) -> dict[str, np.ndarray]:
    """Milliseconds of every run, the runs in turn, so that a slow moment of the machine meets all of them.

    Each turn has another order, and of the calls in a row the first is not timed: who comes second finds in the caches
    what both read, a fifth of the time of a stage that is bound by memory. Short runs are called until they have
    taken _LEAST_MS, as a single call of a fifth of a millisecond may take half or twice that.
    """
    calls = {
        name: int(min(max(_LEAST_MS / _milliseconds(run, 1, clock), 1), _MOST_CALLS)) for name, run in runs.items()
    }
    times: dict[str, list[float]] = {name: [] for name in runs}
    names = list(runs)
    orders = balanced_orders(len(runs))
    for turn in range(repeats):
        for name in (names[place] for place in orders[turn % len(orders)]):
            times[name].append(_milliseconds(runs[name], calls[name], clock))
    return {name: np.array(values) for name, values in times.items()}


def _milliseconds(run: Run, calls: int, clock: Callable[[], float]) -> float:
    """The mean time of so many calls, after one that is not timed."""
    run()
    start = clock()
    for _ in range(calls):
        run()
    return max(1e3 * (clock() - start) / calls, 1e-6)
