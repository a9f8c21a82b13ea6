"""Digests of arrays are those of their numbers, row by row and little-endian."""

import hashlib

import numpy as np
import pytest

from lfssao.rendering.manifest import digest

NUMBERS = np.random.default_rng(3).random((24, 32, 3), np.float32)


@pytest.mark.parametrize(
    "array", [NUMBERS, NUMBERS[:, ::-1].transpose(1, 0, 2), NUMBERS.astype(">f4"), NUMBERS[:0], np.arange(5)]
)
def test_a_digest_is_of_the_numbers_row_by_row(array):
    text = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes()
    assert digest(array) == hashlib.sha256(text).hexdigest()
    assert digest(array.copy()) == digest(array)
