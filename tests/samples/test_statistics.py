"""The checks are checked: each planted wrong sampler is caught, the statistics agree with scipy, limits hold."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.stats import qmc

from lfssao.errors import InputError
from lfssao.samples import METHODS, sample_set, statistics
from lfssao.testing import PROMISES, check_promise

N = 8000


def broken(promise, points, domain, weights=None, **shell):
    return [f.what for f in check_promise(promise, points, domain, weights, **shell) if not f.holds]


def on_sphere(z, phi):
    r = np.sqrt(1 - z * z)
    return np.column_stack([r * np.cos(phi), r * np.sin(phi), z])


@pytest.fixture(scope="module")
def u():
    """Independent numbers on (0, 1) from another generator than ours."""
    return np.random.default_rng(7).random((N, 3))


# Planted wrong samplers


def test_the_right_sampler_is_not_caught(u):
    """False alarms: 1e-6 each, for one fixed seed."""
    directions = on_sphere(2 * u[:, 0] - 1, 2 * np.pi * u[:, 1])
    radius = np.cbrt(0.3**3 + (1 - 0.3**3) * u[:, 2:])
    assert not broken("uniform", directions, "sphere")
    assert not broken("uniform", directions * radius, "ball", r_min=0.3)
    assert not broken("uniform", 2 * u[:, :2] - 1, "square")
    disk = np.sqrt(u[:, :1]) * np.column_stack([np.cos(2 * np.pi * u[:, 1]), np.sin(2 * np.pi * u[:, 1])])
    assert not broken("uniform", disk, "disk")


def test_theta_uniform_instead_of_z_is_caught(u):
    points = on_sphere(np.cos(np.pi * u[:, 0]), 2 * np.pi * u[:, 1])
    assert {"Kolmogorov-Smirnov distance of z", "spherical cap discrepancy"} <= set(broken("uniform", points, "sphere"))
    assert broken("uniform", points * np.cbrt(u[:, 2:]), "ball")


def test_r_uniform_instead_of_its_cube_is_caught(u):
    directions = on_sphere(2 * u[:, 0] - 1, 2 * np.pi * u[:, 1])
    assert "Kolmogorov-Smirnov distance of r^3" in broken("uniform", directions * u[:, 2:], "ball")
    assert broken("uniform", directions * (0.8 + 0.2 * u[:, 2:]), "ball", r_min=0.8)
    assert broken(
        "uniform", directions[:, :2] * 0 + u[:, :1] * on_sphere(0 * u[:, 1], 2 * np.pi * u[:, 1])[:, :2], "disk"
    )


def test_phi_on_a_half_circle_is_caught(u):
    points = on_sphere(2 * u[:, 0] - 1, np.pi * u[:, 1])
    assert {"Kolmogorov-Smirnov distance of phi", "spherical cap discrepancy"} <= set(
        broken("uniform", points, "sphere")
    )


def test_coordinates_that_depend_on_each_other_are_caught_by_chi_square_alone(u):
    tied = np.column_stack([u[:, 0], (u[:, 0] + 0.1 * u[:, 1]) % 1]) * 2 - 1
    found = broken("uniform", tied, "square")
    assert found == ["chi-square over 16^2 equal cells"]


def test_a_repeated_point_is_caught(u):
    points = u[:, :2] * 2 - 1
    assert not broken("distinct", points, "square")
    points[5] = points[4000]
    assert broken("distinct", points, "square") == ["points that repeat another"]
    assert statistics.nearest_distance(points) == 0


def test_a_duplicated_latin_row_is_caught():
    points = sample_set("square", "latin", 64, 3).points.copy()
    assert not broken("latin", points, "square")
    points[10, 1] = points[20, 1]
    assert broken("latin", points, "square") == ["rows without exactly one point"]


def test_every_exact_promise_notices_a_set_without_it():
    random = sample_set("square", "random", 1024, 5).points
    for promise in ("stratified", "rows", "latin", "net", "low-discrepancy", "poisson"):
        assert broken(promise, random, "square"), promise
    assert broken("equal-area", sample_set("sphere", "random", 256, 5).points, "sphere")
    banded = sample_set("sphere", "fibonacci", 256, 5).points.copy()
    banded[:, :2] = np.abs(banded[:, :2])  # right bands, wrong angles
    assert broken("equal-area", banded, "sphere") == ["spherical cap discrepancy"]
    assert broken("apart", sample_set("ball", "random", 64, 5).points, "ball")
    assert broken("radii", sample_set("disk", "random", 64, 5).points, "disk")
    table = sample_set("ball", "repulsion", 8)
    assert not broken("weights", table.points, "ball", table.weights)
    assert broken("weights", table.points, "ball")
    assert broken("weights", table.points, "ball", table.weights * 1.001)
    assert broken("weights", table.points, "ball", table.weights * [-1, *[1] * 7])
    for domain in METHODS:
        assert broken("inside", sample_set(domain, "random", 64, 5).points * 1.1 + 0.1, domain)
    assert broken("inside", np.array([[0.0, 0.0, 0.5]]), "ball", r_min=0.6)


def test_every_promise_of_the_registry_is_a_check_that_some_test_here_breaks():
    promised = {promise for methods in METHODS.values() for method in methods.values() for promise in method.promises}
    assert promised <= set(PROMISES)
    assert set(PROMISES) - promised == {"uniform"}  # for files: methods promise 'unbiased'


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


@pytest.mark.parametrize(("arguments", "words"), [
    (("latn", [[0, 0]], "square"), "nearest is 'latin'"),
    (("latin", [[0, 0]], "sqare"), "nearest is 'square'"),
    (("latin", [[0, 0, 1]], "ball"), "not of the ball"),
    (("inside", [[0, 0, 1]], "square"), r"expected \(n, 2\)"),
    (("inside", np.empty((0, 2)), "square"), "n >= 1"),
    (("inside", [[0, 0], [math.nan, 0]], "square"), "point 1 is not finite"),
    (("inside", [[0, 0, 1]], "ball", None, 0.9, 0.8), "r_min"),
    (("inside", [[0, 0, 1]], "ball", None, 0.0, 0.0), "r_max"),
    (("weights", [[0, 0, 1]], "ball", [1, 1]), "weights of shape"),
])  # fmt: skip
def test_what_is_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        check_promise(*arguments)
