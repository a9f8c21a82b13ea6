"""Sums in a written order; the maps are tested with the scenes and displays that they move."""

import math

import numpy as np

from lfssao.core.affine import sum_in_order, unit_vectors


def test_each_number_is_added_to_the_rounded_sum_of_those_before_finite_or_not():
    assert sum_in_order([1e16, 1.0, 1.0, -1e16]) == 0  # 2 by the compensated sum of Python 3.12 and later
    assert sum_in_order(iter([1.0, 1.0, 1e16, -1e16])) == 2
    assert sum_in_order([0.1] * 10) == 0.9999999999999999
    assert sum_in_order([]) == 0
    assert sum_in_order([1e308, 1e308]) == math.inf
    assert math.isnan(sum_in_order([math.inf, -math.inf]))


def test_unit_vectors_have_the_length_1_or_are_0():
    given = np.array([[[3.0, 0.0, -4.0], [0.0, -0.0, 0.0], [1e30, 1.0, 0.0], [np.nan, 1.0, np.inf]]], np.float32)
    made = unit_vectors(given)
    assert made.dtype == np.float32
    assert made.tolist() == [[[np.float32(0.6), 0.0, np.float32(-0.8)], [0.0] * 3, [0.0] * 3, [0.0] * 3]]
    assert unit_vectors(np.array([np.inf, 1.0, 0.0])).tolist() == [0.0] * 3
    with np.errstate(all="raise"):
        assert unit_vectors(np.array([2.0**100, 0.0, 0.0])).tolist() == [1, 0, 0]
