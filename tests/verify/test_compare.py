"""``lfssao compare``: verdicts, figures, exit codes, matching of channels, reports; that idiff's traps are not here."""

import functools
import json
import operator
import shutil
import subprocess
import sys
import zlib
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import OpenImageIO as oiio
import pytest
from compare_folders import LAYERS, MODULES, changed, compare, copied, nudge, poke, rendered, with_pixels
from PIL import Image

import lfssao
from lfssao.errors import InputError
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.view import KINDS, WorldToImage
from lfssao.rendering.exr import Part, read_exr, write_exr
from lfssao.rendering.image_file import read_image_file
from lfssao.verify.bounds import bounds, post, ssao
from lfssao.verify.bounds.depth import displaced, stray_limit
from lfssao.verify.compare.metrics import measure, ulp_distance
from lfssao.verify.kit.cases import make_case
from lfssao.verify.kit.folder import write_kit
from lfssao.verify.verdict import Verdict


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    return rendered(tmp_path_factory.mktemp("compare") / "reference")


@pytest.fixture(scope="module")
def light(tmp_path_factory):
    """The folder of a camera, with a guard band."""
    folder = tmp_path_factory.mktemp("compare") / "camera"
    words = ["render", "statue", "--camera", "--resolution", "48x32", "--radii", "4%", "--guard", "3", "--normals"]
    assert lfssao.cli.main.main([*words, "-o", str(folder)]) == 0
    return folder


def verdicts(report):
    return {(r.module, r.layer): r.verdict for r in report.results}


def different(report):
    return {key: verdict for key, verdict in verdicts(report).items() if verdict is not Verdict.EQUAL_BITS}


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


def test_each_stage_is_judged_on_the_renderers_own(tmp_path, reference):
    """A wrong ao_1 with the right maximum, blur and shading of it: ao_1 alone is wrong."""

    def change(parts):
        surface = np.isfinite(parts["depth"].pixels)
        ao = np.where(surface, np.float32(1), parts["ao_1"].pixels)
        merged = lfssao.merge([ao[..., 0], parts["ao_2"].pixels[..., 0]])
        blurred = lfssao.blur(merged, 1.0)
        color = parts["color"]
        shaded = lfssao.shade(np.stack([color.pixels[..., color.channels.index(f"color.{c}")] for c in "RGB"], -1),
                              blurred)  # fmt: skip
        new = {"ao_1": ao, "merged": merged[..., None], "blurred": blurred[..., None], "shaded": shaded}
        return {**parts, **{name: replace(parts[name], pixels=pixels) for name, pixels in new.items()}}

    mine = changed(reference, tmp_path / "mine", "module_005", change)
    report = lfssao.compare(mine, reference)
    expected = dict.fromkeys(("merged", "blurred", "shaded"), Verdict.INSIDE) | {"ao_1": Verdict.OUTSIDE}
    assert different(report) == {("module_005", layer): verdict for layer, verdict in expected.items()}
    assert report.first_failure.layer == "ao_1"


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


# Figures


def test_ulp_distance_counts_numbers():
    a = np.array([1, -0.0, 1e-45, -1e-45, 3.4028235e38, 1], np.float32)
    b = np.array([np.nextafter(np.float32(1), np.float32(2)), 0, -1e-45, 1e-45, -3.4028235e38, 1], np.float32)
    assert ulp_distance(a, b).tolist() == [1, 0, 2, 2, 2 * 0x7F7FFFFF, 0]
    most = np.array([1.7976931348623157e308])
    assert ulp_distance(most, -most).tolist() == [2 * 0x7FEFFFFFFFFFFFFF]
    assert ulp_distance(np.float16([1, -1]), np.float16([1.001, 1])).tolist() == [1, 2 * 0x3C00]
    assert ulp_distance(np.uint8([0, 255]), np.uint8([255, 0])).tolist() == [255, 255]


