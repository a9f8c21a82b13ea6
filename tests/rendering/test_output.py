"""Files of a job: what is written, that the manifest tells the truth, and that nothing is left half-written."""

import hashlib
import json
import os
import time

import numpy as np
import pytest
from exr_parts import by_channel, read_parts
from jobs import digests_of, manifest_of, render, sentence
from PIL import Image
from reference.passes import blur_table

import lfssao
from lfssao.gbuffer.trees import embree_installed

TEXTURES = {
    "shaded": ("R", "G", "B"), "depth": ("Z",), "positions": ("P.X", "P.Y", "P.Z"),
    "color": ("color.R", "color.G", "color.B"), "ao_1": ("ao_1.AO",), "ao_2": ("ao_2.AO",),
    "merged": ("merged.AO",), "blurred": ("blurred.AO",),
}  # fmt: skip
PASSES = {"build_bvh", "ray_cast", "ao", "merge", "blur", "shade", "digest", "write", "contact"}

COMMAND = ["statue", "--display", "sample-a", "--modules", "3:5", "--resolution", "64x48",
           "--radii", "0.05,4%", "--samples", "6", "--seed", "9", "--blur", "1.5"]  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return render(tmp_path_factory.mktemp("job") / "out", *COMMAND)


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


def test_files_parts_and_channels_are_the_documented_ones(folder):
    assert sorted(os.listdir(folder)) == ["contact.png", "manifest.json", "module_003.exr", "module_004.exr"]
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


def test_metadata_say_what_a_file_is(folder):
    found = read(folder / "module_003.exr")["shaded"][0]
    said = {"software": f"lfssao {lfssao.__version__}", "display": "sample-a", "module": "module_003", "seed": "9"}
    said |= {"samples": "6 latin", "estimator": "lf"}
    assert {name: found[f"lfssao:{name}"] for name in said} == said
    diagonal = np.linalg.norm(np.ptp(lfssao.find_scene("statue").bounds, axis=0))
    assert [float(r) for r in found["lfssao:radii"].split(", ")] == pytest.approx([0.05, 0.04 * diagonal])


def srgb_codes(linear):
    """The nearest 8-bit codes by the formula of IEC 61966-2-1, in float64, and how far each value is from a tie."""
    light = np.clip(linear.astype(np.float64), 0, 1)
    value = 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.floor(value + 0.5), abs(value - np.floor(value) - 0.5)


@pytest.mark.parametrize("words", [("--guard", "2"), ("--frames", "2")], ids=" ".join)
def test_pictures_are_the_shaded_textures_in_8_bits(tmp_path, words):
    render(tmp_path, *COMMAND, *words, "--png")
    folders = sorted(tmp_path.glob("frame_*")) or [tmp_path]
    assert len(folders) == (2 if "--frames" in words else 1)
    for folder in folders:
        for view in manifest_of(folder)["views"]:
            file = folder / view["picture"]["file"]
            assert file.name == f"{view['name']}.png"
            assert hashlib.sha256(file.read_bytes()).hexdigest() == view["picture"]["sha256"]
            with Image.open(file) as image:
                assert (image.mode, image.size) == ("RGB", (64, 48))
                codes = np.asarray(image)
            channels = {}
            for part in read_parts(folder / view["file"]):
                channels |= by_channel(*part)
            expected, tie = srgb_codes(np.stack([channels[c] for c in "RGB"], axis=-1))
            assert (tie > 1e-5).mean() > 0.99
            assert np.array_equal(codes[tie > 1e-5], expected[tie > 1e-5])
            assert len(np.unique(codes)) > 50


def test_pictures_need_the_shaded_texture(tmp_path, capsys):
    render(tmp_path / "out", *COMMAND, "--png", "--layers", "depth,color", code=2)
    assert sentence(capsys) == "--png: it writes the layer shaded, which --layers leaves out"
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("scene", "run_lengths"), [("statue", {"shaded", "blurred"}), ("armadillo", {"blurred"})])
def test_noise_is_packed_in_run_lengths_and_all_else_by_zip(scene, run_lengths, tmp_path):
    found = read(render(tmp_path, scene, *COMMAND[1:]) / "module_003.exr")
    kinds = {name: attributes["compression"] for name, (attributes, _) in found.items()}
    assert kinds == {name: "rle" if name in run_lengths else "zip" for name in found}


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
    settings = manifest["settings"]
    machine = manifest["machine"]
    x, y, z = np.subtract(*manifest["scene"]["bounds"][::-1])
    assert settings["radii"] == [0.05, pytest.approx(0.04 * (x * x + y * y + z * z) ** 0.5)]
    assert np.shape(settings["samples"]) == (6, 3)
    assert settings["blur_sigma"] == 1.5
    assert settings["caster"] == "exact"
    assert settings["blur_weights"] == blur_table(1.5).tolist()
    assert manifest["sampling"] == {"method": "latin", "count": 6, "seed": 9}
    assert manifest["display"]["name"] == "sample-a"
    assert len(manifest["display"]["modules"]) == 21
    assert manifest["camera"] is None
    assert manifest["scene"]["name"] == "statue"
    assert manifest["scene"]["faces"] == 5010
    assert machine["command"] == ["lfssao", "render", *COMMAND, "-o", str(folder)]
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


