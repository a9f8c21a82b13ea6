"""Numbers that formulas are written with: one text for the bits, for intervals, and for numbers of Python.

A *formula* is a plain function with Python's operators. Compiled for floats it makes the bits: each operator is one
IEEE operation, and a plain number beside a float takes its dtype. Compiled for balls (``lfssao.core.balls``) it bounds
what other renderers make. Python itself runs it on numbers that are exact, or that round at random.

Here are the words of formulas, and floats. Numbers of Python that are no floats may have ``number``, ``double``,
``log2`` and ``is_number`` of their own, methods.
"""

import inspect
import operator
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.core.typing.templates import signature
from numba.extending import (
    lower_builtin,
    lower_cast,
    make_attribute_wrapper,
    models,
    overload,
    overload_method,
    register_model,
    type_callable,
)

from lfssao.core.elementary import log2 as float_log2
from lfssao.core.elementary import power as float_power
from lfssao.core.jit import INLINED


def method(function: Any) -> None:
    """Let compiled code call the methods of this name, and with these parameters, of any NamedTuple."""

    def typed(self, *_arguments):
        found = getattr(self.instance_class, function.__name__, None)
        return bare(found) if found else None

    typed.__signature__ = inspect.signature(bare(function))  # type: ignore[attr-defined]
    overload_method(types.BaseNamedTuple, function.__name__, jit_options=INLINED)(typed)


def bare(function: Any) -> Any:
    """Return a function without its annotations, which numba would compare."""
    code, defaults = function.__code__, function.__defaults__
    return FunctionType(code, function.__globals__, function.__name__, defaults, function.__closure__)


def struct(made, *names):
    """Return the type that calls of ``made`` have in compiled code, of members of these names and any types.

    Its name must be that of ``made`` and Type, in the same module: by it the cache on disk finds it again.
    """

    class Struct(types.Type):
        def __init__(self, *members):
            self.members = members
            super().__init__(f"{made.__name__}({', '.join(map(str, members))})")

    class Model(models.StructModel):
        def __init__(self, dmm, fe_type):
            super().__init__(dmm, fe_type, list(zip(names, fe_type.members, strict=True)))

    Struct.__module__, Struct.__qualname__ = made.__module__, f"{made.__name__}Type"
    Struct.__name__ = Struct.__qualname__
    register_model(Struct)(Model)
    for name in names:
        make_attribute_wrapper(Struct, name, name)

    def typer(*members):
        return signature(Struct(*members), *members)

    typer.__signature__ = inspect.Signature(inspect.Parameter(k, inspect.Parameter.POSITIONAL_ONLY) for k in names)
    type_callable(made)(lambda _context: typer)

    @lower_builtin(made, *[types.Any] * len(names))
    def _make(context, builder, sig, args):
        value = cgutils.create_struct_proxy(sig.return_type)(context, builder)
        for name, each in zip(names, args, strict=True):
            setattr(value, name, each)
        return value._getvalue()

    return Struct


# Floats


class FloatType(types.Type):  # type: ignore[misc]
    """A float32 or float64 beside which plain numbers are weak, as beside NumPy's scalars: they take its dtype."""

    def __init__(self, native):
        self.native = native
        super().__init__(f"Float({native})")

    def can_convert_from(self, _context, other):
        """Whether a plain number may stand for one."""
        return Conversion.safe if is_plain(other) else None

    def unify(self, _context, other):
        """The type of a variable that is sometimes a plain number."""
        return self if is_plain(other) else None


@register_model(FloatType)
class _FloatModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, dmm.lookup(fe_type.native).get_value_type())


def is_plain(x):
    """Whether a type is that of a plain number."""
    return isinstance(x, types.Float | types.Integer)


@lower_cast(types.Number, FloatType)
def _from_plain(context, builder, fromty, toty, value):
    return context.cast(builder, value, fromty, toty.native)


def as_float(x):
    """Return a number of an array as formulas take it; whole numbers stay."""
    return x


def plain(x: Any) -> Any:
    """Return a float of a formula as arrays take it."""
    return x


type_callable(as_float)(lambda _context: lambda x: FloatType(x) if isinstance(x, types.Float) else x)
type_callable(plain)(lambda _context: lambda x: x.native if isinstance(x, FloatType) else x)
for _kind in (types.Float, types.Integer):
    lower_builtin(as_float, _kind)(lambda _context, _builder, _sig, args: args[0])
