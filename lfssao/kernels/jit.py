"""The one decorator that compiles kernels, so that all of them share the flags that fix their bits."""

import ast
import functools
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba import extending, types

from lfssao.kernels.extremes import largest, smallest
from lfssao.kernels.linked import Linked, Loop, for_kernels
from lfssao.kernels.threads import with_shared_loops

FLAGS: dict[str, Any] = {
    "fastmath": False,  # no reassociation, no fused multiply-add: the written order is the order
    "error_model": "numpy",  # division by zero is infinity, as on a GPU, and loops stay free of branches
    "boundscheck": False,
    "nogil": True,
    "no_cfunc_wrapper": True,  # a second entry, for C, would be compiled with each; nobody takes a kernel's address
}

_FOLDER = Path(__file__).parent
_PREFIX = "lfssao.kernels."


@functools.cache
def source_digest(module: str) -> str:
    """SHA-256 over the source of a kernel file and of all that it imports here, the key of its compiled code on disk.

    Parameters
    ----------
    module : str
        The file's name in this folder, without its suffix.
    """
    digest = hashlib.sha256()
    for name in sorted(_with_imports(module)):
        digest.update((_FOLDER / f"{name}.py").read_bytes())
    return digest.hexdigest()


def _with_imports(module: str) -> set[str]:
    """The file and, through any number of steps, the files of this folder that it imports names from."""
    found, new = set(), {module}
    while new:
        found |= new
        new = {name for known in new for name in _imports(known)} - found
    return found


@functools.cache
def _imports(module: str) -> frozenset[str]:
    """The files of this folder that one imports names from; kernels cannot import inside of functions."""
    lines = ast.parse((_FOLDER / f"{module}.py").read_bytes()).body
    modules = [line.module for line in lines if isinstance(line, ast.ImportFrom) and line.module]
    return frozenset(name.removeprefix(_PREFIX) for name in modules if name.startswith(_PREFIX))


def kernel(function: Callable[..., Any] | None = None, *, parallel: bool = False, inline: bool = False) -> Any:
    """Compile a function of arrays and scalars with numba under the flags of ``FLAGS``.

    Parameters
    ----------
    function : callable
        The function; with ``parallel`` each ``prange`` or ``interleaved`` runs over rows that one thread alone writes.
    parallel : bool
        Whether each ``prange`` and ``interleaved`` of the function's own body is shared among threads
        (``lfssao.kernels.threads``).
    inline : bool
        Whether LLVM must put the function into its callers, so that their loops become vectors.

    Returns
    -------
    callable
        The compiled function; its machine code is cached on disk where a folder can be written.
    """
    if function is None:
        return functools.partial(kernel, parallel=parallel, inline=inline)
    if parallel:
        return with_shared_loops(function, _loop, _dispatcher)
    return _compiled(function, forceinline=inline)


def _compiled(function: Callable[..., Any], **more: Any) -> Any:
    """The dispatcher for calls from Python; its attribute ``linked`` gives that for calls from kernels."""
    compiled = _dispatcher(function, **more)
    compiled.linked = functools.cache(lambda: _linked(function, Linked, **more))
    _link(compiled, compiled.linked)
    return compiled


def _loop(function: Callable[..., Any]) -> Any:
    """The dispatcher of a loop that threads share, for calls from kernels."""
    compiled = _linked(function, Loop)
    compiled.get_call_template = _of_plain_types(compiled.get_call_template)
    return compiled


def _linked(function: Callable[..., Any], compiler: type[Linked], **more: Any) -> Any:
    return for_kernels(_dispatcher(function, **more, pipeline_class=compiler, no_cpython_wrapper=True))


def _dispatcher(function: Callable[..., Any], **more: Any) -> Any:
    options = {**FLAGS, **more}
    # As if the module had imported them. Their names stay those that a reader of Python knows.
    function.__globals__.update(max=largest, min=smallest)
    try:
        compiled = numba.njit(function, cache=True, **options)
    except RuntimeError:  # neither the package's folder nor the user's cache folder can be written
        return numba.njit(function, **options)
    _key_by_sources(compiled)
    _key_by_options(compiled, more)
    _name_by_signature(compiled)
    return compiled


@extending.intrinsic
def wide_vectors(_typing: Any) -> Any:
    """Let LLVM use the widest vectors the processor has in the function, or body of a ``prange``, that calls this.

    By default it uses half of AVX-512's width on most processors, in case that wider vectors lower the clock; loops of
    gathers and divisions gain a tenth by them. A processor without AVX-512 is not concerned, nor are any bits.
    """

    def request(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        # llvmlite's own ``add`` knows the attributes without a value only.
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.void(), request


def _link(compiled: Any, linked: Callable[[], Any]) -> None:
    """Let calls from other kernels use ``linked()``, and one compiled function whatever literal numbers they pass.

    What unpacks a call's arguments from Python is a third of a small function's code. By itself numba compiles a callee
    once more for each literal that it is called with; LLVM puts those into the inlined copy all the same, so that only
    the time to compile grows.
    """
    compiled.get_call_template = _of_plain_types(lambda *types_of: linked().get_call_template(*types_of))
    compiled.get_overload = lambda signature: linked().get_overload(signature)


def _of_plain_types(template: Callable[..., Any]) -> Callable[..., Any]:
    """A dispatcher's ``get_call_template`` that takes literal numbers for numbers."""

    def plain(arguments: Any, keywords: Any) -> Any:
        named = {name: types.unliteral(kind) for name, kind in keywords.items()}
        return template(tuple(map(types.unliteral, arguments)), named)

    return plain


def _key_by_sources(compiled: Any) -> None:
    """Make the cached code depend on every kernel file whose functions may be inlined into it.

    numba looks at the time stamp of the file that defines a function only. A kernel has its callees inlined, so
    after an upgrade that touched a callee in another file it would go on running the old code.
    """
    index = compiled._cache._cache_file
    index._source_stamp = (index._source_stamp, source_digest(Path(compiled.py_func.__code__.co_filename).stem))


def _key_by_options(compiled: Any, options: dict[str, Any]) -> None:
    """Keep code compiled with different options apart: numba's index knows the function and the signature only."""
    key = compiled._cache._index_key
    compiled._cache._index_key = lambda *about: (*key(*about), repr(sorted(options)))


def _name_by_signature(compiled: Any) -> None:
    """Give the code of each signature and processor a file name of its own.

    numba numbers the files: processes that compile at the same time for different types take the same number, and
    whoever writes last leaves his code under the other's entry in the index.
    """
    index = compiled._cache._cache_file
    number, save = index._data_name_pattern, index.save

    def save_by_name(key: Any, data: Any) -> None:
        name = hashlib.sha256(repr(key).encode()).hexdigest()[:16]
        index._data_name_pattern = number.replace(".{number", f".{name}.{{number")
        save(key, data)

    index.save = save_by_name
