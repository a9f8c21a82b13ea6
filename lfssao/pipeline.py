"""Items to results: in this process, files being written while the next passes run, or on anybody's executor."""

import pickle
import threading
from collections import deque
from collections.abc import Generator, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from lfssao import __version__
from lfssao.errors import InputError
from lfssao.exr import use_threads
from lfssao.files import scratch_file
from lfssao.rendering import Textures
from lfssao.view_file import Result, SealedView, recover_view, seal, write_view
from lfssao.work import Item, Renderer, Work

# Views whose textures are hashed together, in 16 lanes. Three views of five radii keep seven eighths of these busy,
# two a good half.
TOGETHER = 3

Results = Generator[tuple[Item, Result], None, None]


def run_here(renderer: Renderer, items: Sequence[Item], threads: int, ahead: int) -> Results:
    """Run the passes in the calling thread and, if there are several threads, write files in others.

    Parameters
    ----------
    renderer : Renderer
        Makes the textures.
    items : sequence of Item
        In this order.
    threads : int
        How many threads compute; with 1 the calling thread writes files before the next passes.
    ahead : int
        How many items may wait for their file at the same time: memory is bounded by so many views.

    Yields
    ------
    (Item, Result)
        In the order of the items.

    Raises
    ------
    InputError
        If a file cannot be written; files that were begun are finished first.
    """
    together = hashed_together(ahead, threads)
    groups = [items[first : first + together] for first in range(0, len(items), together)]
    if threads == 1:
        for group in groups:
            for view in seal(renderer.work, _made(renderer, group)):
                yield view.item, write_view(renderer.work, view)
        return
    waiting: deque[tuple[Item, Future[Result]]] = deque()
    # One more than processors: a thread that waits for the disk computes nothing.
    with ThreadPoolExecutor(threads + 1) as pool:
        for group in groups:
            while len(waiting) > ahead - together or (waiting and waiting[0][1].done()):
                yield _next(waiting)
            waiting.extend(zip(group, _begin(pool, renderer, group), strict=True))
        while waiting:
            yield _next(waiting)


def hashed_together(ahead: int, threads: int) -> int:
    """How many views ``run_here`` hashes together where so many may be in memory.

    With several threads the next ones are made at the same time, with one none are.
    """
    return max(1, min(TOGETHER, ahead if threads == 1 else ahead // 2))


def _made(renderer: Renderer, items: Iterable[Item]) -> list[tuple[Item, Textures, float]]:
    """All textures of some views, and the seconds spent building trees for each."""
    return [(item, *renderer.textures(item)) for item in items]


def _begin(pool: Executor, renderer: Renderer, items: Sequence[Item]) -> list[Future[Result]]:
    """Run the passes of some views, and leave their files to the pool."""
    sealing = pool.submit(_seal, renderer.work, _made(renderer, items))
    return [pool.submit(_write, renderer.work, sealing, item) for item in items]


def _seal(work: Work, made: Sequence[tuple[Item, Textures, float]]) -> dict[Item, SealedView]:
    return {view.item: view for view in seal(work, made)}


def _write(work: Work, sealing: Future[dict[Item, SealedView]], item: Item) -> Result:
    """Write the file of one of the views that are sealed together, which a thread of the pool began before this.

    Of each view only who writes it keeps the textures, so that they go with it.
    """
    return write_view(work, sealing.result().pop(item))


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
            _here.clear()
            _here[path] = Renderer(_load(path), threads)
        renderer = _here[path]
    (view,) = seal(renderer.work, _made(renderer, [item]))
    return write_view(renderer.work, view)


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
    use_threads(threads)
    with ThreadPoolExecutor(threads) as pool:
        yield from zip(items, pool.map(lambda item: recover_view(work, item), items), strict=True)
