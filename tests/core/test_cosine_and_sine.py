"""Cosine and sine of angles, and the root of half a float's bits, of floats, balls and exact numbers."""

import struct
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from lfssao.bench.stability.tracked import Arithmetic
from lfssao.core.balls import SAFETY, Ball, ball_of
from lfssao.core.functions import cosine_and_sine, cosine_and_sine_of_ball, crude_root
from lfssao.core.jit import kernel
from lfssao.core.numbers import as_float, plain

ANGLES = [-3.5, -1.5707964, -1.0, -1e-6, 0.0, 0.3, 0.7853982, 1.5707963, 3.1415927, 7.5]
NUMBERS = [2.0**-126, 1e-30, 2.0**-24, 1e-3, 0.24999999, 0.25, 0.3, 0.5, 1 - 2.0**-24, 1.0]


def by_bits(x):
    """The float32 whose bits are half of those of x, and a constant."""
    (bits,) = struct.unpack("<i", struct.pack("<f", x))
    return struct.unpack("<f", struct.pack("<i", 0x1FBD1DF5 + (bits >> 1)))[0]


def far(fraction, right):
    with mpmath.workprec(300):
        return abs(mpmath.mpf(fraction.numerator) / fraction.denominator - right)


@kernel
def of_floats(x, made):
    for i in range(len(x)):
        cosine, sine = cosine_and_sine(as_float(x[i]))
        made[i, 0], made[i, 1], made[i, 2] = plain(cosine), plain(sine), plain(crude_root(as_float(abs(x[i]))))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_floats_are_made_in_float64_and_rounded_once(dtype):
    x = np.array(ANGLES, dtype)
    made = np.zeros((len(x), 3), dtype)
    of_floats(x, made)
    for angle, (cosine, sine, root) in zip(x, made, strict=True):
        off = 2.0**-24 if dtype == np.float32 else 1e-15
        assert abs(cosine - mpmath.cos(mpmath.mpf(float(angle)))) <= off * (1 + 1e-6)
        assert abs(sine - mpmath.sin(mpmath.mpf(float(angle)))) <= off * (1 + 1e-6)
        assert cosine_and_sine(angle) == (cosine, sine)
        assert root == by_bits(abs(angle)) == crude_root(abs(angle))
        assert abs(root - np.sqrt(abs(float(angle)))) <= 0.036 * np.sqrt(abs(float(angle))) + 1e-19


@kernel
def of_balls(given, absolute, model, made):
    zero = ball_of(0.0, 0.0, model)
    for i in range(len(given)):
        ball = Ball(given[i, 0], given[i, 1], zero)
        cosine, sine = cosine_and_sine_of_ball(ball, absolute)
        root = crude_root(Ball(abs(given[i, 0]), given[i, 1], zero))
        for k, each in enumerate((cosine, sine, root)):
            made[i, k, 0], made[i, k, 1] = each.value - each.error * SAFETY, each.value + each.error * SAFETY


@pytest.mark.parametrize("absolute", [2.0**-11, 0.0])
def test_balls_hold_what_all_their_numbers_give_and_hardly_more(absolute):
    rng = np.random.default_rng(3)
    given = np.stack([rng.choice(ANGLES, 100), rng.choice([0.0, 1e-6, 0.01, 0.5], 100)], axis=1)
    made = np.zeros((100, 3, 2))
    of_balls(given, absolute, np.full(5, 2.0**-23), made)
    for (angle, error), ends in zip(given.tolist(), made, strict=True):
        for x in np.linspace(angle - error, angle + error, 5).tolist():
            for value, (low, high) in zip((mpmath.cos(x), mpmath.sin(x)), ends[:2], strict=True):
                assert low <= value - absolute + 1e-15
                assert high >= value + absolute - 1e-15
        assert np.ptp(ends[:2], axis=1).max() <= 2.0001 * (error + absolute) + 1e-15
        roots = [by_bits(max(abs(angle) + sign * error, 0.0)) for sign in (-1, 1)]
        assert roots[0] - 2e-6 * roots[1] <= ends[2, 0] <= roots[0] * (1 + 1e-12)
        assert roots[1] * (1 - 1e-12) <= ends[2, 1] <= roots[1] * (1 + 2e-6) + 1e-18


def test_exact_numbers_have_the_exact_values_and_bounds_of_what_rounding_makes_of_them():
    single = Arithmetic.of("float32")
    exact = Arithmetic()
    for angle in ANGLES:
        found = exact.given(np.float32(angle)).cosine_and_sine()
        with mpmath.workprec(300):
            right = [f(mpmath.mpf(float(np.float32(angle)))) for f in (mpmath.cos, mpmath.sin)]
        assert all(far(each.value, value) < 1e-75 and each.error == 0 for each, value in zip(found, right, strict=True))
        for off in (0.0, 1e-6, 0.1):
            tracked = single.number(Fraction(float(np.float32(angle))), off).cosine_and_sine()
            for x in (angle - off, angle, angle + off):
                for each, computed in zip(tracked, cosine_and_sine(np.float32(x)), strict=True):
                    assert abs(float(computed) - float(each.value)) <= each.error + 1e-7 * off
    for x in NUMBERS:
        assert exact.given(x).crude_root().error == 0
        for off in (0.0, 1e-7 * x, 0.1 * x):
            tracked = single.number(Fraction(float(np.float32(x))), off).crude_root()
            assert abs(float(tracked.value) - by_bits(x)) <= 2.0**-22 * float(tracked.value)
            for moved in (x - off, x, x + off):
                assert abs(by_bits(moved) - float(tracked.value)) <= tracked.error
