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


def result(module, layer, *candidates, equal=1, wrong=100):
    diagnosis = Diagnosis(True, candidates, equal, 0.9, 1000, wrong)
    return Result(module, layer, Verdict.OUTSIDE, diagnosis=diagnosis)


def test_changes_that_tie_are_told_together():
    tied = [result(f"module_00{k}", "ao_1", BIAS, OFFSET, SHIFT, equal=2) for k in range(2)]
    (cause,) = causes_of(tied)
    assert (cause.kind, cause.equal) == ("depth bias", ("ROI offset in z",))
    words = "depth - 0.001, or ROI offset in z + 0.001 m, explains ao_1 of 2 modules (90.00 % of 200 wrong texels)"
    assert cause.words == words
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
