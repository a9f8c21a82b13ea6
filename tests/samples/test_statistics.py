"""Statistics of points: they agree with scipy and with tables, and their p-values and powers are those of many sets."""

import math
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from lfssao.samples import sample_set, statistics

N = 8000
U = np.random.default_rng(7).random((N, 3))  # independent numbers on (0, 1) from another generator than ours


# Against scipy and Stephens


@given(st.lists(st.floats(0, 1), min_size=1, max_size=60))
def test_the_ks_distance_is_scipys(values):
    assert statistics.departures(values).max() == pytest.approx(stats.kstest(values, "uniform").statistic, abs=1e-12)


@given(st.lists(st.integers(0, 2**20), min_size=1, max_size=60), st.integers(0, 2**20))
def test_kuipers_distance_has_no_beginning(places, turn):
    before, after = (statistics.departures((np.array(places) + by) % 2**20 / 2**20).sum() for by in (0, turn))
    assert after == pytest.approx(before, abs=1e-12)


@pytest.mark.parametrize(("percent", "point"), [(10, 1.620), (5, 1.747), (2.5, 1.862), (1, 2.001)])
def test_kuipers_p_is_that_of_stephens_table(percent, point):
    """Stephens 1970, table 1: upper points of (sqrt(n) + 0.155 + 0.24 / sqrt(n)) V."""
    for n in (8, 1000):
        v = point / (math.sqrt(n) + 0.155 + 0.24 / math.sqrt(n))
        assert statistics.kuiper_p(v, n) == pytest.approx(percent / 100, rel=0.01)


def test_the_p_of_a_share_is_that_of_the_binomial():
    assert statistics.share_p(0.5, 8) == statistics.share_p(-0.5, 8) == pytest.approx(2 / 2**8)
    assert statistics.share_p(0.4, 4, 0.1) == pytest.approx(2 * (6 * 0.01 * 0.81 + 4 * 0.001 * 0.9 + 0.0001))


# The power: n points of which a share, drawn, lies in the half, or in the tenth, below ``fair``


@pytest.mark.parametrize(("statistic", "p_value", "fair"), [
    (lambda u: statistics.departures(u).max(axis=0), stats.kstwo.sf, 0.5),
    (lambda u: statistics.departures(u).sum(axis=0), statistics.kuiper_p, 0.5),
    (lambda u: np.mean(u < 0.5, axis=0) - 0.5, statistics.share_p, 0.5),
    (lambda u: np.mean(u < 0.1, axis=0) - 0.1, partial(statistics.share_p, fair=0.1), 0.1),
], ids=("ks", "kuiper", "half", "tenth"))  # fmt: skip
def test_the_least_share_is_found_nine_times_in_ten(statistic, p_value, fair):
    """At least so of the distances, which are never less than the excess; 4 sigma of 1000 sets: 3e-5 each."""
    n = 200
    alarm = 1e-3
    rng = np.random.default_rng(4)
    least = statistics.least_share(p_value, n, alarm, fair)
    within = rng.random((n, 1000)) < least
    u = np.where(within, fair * rng.random((n, 1000)), fair + (1 - fair) * rng.random((n, 1000)))
    found = np.mean([p_value(value, n) < alarm for value in statistic(u)])
    assert found > 0.9 - 0.038
    assert found < 0.9 + 0.038 or p_value in (stats.kstwo.sf, statistics.kuiper_p)


def test_the_least_share_of_chi_square_is_found_nine_times_in_ten():
    n = 4000
    cells = 64
    rng = np.random.default_rng(4)
    least = statistics.chi_square_share(cells, n, 1e-3)
    share = np.where(np.arange(cells) < cells / 2, least, 1 - least) / (cells / 2)
    p = stats.chisquare(rng.multinomial(n, share, 1000), axis=1).pvalue
    assert np.mean(p < 1e-3) == pytest.approx(0.9, abs=0.038)


# Periodogram and pair correlation


def test_the_periodogram_of_random_points_is_flat_and_that_of_a_grid_is_not():
    """False alarm: 1e-6; each power is exponential of mean 1, those at f and -f are equal."""
    power = statistics.periodogram(U[:, :2])
    assert power.max() < math.log(65 * 65 // 2 / 1e-6)
    assert power.sum() / (65 * 65 - 1) == pytest.approx(1, abs=7 * math.sqrt(2) / 65)
    grid = np.stack(np.meshgrid(np.arange(16), np.arange(16)), axis=-1).reshape(-1, 2) / 16
    peaks = statistics.periodogram(grid, 16)
    assert peaks[32, 16] == pytest.approx(256)
    assert peaks[16, 17] == pytest.approx(0, abs=1e-20)
    assert peaks[16, 16] == 0


def test_the_radial_mean_is_over_rings():
    """False alarm: 32 means at 6 sigma, 1e-7."""
    frequency, mean, sigma = statistics.radial_mean(statistics.periodogram(U[:, :2]))
    np.testing.assert_array_equal(frequency, np.arange(1, 33))
    assert (np.abs(mean - 1) < 6 * sigma).all()
    wave = np.zeros((65, 65))
    wave[32 + 3, 32 - 4] = wave[32 - 3, 32 + 4] = 14.0  # |f| = 5, a ring of 28 whole frequencies from 4.5 to 5.5
    np.testing.assert_allclose(statistics.radial_mean(wave)[1], np.where(np.arange(1, 33) == 5, 1, 0))


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


def test_the_pair_correlation_of_random_points_is_one():
    """Each of the outer 30 bins counts over 5000 pairs: 6 sigma are 0.085; false alarm 6e-8 in all."""
    _, ratio = statistics.pair_correlation(U[:4000, :2])
    assert np.abs(ratio[10:] - 1).max() < 0.085


def test_distances_wrap_around_the_cylinder_only():
    assert statistics.nearest_distance(np.array([[0, -0.95], [0, 0.95]]), wraps=True) == pytest.approx(0.1)
    assert statistics.nearest_distance(np.array([[-0.95, 0], [0.95, 0]]), wraps=True) == pytest.approx(1.9)
    assert statistics.nearest_distance(np.array([[0, -0.95], [0, 0.95]])) == pytest.approx(1.9)
    assert statistics.nearest_distance(np.array([[0.0, 0.0]])) == math.inf
    assert statistics.nearest_distance(np.zeros((2, 3))) == 0
