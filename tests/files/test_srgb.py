"""sRGB: the tables against IEC 61966-2-1 worked out in another way, and there and back."""

import math
from decimal import localcontext
from fractions import Fraction

import numpy as np

from lfssao.files import srgb
from lfssao.files.srgb import decode, decode_table, to_codes, to_linear


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
    edges = srgb.code_edges()
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


def test_numbers_beyond_the_codes_and_shapes():
    odd = np.array([[math.nan, -math.inf, -1.0, -0.0], [1e-45, 1.0, 7.0, math.inf]], np.float32)
    assert to_codes(odd).tolist() == [[255, 0, 0, 0], [0, 255, 255, 255]]
    # 0.5 is 187.52 codes, by the standard's 1.055 x**(1/2.4) - 0.055.
    assert to_codes(np.array([-1.0, 0.0, 0.2158605, 0.5, 1.0, 7.0, math.inf])).tolist() == [0, 0, 128, 188, *[255] * 3]
    assert to_codes(np.zeros((0, 3), np.float32)).shape == (0, 3)
    assert to_codes(np.ones((300, 300, 3), np.float32)[:, ::2]).shape == (300, 150, 3)


def test_values_between_codes_are_the_nearest_numbers():
    values = np.random.default_rng(7).random(2000) ** 2
    decoded = decode(values)
    assert decoded.dtype == np.float32
    assert all(is_nearest(number, 255 * Fraction(value)) for number, value in zip(decoded, values, strict=True))
    assert np.array_equal(decode(np.arange(256) / 255), decode_table())