def test_figures_are_those_of_their_formulas():
    from skimage.metrics import peak_signal_noise_ratio

    rng = np.random.default_rng(3)
    b = rng.random((20, 30), np.float32)
    a = b + rng.normal(0, 0.01, b.shape).astype(np.float32)
    found = measure((a,), (b,))
    error = a.astype(np.float64) - b
    assert found.differing == int((a != b).sum())
    assert found.mean_error == pytest.approx(np.abs(error).mean())
    assert found.rmse == pytest.approx(np.sqrt((error**2).mean()))
    assert found.max_error == np.abs(error).max()
    assert found.psnr == pytest.approx(peak_signal_noise_ratio(b.astype(float), a.astype(float), data_range=1))
    assert 0.9 < found.ssim < 1
    assert measure((1 - b,), (b,)).ssim < 0


def test_figures_leave_out_what_is_not_finite_and_count_it():
    b = np.linspace(0, 1, 100, dtype=np.float32).reshape(10, 10)
    a = b.copy()
    b[0, :4] = [np.inf, np.inf, 1, np.nan]
    a[0, :4] = [-np.inf, 1, np.nan, np.nan]
    found = measure((a,), (b,))
    assert (found.infinity_mismatches, found.nan_mismatches) == (2, 1)
    assert (found.differing, found.max_ulp, found.max_error, found.rmse, found.ssim) == (3, 0, 0, 0, 1)


@pytest.mark.parametrize("shape", [(1, 1), (2, 9), (3, 3), (5, 8)])
def test_small_textures_have_figures(shape):
    found = measure((np.ones(shape, np.float32),), (np.zeros(shape, np.float32),))
    assert found.psnr == 0
    assert (found.ssim is None) == (min(shape) < 3)


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


def test_sizes_are_not_filled_up(tmp_path, capsys):
    for name, shape in (("a", (4, 5, 1)), ("b", (4, 6, 1))):
        write_exr(tmp_path / f"{name}.exr", [Part("merged", ("merged.AO",), np.zeros(shape, np.float32))])
    assert compare(tmp_path / "a.exr", tmp_path / "b.exr") == 3
    assert "it has 5x4 texels, the reference's has 6x4" in capsys.readouterr().out


def test_a_cropped_data_window_is_no_smaller_image(tmp_path, capsys):
    for name, guard in (("a", 0), ("b", 1)):
        write_exr(tmp_path / f"{name}.exr", [Part("depth", ("Z",), np.zeros((4, 5, 1), np.float32), guard=guard)])
    assert compare(tmp_path / "a.exr", tmp_path / "b.exr") == 3
    assert "its data window starts at (0, 0), the reference's at (-1, -1)" in capsys.readouterr().out


def test_all_parts_are_compared(tmp_path, reference):
    last = list(read_exr(reference / "module_003.exr"))[-1]
    mine = changed(reference, tmp_path / "mine", "module_003", poke(last, (0, 0), 0.25))
    assert compare(mine / "module_003.exr", reference / "module_003.exr") == 2


def test_channels_that_are_missing_are_noticed(tmp_path, capsys):
    three = np.zeros((4, 5, 3), np.float32)
    write_exr(tmp_path / "a.exr", [Part("positions", ("P.X", "P.Y"), three[..., :2])])
    write_exr(tmp_path / "b.exr", [Part("positions", ("P.X", "P.Y", "P.Z"), three)])
    assert compare(tmp_path / "a.exr", tmp_path / "b.exr") == 3
    assert "there is no channel for P.Z" in capsys.readouterr().out
    assert compare(tmp_path / "b.exr", tmp_path / "a.exr") == 1


@pytest.mark.parametrize(("kind", "ending"), [("half", "exr"), ("double", "tif"), ("uint8", "tif")])
def test_another_data_type_is_not_converted(tmp_path, capsys, kind, ending):
    files = [tmp_path / f"{name}.{ending}" for name in ("a", "b")]
    for file, dtype in zip(files, (kind, "float"), strict=True):
        write_image(file, np.ones((4, 5, 1), np.float32), dtype)
    assert compare(*files) == 3
    assert "the reference's is of float32" in capsys.readouterr().out


