"""What numba does not offer: memory on the stack, look-ups by numbers of known sign, and those to come announced."""

from math import prod
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils

# Numbers that ``scratch`` holds: of a handful of arrays, they fit the nearest cache beside the textures' texels.
CHUNK = 256


@extending.intrinsic
def scratch(_typing: Any, dtype: Any) -> Any:
    """CHUNK numbers of a dtype on the stack of the function, or body of a ``prange``, that calls this; not initialised.

    LLVM knows that such memory overlaps nothing else. Of arrays from ``np.empty`` it has to prove it, and gives up in
    long functions: then it makes no vectors of loops with look-ups in them, and Algorithm 2 with a camera's mapping
    took five times as long. It begins where a cache line does, so that no vector lies across two. It must not be
    returned, nor kept.
    """
    return _on_the_stack(dtype, CHUNK)


@extending.intrinsic
def scratch_rows(_typing: Any, dtype: Any) -> Any:
    """The same, CHUNK rows of four numbers."""
    return _on_the_stack(dtype, CHUNK, 4)


def _on_the_stack(dtype: Any, *shape: int) -> Any:
    array = types.Array(dtype.dtype, len(shape), "C")

    def allocate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        item = context.get_data_type(array.dtype)
        space = cgutils.alloca_once(builder, item, size=prod(shape))
        space.align = 64
        made = context.make_array(array)(context, builder)
        number = context.get_abi_sizeof(item)
        size = context.get_constant(types.intp, number)
        lengths = [context.get_constant(types.intp, length) for length in shape]
        strides = [context.get_constant(types.intp, number * prod(shape[k + 1 :])) for k in range(len(shape))]
        context.populate_array(made, data=space, shape=lengths, strides=strides, itemsize=size, meminfo=None)
        return made._getvalue()

    return array(dtype), allocate


