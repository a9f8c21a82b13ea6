"""Promises of point sets: each planted wrong sampler is caught, the right one is not; what is refused."""

import math
import re

import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc
from wrong_samplers import draw, on_sphere

from lfssao.errors import InputError
from lfssao.samples import METHODS, sample_set
from lfssao.testing import PROMISES, check_promise

N = 8000
U = np.random.default_rng(7).random((N, 3))  # independent numbers on (0, 1) from another generator than ours


def broken(promise, points, domain, weights=None, **shell):
    return [f.what for f in check_promise(promise, points, domain, weights, **shell) if not f.holds]


# Planted wrong samplers


def test_the_right_sampler_is_not_caught():
    """False alarms: 1e-6 each, for one fixed seed."""
    directions = on_sphere(2 * U[:, 0] - 1, 2 * np.pi * U[:, 1])
    radius = np.cbrt(0.3**3 + (1 - 0.3**3) * U[:, 2:])
    assert not broken("uniform", directions, "sphere")
    assert not broken("uniform", directions * radius, "ball", r_min=0.3)
    assert not broken("uniform", 2 * U[:, :2] - 1, "square")
    disk = np.sqrt(U[:, :1]) * np.column_stack([np.cos(2 * np.pi * U[:, 1]), np.sin(2 * np.pi * U[:, 1])])
    assert not broken("uniform", disk, "disk")


def test_theta_uniform_instead_of_z_is_caught():
    points = on_sphere(np.cos(np.pi * U[:, 0]), 2 * np.pi * U[:, 1])
    assert {"share of abs(z) > 0.9, less 1/10", "spherical cap discrepancy"} <= set(broken("uniform", points, "sphere"))
    assert broken("uniform", points * np.cbrt(U[:, 2:]), "ball")


def test_r_uniform_instead_of_its_power_is_caught():
    directions = on_sphere(2 * U[:, 0] - 1, 2 * np.pi * U[:, 1])
    turn = 2 * np.pi * U[:, 1]
    assert broken("uniform", directions * (0.8 + 0.2 * U[:, 2:]), "ball", r_min=0.8)
    assert broken("uniform", U[:, :1] * np.column_stack([np.cos(turn), np.sin(turn)]), "disk")


def test_coordinates_that_depend_on_each_other_are_caught_by_chi_square_alone():
    tied = np.column_stack([U[:, 0], (U[:, 0] + 0.1 * U[:, 1]) % 1]) * 2 - 1
    found = broken("uniform", tied, "square")
    assert found == ["chi-square over 16^2 equal cells"]


# Few points, many sets


@pytest.mark.parametrize("alarm", [1e-6, 0.05, 0.999])
@pytest.mark.parametrize("domain", METHODS)
def test_eight_points_alone_are_never_said_to_hold(domain, alarm):
    findings = check_promise("uniform", sample_set(domain, "random", 8).points, domain, alarm=alarm)
    assert all("holds" not in str(finding) for finding in findings)


def test_each_statistic_alarms_at_its_rate():
    """1000 sets of 200: 5 % are 50, 4 sigma 28; shares of n are discrete, caps an upper limit: they may be below."""
    sets = [check_promise("uniform", draw(200, seed), "ball", alarm=0.05) for seed in range(1000)]
    for column in zip(*sets, strict=True):
        count = sum(finding.p < 0.05 for finding in column)
        assert (0 if "share" in column[0].what or "cap" in column[0].what else 22) <= count <= 78, column[0].what
    assert sum(not all(finding.holds for finding in findings) for findings in sets) <= 78


def test_the_power_of_chi_square_is_that_of_all_its_cells():
    text = str(check_promise("uniform", 2 * U[:, :2] - 1, "square", alarm=0.03)[-1])
    share = float(re.search(r"coordinate with (.*)% of", text)[1]) / 100
    power = stats.ncx2.sf(stats.chi2.isf(0.01, 255), 255, N * (2 * share - 1) ** 2)
    assert power == pytest.approx(0.9, abs=0.03)  # the share is printed to a tenth of a per cent


def test_many_sets_are_pooled_or_judged_by_the_worst():
    sets = [sample_set("square", "latin", 8, seed).points for seed in range(20)]
    assert not broken("latin", sets, "square")
    found = check_promise("latin", [*sets[:3], sets[3] * 0.5, *sets[4:]], "square")
    assert {(finding.worst, finding.holds) for finding in found} == {(3, False)}
    assert "worst in set 3: " in str(found[0])
    table = sample_set("ball", "repulsion", 8)
    found = check_promise("weights", [table.points] * 2, "ball", [table.weights, table.weights * 2])
    assert [(finding.worst, finding.holds) for finding in found] == [(1, True), (1, False)]
    assert broken("uniform", [sets[0], *sets], "square") == [
        "repeated sets of 21 (limits are those of independent points, safe for more even sets)"
    ]


