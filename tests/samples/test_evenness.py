"""Promises of all sets together: samplers that keep them pass, each wrong one is found; what the statistics say."""

import numpy as np
import pytest

from lfssao.errors import InputError
from lfssao.samples import Sampler, sample_set
from lfssao.testing import assert_sampler, check_promise, check_sampler

SETS = 40


def of(name, domain="square"):
    return lambda n, seed: sample_set(domain, name, n, seed).points


def shuffled(n, seed):
    """Points in another order: the first of them are no net."""
    order = np.random.default_rng(seed).permutation(n)
    return of("owen-burley")(n, seed)[order]


def one_axis(n, seed):
    """Even along xi_1, independent along xi_2."""
    points = of("latin")(n, seed).copy()
    points[:, 1] = np.random.default_rng(seed).uniform(-1, 1, n)
    return points


def half_as_bright(n, seed):
    """Poisson sets, half of whose points are replaced by independent ones."""
    points = of("poisson")(n, seed).copy()
    points[::2] = np.random.default_rng(seed).uniform(-1, 1, points[::2].shape)
    return points


KEPT = [("progressive", "sobol", 16), ("progressive", "owen-burley", 64), ("projections", "latin", 8),
        ("projections", "owen-burley", 64), ("projections", "sobol", 16), ("blue", "poisson", 64)]  # fmt: skip
WRONG = [
    ("progressive", of("random"), 16), ("progressive", of("latin"), 16), ("progressive", of("jittered"), 16),
    ("progressive", shuffled, 64), ("projections", of("random"), 8), ("projections", of("jittered"), 64),
    ("projections", one_axis, 16), ("blue", of("random"), 64), ("blue", of("latin"), 64), ("blue", of("jittered"), 64),
    ("blue", of("owen-burley"), 64), ("blue", half_as_bright, 64),
]  # fmt: skip


@pytest.mark.parametrize(("promise", "name", "n"), KEPT)
def test_samplers_that_keep_a_promise_pass(promise, name, n):
    assert_sampler(of(name), n, 3 * SETS, "square", promises=[promise])


@pytest.mark.parametrize(("promise", "sampler", "n"), WRONG)
def test_samplers_without_it_are_refused(promise, sampler, n):
    with pytest.raises(AssertionError, match=rf"{promise} \(square\):\n(.|\n)*BROKEN"):
        assert_sampler(sampler, n, SETS, "square", promises=[promise])


@pytest.mark.parametrize("domain", ["sphere", "ball", "disk"])
def test_projections_are_those_of_coordinates_that_keep_volumes(domain):
    assert_sampler(of("owen-burley", domain), 16, SETS, domain, promises=["projections"])
    with pytest.raises(AssertionError, match="unevenness of"):
        assert_sampler(of("random", domain), 16, SETS, domain, promises=["projections"])


@pytest.mark.parametrize(
    ("promise", "n", "sets"), [("progressive", 3, 9), ("progressive", 8, 5), ("blue", 8, 20), ("projections", 4, 1)]
)
def test_too_few_points_cannot_tell(promise, n, sets):
    found = check_sampler(of("owen-burley"), n, sets, promise, domain="square")
    assert not found.tells
    assert "cannot tell" in str(found)


def test_independent_points_keep_projections_no_more_often_than_is_said():
    random = np.random.default_rng(0)
    alarm = 0.05
    n = 8
    found = [check_promise("projections", random.uniform(-1, 1, (4, n, 2)), "square", alarm=alarm) for _ in range(400)]
    assert all(each.tells for each in found)
    assert sum(each.holds for each in found) <= 400 * alarm


def test_sets_of_several_sizes_and_engines():
    with pytest.raises(InputError, match="one number of points"):
        check_promise("blue", [of("poisson")(8, 0), of("poisson")(9, 0)], "square")
    assert check_sampler(Sampler("owen-burley", 1), 16, 1, "progressive")[0].value == 0