# Files and names


def single(reference, module, layer):
    """(H, W, C), channels R G B and X Y Z in that order."""
    part = read_exr(reference / f"{module}.exr")[layer]
    order = sorted(range(len(part.channels)), key=lambda k: "RGBXYZ".find(part.channels[k][-1]))
    return np.ascontiguousarray(part.pixels[..., order])


def write_image(path, pixels, dtype="float"):
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), oiio.ImageSpec(*pixels.shape[1::-1], pixels.shape[2], dtype))
    assert file.write_image(pixels)
    assert file.close()


def test_one_file_a_layer_in_other_formats(tmp_path, reference):
    for module in MODULES:
        for layer in LAYERS:
            pixels = single(reference, module, layer)
            if layer in ("depth", "ao_1", "positions"):
                np.save(tmp_path / f"{module}_{layer}.npy", np.squeeze(pixels))
            elif layer == "ao_2":
                write_exr(tmp_path / f"{module}-{layer}.exr", [Part("", ("Y",), pixels)])
            else:
                write_image(tmp_path / f"{module}.{layer}.tif", pixels)
    report = lfssao.compare(tmp_path, reference)
    assert set(verdicts(report)) == {(module, layer) for module in MODULES for layer in LAYERS}
    assert not different(report)
    assert report.exit_code == 0


def test_one_part_with_layered_names_and_columns_first(tmp_path, reference):
    parts = read_exr(reference / "module_003.exr")
    names = [name for part in parts.values() for name in part.channels]
    pixels = np.concatenate([part.pixels for part in parts.values()], axis=-1)
    (tmp_path / "mine").mkdir()
    write_exr(tmp_path / "mine" / "module_003.exr", [Part("", tuple(names), pixels)])
    report = lfssao.compare(tmp_path / "mine" / "module_003.exr", reference / "module_003.exr")
    assert (report.exit_code, len(report.results), len(different(report))) == (0, len(LAYERS), 0)
    # A single file of a rendered folder has its manifest, and so its intervals.
    assert report.model == "shader"
    np.save(tmp_path / "a.npy", np.asfortranarray(pixels[..., :2]))
    np.save(tmp_path / "b.npy", np.ascontiguousarray(pixels[..., :2]).astype(">f4"))
    assert compare(tmp_path / "a.npy", tmp_path / "b.npy", "--exact") == 0


def test_names_by_map(tmp_path, capsys, reference):
    def rename(parts):
        out = dict(parts)
        out["ssao"] = replace(out.pop("merged"), name="ssao", channels=("R",))
        out["G"] = replace(out.pop("positions"), name="G", channels=("Z", "X", "Y"))
        return out

    mine = changed(reference, tmp_path / "mine", "module_003", rename) / "module_003.exr"
    right = reference / "module_003.exr"
    swapped = read_exr(mine)["G"]
    order = [swapped.channels.index(c) for c in ("Z", "X", "Y")]
    parts = read_exr(mine)
    parts["G"] = replace(swapped, channels=("X", "Y", "Z"), pixels=swapped.pixels[..., order])
    write_exr(mine, list(parts.values()))
    assert compare(mine, right) == 2
    assert compare(mine, right, "--map", "ssao=merged", "--map", "G=positions") == 0
    assert compare(mine, right, "--map", "ssao.R=merged.AO", "--map", "G.X=P.X", "--map", "G.Y=P.Y", "--map",
                   "G.Z=P.Z") == 0  # fmt: skip
    capsys.readouterr()
    assert compare(mine, right, "--map", "ssao=positions", "--map", "ssao=merged") == 3
    assert "'ssao' has 1 channels, positions has 3" in capsys.readouterr().out
    assert compare(mine, right, "--map", "blurred=merged", "--map", "G=positions") == 2
    assert compare(mine, right, "--map", "nothing=merged", "--map", "G=positions") == 2
    assert "module_003, merged: missing" in capsys.readouterr().out


