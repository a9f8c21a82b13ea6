"""SAO's spiral: the reference, exact reduction of the angle, and the table of the best turns."""

import math

import mpmath
import numpy as np
import pytest
from bits import bits
from hypothesis import given
from hypothesis import strategies as st
from reference import spiral as reference

from lfssao.errors import InputError
from lfssao.samples import best_turns
from lfssao.samples.kernels import spiral
from lfssao.samples.rotation import half_turns, hash_radians
from lfssao.samples.spiral import BEST_TURNS, spiral_discrepancy

texels = st.one_of(st.integers(0, 20_000), st.integers(-300, 2**20), st.sampled_from([0, 1, 14_000, 2**31 - 1]))


@pytest.mark.parametrize("variant", ["paper", "common"])
@given(x=texels, y=texels)
def test_the_hash_equals_the_reference(variant, x, y):
    (angle,) = half_turns(hash_radians(np.array([x]), np.array([y]), variant == "common"))
    assert bits(angle) == bits(reference.half_turns(reference.hash_word(x, y, variant)))
    assert 0 <= angle < 2


@given(x=st.integers(0, 20_000), y=st.integers(0, 20_000), tap=st.floats(0, 300))
def test_an_angle_added_in_float32_is_the_nearest_number_and_its_sine_exact(x, y, tap):
    spin = np.float32(reference.hash_word(x, y, "common"))
    found = spiral.summed_angle(x, y, tap)
    assert found == spin + np.float32(tap)
    with mpmath.workdps(40):
        want = float(mpmath.sin(mpmath.mpf(found))), float(mpmath.cos(mpmath.mpf(found)))
    assert spiral.unit_of(found) == pytest.approx(want, rel=0, abs=1e-15)


@given(st.integers(-(2**31), 2**31 - 1))
def test_whole_radians_are_reduced_exactly(radians):
    """Within one unit of 2**-52 half-turns, towards zero's side, of the true angle; an error of a turn would show."""
    (made,) = half_turns(np.array([radians], np.int32))
    with mpmath.workdps(60):
        true = mpmath.mpf(radians) / mpmath.pi
        true -= 2 * mpmath.floor(true / 2)
        error = abs(mpmath.mpf(float(made)) - true)
        assert min(error, 2 - error) < 1.001 * mpmath.mpf(2) ** -52
    assert bits(made) == bits(reference.half_turns(radians))


@given(s=st.integers(1, 99), data=st.data())
def test_taps_equal_the_reference_and_stand_on_the_spiral(s, data):
    tau = data.draw(st.integers(1, 2 * s))
    taps = np.empty((s, 3))
    spiral.unit_taps(tau, taps)
    np.testing.assert_array_equal(bits(taps), bits([reference.tap_of(i, s, tau) for i in range(s)]))
    theta = 2 * np.pi * taps[:, 2] * tau  # equation 6
    np.testing.assert_array_equal(taps[:, 2], (np.arange(s) + 0.5) / s)
    np.testing.assert_allclose(
        taps[:, :2], np.transpose([np.cos(theta), np.sin(theta)]), atol=1e-15 * (4 + theta.max())
    )


# The table


@pytest.mark.parametrize("s", [1, 2, 3, 4, 7, 9, 12])
def test_the_discrepancy_is_the_references(s):
    for tau in range(1, s + 1):
        assert spiral_discrepancy(s, tau) == pytest.approx(math.sqrt(reference.discrepancy_squared(s, tau)), rel=1e-9)


def test_the_table_has_the_best_turns_of_every_number_of_taps():
    assert len(BEST_TURNS) == 99
    for s in range(1, 100):
        least = min(spiral_discrepancy(s, tau) for tau in range(1, s + 1))
        # The smallest of equally good taus: the next smaller one is worse by more than rounding.
        assert spiral_discrepancy(s, BEST_TURNS[s - 1]) == pytest.approx(least, rel=1e-12)
        assert all(spiral_discrepancy(s, tau) > least * (1 + 1e-9) for tau in range(1, BEST_TURNS[s - 1]))
        assert best_turns(s) == BEST_TURNS[s - 1]


@pytest.mark.parametrize("s", [100, 128, 150])
def test_beyond_the_table_the_golden_ratios_turns_are_nearly_as_good(s):
    assert math.gcd(best_turns(s), s) == 1
    assert spiral_discrepancy(s, best_turns(s)) < 1.5 * min(spiral_discrepancy(s, tau) for tau in range(1, s // 2 + 1))


def test_a_number_of_taps_below_one_is_refused():
    with pytest.raises(InputError):
        best_turns(0)
