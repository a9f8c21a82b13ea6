"""Samplers in tests: each planted wrong one is caught, the right one is not."""

import numpy as np
import pytest
from refusals import is_refused
from scipy.stats import qmc
from wrong_samplers import draw

from lfssao.samples import METHODS, Sampler, sample_set
from lfssao.testing import assert_promise, assert_sampler, check_promise, check_sampler


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


def wrong(kind):
    return lambda n, seed: draw(n, seed, kind)


@pytest.mark.parametrize("kind", ["upper", "half", "r = t"])
def test_assert_notices_a_wrong_sampler_and_the_right_one_passes(kind):
    assert assert_sampler(draw) is None
    with pytest.raises(AssertionError, match=r"uniform \(ball\):\n(.|\n)*BROKEN"):
        assert_sampler(wrong(kind))
    with pytest.raises(AssertionError):
        assert check_sampler(wrong(kind), 64, 200)
    assert check_sampler(draw, 64, 200)


@pytest.mark.parametrize(("function", "words"), [
    (lambda n, seed: draw(n, 0), "repeated sets of 200 .*: 199, at most 0: BROKEN"),
    (lambda n, seed: 1.1 * draw(n, seed), r"inside \(ball\):\nhow far a point lies outside, in radii, worst in set"),
    (lambda n, seed: np.repeat(draw(n // 2, seed), 2, axis=0), r"distinct \(ball\)"),
])  # fmt: skip
def test_assert_checks_more_than_evenness(function, words):
    with pytest.raises(AssertionError, match=words):
        assert_sampler(function)


@pytest.mark.parametrize(("call", "words"), [
    (lambda: assert_sampler(draw, 64, 1), "1 set of 64 points cannot tell whether uniform holds: give more seeds"),
    (lambda: assert_sampler(draw, 8, range(3)), "3 sets of 8 points cannot tell whether uniform holds"),
    (lambda: assert_sampler(wrong("upper"), 8, 1), "1 set of 8 points cannot tell"),
    (lambda: assert_sampler(draw, 64, 200, promises=["unbiased"]), "cannot tell whether unbiased holds"),
    (lambda: assert_sampler(draw, promises="uniform"), "promises is 'uniform', it must be a list of names"),
    (lambda: assert_sampler(draw, promises=["even"]), "there is no promise 'even'"),
    (lambda: assert_sampler(draw, domain="bal"), r"did you mean 'ball'"),
    (lambda: assert_sampler(5), r"the sampler is 5, it must take \(n, seed\)"),
    (lambda: assert_sampler(lambda n: draw(n, 0)), r"it must take \(n, seed\).*too many positional"),
    (lambda: assert_sampler(lambda n, seed: None), "the set of seed 0 is None, expected numbers"),
    (lambda: assert_sampler(lambda n, seed: draw(n + 1, seed)), r"of seed 0 has shape \(65, 3\), expected 64 points"),
])  # fmt: skip
def test_assert_refuses_to_pass_what_it_cannot_tell(call, words):
    assert is_refused(call, words)


def test_engines_are_asserted_on_the_square():
    assert_sampler(qmc.Sobol(2, rng=1))
    with pytest.raises(AssertionError, match=r"uniform \(square\)"):
        assert_sampler(lambda n, seed: np.random.default_rng(seed).random((n, 2)) ** 2, domain="square", bounds=(0, 1))


def test_points_from_0_to_1_get_a_hint_where_they_break_a_promise():
    def unit(n, seed):
        return np.random.default_rng(seed).random((n, 2))

    with pytest.raises(AssertionError, match=r"all points lie in \[0, 1\].*bounds=\(0, 1\)"):
        assert_sampler(unit, domain="square")
    assert_sampler(unit, domain="square", bounds=(0, 1))
    assert check_promise("uniform", 2 * unit(64, 0) ** 4 - 1, "square").hint == ""


def test_findings_are_true_where_all_hold_and_tell():
    half = np.array([[-0.5, 0.5], [0.5, 0.5]])
    kept, broken = (check_promise("latin", points, "square") for points in (half * [[1, -1], [1, 1]], half))
    assert [bool(finding) for finding in kept] == [True, True]
    assert [bool(finding) for finding in broken] == [True, False]
    assert (bool(kept), bool(broken)) == (True, False)
    assert str(broken).count("\n") == 1
    unsure = check_promise("uniform", draw(8, 1), "ball")
    assert (unsure.holds, unsure.tells, bool(unsure)) == (True, False, False)


def test_an_array_of_sets_is_pooled():
    sets = np.stack([draw(64, seed) for seed in range(50)])
    assert str(check_promise("uniform", sets, "ball")) == str(check_promise("uniform", list(sets), "ball"))
    assert check_promise("distinct", sets, "ball")[0].worst is not None
