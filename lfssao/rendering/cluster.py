"""Workers of dask.distributed as an executor; no other file knows dask."""

import logging
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager

from lfssao.errors import InputError, MissingPackageError

_SECONDS_TO_ANSWER = 10


@contextmanager
def executor_of(scheduler: str, processes: int) -> Iterator[tuple[Executor, int]]:
    """An executor on a scheduler's workers, and how many threads each worker has.

    The scheduler is given by its address, or 'local' makes one on this machine for as long as the block runs, with
    ``processes`` workers of one thread each. Raises InputError if no scheduler answers or it has no worker, and
    MissingPackageError if distributed is not installed.
    """
    try:
        from distributed import Client, LocalCluster  # late: an optional package
    except ImportError as error:
        raise MissingPackageError(
            "--scheduler needs the package distributed, which is not installed here: pip install 'lfssao[dask]'"
        ) from error
    with ExitStack() as stack:
        address = scheduler
        if scheduler == "local":
            # Silent: a lost worker is replaced and its items are done again, errors of items come back to the caller,
            # and a worker that is closed during its heartbeat logs an error.
            quiet = {"dashboard_address": "127.0.0.1:0", "silence_logs": logging.CRITICAL}
            cluster = LocalCluster(n_workers=processes, threads_per_worker=1, **quiet)
            address = stack.enter_context(cluster).scheduler_address
        try:
            client = stack.enter_context(Client(address, timeout=_SECONDS_TO_ANSWER))
        except (OSError, ValueError) as error:
            raise InputError(f"--scheduler: no dask scheduler answers at {address}") from error
        threads = client.nthreads().values()
        if not threads:
            raise InputError(f"--scheduler: the scheduler at {address} has no workers")
        yield client.get_executor(pure=False), min(threads)
