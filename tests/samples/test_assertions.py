"""Samplers in tests: each planted wrong one is caught, the right one is not."""

import pytest
from scipy.stats import qmc
from wrong_samplers import draw

from lfssao.samples import METHODS, Sampler, sample_set
from lfssao.testing import assert_promise, check_promise, check_sampler


@pytest.mark.parametrize(("wrong", "found"), [
    ("upper", "share of z > 0, less 1/2"),
    ("r = t", "Kolmogorov-Smirnov distance of r^3"),
    ("half", "Kuiper distance of phi"),
])  # fmt: skip
def test_eight_points_of_a_hundred_seeds_tell_and_those_of_one_do_not(wrong, found):
    findings = check_sampler(lambda n, seed: draw(n, seed, wrong), 8, 100)
    assert found in [finding.what for finding in findings if not finding.holds]
    assert all(finding.holds and finding.tells for finding in check_sampler(draw, 8, 100))
    for finding in check_promise("uniform", draw(8, 0, wrong), "ball"):
        assert ": cannot tell at n = 8: " in str(finding)


@pytest.mark.parametrize("name", [name for name, made in METHODS["ball"].items() if "unbiased" in made.promises])
def test_more_even_sets_alarm_more_rarely(name):
    findings = check_sampler(lambda n, seed: sample_set("ball", name, n, seed).points, 8, 100, alarm=0.01)
    assert all(finding.holds for finding in findings), findings


@pytest.mark.parametrize("engine", [qmc.Sobol(2, rng=1), qmc.LatinHypercube(2, rng=1), Sampler("halton", 1)])
def test_engines_of_scipy_are_samplers_of_the_square(engine):
    found = check_sampler(engine, 16, 60)
    assert all(finding.holds for finding in found)
    assert found[-1].what == "chi-square over 8^2 equal cells"


def test_a_broken_promise_is_an_assertion_in_words():
    points = [draw(8, seed, "upper") for seed in range(100)]
    with pytest.raises(AssertionError, match=r"uniform \(ball\)(.|\n)*z > 0, less 1/2: 0.5, p = .*: BROKEN"):
        assert_promise("uniform", points, "ball")
    assert_promise("uniform", [draw(8, seed) for seed in range(100)], "ball")
    with pytest.warns(UserWarning, match="cannot tell at n = 8: one half of z with all of the points may pass"):
        assert_promise("uniform", draw(8, 1), "ball")
