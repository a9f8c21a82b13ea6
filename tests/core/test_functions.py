"""The exponential of floats and exact numbers, against mpmath; that of balls is among the forms of ``test_balls``."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest

from lfssao.bench.stability.tracked import Arithmetic
from lfssao.core.functions import exponential

EXPONENTS = [-300.0, -20.0, -1.0, -1e-3, 0.0, 0.3, 1.0, 5.5, 88.0]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_it_is_made_in_float64_and_rounded_once(dtype):
    for x in map(dtype, EXPONENTS):
        exact = mpmath.exp(mpmath.mpf(float(x)))
        assert type(exponential(x)) is dtype
        assert abs(exponential(x) - exact) <= (0.501 if dtype == np.float32 else 2) * np.spacing(dtype(float(exact)))


def test_an_exact_number_has_the_exact_value_and_a_bound_of_what_rounding_makes_of_it():
    single = Arithmetic.of("float32")
    exact = Arithmetic()
    for exponent in EXPONENTS[1:]:
        x = np.float32(exponent)
        found = exponential(exact.given(x))
        with mpmath.workprec(300):
            right = mpmath.exp(mpmath.mpf(float(x)))
            assert abs(mpmath.mpf(found.value.numerator) / found.value.denominator / right - 1) < 1e-55
        assert found.error == 0
        for off in (0.0, 1e-6, 0.1):
            tracked = exponential(single.number(Fraction(float(x)), off))
            for y in (x - np.float32(off), x, x + np.float32(off)):
                assert abs(float(exponential(y)) - float(tracked.value)) <= tracked.error * (1 + 1e-5)
    assert exponential(single.number(Fraction(1), 2.0)).error == np.inf
