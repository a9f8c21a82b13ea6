"""A job's items with a progress bar: those of an earlier job taken up, the rest rendered here or on a scheduler."""

import os
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from typing import Any

from lfssao.cli.terminal import bar_size
from lfssao.core.files import output_folder
from lfssao.rendering.job import Job, views_at_once
from lfssao.rendering.output import Result
from lfssao.rendering.run import Results, recover, run_here, run_on
from lfssao.rendering.work import Item, Renderer, Work


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
        If there is a scheduler and distributed is not installed.
    """
    job, items = Job(work, head, seconds), work.items()
    found = _found(work, items, threads) if resume else {}
    rest = [item for item in items if item not in found]
    with ExitStack() as stack:
        results = stack.enter_context(_results(work, rest, threads, scheduler))
        for folder in (work.folder, *(work.frame_folder(frame) for frame in range(work.frame_count))):
            stack.enter_context(output_folder(folder))
        job.open(rest)
        for item, result in found.items():
            job.add(item, result)
        bar = stack.enter_context(_bar(total=len(items), initial=len(found), postfix="the first run compiles kernels"))
        # Closed before the folders are tidied up: files that were begun are finished first.
        for item, result in stack.enter_context(closing(results)):
            job.add(item, result)
            bar.set_postfix_str("", refresh=False)
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


@contextmanager
def _results(work: Work, items: list[Item], threads: int, scheduler: str | None) -> Iterator[Results]:
    """Results of the items, rendered as they are taken; what cannot work is refused before."""
    if scheduler is None or not items:
        # Read when numba's threads start: waiting in a loop, they would take time from those that write files.
        os.environ.setdefault("OMP_WAIT_POLICY", "passive")
        renderer = Renderer(work, threads)
        if items:
            renderer.prepare(items[0])
        ahead = views_at_once(work, threads + 2) if threads > 1 else 1
        yield run_here(renderer, items, threads, ahead)
    else:
        from lfssao.rendering.cluster import executor_of  # late: an optional package

        with executor_of(scheduler, min(threads, len(items))) as (executor, worker_threads):
            yield run_on(executor, work, items, worker_threads)


def _bar(unit: str = "module", **more: Any) -> Any:
    """A progress bar on a terminal, nothing in a pipe (disable=None); `with` ends its line before a message."""
    from tqdm import tqdm

    return tqdm(unit=unit, disable=None, **more, **bar_size())
