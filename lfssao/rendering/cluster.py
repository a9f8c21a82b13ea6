"""Workers of dask.distributed as an executor; no other file knows dask."""

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from lfssao.errors import InputError, MissingPackageError
from lfssao.files.whole import read_json

_SECONDS_TO_ANSWER = 10


@contextmanager
def executor_of(scheduler: str, processes: int) -> Iterator[tuple[Executor, int, Callable[[Any], Any]]]:
    """An executor on a scheduler's workers, how many threads each worker has, and a function that sends them an object.

    The scheduler is given by its address, or by the file in which it wrote that, or 'local' makes one on this machine
    for as long as the block runs, with ``processes`` workers of one thread each. Raises InputError if no scheduler
    answers or it has no worker, and MissingPackageError if distributed is not installed.
    """
    try:
        from dask import config  # late: optional packages
        from distributed import Client, LocalCluster
    except ImportError as error:
        wanted = "the package distributed, which is not installed here: pip install 'lfssao[dask]'"
        raise MissingPackageError(f"--scheduler needs {wanted}") from error
    with ExitStack() as stack:
        address = _address_in(Path(scheduler)) if Path(scheduler).is_file() else scheduler
        if scheduler == "local":
            # TLS with keys of its own: who else is on this machine may not connect. Silent: a lost worker is replaced
            # and its items are done again, errors of items come back to the caller, and a worker that is closed during
            # its heartbeat logs an error.
            alone: dict[str, Any] = {"security": True, "silence_logs": logging.CRITICAL}
            # Its servers of pages begin in any case: they get free ports and no pages.
            alone |= {"dashboard_address": "127.0.0.1:0", "scheduler_kwargs": {"dashboard": False}}
            settings: dict[str, Any] = {f"distributed.{each}.http.routes": [] for each in ("scheduler", "worker")}
            settings["temporary-directory"] = stack.enter_context(TemporaryDirectory(prefix="lfssao-"))
            stack.enter_context(config.set(settings))
            address = stack.enter_context(LocalCluster(n_workers=processes, threads_per_worker=1, **alone))
        try:
            client = stack.enter_context(Client(address, timeout=_SECONDS_TO_ANSWER))
        except (OSError, ValueError) as error:
            raise InputError(f"--scheduler: no dask scheduler answers at {scheduler}") from error
        threads = client.nthreads().values()
        if not threads:
            raise InputError(f"--scheduler: the scheduler at {scheduler} has no workers")
        yield client.get_executor(pure=False), min(threads), partial(client.scatter, broadcast=True, hash=False)


def _address_in(file: Path) -> str:
    """Return the address in a file that ``dask scheduler --scheduler-file`` wrote; InputError if there is none."""
    found = read_json(file)
    address = found.get("address") if isinstance(found, dict) else None
    if not isinstance(address, str):
        raise InputError(f"--scheduler: {file}: it holds no address of a dask scheduler")
    return address
