"""Numbers, whole numbers and arrays without a mask among whatever may be handed over."""

from fractions import Fraction

import numpy as np
import pytest

from lfssao.core.arguments import as_number, as_numbers, as_whole, check_seed, check_unmasked, check_whole
from lfssao.errors import InputError


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2), np.int64(2), np.array(2), np.ma.array(2.0), Fraction(2)])
def test_a_number_of_any_type_is_one(value):
    assert as_number(value) == 2


@pytest.mark.parametrize("value", [
    True, np.bool_(True), "2", b"2", None, [2], np.array([2]), 2j, np.nan, np.ma.masked, 10**400, np.array("2"),
])  # fmt: skip
def test_what_is_no_number_is_nan(value):
    assert np.isnan(as_number(value))


@pytest.mark.parametrize("value", [True, np.bool_(True), 2.0, np.float64(2), "2", None, [2], np.nan, np.ma.masked, 2j])
def test_what_is_no_whole_number_is_none(value):
    assert as_whole(value) is None


def test_whole_numbers_are_pythons_own_and_keep_to_their_range():
    for value in (3, np.int8(3), np.uint64(3), np.array(3)):
        assert type(check_whole("n", value, 3, 3)) is int
    for value, words in ((2, "n is 2, it must be a whole number from 3 to 9"), (10, "from 3 to 9")):
        with pytest.raises(InputError, match=words):
            check_whole("n", value, 3, 9)
    with pytest.raises(InputError, match="of at least 3"):
        check_whole("n", 2, 3)
    assert check_seed("seed", 2**64 - 1) == 2**64 - 1
    with pytest.raises(InputError, match=r"from 0 to 2\*\*64 - 1"):
        check_seed("seed", 2**64)


def test_a_mask_is_refused_only_where_it_hides_a_number():
    check_unmasked("a", np.ma.array([1.0, 2.0]))
    with pytest.raises(InputError, match="a is a masked array, and masks are not read"):
        check_unmasked("a", np.ma.array([1.0, 2.0], mask=[True, False]))
    assert as_numbers("a", [1, 2]).dtype.kind == "i"
    for value in ([[1, 2], [3]], "12", None, [True], [1j], np.ma.masked):
        with pytest.raises(InputError, match="a is"):
            as_numbers("a", value)
