"""Elementary functions: the reference, their stated errors against mpmath at 200 bits, exact values."""

import math

import mpmath
import numpy as np
import pytest
from bits import bits
from reference import elementary as reference

from lfssao.core import elementary

RNG = np.random.default_rng(20170529)
SMALLEST = 5e-324
TINY = 2.0**-1022
LARGEST = 1.7976931348623157e308

# Many points: everywhere, near the joints of the reductions, and the extremes.
ANGLES = np.r_[
    RNG.uniform(-1, 1, 3000),
    RNG.uniform(-1e6, 1e6, 500),
    RNG.uniform(-(2.0**50), 2.0**50, 500),
    np.exp(RNG.uniform(-700, 0, 300)),
    *(np.nextafter(k / 4, np.array([-9, 9])) for k in range(-9, 10)),
    np.arange(-9, 10) / 4,
    0.0, -0.0, SMALLEST, TINY, 2.0**50, -(2.0**50), 2.0**49 + 0.5, 2.0**49 + 0.25,
]  # fmt: skip
CUBES = np.r_[
    RNG.uniform(0, 1, 3000),
    2 ** RNG.uniform(-1074, 1023.9, 2000),
    *(np.nextafter(8.0**k, [0, np.inf]) for k in range(-6, 7)),
    0.0, SMALLEST, 3 * SMALLEST, TINY, np.nextafter(TINY, 0), LARGEST,
]  # fmt: skip
# Some of the powers are subnormal, and there each halving may round.
POWERS = np.r_[
    RNG.uniform(-745, 709, 3000),
    RNG.uniform(-1, 1, 1000),
    -np.exp(RNG.uniform(-700, 0, 200)),
    *(np.nextafter((k + 0.5) * math.log(2), np.array([-999, 999])) for k in range(-20, 21)),
    709.7, 700.0, -700.0, -709.0, -720.0, -735.5, -744.0, SMALLEST, -SMALLEST,
]  # fmt: skip
LOGARITHMS = np.r_[
    RNG.uniform(0, 4, 1000),
    2 ** RNG.uniform(-1074, 1023.9, 1000),
    1 + RNG.uniform(-1e-3, 1e-3, 300),
    *(np.nextafter(x, [0, np.inf]) for x in (0.5**0.5, 1.0, 2**0.5, 0.5)),
    SMALLEST, LARGEST,
]  # fmt: skip
COSINES = np.r_[
    RNG.uniform(-1, 1, 2000),
    1 - 2.0 ** RNG.uniform(-53, -1, 300),
    2.0 ** RNG.uniform(-53, -1, 300) - 1,
    *(np.nextafter(x, [-2, 2]) for x in (-0.5, 0.0, 0.5)),
    np.nextafter(1, 0), np.nextafter(-1, 0), -1.0, 0.0, 0.5, 1.0,
]  # fmt: skip
BINARY = np.r_[
    2.0 ** RNG.uniform(-1022, 1023, 400),
    1 + RNG.uniform(-0.3, 0.4, 400),
    1.0, 8.0, TINY, np.nextafter(1, 2), math.sqrt(2), math.sqrt(0.5),
]  # fmt: skip


def test_sincospi_is_within_2_ulp_of_1_and_equals_the_reference():
    with mpmath.workprec(200):
        for x in ANGLES.tolist():
            s, c = elementary.sincospi(x)
            assert (bits([s, c]) == bits(reference.sincospi(x))).all()
            assert abs(s - mpmath.sinpi(mpmath.mpf(x))) <= 2 * 2.0**-52
            assert abs(c - mpmath.cospi(mpmath.mpf(x))) <= 2 * 2.0**-52


@pytest.mark.parametrize(("name", "points", "ulps", "right"), [
    ("acos", COSINES, 2, mpmath.acos),
    ("cbrt", CUBES, 1, mpmath.cbrt),
    ("exp", POWERS, 2, mpmath.exp),
    ("log", LOGARITHMS, 2, mpmath.log),
    ("log2", BINARY, 4, lambda x: mpmath.log(x, 2)),
])  # fmt: skip
def test_functions_are_within_their_ulps_and_equal_the_reference(name, points, ulps, right):
    ours = getattr(elementary, name)
    again = getattr(reference, name)
    with mpmath.workprec(200):
        for x in points.tolist():
            found = ours(x)
            exact = right(mpmath.mpf(x))
            assert bits(found) == bits(again(x))
            assert abs(mpmath.mpf(found) - exact) <= ulps * math.ulp(float(exact))


def test_exp_special_values():
    assert elementary.exp(0.0) == elementary.exp(-0.0) == 1
    assert elementary.exp(1.0) == pytest.approx(math.e, rel=2 * 2**-52)
    assert elementary.exp(-745.2) == elementary.exp(-1e300) == elementary.exp(-math.inf) == 0
    assert elementary.exp(710.1) == elementary.exp(1e300) == elementary.exp(math.inf) == math.inf


def test_special_values_of_logarithms_and_power():
    assert elementary.log2(8.0) == 3
    assert [elementary.log2(x) for x in (0.0, -1.0, 5e-324, np.inf, np.nan)] == [-1022, -1022, -1022, 1024, 1024]
    assert elementary.log(1.0) == 0
    assert elementary.log(0.0) == -np.inf
    assert elementary.log(np.inf) == np.inf
    assert np.isnan(elementary.log(-1.0))
    for x in (0.0, 0.3, 1.0):
        assert elementary.power(x, 1.0) == x
        assert elementary.power(x, 0.0) == 1
    assert elementary.power(0.0, 2.0) == 0
    assert elementary.power(1.0, 2.5) == 1
    assert elementary.power(0.25, 0.5) == pytest.approx(0.5, abs=1e-15)
