"""Causes: a change is told once of all textures that it explains, with those that explain them as well."""

from dataclasses import replace

import pytest

from lfssao.verify.compare.causes import causes_of
from lfssao.verify.compare.result import Result
from lfssao.verify.diagnosis.change import Candidate
from lfssao.verify.diagnosis.diagnose import Diagnosis
from lfssao.verify.verdict import Verdict

BIAS = Candidate("depth bias", (-1e-3,), "depth - 0.001", 1.0, 1.0, 0.9)
OFFSET = Candidate("ROI offset in z", (1e-3,), "ROI offset in z + 0.001 m", 1.0, 1.0, 0.9)
SHIFT = Candidate("shift of u", (0.5,), "u shifted by 0.500 texels", 0.99, 0.9, 0.9)


def result(module, layer, *candidates, equal=1, wrong=100, left_out=0):
    diagnosis = Diagnosis(True, candidates, equal, 0.9, 1000, wrong, left_out=left_out)
    return Result(module, layer, Verdict.OUTSIDE, diagnosis=diagnosis)


def test_changes_that_tie_are_told_together():
    tied = [result(f"module_00{k}", "ao_1", BIAS, OFFSET, SHIFT, equal=2) for k in range(2)]
    (cause,) = causes_of(tied)
    assert (cause.kind, cause.equal) == ("depth bias", ("ROI offset in z",))
    words = "depth - 0.001, or ROI offset in z + 0.001 m, explains ao_1 of 2 modules"
    assert cause.words == f"{words} (90.00 % of 200 wrong texels, all decided)"
    assert "depth - 0.001, or ROI offset in z + 0.001 m, explains 90.00 %" in tied[0].diagnosis.words("M")


def test_three_changes_that_tie_are_told_in_a_row():
    tied = result("module_000", "ao_1", BIAS, OFFSET, SHIFT, equal=3)
    row = "depth - 0.001, or ROI offset in z + 0.001 m, or u shifted by 0.500 texels, explains"
    assert tied.diagnosis.words("M").startswith(row)
    (cause,) = causes_of([tied])
    assert cause.words.startswith(row)


@pytest.mark.parametrize(("second", "words"), [
    (result("module_001", "ao_1", BIAS), "depth - 0.001 explains ao_1 of 2 modules"),  # does not know the other
    (result("module_001", "ao_1", replace(OFFSET, values=(2e-3,)), BIAS, equal=2), "depth - 0.001 explains"),
    (result("module_001", "depth", OFFSET), "ROI offset in z + 0.001 m explains AO and depth of 2 modules"),
])  # fmt: skip
def test_what_one_texture_excludes_is_not_told(second, words):
    (cause,) = causes_of([result("module_000", "ao_1", BIAS, OFFSET, equal=2), second])
    assert cause.words.startswith(words)
    assert cause.equal == ()


def test_a_cause_of_many_textures_tells_how_many_texels_it_decides_and_leaves_out():
    half = replace(BIAS, decided=0.6, explained=0.6)
    (cause,) = causes_of([result("module_000", "ao_1", BIAS, wrong=300), result("module_001", "ao_1", half)])
    assert cause.words.endswith("ao_1 of 2 modules (82.50 % of 400 wrong texels, 90.00 % decided)")
    (cause,) = causes_of([result(f"module_00{k}", "ao_1", BIAS, left_out=k) for k in (3, 4)])
    assert cause.words.endswith("200 wrong texels, all decided, without 7 of which a sample leaves the texture)")


@pytest.mark.parametrize(("fits", "candidates", "words"), [
    (True, (BIAS,), "depth - 0.001 explains 90.00 % of the 100 wrong texels of M and decides all"),
    (False, (BIAS,), "no change that was tried explains the 100 wrong texels of M"),
    (False, (), "no setting of the reference comes near M (best 0.00 % of 100 wrong texels"),
])  # fmt: skip
def test_texels_left_out_are_told_whether_the_others_have_a_cause_or_none(fits, candidates, words):
    for left_out in (0, 5):
        told = Diagnosis(fits, candidates, 1, 0.9, 1000, 100, left_out=left_out).words("M")
        assert told.startswith(words)
        assert told.count("without 5 of which a sample leaves the texture)") == (left_out > 0)


def test_of_changes_that_explain_as_many_textures_one_of_the_view_comes_first():
    view = replace(SHIFT, shared=True)
    results = [
        result("module_000", "ao_1", BIAS),
        result("module_001", "ao_1", BIAS, view),
        result("module_002", "ao_1", view),
    ]
    assert [cause.kind for cause in causes_of(results)] == [view.kind, BIAS.kind]
    assert [cause.kind for cause in causes_of([*results, result("module_003", "ao_1", BIAS)])] == [BIAS.kind, view.kind]
