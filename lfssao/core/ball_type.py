"""The type of balls (``lfssao.core.balls``), how one is made, and how a rule of them is told to the compiler."""

import inspect

import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, make_attribute_wrapper, models, overload, overload_attribute, register_model

from lfssao.core.jit import INLINED, formula
from lfssao.core.numbers import is_plain

FLUSHED = 2.0**-124  # four flushed numbers: an operation's operands and its result, and one to spare
SAFETY = 1.0 + 2.0**-20
TINY = 2.0**-149  # added to sizes, so that 0 times what is unknown is beyond all float32 numbers, as it may be NaN
UNKNOWN = 2.0**400  # an error of a number of which nothing is known; its square is finite
LARGE = 2.0**126


class BallType(types.Type):  # type: ignore[misc]
    """A ball, with the memory of its error model: relative errors of + - *, quotients, roots, and two of exp.

    exp(x) is off by ``constant`` and by ``slope`` abs(x). A pointer in place of five numbers makes intervals
    compile in 0.7 of the time (benchmarks/README.md).
    """

    def __init__(self):
        super().__init__("Ball")


_MODEL = types.CPointer(types.float64)


@register_model(BallType)
class _BallModel(models.StructModel):  # type: ignore[misc]
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, [("value", types.float64), ("error", types.float64), ("model", _MODEL)])


for _name in ("value", "error", "model"):
    make_attribute_wrapper(BallType, _name, _name)


def _number_of_model(name, k):
    @overload_attribute(BallType, name, jit_options=INLINED)
    def get(x):
        return lambda x: x.model[k]


for _k, _name in enumerate(("operation", "quotient", "root", "constant", "slope")):
    _number_of_model(_name, _k)
ball = BallType()


@intrinsic
def ball_of(_typing, value, error, model):
    """Value +- error, in an error model of five numbers: an array that must outlive the ball, or its memory."""

    def make(context, builder, signature, arguments):
        made, kind = cgutils.create_struct_proxy(ball)(context, builder), signature.args[2]
        made.value, made.error, given = arguments
        of_array = isinstance(kind, types.Array)
        made.model = context.make_array(kind)(context, builder, given).data if of_array else given
        return made._getvalue()

    return ball(types.float64, types.float64, model), make


@formula
def Ball(value, error, like):  # noqa: N802 - it reads as a type
    """Value +- error, in the error model of another ball."""
    return ball_of(value, error, like.model)


@formula
def flushed(by, size):
    """How much flushing may take from a result of a size; nothing of 0."""
    return min(by, LARGE * size)


@formula
def exact(x, like):
    """A plain number as a renderer has it, in float32."""
    return Ball(np.float64(np.float32(x)), 0.0, like)


@formula
def ball_between(low, high, like):
    """All numbers between two floats."""
    return Ball(0.5 * (low + high), 0.5 * (high - low), like)


def rule(function):
    """Overload a function of balls; of two operands one may be a plain number, which is exact."""

    def wrap(implementation):
        one = len(inspect.signature(implementation).parameters) == 1
        typed = (lambda x: implementation if x == ball else None) if one else _of_two(function, implementation)
        overload(function, jit_options=INLINED)(typed)
        return implementation

    return wrap


def _of_two(function, implementation):
    def typed(x, y):
        if x == ball and y == ball:
            return implementation
        if x == ball and is_plain(y):
            return lambda x, y: function(x, exact(y, x))
        if is_plain(x) and y == ball:
            return lambda x, y: function(exact(x, y), y)
        return None

    return typed