def test_another_layers_channel_is_not_taken(tmp_path):
    """Without 'merged' its channel is not looked for in 'blurred', though that alone has a 'Y'."""
    ones = np.ones((4, 5), np.float32)
    for side, layers in (("mine", ["blurred"]), ("right", ["blurred", "merged"])):
        (tmp_path / side).mkdir()
        for layer in layers:
            np.save(tmp_path / side / f"module_000_{layer}.npy", ones)
    report = lfssao.compare(tmp_path / "mine", tmp_path / "right")
    assert report.exit_code == 2
    write_exr(tmp_path / "mine.exr", [Part("blurred", ("Y",), ones[..., None])])
    write_exr(tmp_path / "right.exr", [Part(name, ("Y",), ones[..., None]) for name in ("blurred", "merged")])
    report = lfssao.compare(tmp_path / "mine.exr", tmp_path / "right.exr")
    assert different(report) == {("right", "merged"): Verdict.MISSING}


def test_plain_pictures(tmp_path, capsys):
    codes = np.random.default_rng(5).integers(0, 256, (9, 8, 4), np.uint8)
    Image.fromarray(codes).save(tmp_path / "a.png")
    other = codes.copy()
    other[3, 4, 1] ^= 1
    Image.fromarray(other).save(tmp_path / "b.png")
    assert compare(tmp_path / "a.png", tmp_path / "a.png") == 0
    assert "no interval is known" in capsys.readouterr().out
    assert compare(tmp_path / "a.png", tmp_path / "b.png") == 2
    report = lfssao.compare(tmp_path / "a.png", tmp_path / "b.png")
    (result,) = report.results
    # Alpha is not multiplied in: one code of one channel differs, by one.
    assert (result.metrics.differing, result.metrics.max_ulp, result.metrics.max_error) == (1, 1, 1)
    assert (result.worst[0].column, result.worst[0].row) == (4, 3)


def test_folders_of_pictures(tmp_path):
    codes = np.arange(60, dtype=np.uint16).reshape(6, 10)
    for side in ("a", "b"):
        (tmp_path / side).mkdir()
        for name in ("one", "two"):
            Image.fromarray(codes).save(tmp_path / side / f"{name}.png")
    assert compare(tmp_path / "a", tmp_path / "b") == 0
    Image.fromarray(codes).save(tmp_path / "a" / "three.png")
    assert compare(tmp_path / "a", tmp_path / "b") == 1
    assert compare(tmp_path / "b", tmp_path / "a") == 2


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


# Reports


@pytest.fixture(scope="module")
def failing(tmp_path_factory, reference):
    """A conforming module, one that fails in a stage, one with a file that cannot be read."""
    mine = tmp_path_factory.mktemp("compare") / "mine"
    changed(reference, mine, "module_004", poke("merged", (16, 24), np.nan))
    (mine / "module_005.exr").write_bytes(b"rubbish")
    return mine


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
    wrong = by_place["module_004", "merged"]
    assert wrong["metrics"]["nan_mismatches"] == 1
    assert wrong["worst"][0]["mine"] == ["nan"]


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


def test_picture_shows_the_first_module_that_fails(tmp_path, reference, failing):
    path = tmp_path / "difference.png"
    compare(failing, reference, "--picture", path)
    report = lfssao.compare(failing, reference)
    assert report.panels.module == "module_004"
    (row,) = report.panels.rows
    assert row["difference"][16, 24] == np.inf
    assert row["verdict"][16, 24] == 2
    assert (row["verdict"] > 0).sum() == 1
    with Image.open(path) as picture:
        shown = np.asarray(picture.convert("RGB")).reshape(-1, 3).tolist()
    assert [255, 0, 255] in shown  # a number on one side only
    assert [214, 39, 40] in shown  # outside
    compare(reference, reference, "--picture", path)
    with Image.open(path) as picture:
        assert [255, 0, 255] not in np.asarray(picture.convert("RGB")).reshape(-1, 3).tolist()


