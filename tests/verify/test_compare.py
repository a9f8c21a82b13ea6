"""``lfssao compare``: verdicts, exit codes, kits, bad input; that idiff's traps are not here."""

import re
from dataclasses import replace

import numpy as np
import pytest
from compare_folders import (
    LAYERS,
    MODULES,
    changed,
    compare,
    copied,
    different,
    nudge,
    poke,
    remade,
    single,
    verdicts,
    with_entry,
)
from jobs import manifest_of, python, render

import lfssao
from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.errors import InputError
from lfssao.files.exr import Part, read_exr, write_exr
from lfssao.optics.view import KINDS, WorldToImage
from lfssao.samples import texel_turns
from lfssao.verify.bounds import bounds, post, ssao
from lfssao.verify.bounds.registry import BOUNDS_FILES
from lfssao.verify.kit.folder import read_case, read_kit
from lfssao.verify.verdict import Verdict

# Verdicts


def test_a_folder_conforms_to_itself(capsys, reference):
    assert compare(reference, reference) == 0
    text = capsys.readouterr().out
    assert text.splitlines()[-1] == "conforms (exit code 0)"
    assert "first that" not in text
    assert compare(reference, reference, "--exact") == 0
    report = lfssao.compare(reference, reference)
    assert set(verdicts(report)) == {(module, layer) for module in MODULES for layer in LAYERS}
    assert not different(report)
    assert all(r.metrics.differing == r.metrics.max_ulp == 0 and r.metrics.ssim == 1 for r in report.results)


def test_what_conforms_imports_neither_intervals_nor_the_search(reference):
    """Nor pages and other estimators; bounds of other estimators come without those of estimators that they are not."""
    script = "import sys, lfssao.cli.main; assert lfssao.cli.main.main(sys.argv[1:]) == 0; print(*sys.modules)"
    loaded = [name for name in python("-c", script, "compare", reference, reference).stdout.split() if "lfssao" in name]
    late = "bounds.view bounds.points bounds.post bounds.sao diagnosis compare.diagnoser compare.reasons compare.page"
    assert "lfssao.verify.compare.report" in loaded
    assert not [name for name in loaded if name.startswith(tuple(f"lfssao.verify.{room}" for room in late.split()))]
    assert len(loaded) < 140
    bounded = python("-c", "import sys, lfssao.verify.bounds.points; print(*sys.modules)").stdout.split()
    own = {f"lfssao.verify.bounds.{name}" for name in BOUNDS_FILES.values()}
    families = {f"lfssao.ao.estimators.{ESTIMATORS.data[name]}" for name in ESTIMATORS}
    assert not (own | families) & set(bounded)


def test_the_camera_with_a_guard_band_conforms_to_itself(tmp_path):
    words = ["statue", "--camera", "--resolution", "48x32", "--radii", "4%", "--guard", "3", "--normals"]
    light = render(tmp_path / "camera", *words)
    assert compare(light, light, "--exact") == 0
    mine = changed(light, tmp_path / "mine", "camera", nudge("blurred"))
    report = lfssao.compare(mine, light)
    assert different(report) == {("camera", "blurred"): Verdict.INSIDE}
    mine = changed(light, tmp_path / "off", "camera", poke("normals", (9, 9), 0.5))
    assert different(lfssao.compare(mine, light)) == {("camera", "normals"): Verdict.DIFFERENT}
    mine = changed(light, tmp_path / "signs", "camera", remade("normals", lambda n: np.where(n == 0, -n, n)))
    report = lfssao.compare(mine, light)
    assert (different(report), report.exit_code) == ({("camera", "normals"): Verdict.EQUAL_VALUES}, 0)


@pytest.mark.parametrize(("options", "wrong"), [
    (("--radii", "0.42"), "ao_1"), (("--radii", "0.4", "--blur", "1.2"), "blurred"),
])  # fmt: skip
def test_behind_a_guard_band_an_error_makes_no_later_stage_wrong(tmp_path, options, wrong):
    words = ["corner", "--camera", "--resolution", "48x36", "--guard", "5"]
    right = render(tmp_path / "right", *words, "--radii", "0.4")
    found = different(lfssao.compare(render(tmp_path / "mine", *words, *options), right))
    assert [layer for (_, layer), verdict in found.items() if verdict is Verdict.OUTSIDE] == [wrong]


