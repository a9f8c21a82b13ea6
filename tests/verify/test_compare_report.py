"""Reports of ``lfssao compare``: JSON, JUnit XML, pictures, the table of notebooks, exit codes of a pipe."""

import json
import subprocess
import sys
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from compare_folders import LAYERS, MODULES, changed, compare, copied, poke, remade
from jobs import render
from PIL import Image

import lfssao
from lfssao.files.exr import Part, read_exr, write_exr
from lfssao.verify.compare.picture import Panels
from lfssao.verify.verdict import Verdict


def test_json_holds_every_figure(tmp_path, reference, failing):
    def refuse(word):
        raise AssertionError(f"{word} is not JSON")

    path = tmp_path / "report.json"
    assert compare(failing, reference, "--json", path) == 4
    found = json.loads(path.read_text(), parse_constant=refuse)
    assert found["exit_code"] == 4
    assert found["first_failure"] == {"module": "module_004", "layer": "merged"}
    by_place = {(r["module"], r["layer"]): r for r in found["results"]}
    assert by_place["module_003", "ao_1"]["verdict"] == "equal bits"
    assert by_place["module_005", ""]["exit_code"] == 4
    assert by_place["module_005", ""]["detail"].startswith(str(failing / "module_005.exr"))
    wrong = by_place["module_004", "merged"]
    assert wrong["metrics"]["nan_mismatches"] == 1
    assert wrong["worst"][0]["mine"] == ["nan"]


def test_json_can_be_all_that_is_printed(tmp_path, capsys):
    for name in "ab":
        np.save(tmp_path / f"{name}.npy", np.float32([[0.5]]))
    assert compare(tmp_path / "a.npy", tmp_path / "b.npy", "--json", "-", "--html", tmp_path / "a.html") == 0
    assert json.loads(capsys.readouterr().out)["results"][0]["verdict"] == "equal bits"
    assert (tmp_path / "a.html").exists()


def test_a_report_is_true_where_mine_conforms(tmp_path):
    for name, value in (("a", 0.5), ("b", 0.25)):
        np.save(tmp_path / f"{name}.npy", np.float32([[value]]))
    a = tmp_path / "a.npy"
    b = tmp_path / "b.npy"
    assert lfssao.compare(a, a)
    found = [lfssao.compare(a, b), lfssao.compare(a, b, fail=1.0)]
    assert [(report.exit_code, bool(report)) for report in found] == [(2, False), (1, False)]


def test_junit_has_a_suite_a_module(tmp_path, reference, failing):
    path = tmp_path / "junit.xml"
    compare(failing, reference, "--junit", path)
    suites = {s.get("name"): s for s in ElementTree.parse(path).getroot()}
    assert list(suites) == MODULES
    counts = {name: [int(s.get(k)) for k in ("tests", "failures", "errors")] for name, s in suites.items()}
    assert counts == {"module_003": [8, 0, 0], "module_004": [8, 1, 0], "module_005": [1, 0, 1]}
    assert [c.get("name") for c in suites["module_003"]] == LAYERS
    (failure,) = suites["module_004"].iter("failure")
    assert "outside the interval" in failure.get("message")
    assert "(24, 16) nan" in failure.text


@pytest.mark.parametrize(("rotation", "size", "rounding", "option"), [
    ("common-hash", "64x48", "0.00098", "angle_sum=float32"), ("sao-hash", "64x48", "0.00098", "ANGLES.npy"),
    ("common-hash", "24x16", None, None), ("hash", "64x48", None, None),
])  # fmt: skip
def test_a_hash_that_float32_rounds_to_noise_is_told_once_where_occlusion_is_wrong(
    tmp_path, rotation, size, rounding, option
):
    words = "statue", "--display", "sample-a", "--modules", "3:5", "--resolution", size, "--estimator", "sao"
    right = render(tmp_path / "right", *words, "--rotate", rotation, "--layers", "depth,positions,ao")
    assert lfssao.compare(right, right).notes == ()
    wrong = copied(right, tmp_path / "wrong")
    for module in ("module_003", "module_004"):
        parts = read_exr(right / f"{module}.exr")
        parts["ao_1"] = replace(parts["ao_1"], pixels=1 - parts["ao_1"].pixels)
        write_exr(wrong / f"{module}.exr", list(parts.values()))
    notes = lfssao.compare(wrong, right, diagnosis=False).notes
    assert len(notes) == (rounding is not None)
    assert rounding is None or (f"by up to {rounding} rad" in notes[0] and option in notes[0])


def colors(path):
    """The colours of a picture's pixels."""
    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB")).reshape(-1, 3).tolist()


def test_picture_shows_the_first_module_that_fails(tmp_path, reference, failing):
    path = tmp_path / "difference.png"
    compare(failing, reference, "--picture", path)
    report = lfssao.compare(failing, reference)
    assert report.panels.module == "module_004"
    (row,) = report.panels.rows
    assert row["difference"][16, 24] == np.inf
    assert row["verdict"][16, 24] == 2
    assert (row["verdict"] > 0).sum() == 1
    shown = colors(path)
    assert [255, 0, 255] in shown  # a number on one side only
    assert [214, 39, 40] in shown  # outside
    compare(reference, reference, "--picture", path)
    assert [255, 0, 255] not in colors(path)


