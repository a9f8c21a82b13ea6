"""Threads that share work in chunks: rows of textures among kernels, rays among Embree's calls."""

import functools
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import pairwise
from queue import SimpleQueue
from typing import Any, TypeVar

import numba

from lfssao.core.arguments import check_whole

MOST_THREADS = 1024
_END = object()
Item = TypeVar("Item")


def check_threads(count: object) -> int:
    """A number of threads; InputError if it is none."""
    return check_whole("threads", count, 1, MOST_THREADS)


@contextmanager
def kernel_threads(count: int) -> Iterator[None]:
    """In the block, kernels that this thread calls run on a number of threads."""
    before = numba.get_num_threads()
    numba.set_num_threads(count)
    try:
        yield
    finally:
        numba.set_num_threads(before)


def ahead(items: Iterable[Item]) -> Iterator[Item]:
    """The items, made by a thread of its own before they are asked for; what making one raises is raised here.

    >>> list(ahead(n * n for n in range(3)))
    [0, 1, 4]
    """
    queue: SimpleQueue[Any] = SimpleQueue()

    def fill() -> None:
        try:
            for item in items:
                queue.put(item)
        finally:
            queue.put(_END)

    with ThreadPoolExecutor(1) as pool:
        filled = pool.submit(fill)
        while (item := queue.get()) is not _END:
            yield item
        filled.result()


@functools.cache
def _pool(threads: int, _process: int) -> ThreadPoolExecutor:
    """The threads of a process, which a fork of it does not have."""
    return ThreadPoolExecutor(threads)


def in_chunks(work: Callable[[int, int], None], n: int, size: int, threads: int) -> None:
    """Call work(start, stop) over 0 .. n - 1 in chunks of a size, on several threads if asked.

    An interruption, or what a call raises, keeps the chunks that no thread has begun from being worked on. ``work``
    must not call this function.
    """
    chunks = pairwise([*range(0, n, size), n])
    if threads == 1 or n <= size:
        for start, stop in chunks:
            work(start, stop)
        return
    pool = _pool(threads, os.getpid())
    begun = [pool.submit(work, start, stop) for start, stop in chunks]
    try:
        for each in begun:
            each.result()
    finally:
        for each in begun:
            each.cancel()
        wait(begun)
