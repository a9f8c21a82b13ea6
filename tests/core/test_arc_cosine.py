"""The angle of a cosine, of floats, balls and exact numbers, against mpmath."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest

from lfssao.bench.stability.tracked import Arithmetic
from lfssao.core.balls import SAFETY, Ball, ball_of
from lfssao.core.functions import arc_cosine, arc_cosine_of_ball
from lfssao.core.jit import kernel
from lfssao.core.numbers import as_float, plain

COSINES = [-1.0, -1 + 2.0**-20, -0.75, -0.5, -1e-3, 0.0, 0.3, 0.5, 0.999, 1 - 2.0**-24, 1.0]


@kernel
def of_floats(x, made):
    for i in range(len(x)):
        made[i] = plain(arc_cosine(as_float(x[i])))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_an_angle_is_made_in_float64_and_rounded_once(dtype):
    x = np.array(COSINES, dtype)
    made = np.zeros_like(x)
    of_floats(x, made)
    for cosine, angle in zip(x, made, strict=True):
        exact = mpmath.acos(mpmath.mpf(float(cosine)))
        assert abs(angle - exact) <= (0.5 if dtype == np.float32 else 2) * np.spacing(dtype(float(exact)))
        assert arc_cosine(cosine) == angle
        assert type(arc_cosine(cosine)) is dtype


@kernel
def of_balls(given, relative, model, made):
    zero = ball_of(0.0, 0.0, model)
    for i in range(len(given)):
        ball = arc_cosine_of_ball(Ball(given[i, 0], given[i, 1], zero), relative)
        made[i, 0], made[i, 1] = ball.value - ball.error * SAFETY, ball.value + ball.error * SAFETY


@pytest.mark.parametrize(("relative", "operation"), [(2.0**-11, 2.0**-23), (0.0, 2.0**-23), (2.0**-6, 0.0)])
def test_a_ball_holds_the_angles_of_all_its_numbers_and_hardly_more(relative, operation):
    rng = np.random.default_rng(3)
    given = np.stack([rng.choice(COSINES, 200), rng.choice([0.0, 1e-6, 0.01, 0.5], 200)], axis=1)
    made = np.zeros_like(given)
    of_balls(given, relative, np.full(5, operation), made)
    for (cosine, error), (low, high) in zip(given.tolist(), made.tolist(), strict=True):
        ends = []
        for x in (cosine + error, cosine - error):
            for y in (x, x * (1 + operation), x * (1 - operation)):
                angle = mpmath.acos(min(max(y, -1.0), 1.0))
                ends += [angle * (1 + relative), angle * (1 - relative)]
        slack = 1e-15 + (1e-6 if abs(cosine) + error < 1 else 1e-3) * (operation > 0)  # the ball is off by 1 ulp of 1
        assert low - 1e-15 <= min(ends) <= low + slack + 1e-5 * error + 2.0**-20
        assert high - slack - 1e-5 * error - 2.0**-20 <= max(ends) <= high + 1e-15


def test_an_exact_number_has_the_exact_angle_and_a_bound_of_what_rounding_makes_of_it():
    single = Arithmetic.of("float32")
    exact = Arithmetic()
    for cosine in COSINES:
        found = exact.given(np.float32(cosine)).arc_cosine()
        with mpmath.workprec(300):
            right = mpmath.acos(mpmath.mpf(float(np.float32(cosine))))
            assert abs(mpmath.mpf(found.value.numerator) / found.value.denominator - right) < 1e-80
        assert found.error == 0
        for off in (0.0, 1e-6, 0.1):
            tracked = single.number(Fraction(float(np.float32(cosine))), off).arc_cosine()
            for x in (cosine - off, cosine, cosine + off):
                computed = arc_cosine(np.float32(min(max(x, -1.0), 1.0)))
                assert abs(float(computed) - float(tracked.value)) <= tracked.error + 1e-9 * off