def test_the_picture_holds_surfaces_where_the_reference_has_none(tmp_path, reference):
    """Shifted: at silhouettes one side is infinite, which is no number of a colour bar."""

    def shifted(parts):
        depth = parts["depth"]
        return {**parts, "depth": replace(depth, pixels=np.roll(depth.pixels, 2, axis=1))}

    mine = changed(reference, tmp_path / "mine", "module_003", shifted)
    assert compare(mine, reference, "--picture", tmp_path / "a.png") == 2
    (row,) = lfssao.compare(mine, reference).panels.rows
    assert np.isinf(row["difference"]).any()
    assert np.max(row["difference"], where=np.isfinite(row["difference"]), initial=0) < 1
    with Image.open(tmp_path / "a.png") as picture:
        assert [255, 0, 255] in np.asarray(picture.convert("RGB")).reshape(-1, 3).tolist()


# The mesh


def off_centre(reference, target, du, dv, scene="statue"):
    """The reference's depth texture, looked at (du, dv) texels off its texels' centres."""
    mesh = lfssao.builtin_scene(scene)
    views = lfssao.module_views(mesh, lfssao.find_display("sample-a").with_resolution(48, 32), range(3, 6))
    depth = RayCaster(mesh, views[1].cast_from_world).gbuffer(displaced(views[1], du, dv), color=None).depth

    def change(parts):
        parts["depth"] = replace(parts["depth"], pixels=depth[..., None])

    return changed(reference, target, "module_004", change)


def with_entry(reference, target, place, value):
    """A copy of a rendered folder whose manifest has another value at a place, a path of keys."""
    shutil.copytree(reference, target)
    manifest = json.loads((target / "manifest.json").read_text())
    entry = functools.reduce(operator.getitem, place[:-1], manifest)
    entry[place[-1]] = value
    (target / "manifest.json").write_text(json.dumps(manifest))
    return target


def without_scene(reference, target):
    """The same folder of a mesh file that is not at hand."""
    return with_entry(reference, target, ("scene", "name"), "mine.obj")


def test_depth_is_judged_by_the_mesh(tmp_path, capsys, reference):
    near, half = (
        off_centre(reference, tmp_path / "near", 0.0035, -0.003),
        off_centre(reference, tmp_path / "half", 0.5, 0.5),
    )
    report = lfssao.compare(near, reference)
    assert different(report) == {("module_004", "depth"): Verdict.INSIDE}
    assert report.exit_code == 0
    assert report.first_difference.worst[0].reason.endswith(
        "0.0039 texel of the texel's centre, see this interval of depth"
    )
    report = lfssao.compare(half, reference)
    assert ("module_004", "depth") in {(r.module, r.layer) for r in report.results if r.verdict is Verdict.OUTSIDE}
    reasons = {texel.reason for texel in report.first_failure.worst}
    assert "nine rays into the mesh, within 0.0039 texel of the texel's centre, see nothing" in reasons
    assert compare(near, without_scene(reference, tmp_path / "file"), "--mesh", "statue") == 0
    assert compare(near, reference, "--mesh", "ammonite") == 4
    assert "ammonite is not the scene that the reference was rendered of, statue" in capsys.readouterr().err
    assert compare(near / "module_003.exr", near / "module_004.exr", "--mesh", "statue") == 4
    assert "is not what 'lfssao render' writes" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("place", "value", "code"),
    [
        (("scene", "name"), "ammonite", 1),  # another version's scene of that name: as if there were none
        (("scene", "name"), [], 4),
        (("scene",), None, 4),
        (("display", "modules"), [], 4),
        (("display", "screen_width"), "x", 4),
        (("views", 1, "view", "cast_from_world"), [[1]], 4),
        (("views", 1, "view", "width"), 10**9, 1),
        (("frame",), {"world_from_scene": 5}, 4),
        (("settings", "color_filter"), 7, 4),
    ],
    ids=str,
)
def test_a_manifest_that_does_not_give_the_mesh_its_view(tmp_path, capsys, reference, place, value, code):
    folder = with_entry(reference, tmp_path / "reference", place, value)
    surface = np.argwhere(np.isfinite(single(reference, "module_004", "depth")[..., 0]))[40]
    mine = changed(reference, tmp_path / "mine", "module_004", poke("depth", tuple(surface), 2.0))
    assert compare(mine, folder, "--layers", "depth") == code
    assert ("manifest" in capsys.readouterr().err) == (code == 4)


