"""Sample sets: the reference, cells, rows and columns, the shell, refusals, and how the points are distributed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import samples as reference

from lfssao import make_samples, square_points
from lfssao.errors import InputError
from lfssao.samples.kernels import ball

METHODS = ("random", "jittered", "latin")
every_method = pytest.mark.parametrize("method", METHODS)
counts = st.one_of(st.integers(1, 40), st.sampled_from([1, 2, 31, 36, 37, 64, 97]))
small_seeds = st.integers(0, 2**63 - 1)
radii = st.tuples(
    st.one_of(st.floats(0, 1), st.sampled_from([0.0, 0.8, 1.0])),
    st.one_of(st.floats(0.01, 10), st.sampled_from([1e-30, 1e30, 1.0, 5e-324, 1e-310, 1.7e308])),
).map(lambda pair: (pair[0] * pair[1], pair[1]))


def bits(a):
    return np.asarray(a, np.float64).view(np.int64)


@every_method
@given(n=counts, seed=small_seeds)
def test_square_points_equal_the_reference(method, n, seed):
    points = square_points(method, n, seed)
    assert points.shape == (n, 2)
    assert points.dtype == np.float64
    np.testing.assert_array_equal(bits(points), bits(reference.square(method, n, seed)))
    assert np.abs(points).max() <= 1


@every_method
@given(n=counts, seed=small_seeds, shell=radii)
def test_samples_equal_the_reference_and_lie_in_the_shell(method, n, seed, shell):
    r_min, r_max = shell
    samples = make_samples(method, n, seed, r_min, r_max)
    assert samples.shape == (n, 3)
    np.testing.assert_array_equal(bits(samples), bits(reference.samples(method, n, seed, r_min, r_max)))
    np.testing.assert_array_equal(bits(samples), bits(make_samples(method, n, seed, r_min, r_max)))
    r = [math.dist((0, 0, 0), p) for p in samples.tolist()]
    # The point of the sphere is off by sine's and cosine's 4.5e-16; subnormal radii by their steps.
    slack = 2e-15 * r_max + 2 * 5e-324
    assert r_min - slack <= min(r) <= max(r) <= (r_max + slack)


@every_method
@pytest.mark.parametrize("seed", [2**63, 2**64 - 1])
def test_seeds_reach_to_64_bits(method, seed):
    make_samples(method, 4, 3)  # a small seed before it must not matter
    want = reference.samples(method, 4, seed, 0.5, 1.0)
    np.testing.assert_array_equal(bits(make_samples(method, 4, seed, 0.5)), bits(want))


@given(n=st.integers(1, 300), seed=small_seeds)
def test_latin_has_one_point_in_each_row_and_column(n, seed):
    cells = np.floor((square_points("latin", n, seed) + 1) / 2 * n).astype(int)
    assert sorted(cells[:, 0].tolist()) == list(range(n))
    assert sorted(cells[:, 1].tolist()) == list(range(n))


@given(n=st.one_of(st.integers(1, 300), st.sampled_from([2, 3, 101, 251, 256, 289])), seed=small_seeds)
def test_jittered_has_one_point_in_each_cell(n, seed):
    rows = max(r for r in range(1, math.isqrt(n) + 1) if n % r == 0)
    columns = n // rows
    points = (square_points("jittered", n, seed) + 1) / 2
    cells = np.floor(points * [columns, rows]).astype(int)
    assert sorted(map(tuple, cells.tolist())) == [(i, j) for i in range(columns) for j in range(rows)]


@every_method
def test_seeds_and_methods_differ(method):
    first = make_samples(method, 8, 0)
    others = [make_samples(method, 8, seed) for seed in (1, 2**32, 2**62)]
    others += [make_samples(other, 8, 0) for other in METHODS if other != method]
    assert all(not np.any(first == other) for other in others)


@every_method
def test_a_shell_without_thickness(method):
    for radius in (0.0, 0.7, 1e-30, 1e30):
        r = np.sqrt(np.sum(make_samples(method, 20, 5, radius, radius) ** 2, axis=1))
        np.testing.assert_allclose(r, radius, rtol=2e-15)
    assert not make_samples(method, 3, 1, 0.0, 0.0).any()


@given(st.floats(-1, 1))
def test_the_poles_of_the_cylinder_map(xi2):
    assert ball.algorithm3(1.0, xi2) == (0, 0, 1)
    assert ball.algorithm3(-1.0, xi2) == (0, 0, -1)


def test_the_cylinder_map_by_hand():
    assert ball.algorithm3(0.0, 0.0) == (1, 0, 0)  # phi = 0
    assert ball.algorithm3(0.0, 0.5) == (0, 1, 0)  # phi = pi / 2
    assert ball.algorithm3(0.0, -0.5) == (0, -1, 0)
    assert ball.algorithm3(0.0, 1.0) == ball.algorithm3(0.0, -1.0) == (-1, 0, 0)
    assert ball.algorithm3(0.6, 0.5) == (0, 0.8, 0.6)
    assert ball.algorithm4(0.0, 0.0, 1.0, 0.0, 2.0, 4.0) == (0, 0, 2)
    assert ball.algorithm4(0.0, 0.0, 1.0, 1.0, 2.0, 4.0) == (0, 0, 4)
    assert ball.algorithm4(0.0, 1.0, 0.0, 19 / 56, 2.0, 4.0) == pytest.approx((0, 3, 0), rel=1e-15)  # r^3 = 8 + 19
    assert ball.algorithm4(0.0, 1.0, 0.0, 0.125, 0.0, 4.0) == (0, 2, 0)


@given(xi1=st.floats(-1, 1), xi2=st.floats(-1, 1), t=st.floats(0, 1), shell=radii)
def test_algorithms_3_and_4_equal_the_reference(xi1, xi2, t, shell):
    point = ball.algorithm3(xi1, xi2)
    np.testing.assert_array_equal(bits(point), bits(reference.algorithm3(xi1, xi2)))
    want = reference.algorithm4(*point, t, *shell)
    np.testing.assert_array_equal(bits(ball.algorithm4(*point, t, *shell)), bits(want))


@pytest.mark.parametrize(
    "arguments",
    [
        {"method": "sobel"},
        {"method": ""},
        {"n": 0},
        {"n": -3},
        {"seed": -1},
        {"seed": 2**64},
        {"r_min": 0.9, "r_max": 0.8},
        {"r_min": -0.1},
        {"r_min": math.nan},
        {"r_max": math.nan},
        {"r_max": math.inf},
        {"r_min": math.inf, "r_max": math.inf},
    ],
)
def test_what_is_refused(arguments):
    with pytest.raises(InputError):
        make_samples(**arguments)


# Distribution of 'random': chi-square of the direction over 8 x 8 cells of equal area, and Kolmogorov and Smirnov's
# distance of the radius cubed, at a false-alarm rate of 2.5e-7 each (5e-7 in all, for the one fixed seed).
POINTS = 20_000
CHI_SQUARE_63 = 136.36  # the upper 2.5e-7 quantile for 63 degrees of freedom
KS_DISTANCE = 2.8192 / math.sqrt(POINTS)  # sqrt(ln(2 / 2.5e-7) / 2): P(D > d) <= 2 exp(-2 n d^2) for every n (Massart)


def direction_statistic(points):
    """Chi-square of the directions over cells of equal height in z / r and equal width in azimuth: equal areas."""
    r = np.sqrt(np.sum(points**2, axis=1))
    band = np.minimum((points[:, 2] / r + 1) * 4, 7.5).astype(int)
    sector = np.minimum((np.arctan2(points[:, 1], points[:, 0]) / math.pi + 1) * 4, 7.5).astype(int)
    count = np.bincount(band * 8 + sector, minlength=64)
    expected = len(points) / 64
    return np.sum((count - expected) ** 2) / expected


def radius_statistic(points, r_min, r_max):
    """Largest distance between the distribution of r^3 and the uniform one on r_min^3 .. r_max^3."""
    cubes = np.sort(np.sum(points**2, axis=1) ** 1.5)
    uniform = (cubes - r_min**3) / (r_max**3 - r_min**3)
    steps = np.arange(len(points) + 1) / len(points)
    return max(np.max(steps[1:] - uniform), np.max(uniform - steps[:-1]))


@pytest.fixture(scope="module")
def random_points():
    return make_samples("random", POINTS, 1, 0.3, 1.0)


def test_random_points_are_uniform_in_the_shell(random_points):
    assert direction_statistic(random_points) < CHI_SQUARE_63
    assert radius_statistic(random_points, 0.3, 1.0) < KS_DISTANCE


def test_the_statistics_notice_wrong_samplers(random_points):
    u, phi, t = np.random.default_rng(7).random((3, POINTS)) * [[1], [2 * math.pi], [1]]
    z = np.cos(math.pi * u)  # the polar angle uniform instead of z
    polar = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], axis=1)
    assert direction_statistic(polar) > CHI_SQUARE_63
    direction = random_points / np.sqrt(np.sum(random_points**2, axis=1, keepdims=True))
    linear = direction * (0.3 + 0.7 * t)[:, None]  # r uniform instead of r^3
    assert radius_statistic(linear, 0.3, 1.0) > KS_DISTANCE
    same = direction * np.cbrt(0.027 + 0.973 * random_points[:, 2:3] ** 2)  # the radius tied to the direction
    assert radius_statistic(same, 0.3, 1.0) > KS_DISTANCE
