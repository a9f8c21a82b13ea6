"""The steps of SHA-256 (FIPS 180-4) on vectors: a word of LANES texts at a time.

They are written as LLVM's vectors, not as loops over lanes: LLVM gave up making vectors of such loops, or half of them,
when a line of their surroundings changed. Sixteen rounds are unrolled, as words and state then stay in registers.
Arrays hold word after word, each of all lanes.
"""

from typing import Any

from llvmlite import ir
from numba import extending, types

LANES = 16
BLOCK = 64  # bytes
STATE = 8  # words
WORDS = BLOCK // 4

_WORD, _LONG = ir.IntType(32), ir.IntType(64)
_VECTOR, _OCTETS = ir.VectorType(_WORD, LANES), ir.VectorType(ir.IntType(8), 4 * LANES)


@extending.intrinsic
def load_blocks(_typing: Any, addresses: Any, words: Any) -> Any:
    """Words 0 to 15 of each lane's block; addresses: (LANES,) int64, of any alignment; words: (256,) uint32, out.

    A block's words have their highest byte first, this processor's their lowest.
    """

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        where, out = _data(context, builder, signature, arguments)
        rows = []
        for lane in range(LANES):
            place = builder.inttoptr(builder.load(builder.gep(where, [_LONG(lane)])), _OCTETS.as_pointer())
            swapped = _shuffled(builder, builder.load(place, align=1), None, [k ^ 3 for k in range(4 * LANES)])
            rows.append(builder.bitcast(swapped, _VECTOR))
        # Rows to columns: four times, the first and the second half of the rows like two halves of a pack of cards.
        for _ in range(4):
            rows = [_riffled(builder, rows[k // 2], rows[(k + LANES) // 2], k % 2) for k in range(LANES)]
        _store(builder, rows, out)
        return context.get_dummy_value()

    return types.void(addresses, words), emit


@extending.intrinsic
def next_words(_typing: Any, words: Any) -> Any:
    """Words t to t + 15 of the message schedule in the place of words t - 16 to t - 1 (section 6.2.2, step 1)."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        (data,) = _data(context, builder, signature, arguments)
        w = _load(builder, data, WORDS)
        for t in range(WORDS, 2 * WORDS):
            a, b = w[t - 15], w[t - 2]
            sigma_0 = _xor(builder, _rotated(builder, a, 7), _rotated(builder, a, 18), _shifted(builder, a, 3))
            sigma_1 = _xor(builder, _rotated(builder, b, 17), _rotated(builder, b, 19), _shifted(builder, b, 10))
            w.append(_sum(builder, w[t - 16], sigma_0, w[t - 7], sigma_1))
        _store(builder, w[WORDS:], data)
        return context.get_dummy_value()

    return types.void(words), emit


@extending.intrinsic
def rounds(_typing: Any, state: Any, words: Any, constants: Any, _first: Any) -> Any:
    """Rounds ``first`` to ``first`` + 15 (section 6.2.2, step 3); state: (128,) uint32, changed; constants: (64,)."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kept, words, constants = _data(context, builder, signature, arguments)
        w = _load(builder, words, WORDS)
        a, b, c, d, e, f, g, h = _load(builder, kept, STATE)
        for t in range(WORDS):
            constant = _in_all_lanes(builder, builder.gep(constants, [builder.add(arguments[3], _LONG(t))]))
            chosen = builder.xor(g, builder.and_(e, builder.xor(f, g)))
            most = builder.or_(builder.and_(a, b), builder.and_(c, builder.or_(a, b)))
            sigma_0 = _xor(builder, *(_rotated(builder, a, n) for n in (2, 13, 22)))
            sigma_1 = _xor(builder, *(_rotated(builder, e, n) for n in (6, 11, 25)))
            # What is known early is added first: rounds wait for each other through e.
            one = _sum(builder, h, w[t], constant, chosen, sigma_1)
            a, b, c, d, e, f, g, h = _sum(builder, most, sigma_0, one), a, b, c, builder.add(d, one), e, f, g
        _store(builder, (a, b, c, d, e, f, g, h), kept)
        return context.get_dummy_value()

    return types.void(state, words, constants, types.int64), emit


def _data(context: Any, builder: Any, signature: Any, arguments: Any) -> list[Any]:
    """Pointers to what the arrays among the arguments hold."""
    pairs = zip(signature.args, arguments, strict=True)
    return [context.make_array(kind)(context, builder, value).data for kind, value in pairs if hasattr(kind, "ndim")]


def _places(builder: Any, data: Any, count: int) -> list[Any]:
    return [builder.bitcast(builder.gep(data, [_LONG(LANES * k)]), _VECTOR.as_pointer()) for k in range(count)]


def _load(builder: Any, data: Any, count: int) -> list[Any]:
    return [builder.load(place, align=4) for place in _places(builder, data, count)]


def _store(builder: Any, values: Any, data: Any) -> None:
    for value, place in zip(values, _places(builder, data, len(values)), strict=True):
        builder.store(value, place, align=4)


def _shuffled(builder: Any, one: Any, other: Any, order: list[int]) -> Any:
    """Elements of one vector, or of it and another behind it, in an order."""
    mask = ir.Constant(ir.VectorType(_WORD, len(order)), order)
    return builder.shuffle_vector(one, one if other is None else other, mask)


def _in_all_lanes(builder: Any, place: Any) -> Any:
    """The number in a place, in each element of a vector."""
    first = builder.insert_element(_VECTOR(ir.Undefined), builder.load(place), _WORD(0))
    return _shuffled(builder, first, None, [0] * LANES)


def _riffled(builder: Any, one: Any, other: Any, half: int) -> Any:
    """Elements of two vectors in turn: of their first halves, or of their second."""
    start = half * LANES // 2
    return _shuffled(builder, one, other, [start + k // 2 + LANES * (k % 2) for k in range(LANES)])


def _sum(builder: Any, first: Any, *others: Any) -> Any:
    for other in others:
        first = builder.add(first, other)
    return first


def _xor(builder: Any, one: Any, two: Any, three: Any) -> Any:
    return builder.xor(builder.xor(one, two), three)


def _shifted(builder: Any, value: Any, count: int) -> Any:
    return builder.lshr(value, _VECTOR([count] * LANES))


def _rotated(builder: Any, value: Any, count: int) -> Any:
    return builder.or_(_shifted(builder, value, count), builder.shl(value, _VECTOR([32 - count] * LANES)))
