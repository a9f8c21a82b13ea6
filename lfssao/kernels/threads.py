"""Loops over rows in several threads: what the ``prange`` of a kernel becomes.

numba's own parallel loops are translated to machine code four times over, with threads' shares as arrays around each:
half the time that it took to compile what a render needs. Here a kernel is taken apart in the source instead. Each loop
becomes a function of two bounds and of the names that it uses, compiled once; the lines around the loops stay Python,
which they were written in, and in place of a loop they call ``share_out``. A kernel that they call answers with
Python's float for a float32, hence ``dtype(kernel(...))``.
"""

import ast
import concurrent.futures
import functools
import inspect
import os
import textwrap
from collections.abc import Callable
from typing import Any, TypeGuard

import numba
from numba import extending, types
from numba.np.arrayobj import make_array

Compile = Callable[[Callable[..., None]], Callable[..., None]]


def share_out(loop: Callable[..., None], n: int, *arguments: Any) -> None:
    """Run a loop over 0 .. n - 1, a contiguous run of them in each of numba's threads (``numba.set_num_threads``).

    Parameters
    ----------
    loop : callable
        Called with the first number, the one after the last and the arguments; it holds no lock of Python.
    n : int
        How many.
    *arguments
        What the loop reads and writes.
    """
    threads = max(min(numba.get_num_threads(), n), 1)
    bounds = [n * thread // threads for thread in range(threads + 1)]
    others = [_pool().submit(loop, bounds[k], bounds[k + 1], *arguments) for k in range(1, threads)]
    try:
        loop(0, bounds[1], *arguments)
    finally:  # nobody may go on while another thread still writes
        concurrent.futures.wait(others)
    for other in others:
        other.result()


@functools.cache
def _pool() -> concurrent.futures.ThreadPoolExecutor:
    return concurrent.futures.ThreadPoolExecutor(numba.config.NUMBA_NUM_THREADS, "lfssao")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # a forked process has none of the threads


@extending.intrinsic
def borrowed(_typing: Any, value: Any) -> Any:
    """An array as one that somebody else keeps alive: no references to it are counted. Anything else as it is."""

    def borrow(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if not isinstance(signature.return_type, types.Array):
            return arguments[0]
        array = make_array(signature.return_type)(context, builder, arguments[0])
        array.meminfo, array.parent = array.meminfo.type(None), array.parent.type(None)
        return array._getvalue()

    kind = types.unliteral(value)
    return kind(kind), borrow


def with_shared_loops(function: Callable[..., None], compiled: Compile) -> Callable[..., None]:
    """The function with each ``for k in prange(n)`` of its own body shared out among threads.

    Parameters
    ----------
    function : callable
        Its loops run over rows that one thread alone writes, and bind no name that is used after them.
    compiled : callable
        Compiles the function of one loop.

    Returns
    -------
    callable
        The same in effect, with the attributes ``py_func``, the function, and ``loops``, the compiled ones.
    """
    definition = _definition(textwrap.dedent(inspect.getsource(function)))
    definition.decorator_list = []
    known = {argument.arg for argument in definition.args.args}
    loops: dict[str, Callable[..., None]] = {}
    function.__globals__["borrowed"] = borrowed  # as if the module had imported it
    for place, statement in enumerate(definition.body):
        if _is_parallel(statement):
            name = f"_{function.__name__}_loop_{len(loops)}"
            used = sorted(known & _names(ast.Module(statement.body, []), ast.Load))
            definition.body[place] = _call(name, statement, used)
            loops[name] = compiled(_made(_loop(name, statement, used), function))
        else:
            known |= _names(statement, ast.Store)
            _forbid_copies(statement)
    assert loops, f"{function.__name__} has no loop over prange of its own"
    shared = functools.wraps(function)(_made(definition, function, share_out=share_out, **loops))
    vars(shared).update(py_func=function, loops=tuple(loops.values()))
    return shared


def _definition(source: str) -> ast.FunctionDef:
    (definition,) = ast.parse(source).body
    assert isinstance(definition, ast.FunctionDef)
    return definition


def _is_parallel(statement: ast.stmt) -> TypeGuard[ast.For]:
    return isinstance(statement, ast.For) and ast.unparse(statement.iter).startswith("prange(")


def _names(node: ast.AST, context: type[ast.expr_context]) -> set[str]:
    return {name.id for name in ast.walk(node) if isinstance(name, ast.Name) and isinstance(name.ctx, context)}


def _call(name: str, loop: ast.For, used: list[str]) -> ast.stmt:
    assert isinstance(loop.iter, ast.Call)
    return ast.parse(f"share_out({', '.join([name, ast.unparse(loop.iter.args[0]), *used])})").body[0]


def _loop(name: str, loop: ast.For, used: list[str]) -> ast.FunctionDef:
    """The loop as a function; it borrows the arrays, so that calls in it count no references to them.

    Scratch arrays of every row are made once, as numba does in its own parallel loops.
    """
    own = _names(loop, ast.Store)
    scratch = [line for line in loop.body if _makes_arrays(line) and not own & _names(line, ast.Load)]
    lines = [f"def {name}({', '.join(['_first', '_after', *used])}):", *(f" {x} = borrowed({x})" for x in used)]
    definition = _definition("\n".join([*lines, " for _ in range(_first, _after): pass"]))
    part = definition.body[-1]
    assert isinstance(part, ast.For)
    part.target, part.body = loop.target, [line for line in loop.body if line not in scratch]
    definition.body[-1:] = [*scratch, part]
    return definition


def _makes_arrays(line: ast.stmt) -> bool:
    """Whether it does nothing but bind names to new arrays with nothing in them."""
    value = line.value if isinstance(line, ast.Assign) else None
    made = value.elts if isinstance(value, ast.Tuple) else [value]
    return all(isinstance(array, ast.Call) and ast.unparse(array.func) == "np.empty" for array in made)


def _forbid_copies(statement: ast.stmt) -> None:
    """Let ``reshape`` refuse, as numba's does, what is no view: what a loop writes to a copy would be lost."""
    for node in ast.walk(statement):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "reshape":
            node.keywords.append(ast.keyword("copy", ast.Constant(False)))


def _made(definition: ast.FunctionDef, like: Callable[..., None], **names: Any) -> Callable[..., None]:
    """A function of the same module and lines, which knows some more names."""
    if names:
        around = _definition(f"def around({', '.join(names)}):\n pass\n return {definition.name}")
        around.body[0] = definition
    else:
        around = definition
    tree = ast.fix_missing_locations(ast.Module([around], []))
    ast.increment_lineno(tree, like.__code__.co_firstlineno - 1)
    made: dict[str, Any] = {}
    exec(compile(tree, like.__code__.co_filename, "exec"), like.__globals__, made)
    (function,) = made.values()
    result: Callable[..., None] = function(**names) if names else function
    result.__module__ = like.__module__
    return result