def test_rounding_is_inside_and_passes_but_not_exactly(tmp_path, capsys, reference):
    mine = changed(reference, tmp_path / "mine", "module_004", nudge("shaded"))
    report = lfssao.compare(mine, reference)
    assert different(report) == {("module_004", "shaded"): Verdict.INSIDE}
    assert (report.exit_code, report.first_failure) == (0, None)
    assert report.first_difference.layer == "shaded"
    assert report.first_difference.metrics.max_ulp == 1
    assert "worst texels (column, row) of module_004, shaded:" in str(report)
    assert compare(mine, reference) == 0
    assert compare(mine, reference, "--exact") == 2
    assert compare(mine, reference, "--model", "strict") == 2
    assert "first that differs: module_004, shaded (inside the interval)" in capsys.readouterr().out


def test_a_wrong_texel_fails_and_is_explained(tmp_path, capsys, reference):
    depth = read_exr(reference / "module_004.exr")["depth"].pixels[..., 0]
    row, column = (int(k) for k in np.argwhere(np.isfinite(depth))[40])
    mine = changed(reference, tmp_path / "mine", "module_004", poke("ao_2", (row, column), 0.77))
    report = lfssao.compare(mine, reference)
    # Unchanged textures have the reference's bits, which are right whatever they were made of.
    assert different(report) == {("module_004", "ao_2"): Verdict.OUTSIDE}
    first = report.first_failure
    assert (first.module, first.layer, first.outside) == ("module_004", "ao_2", 1)
    worst = first.worst[0]
    assert (worst.column, worst.row) == (column, row)
    assert worst.mine == (pytest.approx(0.77),)
    assert worst.lower[0] <= worst.reference[0] <= worst.upper[0] < 0.77
    assert "reads texel (" in worst.reason
    assert "from its edge" in worst.reason
    assert compare(mine, reference) == 2
    assert "first that differs: module_004, ao_2 (outside the interval)" in capsys.readouterr().out


@pytest.mark.parametrize("written", [("ao_1", "ao_2", "merged"), ()], ids=["merged", "none"])
def test_stages_that_were_not_written_may_be_anything_that_is_right(tmp_path, reference, written):
    """Blurred and shaded textures of the largest occlusion that conforms, which the renderer did not write."""
    manifest = manifest_of(reference)
    view = manifest["views"][1]["view"]
    settings = manifest["settings"]
    to_image = WorldToImage(KINDS.index(view["world_to_image_kind"]), np.array(view["world_to_image"]))
    turns = texel_turns(settings["rotation"], view["height"], view["width"], 0, np.dtype(np.float32))
    depth, positions, color, merged = (
        single(reference, "module_004", layer) for layer in ("depth", "positions", "color", "merged")
    )
    right = bounds.exact_bounds(merged[..., 0])
    if not written:
        right = post.merge_bounds(
            [ssao.ao_bounds(depth[..., 0], positions, to_image, np.array(settings["samples"]), radius, "sampler",
                            None, turns)
             for radius in settings["radii"]]
        )  # fmt: skip
        assert (right.upper > right.lower + 0.1).any()  # undecided samples
    blurred = post.blur_bounds(right, settings["blur_sigma"], "sampler").upper

    def change(parts):
        parts["blurred"] = replace(parts["blurred"], pixels=blurred[..., None])
        parts["shaded"] = replace(parts["shaded"], pixels=lfssao.shade(color, blurred))
        keep = ("depth", "positions", "color", *written, "shaded", *(() if written else ("blurred",)))
        return {name: part for name, part in parts.items() if name in keep}

    mine = changed(reference, tmp_path / "mine", "module_004", change)
    layers = ["shaded"] if written else ["blurred", "shaded"]
    report = lfssao.compare(mine, reference, layers=layers, model="sampler")
    assert different(report) == {("module_004", layer): Verdict.INSIDE for layer in layers}