def test_no_pass_takes_longer_than_its_command(tmp_path):
    for more in ((), ("--resume",)):
        begin = time.perf_counter()
        made = manifest_of(render(tmp_path / "out", *COMMAND, *more))
        took = time.perf_counter() - begin
        each = [made["seconds"]["load"], made["seconds"]["render"]]
        each += [seconds for view in made["views"] for seconds in view["seconds"].values()]
        assert 0 <= min(each) <= max(each) <= took


def test_manifest_is_text_to_read(folder):
    lines = (folder / "manifest.json").read_text("utf-8").split("\n")
    assert lines[:2] == ["{", ' "format": 1,']
    assert lines[-3:] == [" ]", "}", ""]
    assert [line.split('"')[1] for line in lines if line.startswith('    "') and line.endswith("{")] == [*TEXTURES] * 2


def test_equal_runs_make_equal_pixels_and_another_seed_other_ao(folder, manifest, tmp_path):
    again = render(tmp_path / "again", *COMMAND, "--threads", "1")
    second = manifest_of(again)
    assert digests_of(again) == digests_of(folder)
    assert (folder / "contact.png").read_bytes() == (again / "contact.png").read_bytes()
    for part in ("format", "scene", "display", "sampling", "settings"):
        assert second[part] == manifest[part]
    assert second["machine"]["threads"] == 1
    (before, _), (after, _) = digests_of(folder), digests_of(render(again, *COMMAND, "--seed", "10"))
    assert [name for name in before if before[name] == after[name]] == ["depth", "positions", "color"]


def test_camera_writes_one_view(tmp_path):
    out = render(tmp_path / "out", "statue", "--resolution", "64x48", "--camera", "orthographic")
    assert sorted(os.listdir(out)) == ["camera.exr", "contact.png", "manifest.json"]
    manifest = manifest_of(out)
    assert (manifest["camera"], manifest["display"]) == ("orthographic", None)
    depth = read(out / "camera.exr")["depth"][1]["Z"]
    surface = depth[np.isfinite(depth)]
    assert 0 < surface.min() <= surface.max() < 1  # screen space z


def test_contact_sheet_shows_the_three_pictures(folder):
    found = read(folder / "module_003.exr")
    with Image.open(folder / "contact.png") as image:
        sheet = np.asarray(image).astype(int)
    color = np.stack([found["color"][1][f"color.{c}"] for c in "RGB"], axis=-1)
    shaded = np.stack([found["shaded"][1][c] for c in "RGB"], axis=-1)
    visibility = np.repeat(1 - found["blurred"][1]["blurred.AO"][..., None], 3, axis=-1)

    def encoded(linear):
        linear = np.clip(linear, 0, 1).astype(float)
        return 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)

    # 64x48 is shown 480 wide: each texel is 7.5 pixels, of which the middle one is compared, away from its borders.
    down, right = ((7.5 * np.arange(size) + 3.75).astype(int) for size in (48, 64))
    for column, wanted in enumerate(map(encoded, (color, visibility, shaded))):
        shown = sheet[22 + down[:, None], 12 + column * 492 + right]
        np.testing.assert_allclose(shown, wanted, rtol=0, atol=0.51 + 1e-3)


@pytest.mark.parametrize("name", ["module_000.exr", "contact.png", "manifest.json", "animation.png"])
def test_folder_in_the_way_of_a_file(tmp_path, capsys, name):
    (tmp_path / name).mkdir()
    (tmp_path / "mine").write_text("mine")
    frames = ("--frames", "2") if name == "animation.png" else ()
    render(tmp_path, "statue", "--resolution", "64x48", *frames, code=2)
    assert f"{name}: it cannot be written" in sentence(capsys)
    assert (tmp_path / "mine").read_text() == "mine"
    assert not [file for file in os.listdir(tmp_path) if file.startswith(".")]


def test_an_interrupted_job_leaves_no_manifest_of_an_earlier_one(tmp_path, monkeypatch):
    words = ["ammonite", "--resolution", "16x12", "--samples", "1", "--radii", "1%"]
    render(tmp_path, *words)
    assert (tmp_path / "manifest.json").exists()

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("lfssao.rendering.output.write_frame", stop)
    render(tmp_path, *words, code=130)
    assert not (tmp_path / "manifest.json").exists()
    assert (tmp_path / "module_000.exr").exists()
