"""The logarithm and the power of textures: bit for bit against the reference, and against mpmath."""

import mpmath
import numpy as np
import pytest
from reference import elementary

from lfssao.core import power

NUMBERS = np.concatenate(
    [
        np.random.default_rng(5).uniform(0, 4, 1000),
        2 ** np.random.default_rng(6).uniform(-1074, 1023.9, 1000),
        1 + np.random.default_rng(7).uniform(-1e-3, 1e-3, 300),
        *(np.nextafter(x, [0, np.inf]) for x in (0.5**0.5, 1.0, 2**0.5, 0.5)),
        [5e-324, 1.7976931348623157e308],
    ]
)


def test_log_is_within_2_ulp_and_equals_the_reference():
    worst = 0
    with mpmath.workprec(200):
        for x in NUMBERS:
            found = power.log(x)
            assert found == elementary.log(float(x))
            exact = mpmath.log(mpmath.mpf(float(x)))
            worst = max(worst, abs((mpmath.mpf(found) - exact) / np.spacing(abs(float(exact)))))
    assert worst <= 2


def test_special_values_of_log_and_power():
    assert power.log(1.0) == 0
    assert power.log(0.0) == -np.inf
    assert power.log(np.inf) == np.inf
    assert np.isnan(power.log(-1.0))
    for x in (0.0, 0.3, 1.0):
        assert power.power(x, 1.0) == x
        assert power.power(x, 0.0) == 1
    assert power.power(0.0, 2.0) == 0
    assert power.power(1.0, 2.5) == 1
    assert power.power(0.25, 0.5) == pytest.approx(0.5, abs=1e-15)
