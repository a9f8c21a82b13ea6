"""The one decorator that compiles kernels, so that all of them share the flags that fix their bits."""

import functools
import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
from numba.core import event

FLAGS: dict[str, Any] = {
    "fastmath": False,  # no reassociation, no fused multiply-add: the written order is the order
    "error_model": "numpy",  # division by zero is infinity, as on a GPU, and loops stay free of branches
    "boundscheck": False,
    "nogil": True,
}

_CORE = Path(__file__).parent


@functools.cache
def source_digest() -> str:
    """SHA-256 over the sources of all kernels, the key of their compiled code on disk.

    numba looks at the file that defines a function only. A kernel has its callees inlined, so after a change of a
    callee in another file it would go on running the old code.
    """
    digest = hashlib.sha256()
    for path in sorted([*_CORE.glob("*.py"), *_CORE.parent.rglob("kernels/*.py")]):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


@functools.cache
def _cache_folder(chosen: str) -> str:
    """Return the folder of these sources' compiled code: in ``chosen``, else beside them, else in the user's cache.

    chosen: the user's NUMBA_CACHE_DIR, or nothing. Empty where none of these can be written.
    """
    beside = str(_CORE / "__pycache__")
    for home in (chosen or beside, beside, os.path.expanduser("~/.cache/lfssao")):
        folder = Path(home, f"kernels-{source_digest()[:16]}")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
        except OSError:
            continue
        return str(folder)
    return ""


def kernel(function: Callable[..., Any] | None = None, *, parallel: bool = False, inline: bool = False) -> Any:
    """Compile a function of arrays and scalars with numba under the flags of ``FLAGS``, for the cache on disk.

    With ``parallel`` each ``prange``, over rows that one thread alone writes, is shared among threads. Such a function
    compiles four times as long. A named tuple that the ``prange`` reads must be flat, and an argument of the function
    or made inside the loop. With ``inline`` LLVM must put the function into its callers, so that their loops become
    vectors.
    """
    if function is None:
        return functools.partial(kernel, parallel=parallel, inline=inline)
    options = {**FLAGS, "parallel": parallel, "forceinline": inline}
    chosen = numba.config.CACHE_DIR
    folder = _cache_folder(chosen)
    numba.config.CACHE_DIR = folder
    try:
        return numba.njit(function, cache=bool(folder), **options)
    finally:
        numba.config.CACHE_DIR = chosen


@contextmanager
def compiling_told(begin: Callable[[int], None], end: Callable[[], None]) -> Iterator[None]:
    """In the block, call ``begin(1)``, ``begin(2)``, ... as kernels begin to be compiled, and ``end()`` after each.

    Kernels that are compiled within another one, which they are inlined into, are not told.
    """

    class Listener(event.Listener):  # type: ignore[misc]
        depth = count = 0

        def on_start(self, event: event.Event) -> None:
            self.depth += 1
            if self.depth == 1:
                self.count += 1
                begin(self.count)

        def on_end(self, event: event.Event) -> None:
            self.depth -= 1
            if self.depth == 0:
                end()

    with event.install_listener("numba:compile", Listener()):
        yield