def test_missing_layers_and_modules_fail(tmp_path, capsys, reference):
    mine = changed(reference, tmp_path / "mine", "module_003", lambda p: {k: v for k, v in p.items() if k != "merged"})
    (mine / "module_005.exr").unlink()
    report = lfssao.compare(mine, reference)
    assert different(report) == {("module_003", "merged"): Verdict.MISSING, ("module_005", ""): Verdict.MISSING}
    assert compare(mine, reference) == 2
    text = capsys.readouterr().out
    assert "not given: merged (1 module); compare what is there by --layers depth,positions,color,ao_1," in text
    assert "not given: 1 of 3 modules (module_005)\n" in text
    assert compare(mine, reference, "--layers", "depth,ao_1") == 2  # module_005
    (mine / "module_005.exr").write_bytes((reference / "module_005.exr").read_bytes())
    assert compare(mine, reference, "--layers", "depth,ao_1") == 0


def test_what_is_wrong_is_told_before_what_is_missing(tmp_path, reference):
    def drop(parts):
        return {name: part for name, part in parts.items() if name not in ("color", "shaded")}

    lacking = changed(reference, tmp_path / "lacking", "module_003", drop)
    wrong = poke("ao_2", (16, 24), 0.77)
    mine = changed(lacking, tmp_path / "mine", "module_004", lambda parts: drop(wrong(parts) or parts))
    report = lfssao.compare(mine, reference)
    for first in (report.first_failure, report.first_difference):
        assert (first.module, first.layer) == ("module_004", "ao_2")
    told = [line for line in str(report).splitlines() if "module_00" in line or "not given" in line]
    advice = "depth,positions,ao_1,ao_2,merged,blurred"
    assert [told[0][:28], told[1][:16]] == ["module_004, ao_2: outside th", "  1 wrong texel "]
    assert told[2] == "worst texels (column, row) of module_004, ao_2:"
    assert told[3] == f"not given: color, shaded (2 modules each); compare what is there by --layers {advice}"
    alone = lfssao.compare(mine, reference, layers=advice.split(","))
    assert different(alone) == {("module_004", "ao_2"): Verdict.OUTSIDE}
    report = lfssao.compare(changed(lacking, tmp_path / "inside", "module_004", nudge("blurred")), reference)
    assert report.first_failure.layer == "color"
    assert "worst texels" not in str(report)  # of what is right


def test_what_the_reference_has_not_is_a_warning(tmp_path, capsys, reference):
    more = {"debug": Part("debug", ("debug.Y",), np.zeros((32, 48, 1), np.float32))}
    mine = changed(reference, tmp_path / "mine", "module_003", lambda parts: {**parts, **more})
    (mine / "contact.png").write_bytes(b"no module")
    assert compare(mine, reference) == 1
    assert "warning: module_003: channel debug.debug.Y is not in the reference" in capsys.readouterr().out
    (mine / "module_007.exr").write_bytes((reference / "module_005.exr").read_bytes())
    assert compare(mine, reference) == 1
    assert "warning: module_007.exr is of no module of the reference" in capsys.readouterr().out


# Traps of idiff


@pytest.fixture
def write(tmp_path):
    """Write a file of one layer, a number among halves."""

    def write(value, into):
        pixels = np.full((4, 5, 1), 0.5, np.float32)
        pixels[2, 3] = value
        write_exr(tmp_path / into, [Part("merged", ("merged.AO",), pixels)])
        return tmp_path / into

    return write


@pytest.mark.parametrize(("a", "b"), [
    (0.5, np.nan), (np.nan, 0.5), (np.inf, -np.inf), (0.5, np.inf), (0.5, 0.50000006), (np.nan, np.inf),
])  # fmt: skip
def test_numbers_that_idiff_takes_as_equal_differ(write, capsys, a, b):
    assert compare(write(a, "one.exr"), write(b, "two.exr")) == 2
    assert "different, 1 of 20 texels, and no interval is known" in capsys.readouterr().out


def test_values_are_compared_by_default_and_bits_with_exact(write):
    for one, two in ((0.0, -0.0), (np.nan, np.array([0x7FC00001], np.uint32).view(np.float32)[0])):
        files = write(one, "one.exr"), write(two, "two.exr")
        assert compare(*files) == 0
        assert compare(*files, "--exact") == 2
        assert compare(files[0], files[0], "--exact") == 0