for _kind in (FloatType, types.Integer):
    lower_builtin(plain, _kind)(lambda _context, _builder, _sig, args: args[0])


def _float_operator(function, arity, *, compares=False):
    """Let a function of floats be that of their dtype; plain numbers are rounded to it first."""

    def result(*arguments):
        floats = [each for each in arguments if isinstance(each, FloatType)]
        if not floats or any(each != floats[0] and not is_plain(each) for each in arguments):
            return None
        return signature(types.boolean if compares else floats[0], *[floats[0]] * arity)

    typer = (lambda x: result(x)) if arity == 1 else (lambda x, y: result(x, y))  # noqa: PLW0108 - as above
    type_callable(function)(lambda _context: typer)

    @lower_builtin(function, *[FloatType] * arity)
    def _lower(context, builder, sig, args):
        kinds = [each.native for each in sig.args]
        return context.get_function(function, signature(types.boolean if compares else kinds[0], *kinds))(builder, args)


for _operator in (operator.add, operator.sub, operator.mul, operator.truediv):
    _float_operator(_operator, 2)
for _comparison in (operator.lt, operator.le, operator.gt, operator.ge, operator.eq):
    _float_operator(_comparison, 2, compares=True)
for _function in (operator.neg, abs, np.sqrt, np.floor, np.trunc):
    _float_operator(_function, 1)


# Words


def select(condition: Any, x: Any, y: Any) -> Any:
    """Return x where a condition holds, else y; of a condition in doubt all between the two."""
    return np.where(condition, x, y)[()]


def number(x: Any, like: Any) -> Any:
    """Return a plain number, or a float of another dtype, as one of the kind of another."""
    if isinstance(like, np.generic):
        return type(like)(x)
    return like.number(x) if hasattr(like, "number") else x


def double(x: Any) -> Any:
    """Return a float as a float64; a ball stays, as a renderer may compute in float32 all the way."""
    if hasattr(x, "double"):
        return x.double()
    return np.float64(x) if isinstance(x, np.generic) else x


def is_number(x: Any) -> Any:
    """Whether a float is not NaN; balls stand for numbers."""
    return x.is_number() if hasattr(x, "is_number") else _is_ordered(x)


def _is_ordered(x):
    return (x < 0) | (x >= 0)


def log2(x: Any) -> Any:
    """Return the binary logarithm of a float64, -1022 below the normal numbers."""
    return x.log2() if hasattr(x, "log2") else np.float64(float_log2(np.float64(x)))


def alternatives(x: Any, y: Any) -> Any:
    """Return the first of two formulas, which fixes the bits; of balls all that either gives (a word of VK-GL-CTS)."""
    return x


def rounded(x: Any, times: Any, like: Any, quotients: Any = 0) -> Any:
    """Return a number that a renderer makes itself, as one of the kind of another.

    It makes it by so many sums and products, ``times``, and quotients; a ball by so many more.
    """
    return number(x, like)


def known(x: Any, value: Any) -> Any:
    """Return a number that is known to be a plain value; of balls that value, which nobody rounds."""
    return x


def twice(x: Any) -> Any:
    """Return 2 x, which nobody rounds."""
    return 2 * x


def least(x: Any) -> Any:
    """Return a number itself; of a ball its least number."""
    return x


def most(x: Any) -> Any:
    """Return a number itself; of a ball its largest number."""
    return x


def middle_of(x: Any) -> Any:
    """Return a number itself; of a ball its value, exact."""
    return x


def spread_of(x: Any) -> Any:
    """Return 0; of a ball all that it may be off."""
    return 0


def within(x: Any, low: Any, high: Any) -> Any:
    """Return a number that lies between two plain ones in every renderer; of a ball what does."""
    return x


def power(x: Any, k: Any) -> Any:
    """Return x to the power of a plain number k >= 0, x from 0 to 1: in float64, rounded once."""
    return number(float_power(np.float64(x), np.float64(k)), x) if isinstance(x, np.generic) else x**k


def by_squaring(x: Any, times: int) -> Any:
    """Return x^(2^times), x from 0 on, by so many squarings; of balls by pow, too."""
    for _ in range(times):
        x = x * x
    return x


def surely(condition: Any) -> Any:
    """Whether a condition holds; of one in doubt whether it must."""
    return condition


def is_finite(x: Any) -> Any:
    """Whether a number is below infinity."""
    return x < np.inf


