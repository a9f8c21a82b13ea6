"""A job's folder: what is written, that the manifest tells the truth, and that nothing is left half-written."""

import hashlib
import json
import os
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from exr_parts import by_channel, read_parts
from PIL import Image

from lfssao import RayCaster, Settings, builtin_scene, find_display, module_views
from lfssao.ao.estimators.registry import find_estimator
from lfssao.cli.main import main
from lfssao.core.files import check_folder, output_folder, write_whole
from lfssao.errors import InputError
from lfssao.gbuffer.embree import embree_installed
from lfssao.rendering import exr, memory
from lfssao.rendering.contact import contact_sheet, sheet_rows, strip
from lfssao.rendering.memory import available_memory, check_memory, needed_memory
from lfssao.rendering.passes import render_view

TEXTURES = {
    "shaded": ("R", "G", "B"),
    "depth": ("Z",),
    "positions": ("P.X", "P.Y", "P.Z"),
    "color": ("color.R", "color.G", "color.B"),
    "ao_1": ("ao_1.AO",),
    "ao_2": ("ao_2.AO",),
    "merged": ("merged.AO",),
    "blurred": ("blurred.AO",),
}
PASSES = {"build_bvh", "ray_cast", "ao", "merge", "blur", "shade", "digest", "write", "contact"}
COMMAND = ["render", "statue", "--display", "sample-a", "--modules", "3:5", "--resolution", "64x48",
           "--radii", "0.05,4%", "--samples", "6", "--seed", "9", "--blur", "1.5"]  # fmt: skip


