"""A job's items with a progress bar: those of an earlier job taken up, the rest rendered here or on a scheduler."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from typing import Any, NamedTuple

from lfssao.commands.terminal import bar_size
from lfssao.files import output_folder
from lfssao.job import Job, views_at_once
from lfssao.pipeline import TOGETHER, hashed_together, recover, run_here, run_on
from lfssao.view_file import Result
from lfssao.work import Item, Renderer, Work


def run_items(
    work: Work, head: dict[str, Any], seconds: dict[str, float], threads: int, resume: bool, scheduler: str | None
) -> None:
    """Run a job.

    Parameters
    ----------
    work : Work
        What is rendered.
    head : dict
        What the manifests say of scene, display and machine.
    seconds : dict
        Seconds of what came before.
    threads : int
        How many threads, or with a scheduler of this machine processes.
    resume : bool
        Whether to keep what an earlier job left.
    scheduler : str or None
        'local', the address of a dask scheduler, or None to run here.

    Raises
    ------
    InputError
        If something cannot be written, was left by another job, or the scheduler does not answer.
    MissingPackageError
        If embreex or, with a scheduler, distributed is not installed.
    """
    job, items = Job(work, head, seconds), work.items()
    found = _found(work, items, threads) if resume else {}
    rest = [item for item in items if item not in found]
    with ExitStack() as stack:
        runner = stack.enter_context(_runner(work, rest, threads, scheduler))
        for folder in (work.folder, *(work.frame_folder(frame) for frame in range(work.frame_count))):
            stack.enter_context(output_folder(folder))
        with job.apart("load_kernels"):
            runner.rehearse()
        job.open(rest)
        for item, result in found.items():
            job.add(item, result)
        bar = stack.enter_context(_bar(total=len(items), initial=len(found)))
        # Closed before the folders are tidied up: files that were begun are finished first.
        for item, result in stack.enter_context(closing(runner.start())):
            job.add(item, result)
            bar.update()


def _found(work: Work, items: list[Item], threads: int) -> dict[Item, Result]:
    """What an earlier job left and is whole."""
    with _bar(total=len(items), desc="verify") as bar:
        out = {}
        for item, result in recover(work, items, threads):
            bar.update()
            if result is not None:
                out[item] = result
        return out


class _Runner(NamedTuple):
    """What loads the code that the items need, and what starts them."""

    rehearse: Callable[[], None]
    start: Callable[[], Any]


@contextmanager
def _runner(work: Work, items: list[Item], threads: int, scheduler: str | None) -> Iterator[_Runner]:
    """What runs the items; what can be known to fail fails before."""
    if not items:
        yield _Runner(_nothing, _no_results)
    elif scheduler is None:
        # Read when numba's threads start: waiting in a loop, they would take time from those that write files.
        os.environ.setdefault("OMP_WAIT_POLICY", "passive")
        renderer, ahead = Renderer(work, threads), views_at_once(work, threads + 1 + TOGETHER)
        renderer.prepare(items[0])
        yield _Runner(
            lambda: _rehearse(renderer, items, hashed_together(ahead, threads)),
            lambda: run_here(renderer, items, threads, ahead),
        )
    else:
        from lfssao.cluster import executor_of  # late: an optional package

        with executor_of(scheduler, min(threads, len(items))) as (executor, worker_threads):
            yield _Runner(_nothing, lambda: run_on(executor, work, items, worker_threads))


def _rehearse(renderer: Renderer, items: list[Item], together: int) -> None:
    """A bar of its own, as compiling on a first run takes a while; it goes, as it says nothing of the job."""
    from lfssao.rehearsal import STEPS, rehearse  # late: workers rehearse nothing

    with _bar(total=STEPS, desc="load", unit="step", leave=False) as bar:
        for _ in rehearse(renderer, items, min(together, len(items))):
            bar.update()


def _nothing() -> None:
    pass


def _no_results() -> Iterator[tuple[Item, Result]]:
    yield from ()


def _bar(unit: str = "module", **more: Any) -> Any:
    """A progress bar on a terminal, nothing in a pipe (disable=None); `with` ends its line before a message."""
    from tqdm import tqdm

    return tqdm(unit=unit, disable=None, **more, **bar_size())
