"""sRGB: the tables against IEC 61966-2-1 worked out in another way, and there and back."""

import math

import numpy as np
import pytest

from lfssao.srgb import decode_table, to_codes, to_linear


def decoded(code):
    """IEC 61966-2-1 with the C library's power function (accurate to 1e-15, which rounds to float32 within 1 ulp)."""
    value = code / 255
    return value / 12.92 if value <= 0.04045 else math.pow((value + 0.055) / 1.055, 2.4)


def test_decode_table_is_the_standards_to_one_ulp():
    wanted = np.array([decoded(code) for code in range(256)])
    one_ulp = np.spacing(wanted.astype(np.float32)).astype(np.float64)
    assert decode_table().dtype == np.float32
    assert (np.abs(decode_table() - wanted) <= one_ulp).all()


def test_black_and_white_are_exact():
    assert decode_table()[[0, 255]].tolist() == [0.0, 1.0]


def test_encoding_undoes_decoding_for_every_code():
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16)
    assert np.array_equal(to_codes(to_linear(codes)), codes)


@pytest.mark.parametrize(
    ("linear", "code"), [(-1.0, 0), (0.0, 0), (1.0, 255), (7.0, 255), (math.inf, 255), (0.5, 188), (0.2158605, 128)]
)
def test_encoding_takes_the_nearest_code(linear, code):
    # 0.5 is 187.52 codes, by the standard's 1.055 x**(1/2.4) - 0.055.
    assert to_codes(np.array([linear])).tolist() == [code]


def test_encoding_halfway_between_codes():
    below = [decoded(code + 0.499) for code in range(255)]
    above = [decoded(code + 0.501) for code in range(255)]
    assert to_codes(np.array(below)).tolist() == list(range(255))
    assert to_codes(np.array(above)).tolist() == list(range(1, 256))
