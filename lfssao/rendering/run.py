"""Items to results: in this process, files being written while the next passes run, or on anybody's executor."""

import pickle
import threading
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from lfssao import __version__
from lfssao.core.files import scratch_file
from lfssao.errors import InputError
from lfssao.rendering.exr import use_one_thread_a_file
from lfssao.rendering.output import Result, recover_view, write_view
from lfssao.rendering.work import Item, Renderer, Work

Results = Generator[tuple[Item, Result], None, None]


def run_here(renderer: Renderer, items: Sequence[Item], threads: int, ahead: int) -> Results:
    """Render items in the calling thread; other threads write the files meanwhile.

    Parameters
    ----------
    renderer : Renderer
        Makes the textures.
    items : sequence of Item
        In this order.
    threads : int
        How many threads write files.
    ahead : int
        Most views that are in memory at the same time; with 1 nothing is rendered while a file is written.

    Yields
    ------
    (Item, Result)
        In the order of the items.

    Raises
    ------
    InputError
        If a file cannot be written; files that were begun are finished first.
    """
    use_one_thread_a_file()
    waiting: deque[tuple[Item, Future[Result]]] = deque()
    with ThreadPoolExecutor(threads) as pool:
        for item in items:
            while len(waiting) >= ahead or (waiting and waiting[0][1].done()):
                yield _next(waiting)
            waiting.append((item, pool.submit(write_view, renderer.work, item, renderer.textures(item))))
        while waiting:
            yield _next(waiting)


def _next(waiting: deque[tuple[Item, Future[Result]]]) -> tuple[Item, Result]:
    item, future = waiting.popleft()
    return item, future.result()


def run_on(executor: Executor, work: Work, items: Sequence[Item], threads: int) -> Results:
    """Run whole items, passes and files, wherever an executor runs them; the folder must be the same there.

    Parameters
    ----------
    executor : concurrent.futures.Executor
        A pool of processes, or what dask's ``Client.get_executor`` gives. Pools of threads gain nothing: kernels run
        one at a time in a process.
    work : Work
        What the items are of. It goes to the workers through a file in its folder, once for each.
    items : sequence of Item
        Which.
    threads : int
        Threads of each kernel on a worker.

    Yields
    ------
    (Item, Result)
        In the order of the items, whatever the order of completion.

    Raises
    ------
    InputError
        If a worker cannot write a file, does not see the folder, or runs another version.
    """
    with _shared(work) as path:
        futures = [executor.submit(run_item, str(path), item, threads, __version__) for item in items]
        try:
            for item, future in zip(items, futures, strict=True):
                yield item, future.result()
        finally:
            for future in futures:
                future.cancel()


@contextmanager
def _shared(work: Work) -> Iterator[Path]:
    """The work in a file of its folder, as long as the block runs."""
    with scratch_file(work.folder, "work") as path:
        path.write_bytes(pickle.dumps(work))
        yield path


_here: dict[str, Renderer] = {}
_loading = threading.Lock()


def run_item(path: str, item: Item, threads: int, version: str) -> Result:
    """Run one item in a worker.

    Parameters
    ----------
    path : str
        The file with the work; the last one is kept in memory, with its trees.
    item : Item
        Which.
    threads : int
        Threads of each kernel.
    version : str
        The version of lfssao that the job runs.

    Raises
    ------
    InputError
        If the worker runs another version, does not see the file, or cannot write.
    """
    if version != __version__:
        raise InputError(f"a worker runs lfssao {__version__}, the job {version}")
    with _loading:
        if path not in _here:
            use_one_thread_a_file()
            _here.clear()
            _here[path] = Renderer(_load(path), threads)
        renderer = _here[path]
    return write_view(renderer.work, item, renderer.textures(item))


def _load(path: str) -> Work:
    try:
        work = pickle.loads(Path(path).read_bytes())
    except OSError as error:
        raise InputError(f"{path}: a worker cannot read it ({error.strerror}): it needs the same folder") from error
    assert isinstance(work, Work)
    return work


def recover(work: Work, items: Sequence[Item], threads: int) -> Iterator[tuple[Item, Result | None]]:
    """Verify what an earlier job left of each item (``recover_view``), in their order.

    Parameters
    ----------
    work : Work
        What the items are of.
    items : sequence of Item
        Which.
    threads : int
        How many threads read.

    Yields
    ------
    (Item, Result or None)
        None where the item is still to be done.

    Raises
    ------
    InputError
        If a file was made from something else.
    """
    use_one_thread_a_file()
    with ThreadPoolExecutor(threads) as pool:
        yield from zip(items, pool.map(lambda item: recover_view(work, item), items), strict=True)
