"""Loops over rows in several threads: what ``prange`` and ``interleaved`` of a kernel become.

numba translates a parallel loop of its own to machine code four times over, with threads' shares as arrays around each:
half the time that it took to compile what a render needs. Here a kernel is taken apart in the source instead. Each loop
becomes a function of two bounds and of the names that it uses, compiled once, that numba's threads call for a share
each (Python's would take longer to start than a short kernel takes). The lines around the loops are compiled too, as
another function, which calls those: as Python they took 5 us, and 100 us where the caches are full of textures.
"""

import ast
import functools
import inspect
import textwrap
from collections.abc import Callable
from typing import Any, TypeGuard

import numba
from llvmlite import binding, ir
from numba import extending, types
from numba.core import cgutils
from numba.np.arrayobj import make_array
from numba.np.ufunc import parallel

Function = Callable[..., None]
Compile = Callable[[Function], Function]
Share = Callable[..., tuple[Any, Any, Any]]

# Rows that a thread takes at once, with one set of scratch arrays: enough that starting costs nothing, few enough that
# they divide evenly among threads.
ROWS_A_BLOCK = 8

# What threads call to share a loop out, by the name of what it runs over.
_SHARED = {"prange": "in_threads", "interleaved": "in_turns"}

# LLVM's attribute of a pointer that a function does not keep; its name is another one from version 21 on.
_KEPT_NOWHERE = "captures(none)" if binding.llvm_version_info >= (21,) else "nocapture"


def thread_count() -> int:
    """How many threads numba is set to; the first question starts them, and tells LLVM where numba_parallel_for is.

    ``numba.get_num_threads`` takes a lock between processes at every call, to start them: a tenth of a pass over a
    small texture. Once they run, numba's own number is asked.
    """
    return int(parallel._get_num_threads() if parallel._is_initialized else numba.get_num_threads())


def interleaved(n: int) -> range:
    """0 .. n - 1 shared among a kernel's threads as cards are dealt: of T threads the t-th takes t, t + T, t + 2 T ...

    A picture's empty rows lie together, at its top say: where shares are contiguous, as those of ``prange``, one thread
    may get all of them. Here shares are even, and all threads go down the picture side by side, through texels that are
    in the caches for them all.
    """
    return range(n)


@extending.intrinsic
def in_threads(_typing: Any, values: Any) -> Any:
    """Call the function that calls this once in each of several threads of numba's, and wait for all.

    The tuple has the function's own arguments in its order: the first number of a loop, the one after the last, the
    step, how many threads, and the rest. In the calls the first three give a share, contiguous, and threads is 1.
    """
    return types.void(values), _launcher(values.types, _contiguous)


@extending.intrinsic
def in_turns(_typing: Any, values: Any) -> Any:
    """The same with shares of ``interleaved``."""
    return types.void(values), _launcher(values.types, _dealt)


def _contiguous(builder: Any, first: Any, after: Any, threads: Any, k: Any) -> tuple[Any, Any, Any]:
    """Bounds and step of share number k."""
    n, one = builder.sub(after, first), k.type(1)

    def bound(k: Any) -> Any:
        return builder.add(first, builder.sdiv(builder.mul(n, k), threads))

    return bound(k), bound(builder.add(k, one)), one


def _dealt(builder: Any, first: Any, after: Any, threads: Any, k: Any) -> tuple[Any, Any, Any]:
    """Bounds and step of share number k."""
    return builder.add(first, k), after, threads


