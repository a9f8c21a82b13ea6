"""Conditions in doubt: whether one may hold, and whether it must."""

import operator

from numba import types
from numba.extending import overload

from lfssao.core.jit import INLINED
from lfssao.core.numbers import struct, surely


def Doubt(may, must):  # noqa: N802
    """Whether a condition may hold, and whether it must."""
    return may if may == must else None


DoubtType = struct(Doubt, "may", "must")
doubt = DoubtType(types.boolean, types.boolean)


def doubt_of(condition):
    """Return a condition, in doubt or not, as one in doubt."""
    return Doubt(condition, condition)


@overload(doubt_of, jit_options=INLINED)
def _doubt_of(condition):
    if condition == doubt:
        return lambda condition: condition
    return (lambda condition: Doubt(condition, condition)) if isinstance(condition, types.Boolean) else None


@overload(operator.and_, jit_options=INLINED)
def _and(x, y):
    if x == doubt and y == doubt:
        return lambda x, y: Doubt(x.may & y.may, x.must & y.must)
    if x == doubt and isinstance(y, types.Boolean):
        return lambda x, y: Doubt(x.may & y, x.must & y)
    return (lambda x, y: y & x) if isinstance(x, types.Boolean) and y == doubt else None


@overload(operator.or_, jit_options=INLINED)
def _or(x, y):
    if x == doubt and y == doubt:
        return lambda x, y: Doubt(x.may | y.may, x.must | y.must)
    if x == doubt and isinstance(y, types.Boolean):
        return lambda x, y: Doubt(x.may | y, x.must | y)
    return (lambda x, y: y | x) if isinstance(x, types.Boolean) and y == doubt else None


@overload(operator.invert, jit_options=INLINED)
def _not(x):
    return (lambda x: Doubt(not x.must, not x.may)) if x == doubt else None


@overload(surely, jit_options=INLINED)
def _surely(condition):
    return (lambda condition: condition.must) if condition == doubt else None