@pytest.mark.parametrize("words", [
    "{0} {0} --fail -1", "{0} {0} --fail nan", "{0} {0} --fail inf", "{0} {0} --fail-percent 100.1",
    "{0} {0} --fail 0.1 --exact", "{0} {0} --fail-percent 1 --exact", "{0} {0} --cases a", "--no-such-option {0} {0}",
    "{0}", "{0} {0} --model foo", "{0} {0} --map foo", "{0} {0} --map a=nothing", "{0} {0} --layers nothing",
    "{0} {0} --json {1}/no/a.json", "{0} {0} --picture {1}/a.txt", "{0} {1}", "{0} {1}/nothing.exr",
])  # fmt: skip
def test_usage_errors_are_neither_a_warning_nor_a_difference(write, capsys, words):
    file = write(0.5, "a.exr")
    assert compare(*(word.format(file, file.parent) for word in words.split())) == 4
    assert capsys.readouterr().err.count("\n") == 1


def test_faults_of_the_program_are_no_warning(write, monkeypatch, capsys):
    def fault(*_):
        raise ZeroDivisionError

    monkeypatch.setattr("lfssao.verify.compare.comparison.Comparison.add", fault)
    assert compare(*[write(0.5, "a.exr")] * 2) == 4
    assert "ZeroDivisionError" in capsys.readouterr().err


# Kits


@pytest.fixture
def mine(small_kit):
    """The outputs of a kit's cases as another renderer's folder; the kit is beside it."""
    folder = small_kit.parent / "mine"
    folder.mkdir()
    for case in read_kit(small_kit):
        for name, array in case.outputs.items():
            np.save(folder / f"{case.name}_{name}.npy", array)
    return folder


def test_a_kit_is_a_reference(small_kit, mine, capsys):
    assert compare(mine, small_kit, "--exact") == 0
    assert "intervals of the error model 'shader'" in capsys.readouterr().out
    case = read_case(small_kit / "cases" / "frame")
    main, *steps = case.outputs
    upper = case.bounds[main].upper
    for step in steps:  # they can be left out
        (mine / f"frame_{step}.npy").unlink()
    beyond = np.nextafter(upper, np.float32(np.inf))
    for made, verdict in ((upper, Verdict.INSIDE), (beyond, Verdict.OUTSIDE)):
        np.save(mine / f"frame_{main}.npy", made)
        report = lfssao.compare(mine, small_kit)
        assert different(report) == {("frame", main): verdict}
    assert report.first_failure.worst[0].upper is not None
    (mine / f"frame_{main}.npy").unlink()
    assert different(lfssao.compare(mine, small_kit)) == {("frame", ""): Verdict.MISSING}


def test_cases_that_were_not_tried_are_one_line(small_kit, mine, capsys):
    for file in [*mine.glob("blur_usual_*"), *mine.glob("frame_*")]:
        file.unlink()
    assert compare(mine, small_kit) == 2
    (line,) = (line for line in capsys.readouterr().out.splitlines() if "not tried" in line)
    advice = "compare what is there by --cases algorithm2_conical,samples_latin"
    assert line == f"not tried: 2 of 4 cases (blur_usual, frame); {advice}"
    assert compare(mine, small_kit, "--exact", *advice.split()[-2:]) == 0
    assert ": 2 cases, " in capsys.readouterr().out
    assert compare(mine, small_kit, "--cases", "samples_latin") == 0  # files of other cases are no warning
    assert different(lfssao.compare(mine, small_kit, cases=["frame"])) == {("frame", ""): Verdict.MISSING}
    assert compare(mine, small_kit, "--cases", "frames") == 4
    assert "'frames' is no case of a kit" in capsys.readouterr().err


def test_a_case_of_a_kit_is_a_reference(small_kit, tmp_path, capsys):
    case = small_kit / "cases" / "samples_latin"
    for name, array in read_case(case).outputs.items():
        np.save(tmp_path / f"{name}.npy", array)
    assert compare(tmp_path, case, "--exact") == 0
    np.save(tmp_path / f"{name}.npy", -array)
    assert compare(tmp_path, case) == 2
    for file, folder in ((case / "case.json", case), (small_kit / "kit.json", small_kit)):
        file.write_text(file.read_text().replace('"format": 3', '"format": 4', 1))
        assert compare(tmp_path, folder) == 4
        assert "the kit is of format 4" in "".join(capsys.readouterr())


