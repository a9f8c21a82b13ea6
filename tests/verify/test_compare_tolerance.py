"""Tolerances of ``lfssao compare``: which texels and textures pass by them, and how that is told."""

import json
from xml.etree import ElementTree

import numpy as np
import pytest
from compare_folders import changed, compare, different, poke, single

import lfssao
from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.compare.result import Tolerance
from lfssao.verify.verdict import Judgement, Verdict


@pytest.mark.parametrize(("words", "code"), [
    ("", 2), ("--fail 0.25", 1), ("--fail 0.2", 2), ("--fail-percent 3", 1), ("--fail-percent 2.9", 2),
    ("--fail 0.125 --fail-percent 1", 1), ("--fail 0.125 --fail-percent 0.9", 2), ("--fail 0 --fail-percent 0", 2),
])  # fmt: skip
@pytest.mark.parametrize("farthest", [0.25, np.nan, -np.inf])
def test_texels_fail_by_their_difference_and_textures_by_their_share(tmp_path, capsys, words, code, farthest):
    """100 texels, of which two differ by 1/8 and one by more, or is no number: no difference allows that."""
    right = np.ones((10, 10), np.float32)
    mine = right.copy()
    mine[2, 3:6] += (0.125, -0.125, farthest)
    files = tmp_path / "mine.npy", tmp_path / "right.npy"
    np.save(files[0], mine)
    np.save(files[1], right)
    code = 2 if words == "--fail 0.25" and farthest != 0.25 else code
    assert compare(*files, *words.split()) == code
    assert ("warning: right, image: within tolerance, 3 of 100 " in capsys.readouterr().out) == (code == 1)
    assert compare(files[1], files[1], *words.split()) == 0


def test_only_texels_beyond_their_interval_count():
    right = np.zeros((2, 4), np.float32)
    mine = np.float32([[0.25] * 4, [100, 0, 0, 0]])
    judged = [
        Judgement(Verdict.OUTSIDE, "", mine != right, mine == 0.25, Bounds(right, right, outliers=n)) for n in (0, 4)
    ]
    assert Tolerance(0.25).judge(judged[0], (mine,), (right,)) == (Verdict.WITHIN, 0)
    assert Tolerance(0.125, 49).judge(judged[0], (mine,), (right,)) == (Verdict.OUTSIDE, 4)
    assert Tolerance(0.125).judge(judged[1], (mine,), (right,)) == (Verdict.WITHIN, 4)


def test_all_reports_tell_what_passes_by_tolerances(tmp_path, capsys, reference):
    near = float(single(reference, "module_004", "ao_2")[16, 24, 0]) + 0.2
    mine = changed(reference, tmp_path / "mine", "module_004", poke("ao_2", (16, 24), near))
    assert compare(mine, reference, "--fail", "0.25", "--json", tmp_path / "json", "--junit", tmp_path / "xml") == 1
    text = capsys.readouterr().out
    assert "tolerances --fail 0.25 --fail-percent 0\n" in text
    assert "module_004, ao_2: within tolerance, 1 of 1536 texels are outside, 0 by more than is tolerated" in text
    report = lfssao.compare(mine, reference, fail=0.25, page=True)
    words = report.textures.kept["module_004", "ao_2"]["words"]
    assert words == ["equal bits", "inside the interval", "outside the interval"]
    assert different(report) == {("module_004", "ao_2"): Verdict.WITHIN}
    assert report.summary()[5][:6] == ["ao_2", "2", "0", "1", "0", "0"]
    assert all(word in report._repr_html_() for word in ("tolerances --fail 0.25", "<th>tolerated</th>"))
    found = json.loads((tmp_path / "json").read_text())
    assert [found[name] for name in ("fail", "fail_percent", "exit_code", "first_failure")] == [0.25, 0, 1, None]
    (told,) = (r for r in found["results"] if r["exit_code"])
    assert (told["verdict"], told["beyond"], told["interval"], told["diagnosis"]) == ("within tolerance", 0, True, None)
    suites = ElementTree.parse(tmp_path / "xml").getroot()
    assert {s.get("failures") + s.get("errors") for s in suites} == {"00"}
    assert [said.text[:16] for said in suites.iter("system-out")] == ["within tolerance"]
    # Whatever fails comes first, though in a later module.
    report = lfssao.compare(
        changed(mine, tmp_path / "b", "module_005", poke("ao_2", (16, 24), 9)), reference, fail=0.25
    )
    assert (report.exit_code, report.first_failure.module, report.panels.module) == (2, "module_005", "module_005")
    assert "worst texels (column, row) of module_005, ao_2:" in str(report)