@extending.intrinsic
def element(_typing: Any, array: Any, number: Any) -> Any:
    """The element of a flat array under an int32 number that is not negative.

    numba takes negative numbers to count from the end, and asks; unsigned ones it widens without their sign, which the
    processor's gathers cannot, so that a loop needs an instruction more to show that there is no sign.
    """

    def load(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        made = context.make_array(signature.args[0])(context, builder, arguments[0])
        wide = context.cast(builder, arguments[1], types.int32, types.intp)
        return builder.load(builder.gep(made.data, [wide], inbounds=True))

    return array.dtype(array, types.int32), load


@extending.intrinsic
def prefetch(_typing: Any, array: Any, number: Any) -> Any:
    """Let the processor bring an element of a flat array near, which will be read soon; it waits for nothing."""

    def announce(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        made = context.make_array(signature.args[0])(context, builder, arguments[0])
        place = builder.bitcast(builder.gep(made.data, [arguments[1]]), cgutils.voidptr_t)
        whole = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [place.type, whole, whole, whole])
        # To read, to be kept in all caches, data.
        builder.call(
            builder.module.declare_intrinsic("llvm.prefetch", [place.type], kind), [place, whole(0), whole(3), whole(1)]
        )
        return context.get_dummy_value()

    return types.void(array, number), announce


# Bytes of a cache line, which ``stream`` writes at once.
LINE = 64


@extending.intrinsic
def bytes_into_line(_typing: Any, array: Any, number: Any) -> Any:
    """How many bytes behind the beginning of its cache line an element of a flat array lies, int64."""

    def find(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        made = context.make_array(signature.args[0])(context, builder, arguments[0])
        place = builder.ptrtoint(builder.gep(made.data, [arguments[1]]), ir.IntType(64))
        return builder.and_(place, ir.IntType(64)(LINE - 1))

    return types.int64(array, number), find


@extending.intrinsic
def stream(_typing: Any, array: Any, number: Any, value: Any) -> Any:
    """Write a cache line full of a value, from an element on that begins one, past the caches.

    A store fetches the line that it changes; of one that is written whole nothing need be fetched. ``streamed`` ends
    a series of these.
    """

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = signature.args[0]
        made = context.make_array(kind)(context, builder, arguments[0])
        item = context.get_data_type(kind.dtype)
        many = ir.VectorType(item, LINE // context.get_abi_sizeof(item))
        one = context.cast(builder, arguments[2], signature.args[2], kind.dtype)
        first = builder.insert_element(ir.Constant(many, ir.Undefined), one, ir.IntType(32)(0))
        mask = ir.Constant(ir.VectorType(ir.IntType(32), many.count), [0] * many.count)
        vector = builder.shuffle_vector(first, ir.Constant(many, ir.Undefined), mask)
        place = builder.bitcast(builder.gep(made.data, [arguments[1]]), many.as_pointer())
        store = builder.store(vector, place, align=LINE)
        store.set_metadata("nontemporal", builder.module.add_metadata([ir.IntType(32)(1)]))
        return context.get_dummy_value()

    return types.void(array, number, value), write


@extending.intrinsic
def streamed(_typing: Any) -> Any:
    """Let other threads see what was streamed before what is written from here on."""

    def wait(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        builder.fence("seq_cst")
        return context.get_dummy_value()

    return types.void(), wait


# Bytes that ``equal_bytes`` compares at once: one bit each of what it gives.
COMPARED = 64


@extending.intrinsic
def equal_bytes(_typing: Any, array: Any, first: Any, second: Any) -> Any:
    """Bit j tells whether elements first + j and second + j of a flat array of uint8 are equal; uint64.

    COMPARED elements from either number on must be there. numba's own loops find no bits out of vectors.
    """

    def compare(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        many = ir.VectorType(ir.IntType(8), COMPARED).as_pointer()
        sides = [builder.load(builder.bitcast(builder.gep(data, [place]), many), align=1) for place in arguments[1:]]
        return builder.bitcast(builder.icmp_unsigned("==", *sides), ir.IntType(COMPARED))

    return types.uint64(array, first, second), compare


@extending.intrinsic
def trailing_zeros(_typing: Any, word: Any) -> Any:
    """How many bits of a uint64 are 0 below the lowest that is 1, int64; 64 of 0."""

    def count(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], ir.IntType(1)(0))

    return types.int64(types.uint64), count


@extending.intrinsic
def put_word(_typing: Any, array: Any, number: Any, word: Any) -> Any:
    """Write the eight bytes of an int64, the lowest first, into a flat array of uint8 from an element on."""

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        place = builder.bitcast(builder.gep(data, [arguments[1]]), ir.IntType(64).as_pointer())
        builder.store(arguments[2], place, align=1)
        return context.get_dummy_value()

    return types.void(array, number, types.int64), write


# Columns and rows of the block of ``negative_somewhere``.
WIDE, HIGH = 6, 4


@extending.intrinsic
def negative_somewhere(_typing: Any, values: Any, rights: Any, downs: Any) -> Any:
    """Bit i + 8 j, int32, of column i and row j: whether one of several int32 v + i right + j down is negative.

    Each comes as a tuple, all of one length. Written out for all columns and rows, as LLVM makes vectors of no loop
    around this if it has loops of its own; so many lines of Python would take numba half a second to translate.
    """

    def find(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        number = ir.IntType(32)
        sums = list(zip(*(cgutils.unpack_tuple(builder, packed) for packed in arguments), strict=True))
        found = number(0)
        for j in range(HIGH):
            for i in range(WIDE):
                signs = number(0)
                for value, right, down in sums:
                    across, below = builder.mul(number(i), right), builder.mul(number(j), down)
                    signs = builder.or_(signs, builder.add(builder.add(value, below), across))
                negative = builder.lshr(signs, number(31))
                found = builder.or_(found, builder.shl(negative, number(i + 8 * j)))
        return found

    return types.int32(values, rights, downs), find
