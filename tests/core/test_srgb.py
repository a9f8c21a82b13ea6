"""sRGB: the tables against IEC 61966-2-1 worked out in another way, and there and back."""

import bisect
import math
from decimal import localcontext
from fractions import Fraction

import numpy as np
import pytest

from lfssao.core import srgb
from lfssao.core.srgb import decode_table, to_codes, to_linear


def decoded(code):
    """IEC 61966-2-1 with the C library's power function (accurate to 1e-15)."""
    value = code / 255
    return value / 12.92 if value <= 0.04045 else math.pow((value + 0.055) / 1.055, 2.4)


def is_nearest(number, code):
    """Whether no number of its type is nearer to a code's linear value x, exactly: x^5 is the 12th power of a ratio."""
    value = Fraction(code) / 255
    below, above = (
        (Fraction(float(number)) + Fraction(float(np.nextafter(number, number.dtype.type(end))))) / 2 for end in (0, 2)
    )
    if value <= Fraction("0.04045"):
        return below <= value / Fraction("12.92") <= above
    return below**5 <= ((value + Fraction("0.055")) / Fraction("1.055")) ** 12 <= above**5


def test_tables_are_the_nearest_numbers_to_the_standards():
    assert decode_table().dtype == np.float32
    assert all(is_nearest(number, code) for code, number in enumerate(decode_table()))
    edges = srgb._code_edges()
    assert len(edges) == 255
    assert all(is_nearest(edge, code + Fraction(1, 2)) for code, edge in enumerate(edges))
    assert to_codes(edges).tolist() == list(range(1, 256))
    assert to_codes(np.nextafter(edges, 0)).tolist() == list(range(255))


def test_tables_do_not_depend_on_the_callers_precision():
    with localcontext(prec=3):
        assert np.array_equal(decode_table.__wrapped__(), decode_table())


def test_encoding_undoes_decoding_for_every_code():
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16)
    assert np.array_equal(to_codes(to_linear(codes)), codes)


@pytest.mark.parametrize(
    ("linear", "code"), [(-1.0, 0), (0.0, 0), (1.0, 255), (7.0, 255), (math.inf, 255), (0.5, 188), (0.2158605, 128)]
)
def test_encoding_takes_the_nearest_code(linear, code):
    # 0.5 is 187.52 codes, by the standard's 1.055 x**(1/2.4) - 0.055.
    assert to_codes(np.array([linear])).tolist() == [code]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_every_number_beside_an_edge_gets_the_code_of_its_side(dtype):
    """The edges are found by halving intervals of the function itself, then all numbers near them are tried."""
    code_of = lambda x: int(to_codes(np.array([x], dtype))[0])  # noqa: E731
    edges = []
    for code in range(255):
        low, high = dtype(decoded(code + 0.4)), dtype(decoded(code + 0.6))
        while np.nextafter(low, dtype(2)) < high:
            middle = dtype((low + high) / 2)
            low, high = (middle, high) if code_of(middle) <= code else (low, middle)
        edges.append(high)
        assert float(high) == pytest.approx(decoded(code + 0.5), rel=1e-6 if dtype is np.float32 else 1e-12)
    ulps = np.arange(-3, 4) * np.finfo(dtype).eps
    points = np.outer(np.array(edges), 1 + ulps).ravel()
    assert to_codes(points).tolist() == [bisect.bisect_right(edges, x) for x in points.tolist()]


def test_numbers_that_are_none_and_shapes():
    odd = np.array([[math.nan, -math.inf], [-0.0, 1e-45]], np.float32)
    assert to_codes(odd).tolist() == [[255, 0], [0, 0]]
    assert to_codes(np.zeros((0, 3), np.float32)).shape == (0, 3)
    assert to_codes(np.ones((300, 300, 3), np.float32)[:, ::2]).shape == (300, 150, 3)
