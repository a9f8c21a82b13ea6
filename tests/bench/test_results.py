"""The page of results: it is what its numbers give, its links lead somewhere, its verdicts follow the numbers."""

import copy
import json
import re
from itertools import product

import error_parts
import numpy as np
import papers_lf
import papers_page
import pytest
import results
from papers_common import PAPERS, RESULTS

import lfssao
from lfssao.bench.work_precision.advise import COMMITTED, ERRORS, advice, read_result
from lfssao.bench.work_precision.page import as_text

MEASURED = json.loads((RESULTS / "papers.json").read_text())
PAGE = results.PAGE.read_text()


def test_the_page_is_what_its_numbers_give():
    assert papers_page.page(MEASURED, papers_page.work_precision_text() + error_parts.parts_text()) == PAGE
    assert list(MEASURED) == [name for name, paper in PAPERS.items() if "why" not in paper] == list(papers_page.CLAIMS)
    assert not any(entry["quick"] for entry in MEASURED.values())
    run = read_result(RESULTS / "work-precision.json")
    assert as_text(run) + "\n" == (RESULTS / "work-precision.md").read_text()


def test_the_package_answers_as_the_whole_run_does():
    run = read_result(RESULTS / "work-precision.json")
    held = read_result(COMMITTED)
    assert results.fronts_only(run) == held
    for error, radii, limit, kind in product(
        ERRORS, run["setup"]["grid"]["radii"][:2], np.geomspace(1e-3, 30, 6), ("max_error", "max_ms")
    ):
        answers = [advice(result, error, radii=radii, **{kind: limit}) for result in (run, held)]
        assert answers[0] == answers[1]


def test_links_and_pictures_are_there():
    titles = {papers_page.anchor(line.lstrip("# ")) for line in PAGE.splitlines() if line.startswith("#")}
    links = re.findall(r"\]\(([^)]+)\)", PAGE)
    pictures = {f"results/{papers_page.anchor(name)[1:]}.png" for name in papers_page.CLAIMS}
    assert {papers_page.anchor(name) for name in papers_page.CLAIMS} <= set(links)
    assert {each for each in pictures if (results.PAGE.parent / each).is_file()} <= set(links)
    for link in links:
        assert link in titles or (results.PAGE.parent / link).is_file()
    pictures = [path.stat().st_size for path in RESULTS.glob("*-*.png")]
    assert max(pictures) < 250_000
    assert sum(pictures) < 2_000_000


def test_verdicts_follow_the_numbers():
    found = copy.deepcopy(MEASURED["VO table 1"]["measured"])
    for k, row in enumerate(found["rows"].values()):
        row["ms"] = row["loaded ms"] = 1.0 + k
    assert papers_page.judged("VO table 1", found)[0] == "reproduced"
    found["rows"]["points, 12"]["loaded ms"] = 0.5
    assert papers_page.judged("VO table 1", found)[0].startswith("depends on the machine")
    found["rows"]["horizons"]["ms"] = 0.5
    assert papers_page.judged("VO table 1", found)[0] == "contradicted"


def test_the_papers_tables_have_the_sums_and_ratios_that_they_print():
    for without, with_, difference in PAPERS["LF table 1"]["milliseconds"].values():
        assert with_ - without == pytest.approx(difference)
    sao = PAPERS["SAO table 2"]["theirs"]
    for whole in ("Alchemy", "SAO"):
        parts = [ms for name, ms in sao.items() if name.startswith(whole) and not name.endswith("total")]
        assert sum(parts) == pytest.approx(sao[f"{whole}, total"])
    assert sao["Alchemy, total"] / sao["SAO, total"] == pytest.approx(7.1, abs=0.05)
    columns = (0.71, 0.71, 0.54, 0.59), (1.01, 1.03, 0.77, 0.82), (1.18, 1.31, 1.14, 0.97), (3.11, 3.55, 2.32, 2.52)
    vo = list(PAPERS["VO table 1"]["theirs"].values())
    assert vo[:4] == pytest.approx([np.mean(column) for column in columns], abs=0.006)


def test_models_are_brought_to_equal_cover():
    shown = [papers_lf.model(lfssao.builtin_scene(name), (128, 96)) for name in ("statue", "ammonite")]
    assert shown[1].cover > 2 * shown[0].cover
    assert papers_lf.covering(shown[1], shown[0].cover, (128, 96)).cover == pytest.approx(shown[0].cover, rel=0.02)