def test_another_estimators_occlusion_is_said_to_have_no_interval(tmp_path, capsys, reference):
    folder = with_entry(reference, tmp_path / "reference", ("settings", "estimator"), "hbao")
    mine = changed(reference, tmp_path / "mine", "module_004", nudge("ao_1"))
    assert compare(mine, folder) == 2
    text = capsys.readouterr().out
    assert "of estimator hbao must have equal values" in text
    assert "module_004, ao_1: different" in text
    assert compare(mine, reference) == 0
    assert "must have equal values" not in capsys.readouterr().out


def test_a_missing_layer_is_said_with_what_may_be_it(tmp_path, capsys, reference):
    """Another name, a wrong rule, files of other names."""

    def rename(parts):
        merged = parts.pop("merged")
        return {**parts, "ssao": replace(merged, name="ssao", channels=("ssao.R",))}

    mine = changed(reference, tmp_path / "mine", "module_004", rename)
    assert compare(mine, reference) == 2
    sentence = "if it is one of ssao.ssao.R, say so by --map, such as --map ssao.ssao.R=merged.AO"
    assert f"module_004, merged: missing: there is no such layer; {sentence}" in capsys.readouterr().out
    assert compare(mine, reference, "--map", "nothing=merged", "--layers", "merged") == 2
    assert "missing: there is no layer or channel 'nothing', which --map names" in capsys.readouterr().out
    (tmp_path / "other").mkdir()
    shutil.copy(reference / "module_004.exr", tmp_path / "other" / "frame.exr")
    assert compare(tmp_path / "other", reference) == 2
    assert "has no file of it, such as module_003.exr or module_003_LAYER.npy" in capsys.readouterr().out


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


def test_without_the_mesh_a_texel_that_cannot_be_judged_is_a_warning_and_many_are_a_failure(tmp_path, reference):
    unknown = without_scene(reference, tmp_path / "file")
    limit = stray_limit(single(reference, "module_004", "depth")[..., 0])
    assert limit > 0
    for count in (limit, limit + 1):

        def change(parts, count=count):
            def put(pixels):
                surface = np.argwhere(np.isfinite(pixels[..., 0]))[5::15][:count]
                assert len(surface) == count
                pixels[surface[:, 0], surface[:, 1], 0] = -1.5

            parts["depth"] = with_pixels(parts["depth"], put)

        mine = changed(reference, tmp_path / f"mine_{count}", "module_004", change)
        report = lfssao.compare(mine, unknown)
        if count == limit:
            assert different(report) == {("module_004", "depth"): Verdict.INSIDE}
            assert report.notes == (
                f"module_004, depth: {limit} texels outside the interval, which only the mesh can judge (--mesh FILE); "
                f"up to {limit} may look past an edge (4 standard deviations)",
            )
            assert report.exit_code == 1
        else:
            assert different(report) == {("module_004", "depth"): Verdict.OUTSIDE}
        assert lfssao.compare(mine, reference).first_failure.layer == "depth"


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


