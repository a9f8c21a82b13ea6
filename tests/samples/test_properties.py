"""Promises of point sets: each planted wrong sampler is caught, the right one is not; what is refused."""

import math

import numpy as np
import pytest

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
