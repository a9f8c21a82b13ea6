"""``lfssao compare``: verdicts, exit codes, kits, bad input; that idiff's traps are not here."""

import json
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
    single,
    verdicts,
    with_entry,
)

import lfssao
from lfssao.optics.view import KINDS, WorldToImage
from lfssao.rendering.exr import Part, read_exr, write_exr
from lfssao.verify.bounds import bounds, post, ssao
from lfssao.verify.kit.cases import make_case
from lfssao.verify.kit.folder import write_kit
from lfssao.verify.verdict import Verdict


@pytest.fixture(scope="module")
def light(tmp_path_factory):
    """The folder of a camera, with a guard band."""
    folder = tmp_path_factory.mktemp("compare") / "camera"
    words = ["render", "statue", "--camera", "--resolution", "48x32", "--radii", "4%", "--guard", "3", "--normals"]
    assert lfssao.cli.main.main([*words, "-o", str(folder)]) == 0
    return folder


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


def test_the_camera_with_a_guard_band_conforms_to_itself(tmp_path, light):
    assert compare(light, light, "--exact") == 0
    mine = changed(light, tmp_path / "mine", "camera", nudge("blurred"))
    report = lfssao.compare(mine, light)
    assert different(report) == {("camera", "blurred"): Verdict.INSIDE}
    mine = changed(light, tmp_path / "off", "camera", poke("normals", (9, 9), 0.5))
    assert different(lfssao.compare(mine, light)) == {("camera", "normals"): Verdict.DIFFERENT}


