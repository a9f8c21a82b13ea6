"""Philox4x32-10: the known answers of Random123, the reference, streams, and the numbers made from its words."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import philox as reference

from lfssao.core import philox

words = st.integers(0, 2**32 - 1)
seeds = st.one_of(st.integers(0, 2**64 - 1), st.sampled_from([0, 1, 2**32 - 1, 2**32, 2**63 - 1, 2**63, 2**64 - 1]))

# The kernels take the seed as np.uint64: numba would try to make an int64 of a Python int.
unsigned = np.uint64

# Random123's file kat_vectors, lines 'philox4x32 10': counter, key, result. The third is made of the digits of pi.
KNOWN = [
    ("00000000 00000000 00000000 00000000", "00000000 00000000", "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ("ffffffff ffffffff ffffffff ffffffff", "ffffffff ffffffff", "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    ("243f6a88 85a308d3 13198a2e 03707344", "a4093822 299f31d0", "d16cfe09 94fdcceb 5001e420 24126ea1"),
]


def hexadecimal(text):
    return tuple(int(word, 16) for word in text.split())


@pytest.mark.parametrize(("counter", "key", "result"), KNOWN)
def test_known_answers(counter, key, result):
    counter = hexadecimal(counter)
    key = hexadecimal(key)
    result = hexadecimal(result)
    assert tuple(int(word) for word in philox.philox4x32(*counter, *key)) == result
    assert reference.philox4x32(counter, key) == result


@given(seeds, words, words, st.integers(1, 2**32))
def test_numbers_equal_the_reference(seed, stream, index, n):
    assert int(philox.random_word(unsigned(seed), stream, index)) == reference.word(seed, stream, index)
    assert philox.random_signed(unsigned(seed), stream, index) == reference.signed(seed, stream, index)
    assert philox.random_unit(unsigned(seed), stream, index) == reference.unit(seed, stream, index)
    assert philox.random_below(unsigned(seed), stream, index, n) == reference.below(seed, stream, index, n)