def larger(x: Any, y: Any) -> Any:
    """Return the larger of two numbers, the first unless the second is larger."""
    return select(y > x, y, x)


def smaller(x: Any, y: Any) -> Any:
    """Return the smaller of two numbers, the first unless the second is smaller."""
    return select(y < x, y, x)


def smoothstep(x: Any) -> Any:
    """Return x^2 (3 - 2 x) of a number from 0 to 1, as GLSL does; of balls 3 x^2 - 2 x^3, too."""
    return (x * x) * (3 - (x + x))


def line(start: Any, slope: Any, at: Any, middle: Any) -> Any:
    """Return start + slope (at - middle), all but ``at`` plain; of balls multiplied out, too."""
    return start + slope * (at - middle)


def where_none(x: Any, one: Any, other: Any) -> Any:
    """Return one value where x is None, else another, which may be of another type; compilers know which."""
    return one if x is None else other


@overload(where_none, jit_options=INLINED)
def _where_none(x, one, other):
    return (lambda x, one, other: one) if isinstance(x, types.NoneType) else lambda x, one, other: other


def unless_none(x: Any, otherwise: Any, function: Callable[..., Any], arguments: Any) -> Any:
    """Return a value where x is None, else that of a formula of x and arguments; compilers know which."""
    return otherwise if x is None else function(x, *arguments)


@overload(unless_none, jit_options=INLINED)
def _unless_none(x, otherwise, function, arguments):
    if isinstance(x, types.NoneType):
        return lambda x, otherwise, function, arguments: otherwise
    return lambda x, otherwise, function, arguments: function(x, *arguments)


def tabled(table: Any, k: Any, function: Callable[..., Any], arguments: Any) -> Any:
    """Return function(k, *arguments) of a whole number k, which floats read in row k of a table.

    A call that is no vector's makes a loop over texels slow.
    """
    return function(k, *arguments)


@overload(tabled, jit_options=INLINED)
def _tabled(table, k, function, arguments):
    if isinstance(k, FloatType):
        return lambda table, k, function, arguments: as_float(table[np.int64(plain(k))])
    return lambda table, k, function, arguments: function(k, *arguments)


@type_callable(select)
def _type_select(_context):
    def typer(condition, x, y):
        kind = x if isinstance(x, FloatType) else y
        if isinstance(kind, FloatType) and isinstance(condition, types.Boolean):
            return signature(kind, types.boolean, kind, kind)
        return None

    return typer


@lower_builtin(select, types.boolean, FloatType, FloatType)
def _select(_context, builder, _sig, args):
    return builder.select(*args)


@overload(select, jit_options=INLINED)
def _select_plain(condition, x, y):
    return (lambda condition, x, y: x if condition else y) if is_plain(x) and is_plain(y) else None


@overload(number, jit_options=INLINED)
def _number(x, like):
    if isinstance(like, FloatType) and is_plain(x):
        return lambda x, like: select(True, x, like)
    if x == like:
        return lambda x, like: x
    if isinstance(x, FloatType) and isinstance(like, FloatType):
        return lambda x, like: select(True, plain(x), like)
    return (lambda x, like: type(like)(x)) if is_plain(like) else None


@overload(double, jit_options=INLINED)
def _double(x):
    return (lambda x: as_float(np.float64(plain(x)))) if isinstance(x, FloatType) else None


@overload(log2, jit_options=INLINED)
def _log2(x):
    return (lambda x: as_float(float_log2(plain(x)))) if isinstance(x, FloatType) else None


def of_floats(function: Any, compiled: Any = None) -> None:
    """Let compiled code call a function of numbers none of which is a ball, or another one in its place."""

    def all_are(*arguments):
        floats = all(is_plain(x) or isinstance(x, FloatType | types.Boolean) for x in arguments)
        return implementation if floats else None

    implementation = bare(compiled or function)
    all_are.__signature__ = inspect.signature(implementation)  # type: ignore[attr-defined]
    overload(function, jit_options=INLINED)(all_are)


for _word in (
    rounded, known, twice, by_squaring, is_finite, least, most, middle_of, spread_of, within, alternatives,
    larger, smaller, smoothstep, line, surely,
):  # fmt: skip
    of_floats(_word)
of_floats(is_number, _is_ordered)


@overload(power, jit_options=INLINED)
def _power(x, k):
    if not isinstance(x, FloatType):
        return None
    return lambda x, k: number(float_power(np.float64(plain(x)), np.float64(k)), x)