def test_rounding_is_inside_and_passes_but_not_exactly(tmp_path, capsys, reference):
    mine = changed(reference, tmp_path / "mine", "module_004", nudge("shaded"))
    report = lfssao.compare(mine, reference)
    assert different(report) == {("module_004", "shaded"): Verdict.INSIDE}
    assert (report.exit_code, report.first_failure) == (0, None)
    assert report.first_difference.layer == "shaded"
    assert report.first_difference.metrics.max_ulp == 1
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
    manifest = json.loads((reference / "manifest.json").read_text())
    view, settings = manifest["views"][1]["view"], manifest["settings"]
    to_image = WorldToImage(KINDS.index(view["world_to_image_kind"]), np.array(view["world_to_image"]))
    depth, positions, color, merged = (
        single(reference, "module_004", layer) for layer in ("depth", "positions", "color", "merged")
    )
    right = bounds.exactly(merged[..., 0])
    if not written:
        right = post.merge_bounds(
            [ssao.ao_bounds(depth[..., 0], positions, to_image, np.array(settings["samples"]), radius, "sampler")
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
    assert "module_003, merged: missing" in text
    assert "module_005: missing" in text
    assert compare(mine, reference, "--layers", "depth,ao_1") == 2  # module_005
    (mine / "module_005.exr").write_bytes((reference / "module_005.exr").read_bytes())
    assert compare(mine, reference, "--layers", "depth,ao_1") == 0


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
def pair(tmp_path):
    """Two equal files of one layer; write(value) puts a number into the second."""
    pixels = np.full((4, 5, 1), 0.5, np.float32)
    write_exr(tmp_path / "a.exr", [Part("merged", ("merged.AO",), pixels)])

    def write(value, into="b.exr"):
        other = pixels.copy()
        other[2, 3] = value
        write_exr(tmp_path / into, [Part("merged", ("merged.AO",), other)])
        return tmp_path / into

    return tmp_path / "a.exr", write


@pytest.mark.parametrize(
    ("a", "b"),
    [(0.5, np.nan), (np.nan, 0.5), (np.inf, -np.inf), (0.5, np.inf), (0.5, 0.50000006), (np.nan, np.inf)],
    ids=["finite-nan", "nan-finite", "inf-signs", "finite-inf", "one-ulp", "nan-inf"],
)
def test_numbers_that_idiff_takes_as_equal_differ(pair, capsys, a, b):
    _, write = pair
    files = write(a, "one.exr"), write(b, "two.exr")
    assert compare(*files) == 2
    assert "different, 1 of 20 texels, and no interval is known" in capsys.readouterr().out


def test_values_are_compared_by_default_and_bits_with_exact(pair, tmp_path):
    _, write = pair
    zeros = write(0.0, "one.exr"), write(-0.0, "two.exr")
    assert compare(*zeros) == 0
    assert compare(*zeros, "--exact") == 2
    payload = np.array([0x7FC00001], np.uint32).view(np.float32)[0]
    nans = write(np.nan, "one.exr"), write(payload, "two.exr")
    assert compare(*nans) == 0
    assert compare(*nans, "--exact") == 2
    assert compare(nans[0], nans[0], "--exact") == 0


@pytest.mark.parametrize(
    "words",
    ["--no-such-option {0} {0}", "{0}", "{0} {0} --model foo", "{0} {0} --map foo", "{0} {0} --map a=nothing",
     "{0} {0} --layers nothing", "{0} {0} --json {1}/no/a.json", "{0} {0} --picture {1}/a.txt", "{0} {1}",
     "{0} {1}/nothing.exr"],
)  # fmt: skip
def test_usage_errors_are_neither_a_warning_nor_a_difference(pair, capsys, words):
    file, _ = pair
    assert compare(*(word.format(file, file.parent) for word in words.split())) == 4
    assert capsys.readouterr().err.count("\n") == 1


def test_faults_of_the_program_are_no_warning(pair, monkeypatch, capsys):
    def fault(*_):
        raise ZeroDivisionError

    monkeypatch.setattr("lfssao.verify.compare.compare.Comparison.add", fault)
    assert compare(pair[0], pair[0]) == 4
    assert "ZeroDivisionError" in capsys.readouterr().err


# Kits


CASES = ("blur_usual", "frame", "philox")


@pytest.fixture
def kit(tmp_path):
    """A kit of a few cases, and its outputs as another renderer's."""
    cases = [make_case(name) for name in CASES]
    write_kit(tmp_path / "kit", cases, "text")
    (tmp_path / "mine").mkdir()
    for case in cases:
        for name, array in case.outputs.items():
            np.save(tmp_path / "mine" / f"{case.name}_{name}.npy", array)
    return tmp_path, {case.name: case for case in cases}


def test_a_kit_is_a_reference(kit, capsys):
    folder, cases = kit
    assert compare(folder / "mine", folder / "kit", "--exact") == 0
    assert "intervals of the error model 'shader'" in capsys.readouterr().out
    main, *steps = cases["frame"].outputs
    upper = cases["frame"].bounds[main].upper
    for step in steps:  # they can be left out
        (folder / "mine" / f"frame_{step}.npy").unlink()
    np.save(folder / "mine" / f"frame_{main}.npy", upper)
    report = lfssao.compare(folder / "mine", folder / "kit")
    assert different(report) == {("frame", main): Verdict.INSIDE}
    np.save(folder / "mine" / f"frame_{main}.npy", np.nextafter(upper, np.float32(np.inf)))
    report = lfssao.compare(folder / "mine", folder / "kit")
    assert different(report) == {("frame", main): Verdict.OUTSIDE}
    assert report.first_failure.worst[0].upper is not None
    (folder / "mine" / f"frame_{main}.npy").unlink()
    assert different(lfssao.compare(folder / "mine", folder / "kit")) == {("frame", ""): Verdict.MISSING}


def test_a_case_of_a_kit_is_a_reference(kit, capsys):
    folder, cases = kit
    (folder / "one").mkdir()
    ((name, array),) = cases["philox"].outputs.items()
    np.save(folder / "one" / f"{name}.npy", array)
    case = folder / "kit" / "cases" / "philox"
    assert compare(folder / "one", case, "--exact") == 0
    np.save(folder / "one" / f"{name}.npy", array ^ np.uint32(1))
    assert compare(folder / "one", case) == 2
    text = (case / "case.json").read_text()
    assert text.count('"format": 1') == 1
    (case / "case.json").write_text(text.replace('"format": 1', '"format": 2'))
    capsys.readouterr()
    assert compare(folder / "one", case) == 4
    assert "the kit is of format 2" in capsys.readouterr().out
    index = folder / "kit" / "kit.json"
    index.write_text(index.read_text().replace('"format": 1', '"format": 2'))
    assert compare(folder / "mine", folder / "kit") == 4
    assert "the kit is of format 2" in capsys.readouterr().err


# Estimators


def test_another_estimators_occlusion_is_said_to_have_no_interval(tmp_path, capsys, reference):
    folder = with_entry(reference, tmp_path / "reference", ("settings", "estimator"), "hbao")
    mine = changed(reference, tmp_path / "mine", "module_004", nudge("ao_1"))
    assert compare(mine, folder) == 2
    text = capsys.readouterr().out
    assert "of estimator hbao must have equal values" in text
    assert "module_004, ao_1: different" in text
    assert compare(mine, reference) == 0
    assert "must have equal values" not in capsys.readouterr().out


SMALL = ["render", "statue", "--display", "sample-a", "--modules", "4:5", "--resolution", "32x24", "--radii", "4%"]


@pytest.mark.parametrize("estimator", ["hemisphere", "vo-points"])
def test_estimators_that_count_points_have_intervals(tmp_path, capsys, estimator):
    reference = tmp_path / "reference"
    assert lfssao.cli.main.main([*SMALL, "--estimator", estimator, "-o", str(reference)]) == 0
    inside = changed(reference, tmp_path / "inside", "module_004", nudge("ao_1"))
    report = lfssao.compare(inside, reference)
    assert different(report)["module_004", "ao_1"] is Verdict.INSIDE
    assert (report.exit_code, report.estimator) == (0, None)
    assert different(lfssao.compare(inside, reference, model="strict"))["module_004", "ao_1"] is Verdict.DIFFERENT
    place = tuple(np.argwhere(np.isfinite(single(reference, "module_004", "depth")[..., 0]))[40])
    mine = changed(reference, tmp_path / "mine", "module_004", poke("ao_1", place, 0.777))
    found = lfssao.compare(mine, reference).results
    assert [r.verdict for r in found if r.layer == "ao_1"] == [Verdict.OUTSIDE]
    (worst,) = (r.worst[0] for r in found if r.layer == "ao_1")
    assert worst.lower[0] <= worst.reference[0] <= worst.upper[0]
    assert worst.reason == f"0 of {8 if estimator == 'hemisphere' else 12} points are undecided"
    option, value = ("thickness", 0.1) if estimator == "vo-points" else ("range_check", "yes")
    other = with_entry(reference, tmp_path / "other", ("settings", "parameters", option), value)
    capsys.readouterr()
    code = compare(inside, other)
    said = capsys.readouterr()
    if estimator == "vo-points":  # the directions in which texels look are no layer
        assert (code, "of estimator vo-points must have equal values" in said.out) == (2, True)
    else:
        assert (code, said.err.count("\n"), "range_check" in said.err) == (4, 1, True)


# Bad input


def test_the_reference_must_be_what_its_manifest_says(tmp_path, capsys, reference):
    folder = copied(reference, tmp_path / "folder")
    text = (reference / "manifest.json").read_text()
    (folder / "manifest.json").write_text(text.replace('"format": 1', '"format": 2', 1))
    assert compare(reference, folder) == 4
    assert "a newer version of lfssao wrote it" in capsys.readouterr().err
    (folder / "manifest.json").write_text(text[: len(text) // 2])
    assert compare(reference, folder) == 4
    assert "it is not a JSON file" in capsys.readouterr().err
    (folder / "manifest.json").write_text(text)
    assert compare(reference, folder) == 0
    (folder / "module_004.exr").write_bytes((reference / "module_003.exr").read_bytes())
    capsys.readouterr()
    assert compare(reference, folder) == 4
    assert "is not what manifest.json describes" in capsys.readouterr().out
