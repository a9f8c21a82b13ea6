"""Numbers compared as integers, not with a tolerance."""

import numpy as np


def bits(a):
    """Float64 numbers, or a list of them, as integers."""
    return np.asarray(a, np.float64).view(np.int64)


def assert_same_bits(actual, expected):
    assert (actual.dtype, actual.shape) == (expected.dtype, expected.shape)
    assert not np.isnan(actual).any()
    integer = {1: np.int8, 4: np.int32, 8: np.int64}[actual.dtype.itemsize]
    np.testing.assert_array_equal(np.ascontiguousarray(actual).view(integer), expected.view(integer))