def test_nothing_is_drawn_after_the_first_module_that_fails(tmp_path, reference, failing, monkeypatch):
    drawn = []
    offer = Panels.offer
    monkeypatch.setattr(Panels, "offer", lambda self, *args: drawn.append(self.module) or offer(self, *args))
    mine = changed(failing, tmp_path / "mine", "module_003", poke("merged", (8, 8), np.nan))
    report = lfssao.compare(mine, reference, diagnosis=False)
    failed = {result.module for result in report.results if result.verdict is Verdict.OUTSIDE}
    assert failed == {"module_003", "module_004"}
    assert {*drawn} == {"module_003"} == {report.panels.module}


def test_the_picture_holds_surfaces_where_the_reference_has_none(tmp_path, reference):
    """Shifted: at silhouettes one side is infinite, which is no number of a colour bar."""
    shifted = remade("depth", lambda pixels: np.roll(pixels, 2, axis=1))
    mine = changed(reference, tmp_path / "mine", "module_003", shifted)
    assert compare(mine, reference, "--picture", tmp_path / "a.png") == 2
    (row,) = lfssao.compare(mine, reference).panels.rows
    assert np.isinf(row["difference"]).any()
    assert np.max(row["difference"], where=np.isfinite(row["difference"]), initial=0) < 1
    assert [255, 0, 255] in colors(tmp_path / "a.png")


def test_the_picture_draws_both_sides_by_the_names_of_the_reference(tmp_path):
    """Channels of an NPY file have no names of colours of their own."""
    pixels = np.random.default_rng(2).random((4, 5, 3), np.float32)
    write_exr(tmp_path / "b.exr", [Part("color", ("R", "G", "B"), pixels)])
    pixels[0, 0] = np.nextafter(pixels[0, 0], np.float32(2))
    np.save(tmp_path / "a.npy", pixels)
    (row,) = lfssao.compare(tmp_path / "a.npy", tmp_path / "b.exr").panels.rows
    assert np.array_equal(row["mine"], row["reference"])


def test_the_picture_is_grey_from_the_least_number_of_the_reference_to_the_largest(tmp_path):
    numbers = np.array([[-3, 1, 5], [5, np.inf, -7]], np.float32)
    np.save(tmp_path / "b.npy", numbers)
    np.save(tmp_path / "a.npy", numbers + 4)
    (row,) = lfssao.compare(tmp_path / "a.npy", tmp_path / "b.npy").panels.rows
    assert row["reference"][..., 0].tolist() == [[85, 170, 255], [255, 255, 0]]
    assert row["mine"][..., 0].tolist() == [[170, 255, 255], [255, 255, 85]]


def test_one_wrong_texel_of_a_large_texture_is_in_the_picture(tmp_path):
    ones = np.ones((700, 1100), np.float32)
    np.save(tmp_path / "b.npy", ones)
    ones[699, 1099] = 0.5
    np.save(tmp_path / "a.npy", ones)
    (row,) = lfssao.compare(tmp_path / "a.npy", tmp_path / "b.npy").panels.rows
    assert max(row["verdict"].shape) <= 480
    assert row["verdict"][-1, -1] == 2
    assert row["difference"][-1, -1] == 0.5


def test_notebooks_get_a_table(reference, failing):
    html = lfssao.compare(failing, reference)._repr_html_()
    table = ElementTree.fromstring(f"<div>{html}</div>")
    assert [row[0].text for row in table.iter("tr")] == ["stage", *LAYERS, "(whole module)"]
    assert "module_004, merged: outside the interval" in "".join(table.find("p").itertext())


def test_the_table_sums_texels_and_shows_ulp_that_mean_something(tmp_path):
    (tmp_path / "right").mkdir()
    (tmp_path / "mine").mkdir()
    for count in (2, 3):
        for side, value in (("right", 1), ("mine", 1 + 2**-22)):
            np.save(tmp_path / side / f"{count}.npy", np.float32([[value] * count + [1] * 4] * 3))
    for figures in (["15", "2"], ["18", "-"]):
        report = lfssao.compare(tmp_path / "mine", tmp_path / "right")
        cells = dict(zip(*report.summary(), strict=True))
        shown = [cells[name] for name in ("inside", "outside", "other", "texels off", "max ulp")]
        assert shown == ["0", "2", "0", *figures]
        assert (" ulp, " in str(report).partition("3, image")[2].partition("\n")[0]) == (figures[1] == "2")
        np.save(tmp_path / "mine" / "3.npy", np.float32([[-1] * 4 + [1] * 3] * 3))


def test_the_code_survives_a_closed_pipe(reference, failing):
    script = f"{sys.executable} -m lfssao compare {failing} {reference} | head -c 1; exit ${{PIPESTATUS[0]}}"
    assert subprocess.run(["bash", "-c", script], capture_output=True, check=False).returncode == 4


def test_progress_is_shown_on_terminals_only(capsys, reference):
    compare(reference, reference)
    assert capsys.readouterr().err == ""
