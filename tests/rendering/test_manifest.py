"""Digests of arrays are those of their numbers, row by row and little-endian; sizes of views are those of a display."""

import hashlib
from dataclasses import asdict

import numpy as np
import pytest

from lfssao import find_display
from lfssao.rendering.folder import display_of
from lfssao.rendering.manifest import digest

NUMBERS = np.random.default_rng(3).random((24, 32, 3), np.float32)


@pytest.mark.parametrize(
    "array", [NUMBERS, NUMBERS[:, ::-1].transpose(1, 0, 2), NUMBERS.astype(">f4"), NUMBERS[:0], np.arange(5)]
)
def test_a_digest_is_of_the_numbers_row_by_row(array):
    text = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes()
    assert digest(array) == hashlib.sha256(text).hexdigest()
    assert digest(array.copy()) == digest(array)


def test_views_of_two_sizes_are_not_those_of_a_display():
    values = asdict(find_display("sample-a"))
    entries = {k: {"view": {"width": width, "height": 9}} for k, width in enumerate((16, 17))}
    with pytest.raises(ValueError, match="the sizes of its views are not those of the display's modules"):
        display_of(values, entries)
    small = display_of(values, {0: entries[0]})
    assert {(module.width, module.height) for module in small.modules} == {(16, 9)}
