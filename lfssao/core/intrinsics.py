"""Intrinsics that numba lacks: memory on the stack, and look-ups by numbers of known sign.

With NUMBA_DISABLE_JIT=1, by which a debugger steps through kernels, they are plain functions.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import config, extending, types
from numba.core import cgutils

# Numbers that ``scratch`` holds: of a handful of arrays, they fit the nearest cache beside the textures' texels.
CHUNK = 256


def _intrinsic(plain: Callable[..., Any]) -> Callable[[Any], Any]:
    """A decorator of a function that makes code: an intrinsic, or the plain function where nothing is compiled."""
    return lambda typed: plain if config.DISABLE_JIT else extending.intrinsic(typed)


def on_the_stack(count: int) -> Any:
    """A function of a dtype: so many numbers of it on the stack of the calling function, not initialised.

    LLVM knows that such memory overlaps nothing else, and makes vectors of loops with look-ups: with arrays from
    ``np.empty`` Algorithm 2 with a camera's mapping took five times as long. The memory begins with a cache line. It
    must not be returned, nor kept.
    """

    @_intrinsic(lambda dtype: np.empty(count, dtype))
    def memory(_typing: Any, dtype: Any) -> Any:
        array = types.Array(dtype.dtype, 1, "C")

        def allocate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
            item = context.get_data_type(array.dtype)
            space = cgutils.alloca_once(builder, item, size=count)
            space.align = 64
            made = context.make_array(array)(context, builder)
            length, size = (context.get_constant(types.intp, n) for n in (count, context.get_abi_sizeof(item)))
            context.populate_array(made, data=space, shape=[length], strides=[size], itemsize=size, meminfo=None)
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