def test_unbiased_takes_one_point_of_each_set():
    """Points of a set stand together here, which 'uniform' finds."""
    rng = np.random.default_rng(2)
    clumps = list(np.clip(rng.uniform(-1, 1, (300, 1, 2)) + rng.uniform(-1e-3, 1e-3, (300, 8, 2)), -1, 1))
    assert not broken("unbiased", clumps, "square")
    assert broken("uniform", clumps, "square")


def test_bounds_are_the_coordinates_at_the_ends():
    assert not broken("uniform", U[:, :2], "square", bounds=(0, 1))
    assert broken("uniform", U[:, :2], "square")
    assert not broken("inside", draw(50, 1) * 3, "ball", bounds=(-3, 3))


def test_every_exact_promise_notices_a_set_without_it():
    random = sample_set("square", "random", 1024, 5).points
    for promise in ("stratified", "rows", "latin", "net", "low-discrepancy", "poisson"):
        assert broken(promise, random, "square"), promise
    assert not broken("distinct", random, "square")
    random[5] = random[400]
    assert broken("distinct", random, "square") == ["points that repeat another"]
    latin = sample_set("square", "latin", 64, 3).points
    latin[10, 1] = latin[20, 1]
    assert broken("latin", latin, "square") == ["rows without exactly one point"]
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


def radical_inverses(n, base):
    """The first n numbers of van der Corput's sequence."""
    digits = np.arange(n)[:, None] // base ** np.arange(13) % base
    return (digits / base ** np.arange(1.0, 14.0)).sum(axis=1)


def halton(n, *bases):
    return np.stack([radical_inverses(n, base) for base in bases], axis=1)


def hammersley(n):
    return np.stack([np.arange(n) / n, radical_inverses(n, 2)], axis=1)


def roberts(n):
    """R2: steps by powers of the plastic number, the real root of x^3 = x + 1."""
    plastic = np.roots([1, 0, -1, -1]).real.max()
    return (0.5 + np.arange(n)[:, None] / plastic ** np.array([1, 2])) % 1


@pytest.mark.parametrize("n", [16, 31, 34, 64, 100, 120, 256, 400, 1024])
def test_low_discrepancy_is_that_of_low_discrepancy_sets_alone(n):
    owen = qmc.Sobol(2, rng=n).random(1024)[:n]
    for points in (halton(n, 2, 3), halton(n, 2, 3) + 0.5 / n, hammersley(n), roberts(n), owen, halton(n, 3, 5)):
        assert not broken("low-discrepancy", points, "square", bounds=(0, 1))
    uniform = np.random.default_rng(n).random((n, 2)) ** 2
    for points in (halton(n, 17, 19), halton(n, 29, 31), uniform):
        assert broken("low-discrepancy", points, "square", bounds=(0, 1))


def test_the_limit_of_low_discrepancy_is_2_4_times_that_of_hammersleys_set():
    for n in (1, 16, 128):
        (found,) = check_promise("low-discrepancy", hammersley(n), "square", bounds=(0, 1))
        assert found.limit == pytest.approx(2.4 * found.value, rel=1e-9)


def test_every_promise_of_the_registry_is_a_check_that_some_test_here_breaks():
    promised = {promise for methods in METHODS.values() for method in methods.values() for promise in method.promises}
    assert promised <= set(PROMISES)
    assert set(PROMISES) - promised == {"uniform"}  # for files: methods promise 'unbiased'


@pytest.mark.parametrize(("arguments", "words"), [
    (("latn", [[0, 0]], "square"), "did you mean 'latin'"),
    (("latin", [[0, 0]], "sqare"), "did you mean 'square'"),
    (("latin", [[0, 0, 1]], "ball"), "not of the ball"),
    (("inside", [[0, 0, 1]], "square"), r"expected \(n, 2\)"),
    (("inside", np.empty((0, 2)), "square"), "n >= 1"),
    (("inside", [[0, 0], [math.nan, 0]], "square"), "point 1 is not finite"),
    (("inside", [[0, 0, 1]], "ball", None, 0.9, 0.8), "r_min"),
    (("inside", [[0, 0, 1]], "ball", None, 0.0, 0.0), "r_max"),
    (("weights", [[0, 0, 1]], "ball", [1, 1]), "weights of shape"),
    (("inside", [[0, 0]], "square", None, 0.0, 1.0, 0.0, (1, 0)), "the range is 1 to 0"),
    (("uniform", [[0, 0]], "square", None, 0.0, 1.0, 0.0, (0, 1), 1.0), "alarm is 1.0"),
])  # fmt: skip
def test_what_is_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        check_promise(*arguments)
