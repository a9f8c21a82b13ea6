"""Intrinsics that numba lacks: memory on the stack, and look-ups by numbers of known sign.

With NUMBA_DISABLE_JIT=1, by which a debugger steps through kernels, they are plain functions.
"""

from collections.abc import Callable, Iterator
from itertools import count
from typing import Any

import numpy as np
from llvmlite import ir
from numba import config, extending, types
from numba.core import cgutils, imputils

# Numbers that ``scratch`` holds: of a handful of arrays, they fit the nearest cache beside the textures' texels.
CHUNK = 256


def _intrinsic(plain: Callable[..., Any]) -> Callable[[Any], Any]:
    """A decorator of a function that makes code: an intrinsic, or the plain function where nothing is compiled."""
    return lambda typed: plain if config.DISABLE_JIT else extending.intrinsic(typed)


def on_the_stack(size: int, plain: Callable[[Any], Any] | None = None) -> Any:
    """A function of a dtype: so many numbers of it on the stack of the calling function, not initialised.

    LLVM knows that such memory overlaps nothing else, and makes vectors of loops with look-ups: with arrays from
    ``np.empty`` Algorithm 2 with a camera's mapping took five times as long. The memory begins with a cache line. It
    must not be returned, nor kept.
    """

    @_intrinsic(plain or (lambda dtype: np.empty(size, dtype)))
    def memory(_typing: Any, dtype: Any) -> Any:
        array = types.Array(dtype.dtype, 1, "C")

        def allocate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
            item = context.get_data_type(array.dtype)
            space = cgutils.alloca_once(builder, item, size=size)
            space.align = 64
            made = context.make_array(array)(context, builder)
            length, item_size = (context.get_constant(types.intp, n) for n in (size, context.get_abi_sizeof(item)))
            context.populate_array(
                made, data=space, shape=[length], strides=[item_size], itemsize=item_size, meminfo=None
            )
            return made._getvalue()

        return array(dtype), allocate

    return memory


scratch = on_the_stack(CHUNK)


@_intrinsic(lambda array, number: array[number])
def element(_typing: Any, array: Any, number: Any) -> Any:
    """The element of a flat array under an int32 number that is not negative.

    numba tests signed numbers for being negative, and widens unsigned ones, which costs a gather one more instruction.
    """

    def load(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        made = context.make_array(signature.args[0])(context, builder, arguments[0])
        wide = context.cast(builder, arguments[1], types.int32, types.intp)
        return builder.load(builder.gep(made.data, [wide], inbounds=True))

    return array.dtype(array, types.int32), load


@_intrinsic(lambda array: array)
def memory_of(_typing: Any, array: Any) -> Any:
    """The numbers of a flat array without its owner, length and stride, for look-ups; None of None.

    numba hands an array on as seven values and counts its readers. Float kernels compile in about three quarters of the
    time by this, and are as fast (benchmarks/README.md). The array must outlive the kernel. Indices are not checked;
    with NUMBA_BOUNDSCHECK=1, by which numba checks them, this returns the array itself.
    """
    if isinstance(array, types.NoneType):
        return array(array), lambda context, *_: context.get_dummy_value()

    def take(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if config.BOUNDSCHECK:
            return imputils.impl_ret_borrowed(context, builder, array, arguments[0])
        return context.make_array(signature.args[0])(context, builder, arguments[0]).data

    return (array if config.BOUNDSCHECK else types.CPointer(array.dtype))(array), take


def _leaves(builder: Any, value: Any) -> list[Any]:
    """The numbers of which a value of LLVM consists."""
    if not isinstance(value.type, ir.Aggregate):
        return [value]
    return [leaf for k in range(len(value.type)) for leaf in _leaves(builder, builder.extract_value(value, k))]


def _built(builder: Any, kind: Any, leaves: Iterator[Any]) -> Any:
    """A value of a type of LLVM of the next of these numbers."""
    if not isinstance(kind, ir.Aggregate):
        return next(leaves)
    made = ir.Constant(kind, ir.Undefined)
    for k in range(len(kind)):
        made = builder.insert_value(made, _built(builder, kind.elements[k], leaves), k)
    return made


def _places(context: Any, builder: Any, slots: Any, i: Any, kind: Any) -> Iterator[Any]:
    """The places of the numbers of texel i in slots, one after the other."""
    data, first = context.make_array(slots)(context, builder, kind).data, context.cast(builder, *i, types.intp)
    for k in count():
        yield builder.gep(data, [builder.add(first, context.get_constant(types.intp, k * CHUNK))], inbounds=True)


def texel_slots(count: int) -> Any:
    """A function of a dtype: so many slots of each texel of a chunk, for ``put`` and ``get``, on the stack."""
    return on_the_stack(count * CHUNK, plain=lambda _dtype: [None] * CHUNK)


@_intrinsic(lambda slots, i, value: slots.__setitem__(i, value))
def put(_typing: Any, slots: Any, i: Any, value: Any) -> Any:
    """Put all numbers of a value, which may be a tuple of tuples, into the slots of texel i, from slot 0 on."""

    def store(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        places = _places(context, builder, signature.args[0], (arguments[1], signature.args[1]), arguments[0])
        for leaf, place in zip(_leaves(builder, arguments[2]), places, strict=False):
            builder.store(leaf, place)
        return context.get_dummy_value()

    return types.void(slots, i, value), store


@_intrinsic(lambda slots, i, like: slots[i])
def get(_typing: Any, slots: Any, i: Any, like: Any) -> Any:
    """The value of the type of another that ``put`` has put there."""

    def load(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        places = _places(context, builder, signature.args[0], (arguments[1], signature.args[1]), arguments[0])
        return _built(builder, context.get_value_type(like), (builder.load(place) for place in places))

    return like(slots, i, like), load
