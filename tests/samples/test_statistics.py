"""Statistics of points: they agree with scipy, and their limits hold."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.stats import qmc

from lfssao.samples import sample_set, statistics

N = 8000


@pytest.fixture(scope="module")
def u():
    """Independent numbers on (0, 1) from another generator than ours."""
    return np.random.default_rng(7).random((N, 3))


# Against scipy


@settings(max_examples=20)
@given(n=st.integers(1, 50), d=st.integers(1, 3), seed=st.integers(0, 10**6))
def test_the_discrepancy_is_scipys(n, d, seed):
    cube = np.random.default_rng(seed).random((n, d))
    expected = qmc.discrepancy(cube, method="L2-star")
    assert statistics.star_discrepancy(cube) == pytest.approx(expected, rel=1e-9, abs=1e-12)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=60))
def test_the_ks_distance_is_scipys(values):
    assert statistics.ks_distance(values) == pytest.approx(stats.kstest(values, "uniform").statistic, abs=1e-12)


@pytest.mark.parametrize("alarm", [1e-2, 1e-6, 1e-8])
def test_limits_are_above_the_true_quantiles(alarm):
    for freedom in (3, 63, 255, 511):
        true = stats.chi2.isf(alarm, freedom)
        assert true <= statistics.chi_square_limit(freedom, alarm) < 1.5 * true + 30
    for n in (8, 100, 8000):
        true = stats.kstwo.isf(alarm, n)
        assert true <= statistics.ks_limit(n, alarm) < 1.6 * true


def test_the_chi_square_is_scipys(u):
    counts, _, _ = np.histogram2d(u[:, 0], u[:, 1], bins=8, range=[[0, 1], [0, 1]])
    assert statistics.chi_square(u[:, :2], 8) == pytest.approx(stats.chisquare(counts.ravel()).statistic)


# Periodogram and pair correlation


def test_the_periodogram_of_random_points_is_flat_and_that_of_a_grid_is_not(u):
    """False alarm: 1e-6; each power is exponential of mean 1, those at f and -f are equal."""
    power = statistics.periodogram(u[:, :2])
    assert power.max() < math.log(65 * 65 // 2 / 1e-6)
    assert power.sum() / (65 * 65 - 1) == pytest.approx(1, abs=7 * math.sqrt(2) / 65)
    grid = np.stack(np.meshgrid(np.arange(16), np.arange(16)), axis=-1).reshape(-1, 2) / 16
    peaks = statistics.periodogram(grid, 16)
    assert peaks[32, 16] == pytest.approx(256)
    assert peaks[16, 17] == pytest.approx(0, abs=1e-20)
    assert peaks[16, 16] == 0


def test_poisson_disks_lack_low_frequencies_and_near_pairs():
    cube = (sample_set("square", "poisson", 2000, 1).points + 1) / 2
    power = statistics.periodogram(cube, 40)
    f = np.arange(-40, 41)
    radius = np.hypot(*np.meshgrid(f, f))
    assert power[(radius > 1) & (radius < 15)].mean() < 0.25  # random: 1, sigma 0.05
    distance, ratio = statistics.pair_correlation(cube)
    # The first direction's edges wrap here and not in the method: a few pairs across them are near.
    assert ratio[distance < 0.6].max() < 0.1
    assert ratio[(distance > 0.85) & (distance < 1)].max() > 1.3


def test_the_pair_correlation_of_random_points_is_one(u):
    """Each of the outer 30 bins counts over 5000 pairs: 6 sigma are 0.085; false alarm 6e-8 in all."""
    _, ratio = statistics.pair_correlation(u[:4000, :2])
    assert np.abs(ratio[10:] - 1).max() < 0.085


def test_distances_wrap_around_the_cylinder_only():
    assert statistics.nearest_distance(np.array([[0, -0.95], [0, 0.95]]), wraps=True) == pytest.approx(0.1)
    assert statistics.nearest_distance(np.array([[-0.95, 0], [0.95, 0]]), wraps=True) == pytest.approx(1.9)
    assert statistics.nearest_distance(np.array([[0, -0.95], [0, 0.95]])) == pytest.approx(1.9)
    assert statistics.nearest_distance(np.array([[0.0, 0.0]])) == math.inf
