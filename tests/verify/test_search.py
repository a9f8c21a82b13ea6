"""The search of a diagnosis: an explanation predicts, and its values read as changes."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from lfssao.verify.diagnosis.change import Axis, Change, Problem, fixed, pair, scaled
from lfssao.verify.diagnosis.search import Sample, Search

RIGHT = np.linspace(0.2, 0.9, 400)


@dataclass(frozen=True, eq=False, kw_only=True)
class Line(Problem):
    """Numbers that are right within a width, times a factor."""

    factor: float = 1.0
    width: float = 1e-4
    wide: object = None  # texels whose interval is everything; none by default

    def ends(self):
        made = self.factor * RIGHT[self.columns]
        low = made - self.width
        high = made + self.width
        if self.wide is not None:
            low[self.wide], high[self.wide] = -np.inf, np.inf
        return low, high

    def changes(self):
        return []


def sample(mine, **fields):
    places = np.arange(len(RIGHT))
    problem = Line(mine=mine, columns=places, rows=0 * places, interval_width=0 * RIGHT, excess=0 * RIGHT, **fields)
    low, high = problem.interval()
    wrong = (mine < low) | (mine > high)
    return Sample(problem, wrong, np.full(len(RIGHT), 1 / len(RIGHT)), int(wrong.sum()), np.arange(len(RIGHT)))


def test_a_change_that_decides_nothing_explains_nothing():
    texels = sample(1.1 * RIGHT)
    nothing = texels.trial(fixed("anything goes", wide=slice(None)), ())
    assert (nothing.left, nothing.decided, texels.fits(nothing)) == (0.0, 0.0, False)
    right = texels.trial(fixed("factor", factor=1.1), ())
    assert (right.left, right.decided, right.explained, texels.fits(right)) == (0.0, 1.0, 1.0, True)
    assert right.cost < 1e-6
    assert nothing.cost > 0.2


@pytest.mark.parametrize(("open_texels", "fits"), [(190, True), (210, False)])
def test_most_of_the_wrong_texels_have_to_be_decided(open_texels, fits):
    texels = sample(1.1 * RIGHT)
    change = fixed("factor", factor=1.1, wide=slice(open_texels))
    trial = texels.trial(change, ())
    assert trial.decided == pytest.approx(1 - open_texels / 400)
    assert texels.fits(trial) is fits


def test_an_interval_as_wide_as_the_deviation_decides_nothing():
    texels = sample(RIGHT + 0.01)
    off = texels.deviation[0]
    for width, decided in ((0.49 * off, 1.0), (0.51 * off, 0.0)):
        moved = fixed("bias", value=lambda x: x + 0.01, width=width)
        assert texels.trial(moved, ()).decided == decided


def test_what_a_change_makes_wrong_counts_against_it():
    mine = np.where(np.arange(400) < 40, 1.1 * RIGHT, RIGHT)
    texels = sample(mine)
    trial = texels.trial(fixed("factor", factor=1.1), ())
    assert trial.explained == 1.0
    assert texels.fits(trial) is False
    assert texels.gain(trial) == pytest.approx(1 - 360 / 40)


def test_other_texels_weigh_less_if_most_texels_are_wrong():
    """Shares of many samples change at nearly all texels: a change that is nearly right makes the others wrong."""
    number = np.arange(400)
    is_wrong = np.arange(400) < 200
    texels = sample(np.where(is_wrong, 1.1 * RIGHT, RIGHT))
    nearly = fixed("nearly", value=lambda x: np.where(number < 100, 1.1, np.where(is_wrong, 1.08, 1.02)) * x)
    nothing = fixed("nothing", factor=1.0)
    assert texels.trial(nearly, ()).cost > texels.trial(nothing, ()).cost
    most = replace(texels, weights=np.where(is_wrong, 0.95, 0.05) / 200)
    assert most.trial(nearly, ()).cost < most.trial(nothing, ()).cost


def test_a_trial_is_made_once():
    texels = sample(1.1 * RIGHT)
    made = []
    change = Change("spy", lambda problem, _: made.append(problem) or problem, "spy")
    assert texels.trial(change, ()) is texels.trial(change, ())
    assert len(made) == 1


@pytest.mark.parametrize(("number", "fits"), [(5, False), (6, True)])
def test_few_texels_tell_no_cause(number, fits):
    mine = np.where(np.arange(400) < number, 1.1 * RIGHT, RIGHT)
    texels = sample(mine)
    assert (
        texels.fits(texels.trial(fixed("some", value=lambda x: np.where(np.arange(400) < number, 1.1 * x, x)), ()))
        is fits
    )


@pytest.mark.parametrize(("number", "fits"), [(11, False), (12, True)])
def test_two_values_need_twice_as_many(number, fits):
    texels = sample(np.where(np.arange(400) < number, 1.1 * RIGHT + 0.1, RIGHT))

    def apply(problem, values):
        factor, bias = values
        return problem.changed(value=lambda x: np.where(np.arange(400) < number, factor * x + bias, x))

    axes = Axis(1e-5, 1.0, factor=True), Axis(1e-5, 1.0)
    change = Change("line", apply, "{} {}", axes)
    assert texels.fits(texels.trial(change, (float(np.log(1.1)), 0.1))) is fits


@pytest.mark.parametrize("number", [20, 200])
def test_changes_tie_if_two_wrong_texels_tell_them_apart(number):
    def moved(first):
        return np.where(np.arange(400) < first, 1.1 * RIGHT, RIGHT)

    texels = sample(moved(number))
    whole, tied, worse = (
        texels.trial(fixed("some", value=lambda x, n=n: x * moved(n) / RIGHT), ())
        for n in (number, number - 2, number - 3)
    )
    assert texels.equals(whole, tied)
    assert not texels.equals(whole, worse)


@pytest.mark.parametrize(("planted", "fits"), [(1.003, True), (0.71, True), (1.9, True), (3.9, False)])
def test_a_value_is_found_and_one_at_the_end_of_its_range_is_none(planted, fits):
    texels = sample(planted * RIGHT)
    change = scaled("factor", lambda p, f: p.changed(factor=f), Axis(1e-5, float(np.log(2.0)), factor=True))
    best = Search(texels, texels, texels, [change]).best()[0]
    assert texels.fits(best) is fits
    if fits:
        assert best.change.values(best.steps)[0] == pytest.approx(planted, rel=1e-3)


@pytest.mark.parametrize(("axis", "step", "text"), [
    (Axis(1e-9, 1.0, factor=True), np.log1p(2e-4), "1.000200"),
    (Axis(1e-9, 1.0, factor=True), np.log1p(-2.5e-6), "0.99999750"),
    (Axis(1e-9, 1.0, factor=True), np.log(2.5), "2.5000"),
    (Axis(1e-9, 1.0, signed=False), -0.31, "-0.310"),
    (Axis(1e-9, 1.0, signed=False), -0.00031, "-0.000310"),
    (Axis(1e-9, 1.0), -0.002, "- 0.002"),
    (Axis(1e-9, 1.0), 1.23456e-5, "+ 1.235e-05"),
])  # fmt: skip
def test_a_value_reads_as_a_change(axis, step, text):
    assert axis.text(float(step)) == text


def test_a_name_with_braces_is_told_as_it_is():
    """Other views are named by their folders, which may have any name."""
    braces = fixed("the depth of left of a{b}")
    assert braces.text(()) == "the depth of left of a{b}"
    joined = pair(braces, scaled("factor", lambda p, f: p, Axis(1e-5, 1.0)))
    assert joined.text((0.5,)) == "the depth of left of a{b} and factor x + 0.5"


def test_two_changes_at_once_are_found_if_one_explains_half():
    mine = np.where(np.arange(400) < 260, 1.3 * RIGHT, 1.3 * RIGHT + 0.2)
    texels = sample(mine)
    steep = fixed("steep", factor=1.3)
    step = fixed("step", value=lambda x: x + 0.2 * (np.arange(400) >= 260))
    search = Search(texels, texels, texels, [steep, step, fixed("flat", factor=0.0)])
    pair = search.paired(search.best()[0])
    assert (pair.change.kind, texels.fits(pair)) == ("steep and step", True)
    assert search.paired(texels.trial(step, ())) is None