def run(folder, *words):
    assert main([*words, "-o", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return run(tmp_path_factory.mktemp("job") / "out", *COMMAND)


@pytest.fixture(scope="module")
def manifest(folder):
    def refuse(word):
        raise AssertionError(f"{word} is not JSON")

    return json.loads((folder / "manifest.json").read_text("utf-8"), parse_constant=refuse)


def read(path):
    """Part name -> (attributes, channel name -> (H, W) array), by OpenImageIO alone."""
    return {
        spec["name"]: ({a.name: a.value for a in spec.extra_attribs}, by_channel(spec, pixels))
        for spec, pixels in read_parts(path)
    }


def test_folder_holds_what_is_promised(folder):
    assert sorted(os.listdir(folder)) == ["contact.png", "manifest.json", "module_003.exr", "module_004.exr"]


def test_parts_and_channels_are_the_documented_ones(folder):
    found = read(folder / "module_003.exr")
    assert list(found) == list(TEXTURES)
    for name, channels in TEXTURES.items():
        attributes, arrays = found[name]
        assert set(arrays) == set(channels)
        for array in arrays.values():
            assert (array.dtype, array.shape) == (np.float32, (48, 64))
            assert not np.isnan(array).any()
        if name in ("merged", "blurred", "ao_1", "ao_2"):
            assert "0 open, 1 covered" in attributes["lfssao:AO"]
    assert "metres" in found["depth"][0]["lfssao:depth"]
    assert found["blurred"][0]["lfssao:sigma"] == 1.5


def test_textures_belong_together(folder):
    found = {name: np.stack([arrays[c] for c in TEXTURES[name]], axis=-1)
             for name, (_, arrays) in read(folder / "module_004.exr").items()}  # fmt: skip
    empty = np.isinf(found["depth"][..., 0])
    assert 0 < empty.sum() < empty.size
    assert np.isposinf(found["positions"][empty]).all()
    assert np.isfinite(found["positions"][~empty]).all()
    assert np.array_equal(found["merged"], np.maximum(found["ao_1"], found["ao_2"]))
    # Six samples: occlusion is a number of sixths.
    assert found["ao_1"] * 6 == pytest.approx(np.round(found["ao_1"] * 6), abs=1e-5)
    assert found["shaded"] == pytest.approx(found["color"] * (1 - found["blurred"]), abs=1e-6)
    assert 0.05 < found["blurred"][~empty].mean() < 0.95


def test_digests_are_those_of_the_files_pixels(folder, manifest):
    for view in manifest["views"]:
        found = read(folder / view["file"])
        assert set(view["textures"]) == set(found)
        for name, entry in view["textures"].items():
            pixels = np.stack([found[name][1][channel] for channel in entry["channels"]], axis=-1)
            assert list(pixels.shape) == entry["shape"]
            assert entry["dtype"] == "float32"
            assert hashlib.sha256(pixels.astype("<f4").tobytes()).hexdigest() == entry["sha256"]


def test_manifest_has_all_parameters(folder, manifest):
    settings, machine = manifest["settings"], manifest["machine"]
    x, y, z = np.subtract(*manifest["scene"]["bounds"][::-1])
    assert settings["radii"] == [0.05, pytest.approx(0.04 * (x * x + y * y + z * z) ** 0.5)]
    assert np.shape(settings["samples"]) == (6, 3)
    assert settings["blur_sigma"] == 1.5
    assert settings["caster"] == "exact"
    assert len(settings["blur_weights"]) == 2 * 5 + 1  # ceil(3 sigma) to each side
    assert manifest["sampling"] == {"method": "latin", "count": 6, "seed": 9}
    assert manifest["display"]["name"] == "sample-a"
    assert len(manifest["display"]["modules"]) == 21
    assert manifest["camera"] is None
    assert manifest["scene"]["name"] == "statue"
    assert manifest["scene"]["faces"] == 5010
    assert machine["command"] == ["lfssao", *COMMAND, "-o", str(folder)]
    assert machine["threads"] >= 1
    for package in ("numpy", "numba", "trimesh", "OpenImageIO"):
        assert machine["packages"][package]
    assert (machine["packages"]["embreex"] is not None) == embree_installed()
    assert [view["name"] for view in manifest["views"]] == ["module_003", "module_004"]
    for view in manifest["views"]:
        assert (view["view"]["width"], view["view"]["height"]) == (64, 48)
        assert view["bytes"] == (folder / view["file"]).stat().st_size
        assert len(view["samples_outside"]) == 2
        assert set(view["seconds"]) == PASSES
    seconds = manifest["seconds"]
    assert set(seconds["passes"]) == PASSES
    assert all(value > 0 for value in (seconds["load"], seconds["passes"]["build_bvh"], seconds["render"]))
    assert seconds["passes"]["ao"] == pytest.approx(sum(view["seconds"]["ao"] for view in manifest["views"]))


def test_manifest_is_text_to_read(folder):
    lines = (folder / "manifest.json").read_text("utf-8").split("\n")
    assert lines[:2] == ["{", ' "format": 1,']
    assert lines[-3:] == [" ]", "}", ""]
    assert [line.split('"')[1] for line in lines if line.startswith('    "') and line.endswith("{")] == [*TEXTURES] * 2


def texture_digests(manifest):
    return [{name: t["sha256"] for name, t in view["textures"].items()} for view in manifest["views"]]


def test_equal_runs_make_equal_pixels(folder, manifest, tmp_path):
    again = run(tmp_path / "again", *COMMAND, "--threads", "1")
    second = json.loads((again / "manifest.json").read_text("utf-8"))
    assert texture_digests(second) == texture_digests(manifest)
    assert (folder / "contact.png").read_bytes() == (again / "contact.png").read_bytes()
    for part in ("format", "scene", "display", "sampling", "settings"):
        assert second[part] == manifest[part]
    assert second["machine"]["threads"] == 1


def test_seed_changes_the_textures(manifest, tmp_path):
    other = run(tmp_path / "other", *COMMAND, "--seed", "10")
    (before, _), (after, _) = (
        texture_digests(manifest),
        texture_digests(json.loads((other / "manifest.json").read_text())),
    )
    assert [name for name in before if before[name] == after[name]] == ["depth", "positions", "color"]


def test_scene_without_colour_has_no_colour_texture(tmp_path):
    (tmp_path / "a.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    out = run(tmp_path / "out", "render", str(tmp_path / "a.off"), "--resolution", "64x48")
    assert "color" not in read(out / "module_000.exr")


def test_camera_writes_one_view(tmp_path):
    out = run(tmp_path / "out", "render", "statue", "--resolution", "64x48", "--camera", "orthographic")
    assert sorted(os.listdir(out)) == ["camera.exr", "contact.png", "manifest.json"]
    manifest = json.loads((out / "manifest.json").read_text("utf-8"))
    assert (manifest["camera"], manifest["display"]) == ("orthographic", None)
    depth = read(out / "camera.exr")["depth"][1]["Z"]
    surface = depth[np.isfinite(depth)]
    assert 0 < surface.min() <= surface.max() < 1  # screen space z


# --- contact sheet


def test_contact_sheet_shows_the_three_pictures(folder):
    found = read(folder / "module_003.exr")
    with Image.open(folder / "contact.png") as image:
        sheet = np.asarray(image).astype(int)
    # 64x48 is shown 480 wide: each texel is 7.5 pixels; compare in the middle of large tiles of 2x2 texels.
    color = np.stack([found["color"][1][f"color.{c}"] for c in "RGB"], axis=-1)
    shaded = np.stack([found["shaded"][1][c] for c in "RGB"], axis=-1)
    visibility = np.repeat(1 - found["blurred"][1]["blurred.AO"][..., None], 3, axis=-1)

    def encoded(linear):
        linear = np.clip(linear, 0, 1).astype(float)
        return 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)

    for column, wanted in enumerate((encoded(color), 255.0 * visibility, encoded(shaded))):
        left, top = 12 + column * 492, 22
        for row in range(0, 48, 5):
            for texel in range(0, 64, 5):
                # A pixel within the texel (7.5 pixels a texel), away from its borders.
                pixel = sheet[top + int(7.5 * row + 3.75), left + int(7.5 * texel + 3.75)]
                assert pixel == pytest.approx(wanted[row, texel], abs=0.51 + 1e-3)


def test_contact_sheet_without_colour_has_one_channel_of_the_same_picture():
    random = np.random.default_rng(5)
    surface, blurred = random.random((24, 32)) < 0.5, random.random((24, 32), np.float32)
    white, shaded = (np.repeat(grey[..., None], 3, axis=2) for grey in (surface.astype(np.float32), blurred / 2))
    found, expected = (strip(color, surface, blurred, shaded) for color in (None, white))
    assert found.mode == contact_sheet([("one", found)] * 2).mode == "L"
    assert expected.mode == contact_sheet([("one", expected)]).mode == "RGB"
    np.testing.assert_array_equal(np.asarray(found.convert("RGB")), np.asarray(expected))


@pytest.mark.parametrize("size", ["1x900", "900x1", "1x1"])
def test_contact_sheet_of_a_thin_texture_stays_small(tmp_path, size):
    out = run(tmp_path / "out", "render", "statue", "--resolution", size)
    with Image.open(out / "contact.png") as sheet:
        width, height = sheet.size
    assert (width, height <= 480 + 22 + 12) == (3 * 480 + 4 * 12, True)


@pytest.mark.parametrize(
    ("count", "rows"), [(1, [0]), (5, [0, 1, 2, 3, 4]), (6, [0, 1, 2, 4, 5]), (21, [0, 5, 10, 15, 20])]
)
def test_contact_sheet_shows_a_handful_from_first_to_last(count, rows):
    assert sheet_rows(count) == rows


# --- failures


def lines(capsys):
    return capsys.readouterr().err.splitlines()


@pytest.mark.parametrize("after", [0, 1])
def test_failing_write_says_so_and_leaves_no_partial_file(tmp_path, monkeypatch, capsys, after):
    calls = []
    real = exr.write_parts

    def fail(path, parts):
        calls.append(1)
        real(path, parts)
        if len(calls) > after:
            raise OSError(5, "Input/output error")

    monkeypatch.setattr(exr, "write_parts", fail)
    out = tmp_path / "new" / "out"
    assert main([*COMMAND, "-o", str(out), "--threads", "1"]) == 2  # with more, two files are written at once
    error = lines(capsys)
    assert len(error) == 1
    assert f"module_00{3 if after == 0 else 4}.exr: it cannot be written" in error[0]
    if after == 0:  # nothing was written: the folders that were made for it are gone too
        assert list(tmp_path.iterdir()) == []
    else:
        assert os.listdir(out) == ["module_003.exr"]
        assert list(read(out / "module_003.exr")) == list(TEXTURES)


@pytest.mark.parametrize("name", ["module_000.exr", "contact.png", "manifest.json"])
def test_folder_in_the_way_of_a_file(tmp_path, capsys, name):
    (tmp_path / name).mkdir()
    (tmp_path / "mine").write_text("mine")
    assert main(["render", "statue", "--resolution", "64x48", "-o", str(tmp_path)]) == 2
    error = lines(capsys)
    assert len(error) == 1
    assert f"{name}: it cannot be written" in error[0]
    assert (tmp_path / "mine").read_text() == "mine"
    assert not [file for file in os.listdir(tmp_path) if file.startswith(".")]


def test_write_whole_keeps_the_old_file_when_interrupted(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")

    def interrupted(part):
        part.write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_whole(path, interrupted)
    assert os.listdir(tmp_path) == ["a.txt"]
    assert path.read_text() == "old"


def test_write_whole_replaces_and_does_not_overwrite(tmp_path):
    # Whoever has the old file open, or linked to it, keeps it whole.
    path = tmp_path / "a.txt"
    path.write_text("old")
    os.link(path, tmp_path / "link.txt")
    write_whole(path, lambda part: part.write_text("new"))
    assert (path.read_text(), (tmp_path / "link.txt").read_text()) == ("new", "old")


def test_write_whole_into_a_folder_that_went(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        write_whole(tmp_path / "a" / "b.txt", lambda part: part.write_text("x"))
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_whole(tmp_path / "file" / "b.txt", lambda part: part.write_text("x"))


def test_output_folder_removes_only_what_it_made(tmp_path):
    (tmp_path / "old").mkdir()

    def fail_in(path, *made):
        with output_folder(path):
            for name in made:
                (path / name).write_text("x")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_in(tmp_path / "old" / "new" / "newer")
    assert os.listdir(tmp_path) == ["old"]
    assert os.listdir(tmp_path / "old") == []
    with pytest.raises(KeyboardInterrupt):
        fail_in(tmp_path / "old")
    assert os.listdir(tmp_path) == ["old"]
    # A signal between making the temporary file and the clause that removes it leaves it to the folder.
    with pytest.raises(KeyboardInterrupt):
        fail_in(tmp_path / "new", "whole.exr", f".half.{os.getpid()}.part.exr", ".half.0.part.exr")
    assert sorted(os.listdir(tmp_path / "new")) == [".half.0.part.exr", "whole.exr"]


def test_check_folder_touches_nothing(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for bad in ("file", "file/a", "file/a/b", "link", "link/a"):
        with pytest.raises(InputError, match="the output folder cannot be made"):
            check_folder(tmp_path / bad)
    check_folder(tmp_path / "a" / "b")
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(InputError, match="no permission"):
        check_folder(tmp_path / "a" / "b")
    assert sorted(os.listdir(tmp_path)) == ["file", "link"]


def test_memory_is_checked_against_what_is_there(monkeypatch):
    assert available_memory() > 10_000_000
    monkeypatch.setattr(memory, "available_memory", lambda: 10**9)
    check_memory(2000, 2000, 5, 4)  # 0.5 GB
    with pytest.raises(InputError, match=r"resolution 4000x4000.* 2\.0 GB of memory, 1\.0 GB are available"):
        check_memory(4000, 4000, 5, 4)
    check_memory(2000, 3400, 5, 4)  # 0.9 GB
    with pytest.raises(InputError, match=r"resolution 2000x3400.* 1\.1 GB of memory, 1\.0 GB are available"):
        check_memory(2000, 3400, 5, 96)
    monkeypatch.setattr(memory, "available_memory", lambda: None)
    check_memory(2**16, 2**15 - 1, 5, 4)
    with pytest.raises(InputError, match="at most 2147483647 texels"):
        check_memory(2**16, 2**15, 5, 4)


def test_memory_is_what_the_passes_take():
    """Of sao where the texels' lines are a table, which needs more than all that comes after it."""
    mesh, display = builtin_scene(), find_display("convex")
    settings = Settings((0.1, 0.2), estimator="sao", normals="geometric")

    def rendering(width, height):
        module = replace(display.modules[0], width=width, height=height)
        (view,) = module_views(mesh, replace(display, modules=(module,)))
        caster = RayCaster(mesh, view.cast_from_world)
        caster.gbuffer(view)  # Embree's tree is built by the first one
        return lambda: render_view(caster, view, settings)

    def peak(width, height):
        render = rendering(width, height)
        tracemalloc.start()
        try:
            render()
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    rendering(20, 10)()  # what is made once; to trace the compiler's memory takes four times as long as to compile
    texels = 240 * 180 - 80 * 60
    needed = needed_memory(texels, 2, find_estimator("sao").texel_bytes)
    assert needed == 144 * texels
    assert 0.97 * needed < peak(240, 180) - peak(80, 60) < 1.03 * needed


def test_memory_without_proc(monkeypatch):
    def missing(*_, **__):
        raise FileNotFoundError

    monkeypatch.setattr(Path, "read_text", missing)
    assert available_memory() == os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def test_an_interrupted_job_leaves_no_manifest_of_an_earlier_one(tmp_path, monkeypatch):
    arguments = ["render", "ammonite", "-o", str(tmp_path), "--resolution", "16x12", "--samples", "1", "--radii", "1%"]
    assert main(arguments) == 0
    assert (tmp_path / "manifest.json").exists()

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("lfssao.rendering.run.write_frame", stop)
    assert main(arguments) == 130
    assert not (tmp_path / "manifest.json").exists()
    assert (tmp_path / "module_000.exr").exists()