# Estimators


def test_another_estimators_occlusion_is_said_to_have_no_interval(tmp_path, capsys, reference, monkeypatch):
    monkeypatch.delitem(BOUNDS_FILES, "multiresolution")
    folder = with_entry(reference, tmp_path / "reference", ("settings", "estimator"), "multiresolution")
    mine = changed(reference, tmp_path / "mine", "module_004", nudge("ao_1"))
    assert compare(mine, folder) == 2
    text = capsys.readouterr().out
    assert "of estimator multiresolution must have equal values" in text
    assert "module_004, ao_1: different" in text
    assert compare(mine, reference) == 0
    assert "must have equal values" not in capsys.readouterr().out


SMALL = ["statue", "--display", "sample-a", "--modules", "4:5", "--resolution", "32x24", "--radii", "4%"]


@pytest.mark.parametrize(("estimator", "points", "option", "value"), [
    ("hemisphere", 8, "range_check", "yes"), ("vo-points", 12, "thickness", "no"), ("vo-lines", 5, "thickness", "no"),
])  # fmt: skip
def test_estimators_that_count_points_have_intervals(tmp_path, capsys, estimator, points, option, value):
    reference = render(tmp_path / "reference", *SMALL, "--estimator", estimator)
    inside = changed(reference, tmp_path / "inside", "module_004", nudge("ao_1"))
    report = lfssao.compare(inside, reference)
    assert different(report)["module_004", "ao_1"] is Verdict.INSIDE
    assert (report.exit_code, report.estimator) == (0, None)
    assert different(lfssao.compare(inside, reference, model="strict"))["module_004", "ao_1"] is Verdict.DIFFERENT
    place = tuple(np.argwhere(np.isfinite(single(reference, "module_004", "depth")[..., 0]))[40])
    mine = changed(reference, tmp_path / "mine", "module_004", poke("ao_1", place, 0.777))
    (found,) = (r for r in lfssao.compare(mine, reference).results if r.layer == "ao_1")
    assert found.verdict is Verdict.OUTSIDE
    worst = found.worst[0]
    assert worst.lower[0] <= worst.reference[0] <= worst.upper[0]
    assert re.fullmatch(
        rf"0 of {points} points are undecided; sample \d+ reads texel \(\d+, \d+\), [\d.e-]+ from its edge "
        r"\(error up to [\d.e-]+\), and adds [\d.]+( to [\d.]+)?", worst.reason
    )  # fmt: skip
    sky = tuple(np.argwhere(~np.isfinite(single(reference, "module_004", "depth")[..., 0]))[40])
    grey = changed(reference, tmp_path / "grey", "module_004", poke("ao_1", sky, 0.5))
    (found,) = (r for r in lfssao.compare(grey, reference).results if r.layer == "ao_1")
    assert found.worst[0].reason == "no surface is seen there"
    other = with_entry(reference, tmp_path / "other", ("settings", "parameters", option), value)
    capsys.readouterr()
    assert compare(inside, other) == 4
    said = capsys.readouterr().err
    assert option in said
    assert said.count("\n") == 1


# Bad input


def test_names_that_no_file_can_have_are_refused(reference):
    for pair in (("n" * 300, reference), (reference, "n" * 300)):
        with pytest.raises(InputError, match="n: there is no such file or folder"):
            lfssao.compare(*pair)


def test_the_reference_must_be_what_its_manifest_says(tmp_path, capsys, reference):
    folder = copied(reference, tmp_path / "folder")
    text = (reference / "manifest.json").read_text()
    for wrong, words in (
        (text.replace('"format": 1', '"format": 2', 1), "a newer version of lfssao wrote it"),
        (text[: len(text) // 2], "it is not a JSON file"),
    ):
        (folder / "manifest.json").write_text(wrong)
        assert compare(reference, folder) == 4
        assert words in capsys.readouterr().err
    (folder / "manifest.json").write_text(text)
    assert compare(reference, folder) == 0
    (folder / "module_004.exr").write_bytes((reference / "module_003.exr").read_bytes())
    capsys.readouterr()
    assert compare(reference, folder) == 4
    assert "is not what manifest.json describes" in capsys.readouterr().out
