"""The one decorator that compiles kernels, so that all of them share the flags that fix their bits."""

import functools
import hashlib
import inspect
import os
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import caching
from numba.extending import register_jitable

from lfssao.core.threads import in_chunks
from lfssao.errors import InputWarning

FLAGS: dict[str, Any] = {
    "fastmath": False,  # no reassociation, no fused multiply-add: the written order is the order
    "error_model": "numpy",  # division by zero is infinity, as on a GPU, and loops stay free of branches
    "boundscheck": False,
    "nogil": True,
    "no_cfunc_wrapper": True,  # for pointers to functions, which nobody takes: compiling takes 0.92 of the time
}

_CORE = Path(__file__).parent
FEW = 64  # rows of a texture: threads would take longer to begin, which is half of a search's time on small ones
_BANDS_A_THREAD = 4  # bands that are slow do not leave a thread without work


def compiled_sources() -> list[Path]:
    """Return the files of all kernels and formulas: those of ``core``, of folders ``kernels`` and of estimators."""
    package = _CORE.parent
    formulas = (package / "ao" / "estimators").rglob("*.py")
    return sorted({*_CORE.glob("*.py"), *package.rglob("kernels/*.py"), *formulas})


@functools.cache
def source_digest() -> str:
    """SHA-256 over the sources of all kernels and formulas, the key of their compiled code on disk.

    numba looks at the file that defines a function only. A kernel has its callees inlined, so after a change of a
    callee in another file it would go on running the old code.
    """
    digest = hashlib.sha256()
    for path in compiled_sources():
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


@functools.cache
def _cache_folder(chosen: str) -> str:
    """Return the folder of these sources' compiled code: in ``chosen``, else beside them, else in the user's cache.

    chosen: the user's NUMBA_CACHE_DIR, or nothing. Empty where none of these can be written. Code that checks its
    indices, of NUMBA_BOUNDSCHECK=1, has a folder of its own.
    """
    beside, checked = str(_CORE / "__pycache__"), "-checked" if numba.config.BOUNDSCHECK else ""
    for home in (chosen or beside, beside, os.path.expanduser("~/.cache/lfssao")):
        folder = Path(home, f"kernels-{source_digest()[:16]}{checked}")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
        except OSError:
            continue
        return str(folder)
    return ""


def _is_whole(path: Path) -> bool:
    """Whether a file ends with the SHA-256 of all before. One that does not is removed, with a warning.

    A folder in its place is no file, and stays.
    """
    try:
        # In this order, as another process may write the file in between.
        data = b"" if path.exists() and not path.is_file() else path.read_bytes()
        if hashlib.sha256(data[:-32]).digest() == data[-32:]:
            return True
        path.unlink()
    except OSError:
        return False
    warnings.warn(
        f"{path.parents[1]}: compiled code in it was damaged and is compiled anew", InputWarning, stacklevel=2
    )
    return False


class _Files(caching.IndexDataCacheFile):  # type: ignore[misc]
    """A kernel's files on disk, each with a SHA-256 at its end, where numba does not read; a damaged one is not there.

    Damaged code would be run, and a damaged index ends in an exception of ``pickle``.
    """

    def _load_index(self) -> Any:
        return super()._load_index() if _is_whole(Path(self._index_path)) else {}

    def _load_data(self, name: str) -> Any:
        if not _is_whole(Path(self._data_path(name))):
            raise FileNotFoundError(name)
        return super()._load_data(name)

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[BytesIO]:
        with super()._open_for_write(filepath) as file:
            yield (content := BytesIO())
            file.write(content.getvalue() + hashlib.sha256(content.getvalue()).digest())


class _Report:
    """Calls ``begin`` with the number of each kernel that numba begins to compile, and ``end`` after it."""

    def __init__(self, begin: Callable[[int], None], end: Callable[[], None]) -> None:
        self._begin = begin
        self._end = end
        self._count = 0
        self._compiled: _Cache | None = None  # of the kernel that callees are compiled for

    def begin(self, cache: "_Cache") -> None:
        """A kernel has no code on disk, so that it is compiled next."""
        if self._compiled is None:
            self._compiled = cache
            self._count += 1
            self._begin(self._count)

    def end(self, cache: "_Cache") -> None:
        """A kernel is compiled."""
        if self._compiled is cache:
            self._compiled = None
            self._end()


_reports: list[_Report] = []