def _launcher(kinds: Any, shares: Share) -> Callable[..., Any]:
    """What an intrinsic compiles: a call of the launch function."""

    def call(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        packer = context.get_arg_packer(kinds)
        given = packer.as_arguments(builder, cgutils.unpack_tuple(builder, arguments[0]))
        builder.call(_launch_function(context, builder.function, kinds, packer, shares), given)
        return context.get_dummy_value()

    return call


def _launch_function(context: Any, function: Any, kinds: Any, packer: Any, shares: Share) -> Any:
    """What ``function`` calls to be called in threads, with its own arguments.

    It is a function of its own, not to be inlined, which keeps no pointer: where pointers are stored LLVM takes it that
    scratch arrays may overlap what they point to, and makes no vectors.
    """
    number, pointer = ir.IntType(64), ir.IntType(8).as_pointer()
    launch = ir.Function(
        function.module, ir.FunctionType(ir.VoidType(), packer.argument_types), f"{function.name}.launch"
    )
    launch.linkage = "internal"
    launch.attributes.add("noinline")
    for argument in launch.args:
        if isinstance(argument.type, ir.PointerType):
            argument.add_attribute(_KEPT_NOWHERE)
    builder = ir.IRBuilder(launch.append_basic_block())
    own = packer.from_arguments(builder, launch.args)
    packed, threads = cgutils.pack_struct(builder, own), own[3]
    share = _share_function(context, function, kinds, packed.type, shares)
    run = ir.FunctionType(ir.VoidType(), [pointer] * 5 + [number] * 3)
    # What numba advances by a step from share to share is a pointer; nothing is there: it counts the shares.
    counter = cgutils.alloca_once_value(builder, pointer(None))
    steps = cgutils.alloca_once_value(builder, number(1))
    count, data = cgutils.alloca_once_value(builder, threads), cgutils.alloca_once_value(builder, packed)
    given = [builder.bitcast(value, pointer) for value in (share, counter, count, steps, data)]
    numba_parallel_for = cgutils.get_or_insert_function(function.module, run, "numba_parallel_for")
    builder.call(numba_parallel_for, [*given, number(0), number(1), threads])
    builder.ret_void()
    return launch


def _share_function(context: Any, function: Any, kinds: Any, packed: Any, shares: Share) -> Any:
    """What numba's threads call: ``function`` on the shares whose numbers begin at a pointer's."""
    number, pointer = ir.IntType(64), ir.IntType(8).as_pointer()
    kind = ir.FunctionType(ir.VoidType(), [pointer.as_pointer(), number.as_pointer(), number.as_pointer(), pointer])
    share = ir.Function(function.module, kind, f"{function.name}.share")
    share.linkage = "internal"
    builder = ir.IRBuilder(share.append_basic_block())
    counter, count, _, data = share.args
    first, after, _, threads, *rest = cgutils.unpack_tuple(
        builder, builder.load(builder.bitcast(data, packed.as_pointer()))
    )
    begin = builder.ptrtoint(builder.load(counter), number)
    with cgutils.for_range(builder, builder.load(count)) as loop:
        own = shares(builder, first, after, threads, builder.add(begin, loop.index))
        context.call_conv.call_function(builder, function, types.none, kinds, [*own, number(1), *rest])
    builder.ret_void()
    return share


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


def with_shared_loops(function: Function, compiled_loop: Compile, compiled_head: Compile) -> Function:
    """The function with each ``for k in prange(n)``, or ``interleaved(n)``, of its own body shared out among threads.

    Parameters
    ----------
    function : callable
        Its loops run over rows that one thread alone writes, and bind no name that is used after them.
    compiled_loop : callable
        Compiles the function of one loop, for arguments of plain types: were a literal 0 the first bound, it would be
        compiled in, and every thread would begin there.
    compiled_head : callable
        Compiles what is left.

    Returns
    -------
    callable
        The same in effect, with the attributes ``py_func``, the function, and the compiled ``head`` and ``loops``.
    """
    definition = _definition(textwrap.dedent(inspect.getsource(function)))
    definition.decorator_list = []
    known = {argument.arg for argument in definition.args.args}
    loops: dict[str, Function] = {}
    # As if the module had imported them.
    function.__globals__.update(borrowed=borrowed, in_threads=in_threads, in_turns=in_turns)
    for place, statement in enumerate(definition.body):
        if _is_parallel(statement):
            name = f"_{function.__name__}_loop_{len(loops)}"
            used = sorted(known & _names(ast.Module(statement.body, []), ast.Load))
            definition.body[place] = _call(name, statement, used)
            loops[name] = compiled_loop(_made(_loop(name, statement, used), function))
        else:
            known |= _names(statement, ast.Store)
    assert loops, f"{function.__name__} has no loop over prange or interleaved of its own"
    function.__globals__.update(loops)
    definition.name = f"_{function.__name__}_head"
    definition.args.args[:0] = [ast.arg(name) for name in ("_threads", "_first", "_step")]
    head = compiled_head(_made(definition, function))

    @functools.wraps(function)
    def shared(*arguments: Any, **named: Any) -> None:
        head(thread_count(), 0, 1, *arguments, **named)

    vars(shared).update(py_func=function, head=head, loops=tuple(loops.values()))
    return shared


def _definition(source: str) -> ast.FunctionDef:
    (definition,) = ast.parse(source).body
    assert isinstance(definition, ast.FunctionDef)
    return definition


def _is_parallel(statement: ast.stmt) -> TypeGuard[ast.For]:
    return isinstance(statement, ast.For) and _runs_over(statement) in _SHARED


def _runs_over(loop: ast.For) -> str:
    """The name of what a loop calls for its numbers."""
    return ast.unparse(loop.iter.func) if isinstance(loop.iter, ast.Call) else ""


def _names(node: ast.AST, context: type[ast.expr_context]) -> set[str]:
    return {name.id for name in ast.walk(node) if isinstance(name, ast.Name) and isinstance(name.ctx, context)}


def _call(name: str, loop: ast.For, used: list[str]) -> ast.stmt:
    assert isinstance(loop.iter, ast.Call)
    n = ast.unparse(loop.iter.args[0])
    return ast.parse(f"{name}({', '.join(['_first', n, '_step', f'max(min(_threads, {n}), 1)', *used])})").body[0]


def _loop(name: str, loop: ast.For, used: list[str]) -> ast.FunctionDef:
    """The loop as a function; it borrows the arrays, so that calls in it count no references to them.

    Scratch arrays of every row are made once, as numba does in its own parallel loops.
    """
    own = _names(loop, ast.Store)
    scratch = [line for line in loop.body if _makes_arrays(line) and not own & _names(line, ast.Load)]
    taken = ", ".join(["_first", "_after", "_step", "_threads", *used])
    numbers = "_first, _after" if _runs_over(loop) == "prange" else "_first, _after, _step"
    lines = [
        f"def {name}({taken}):",
        *(f" {x} = borrowed({x})" for x in used),
        f" if _threads > 1: {_SHARED[_runs_over(loop)]}(({taken}))",
        " else:",
        f"  for _ in range({numbers}): pass",
    ]
    definition = _definition("\n".join(lines))
    branch = definition.body[-1]
    assert isinstance(branch, ast.If)
    part = branch.orelse[-1]
    assert isinstance(part, ast.For)
    part.target, part.body = loop.target, [line for line in loop.body if line not in scratch]
    branch.orelse[-1:] = [*scratch, part]
    return definition


def _makes_arrays(line: ast.stmt) -> bool:
    """Whether it does nothing but bind names to new arrays with nothing in them."""
    value = line.value if isinstance(line, ast.Assign) else None
    made = value.elts if isinstance(value, ast.Tuple) else [value]
    return all(isinstance(array, ast.Call) and ast.unparse(array.func) == "np.empty" for array in made)


def _made(definition: ast.FunctionDef, like: Function) -> Function:
    """A function of the same module and lines."""
    tree = ast.fix_missing_locations(ast.Module([definition], []))
    ast.increment_lineno(tree, like.__code__.co_firstlineno - 1)
    made: dict[str, Any] = {}
    exec(compile(tree, like.__code__.co_filename, "exec"), like.__globals__, made)
    (function,) = made.values()
    function.__module__ = like.__module__
    result: Function = function
    return result
