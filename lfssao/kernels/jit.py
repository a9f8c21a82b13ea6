"""The one decorator that compiles kernels, so that all of them share the flags that fix their bits."""

import functools
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

FLAGS: dict[str, Any] = {
    "fastmath": False,  # no reassociation, no fused multiply-add: the written order is the order
    "error_model": "numpy",  # division by zero is infinity, as on a GPU, and loops stay free of branches
    "boundscheck": False,
    "nogil": True,
}


@functools.cache
def source_digest() -> str:
    """SHA-256 over the source of every kernel, the key of the compiled code on disk."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def kernel(function: Callable[..., Any] | None = None, *, parallel: bool = False, inline: bool = False) -> Any:
    """Compile a function of arrays and scalars with numba under the flags of ``FLAGS``.

    Parameters
    ----------
    function : callable
        The function; with ``parallel`` its ``prange`` runs over rows that one thread alone writes.
    parallel : bool
        Whether ``numba.prange`` starts threads.
    inline : bool
        Whether LLVM must put the function into its callers, so that their loops become vectors.

    Returns
    -------
    callable
        The compiled function; its machine code is cached on disk where a folder can be written.
    """
    if function is None:
        return functools.partial(kernel, parallel=parallel, inline=inline)
    options = {**FLAGS, "parallel": parallel, "forceinline": inline}
    try:
        compiled = numba.njit(function, cache=True, **options)
    except RuntimeError:  # neither the package's folder nor the user's cache folder can be written
        return numba.njit(function, **options)
    _key_by_all_sources(compiled)
    return compiled


def _key_by_all_sources(compiled: Any) -> None:
    """Make the cached code depend on every kernel file.

    numba looks at the time stamp of the file that defines a function only. A kernel has its callees inlined, so
    after an upgrade that touched a callee in another file it would go on running the old code.
    """
    index = compiled._cache._cache_file
    index._source_stamp = (index._source_stamp, source_digest())
