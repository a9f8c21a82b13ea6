"""States of marching estimators: a number, or *sectors* of a half circle, up to 32 bits of which some are set.

Floats have sectors as a uint32, balls as two: those that are set for sure, and those that may be. Numbers of Python
have ints, or methods ``sectors_to`` and ``no_sectors`` that make sectors with ``|`` and ``sector_count``. Here is also
what drivers of balls need of a state: its *ends*, between which it lies, the least and the largest number, or sectors
for sure and sectors that may be set.
"""

from math import ceil, floor
from typing import Any

import numpy as np
from numba import types
from numba.extending import overload

from lfssao.core.balls import SAFETY, UNKNOWN, ball, ball_between
from lfssao.core.doubts import Doubt, doubt
from lfssao.core.jit import INLINED, formula
from lfssao.core.numbers import FloatType, number, plain, select, struct

MOST = 32  # sectors
_ALL = np.uint32(2**MOST - 1)


def Sectors(must, may):  # noqa: N802 - it reads as a type
    """Sectors that are set for sure, and those that may be."""
    return must if must == may else None


SectorsType = struct(Sectors, "must", "may")
sectors = SectorsType(types.uint32, types.uint32)


@formula
def _run(first, last):
    """Bits from one number to before another, whole numbers from 0 to 32."""
    one = np.uint64(1)
    below, through = (one << np.uint64(first)) - one, (one << np.uint64(last)) - one
    return np.uint32(through & ~below)


@formula
def _bits(mask):
    """How many bits are set, summed by pairs, fours and bytes."""
    x = np.int64(mask)
    x = x - ((x >> 1) & 0x55555555)
    x = (x & 0x33333333) + ((x >> 2) & 0x33333333)
    x = (x + (x >> 4)) & 0x0F0F0F0F
    return np.int32((x * 0x01010101 >> 24) & 0x3F)


def sectors_between(first: Any, last: Any) -> Any:
    """Return sectors of which those from one number to before another are set, whole numbers from 0 to 32."""
    return first.sectors_to(last) if hasattr(first, "sectors_to") else _run(int(first), int(last))


def no_sectors(like: Any) -> Any:
    """Return sectors of which none is set, of numbers of the kind of another."""
    return like.no_sectors() if hasattr(like, "no_sectors") else np.uint32(0)


def joined(x: Any, y: Any) -> Any:
    """Return sectors that are set in either."""
    return x | y


def sector_is_set(x: Any, k: Any) -> Any:
    """Whether a sector is set, by its number."""
    return (x >> k) & 1 != 0


def sector_count(x: Any, like: Any) -> Any:
    """Return how many sectors are set, a number of the kind of another."""
    return number(x.sector_count() if hasattr(x, "sector_count") else _bits(x), like)


@overload(sectors_between, jit_options=INLINED)
def _sectors_between(first, last):
    """More sectors are set where the first is less or the last is more, so the ends of balls set the most and least."""
    if isinstance(first, FloatType):
        return lambda first, last: _run(np.int32(plain(first)), np.int32(plain(last)))
    if not first == last == ball:
        return None

    def bounded(first, last):
        (low, high), (lower, upper) = _whole(first), _whole(last)
        return Sectors(_run(high, lower), _run(low, upper))

    return bounded


@formula
def _whole(x):
    """The least and the largest whole number of a ball, from 0 to 32."""
    error = x.error * SAFETY
    low, high = max(x.value - error, 0.0), min(x.value + error, 32.0)
    return np.int64(ceil(min(low, 32.0))), np.int64(floor(max(high, 0.0)))


@overload(no_sectors, jit_options=INLINED)
def _no_sectors(like):
    if like == ball:
        return lambda like: Sectors(np.uint32(0), np.uint32(0))
    return (lambda like: np.uint32(0)) if isinstance(like, FloatType) else None


@overload(joined, jit_options=INLINED)
def _joined(x, y):
    if x == y == sectors:
        return lambda x, y: Sectors(np.uint32(x.must | y.must), np.uint32(x.may | y.may))
    return (lambda x, y: np.uint32(x | y)) if isinstance(x, types.Integer) else None


@overload(sector_is_set, jit_options=INLINED)
def _sector_is_set(x, k):
    if x == sectors:
        return lambda x, k: Doubt((x.may >> k) & 1 != 0, (x.must >> k) & 1 != 0)
    return (lambda x, k: (x >> k) & 1 != 0) if isinstance(x, types.Integer) else None


@overload(sector_count, jit_options=INLINED)
def _sector_count(x, like):
    """Between that of those that are set for sure and that of all that may be."""
    if x == sectors:
        return lambda x, like: ball_between(np.float64(_bits(x.must)), np.float64(_bits(x.may)), like)
    return (lambda x, like: number(_bits(x), like)) if isinstance(x, types.Integer) else None


@overload(select, jit_options=INLINED)
def _select(condition, x, y):
    if not x == y == sectors:
        return None
    if condition == doubt:
        return lambda condition, x, y: x if condition.must else join_ends(x, y) if condition.may else y
    return lambda condition, x, y: x if condition else y


def kept_as(state, dtype):
    """Return the dtype of an array of states: that of floats, or uint32."""
    return dtype if isinstance(state, np.floating) else np.uint32


@overload(kept_as, jit_options=INLINED)
def _kept_as(state, dtype):
    if isinstance(state, FloatType):
        return lambda state, dtype: dtype
    return lambda state, dtype: np.uint32


# Ends of states


def ends_of(state):
    """Return the ends of a state of balls."""


def state_between(ends, like):
    """Return the state of balls that has ends; like: a ball."""


def join_ends(x, y):
    """Return the ends of all states between two pairs of them."""


def no_ends(ends):
    """Return ends of no state, which joined with others give these."""


def any_ends(ends):
    """Return the ends of every state."""


@overload(ends_of, jit_options=INLINED)
def _ends_of(state):
    if state == sectors:
        return lambda state: state
    return lambda state: (state.value - state.error * SAFETY, state.value + state.error * SAFETY)


@overload(state_between, jit_options=INLINED)
def _state_between(ends, like):
    if ends == sectors:
        return lambda ends, like: ends
    return lambda ends, like: ball_between(ends[0], ends[1], like)


@overload(join_ends, jit_options=INLINED)
def _join_ends(x, y):
    if x == sectors:
        return lambda x, y: Sectors(np.uint32(x.must & y.must), np.uint32(x.may | y.may))
    return lambda x, y: (min(x[0], y[0]), max(x[1], y[1]))


@overload(no_ends, jit_options=INLINED)
def _no_ends(ends):
    return (lambda ends: Sectors(_ALL, np.uint32(0))) if ends == sectors else lambda ends: (np.inf, -np.inf)


@overload(any_ends, jit_options=INLINED)
def _any_ends(ends):
    return (lambda ends: Sectors(np.uint32(0), _ALL)) if ends == sectors else lambda ends: (-UNKNOWN, UNKNOWN)
