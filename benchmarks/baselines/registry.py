"""All peers by name, each measured in a process of its own: a driver that crashes takes no figures with it."""

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from importlib import import_module
from multiprocessing import get_context
from typing import Any

from lfssao.errors import MissingPackageError

# A peer is a file of this folder with ``measure(repeats, threads) -> dict``, which raises MissingPackageError without
# what it needs.
PEERS = {
    "c": "LF Algorithm 2 in plain C",
    "glsl": "LF Algorithm 2 as a GLSL compute shader",
    "vtk": "VTK's SSAO pass",
    "embree": "ray-cast occlusion, the same rays through Embree",
}


def measure_peer(name: str, repeats: int, threads: int) -> dict[str, Any]:
    """Rows of one peer, or {'skipped': reason}."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        try:
            return pool.submit(_measure, name, repeats, threads).result()
        except BrokenProcessPool:
            return {"skipped": "its process died"}


def measure_peers(repeats: int, threads: int, tick: Callable[[str], None]) -> dict[str, Any]:
    """Rows of all peers, 'measured', by name."""
    out = {}
    for name, title in PEERS.items():
        tick(f"peer: {title}")
        out[name] = {"title": title, **measure_peer(name, repeats, threads)}
    return {"measured": out}


def _measure(name: str, repeats: int, threads: int) -> dict[str, Any]:
    import os

    import numba

    os.environ["OMP_NUM_THREADS"] = os.environ["LP_NUM_THREADS"] = str(threads)
    numba.set_num_threads(threads)
    try:
        measured: dict[str, Any] = import_module(f"baselines.{name}").measure(repeats, threads)
    except MissingPackageError as error:
        return {"skipped": str(error)}
    return measured