class _Cache(caching.FunctionCache):  # type: ignore[misc]
    """numba's cache of a kernel, with such files; numba asks it before it compiles, and hands over the code after."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _Files(self.cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return compiled code of a signature; without any, numba compiles next."""
        code = super().load_overload(sig, target_context)
        if code is None:
            for report in _reports:
                report.begin(self)
        return code

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep compiled code, but not for tuples of others: a process that cannot import them could read none."""
        if all(map(_is_known, sig)):
            with suppress(OSError):  # on a full disk, or where a folder is in the way, the next process compiles anew
                super().save_overload(sig, data)
        for report in _reports:
            report.end(self)


def _is_known(kind: Any) -> bool:
    """Whether the tuples in a type of numba's are those of this package."""
    kind_class = getattr(kind, "instance_class", None)
    own = kind_class is None or kind_class.__module__.partition(".")[0] == "lfssao"
    return own and all(map(_is_known, getattr(kind, "types", ())))


class RowKernel:
    """A kernel of a band of rows, which is called for all of them: threads share the rows (``kernel``).

    py_func: the function as it is written. compiled: numba's, whose first two arguments are the band.
    """

    def __init__(self, function: Callable[..., None], compiled: Callable[..., None], rows: str, few: int) -> None:
        self._few = few
        functools.update_wrapper(self, function)
        name, _, self._attribute = rows.partition(".")
        self._place = list(inspect.signature(function).parameters).index(name) - 2
        self.compiled, self.py_func = compiled, function

    def __call__(self, *arguments: Any) -> None:
        """Compute all rows; arguments are the kernel's without the band."""
        rows, threads = arguments[self._place], numba.get_num_threads()
        rows = getattr(rows, self._attribute) if self._attribute else rows
        count = rows if isinstance(rows, int) else rows.shape[0]
        if count <= self._few:
            self.compiled(0, count, *arguments)
            return
        self.compiled(0, 0, *arguments)  # compiles here, where an interruption arrives, and not in a thread
        size = 2 * -(-count // (2 * _BANDS_A_THREAD * threads))
        in_chunks(lambda begin, stop: self.compiled(begin, stop, *arguments), count, max(size, 2), threads)


INLINED = {**FLAGS, "forceinline": True}  # other flags would compile a formula once more

_F = TypeVar("_F", bound=Callable[..., Any])
# Compiled code calls the function, which LLVM puts into it, so that loops become vectors; Python calls it, too. numba
# makes no wrapper for calls from Python: a first render takes 0.89 times the processor time by it.
formula: Callable[[_F], _F] = register_jitable(**INLINED)


def kernel(function: Callable[..., Any] | None = None, *, rows: str = "", few: int = FEW, inline: bool = False) -> Any:
    """Compile a function of arrays and scalars with numba under the flags of ``FLAGS``, for the cache on disk.

    With ``rows`` it computes a band of rows, from ``begin`` to before ``stop``, its first two parameters. Callers leave
    them out: threads share the rows of the array, or the number of rows, that ``rows`` names, ``argument`` or
    ``argument.attribute``; each thread takes the next band, which begins at an even row. One thread alone writes a row.
    The calling thread computes ``few`` rows and less alone: where a row is one point, more than of a texture's.
    numba's own ``prange`` has the same speed and compiles 1.4 to 1.7 times as long (benchmarks/README.md).
    With ``inline`` LLVM puts the function into its callers, too, as a ``formula``.
    """
    if function is None:
        return functools.partial(kernel, rows=rows, few=few, inline=inline)
    compiled = numba.njit(function, forceinline=inline, **FLAGS)
    chosen = numba.config.CACHE_DIR
    folder = _cache_folder(chosen)
    if folder and compiled is not function:  # it is with NUMBA_DISABLE_JIT=1
        numba.config.CACHE_DIR = folder
        try:
            compiled._cache = _Cache(function)
        finally:
            numba.config.CACHE_DIR = chosen
    return RowKernel(function, compiled, rows, few) if rows else compiled


@contextmanager
def report_compiling(begin: Callable[[int], None], end: Callable[[], None]) -> Iterator[None]:
    """In the block, call ``begin(1)``, ``begin(2)``, ... as kernels begin to be compiled, and ``end()`` after each.

    Kernels that are compiled within another one, which they are inlined into, are not reported; neither are any where
    no folder holds compiled code.
    """
    _reports.append(_Report(begin, end))
    try:
        yield
    finally:
        _reports.pop()