def test_the_code_survives_a_closed_pipe(reference, failing):
    script = f"{sys.executable} -m lfssao compare {failing} {reference} | head -c 1; exit ${{PIPESTATUS[0]}}"
    assert subprocess.run(["bash", "-c", script], capture_output=True, check=False).returncode == 4


def test_progress_is_shown_on_terminals_only(capsys, reference):
    compare(reference, reference)
    assert capsys.readouterr().err == ""


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


def test_truncated_files_are_named(tmp_path, capsys, reference):
    mine = copied(reference, tmp_path / "mine")
    whole = (mine / "module_004.exr").read_bytes()
    (mine / "module_004.exr").write_bytes(whole[: len(whole) // 2])
    assert compare(mine, reference) == 4
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("module_004")]
    assert len(lines) == 1
    assert str(mine / "module_004.exr") in lines[0]


def test_a_header_of_a_thousand_million_pixels_is_refused(tmp_path, reference):
    mine = copied(reference, tmp_path / "mine")
    data = (mine / "module_004.exr").read_bytes()
    old = np.array([0, 0, 47, 31], "<i4").tobytes()
    assert data.count(old) > 8
    (mine / "module_004.exr").write_bytes(data.replace(old, np.array([0, 0, 31622, 31622], "<i4").tobytes()))
    report = lfssao.compare(mine, reference)
    (wrong,) = different(report).items()
    assert wrong == (("module_004", ""), Verdict.UNREADABLE)


def test_npy_files_are_checked_before_they_are_read(tmp_path):
    def refused(words):
        with pytest.raises(InputError, match=words):
            read_image_file(tmp_path / "a.npy")

    np.save(tmp_path / "a.npy", np.ones((3, 4), np.float32))
    data = (tmp_path / "a.npy").read_bytes()
    (tmp_path / "a.npy").write_bytes(data[:-1])
    refused("is damaged")
    (tmp_path / "a.npy").write_bytes(data.replace(b"(3, 4)", b"(30000, 40000)"))
    refused("is damaged|cannot be read")
    np.save(tmp_path / "a.npy", np.array([{}], object), allow_pickle=True)
    refused("holds object")
    np.save(tmp_path / "a.npy", np.ones((1, 2, 3, 4)))
    refused(r"expected numbers of shape \(H, W\)")
    (tmp_path / "a.npy").write_bytes(b"\x93NUMPY")
    refused("cannot be read as an NPY file")


def test_deep_images_and_other_formats_are_refused(tmp_path):
    Image.new("RGB", (4, 4)).save(tmp_path / "a.bmp")
    with pytest.raises(InputError, match="of format bmp, not EXR, TIFF, PNG or NPY"):
        read_image_file(tmp_path / "a.bmp")
    spec = oiio.ImageSpec(4, 4, 1, "float")
    spec.deep = True
    data = oiio.DeepData()
    data.init(16, 1, oiio.TypeFloat, ("Z",))
    file = oiio.ImageOutput.create(str(tmp_path / "deep.exr"))
    assert file.open(str(tmp_path / "deep.exr"), spec)
    assert file.write_deep_image(data)
    file.close()
    with pytest.raises(InputError, match="deep image"):
        read_image_file(tmp_path / "deep.exr")


def test_sizes_that_the_format_believes_are_refused_by_the_files_own(tmp_path):
    """OpenEXR looks at its table of chunks; of a PNG OpenImageIO believes what is not enormous."""
    Image.new("RGB", (4, 4)).save(tmp_path / "a.png")
    data = bytearray((tmp_path / "a.png").read_bytes())
    data[16:24] = (10_000).to_bytes(4, "big") * 2
    data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
    (tmp_path / "a.png").write_bytes(data)
    with pytest.raises(InputError, match="its header claims 10000x10000 texels"):
        read_image_file(tmp_path / "a.png")
