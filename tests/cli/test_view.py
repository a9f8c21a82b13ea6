"""lfssao view: pictures and animations of rendered folders; spoiled folders are refused in one sentence."""

import re
import shutil
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from jobs import edit, manifest_of, render, sentence
from PIL import Image

from lfssao import LightField, eye_range, find_display
from lfssao.cli.main import main
from lfssao.files.exr import read_exr, write_exr
from lfssao.files.srgb import to_codes
from lfssao.rendering import folder as folder_module
from lfssao.rendering.folder import read_layer

WORDS = ["statue", "--resolution", "64x38", "--radii", "5%", "--samples", "4", "--guard", "3"]


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    return render(tmp_path_factory.mktemp("view") / "out", *WORDS)


@pytest.fixture
def folder(rendered, tmp_path):
    """A copy of the rendered folder that a test may spoil."""
    for path in rendered.iterdir():
        if path.name != "view.png":
            (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path


def view(*words):
    return main(["view", *map(str, words)])


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB"))


def test_view_writes_what_the_library_composes(folder, capsys):
    assert view(folder, "--eye-x", "0.4", "--width", "50") == 0
    said = f"{folder / 'eye.png'}: the modules' light goes to eyes from x = -0.93 to 0.93 m\n"
    assert capsys.readouterr().out == said
    expected = to_codes(light_field(folder, "shaded").photograph(0.4, 50).image)
    assert expected.any()
    assert np.array_equal(pixels(folder / "eye.png"), expected)


def test_examples_of_the_help_run(rendered, tmp_path, monkeypatch):
    shutil.copytree(rendered, tmp_path / "out")
    monkeypatch.chdir(tmp_path)
    text = (files("lfssao.cli") / "help" / "view.txt").read_text()
    examples = re.findall(r"^  lfssao (view (?:\S| (?=\S))+)", text, re.MULTILINE)
    assert len(examples) == 4
    for line in examples:
        assert main([*line.split(), "--width", "20"]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"out", "right.png", "walk.png", "eye.html"}


def light_field(folder, layer, guard=0):
    """A layer of the folder's textures."""
    field = LightField(find_display("sample-a").with_resolution(64, 38), range(21))
    for k in range(21):
        part = read_exr(folder / f"module_{k:03d}.exr")[layer]
        inner = np.s_[guard : part.pixels.shape[0] - guard, guard : part.pixels.shape[1] - guard]
        order = [[name.split(".")[-1] for name in part.channels].index(c) for c in "RGB"]
        field.put(k, np.ascontiguousarray(part.pixels[inner][..., order]))
    return field


def test_render_ends_with_what_an_eye_in_the_middle_sees_without_and_with_ao(rendered):
    made = pixels(rendered / "view.png")
    without, shaded = (
        light_field(rendered, *layer).photograph(0.0, 900).image for layer in (("color", 3), ("shaded",))
    )
    height = without.shape[0]
    assert np.array_equal(made[-height:, :900], to_codes(without))
    assert np.array_equal(made[-height:, -900:], to_codes(shaded))
    assert (without > shaded).any()


def test_the_picture_is_the_same_where_files_are_read_back_and_room_is_that_of_few_textures(
    rendered, tmp_path, monkeypatch
):
    read = []
    room = []
    out = tmp_path / "out"
    monkeypatch.setattr("lfssao.rendering.viewer.check_available", lambda _, needed: room.append(needed))
    shutil.copytree(rendered, out)
    (out / "view.png").unlink()
    monkeypatch.setattr(folder_module, "read_layer", lambda *all_: read.append(all_[1]) or read_layer(*all_))
    render(out, *WORDS, "--resume")
    assert sorted(read) == 21 * ["color"] + 21 * ["shaded"]
    assert (out / "view.png").read_bytes() == (rendered / "view.png").read_bytes()
    assert room[0] < 3 * 64 * 38 * 6 * 4


def test_a_white_mesh_has_the_picture_without_a_colour_layer(tmp_path):
    words = ["armadillo", "--resolution", "16x10", "--radii", "5%", "--samples", "1"]
    for name, layers in (("all", []), ("few", ["--layers", "depth,blurred,shaded"])):
        render(tmp_path / name, *words, *layers)
    assert (tmp_path / "all" / "view.png").read_bytes() == (tmp_path / "few" / "view.png").read_bytes()


@pytest.mark.parametrize(
    "words", [["--modules", "0:20"], ["--frames", "1"], ["--display", "virtual"], ["--layers", "depth"]]
)
def test_render_of_less_than_a_display_has_no_such_picture(words, tmp_path, capsys):
    render(tmp_path, "statue", "--resolution", "16x10", "--radii", "5%", "--samples", "1", *words)
    assert not list(tmp_path.rglob("view.png"))
    assert capsys.readouterr().out.count("\n") == 1


@pytest.mark.parametrize(("layer", "blend"), [("color", "nearest"), ("ao_1", "gaussian"), ("blurred", "linear")])
def test_layers_and_blends(folder, layer, blend):
    target = folder / "other.png"
    words = ["--eye-x", "-0.4", "--layer", layer, "--blend", blend, "--width", "40", "-o", target]
    assert view(folder, *words) == 0
    found = pixels(target)
    assert found.shape == (24, 40, 3)
    grey = np.array_equal(found[..., 0], found[..., 2])
    assert grey == (layer != "color")
    assert len(np.unique(found)) > 3
    # No surface: no colour, but all of the light.
    assert (found[0, 0] == (0 if layer == "color" else 255)).all()


@pytest.mark.parametrize("count", [2, 24])
def test_orbit_has_as_many_frames_and_comes_back(folder, count):
    given = [] if count == 24 else [count]  # the default
    assert view(folder, "--orbit", *given, "--width", "48", "-o", folder / "a.png") == 0
    with Image.open(folder / "a.png") as image:
        assert image.n_frames == count
        assert image.size == (48, 29)
        frames = []
        for k in range(count):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB")).astype(int))
    for k in range(1, count // 2):
        assert np.array_equal(frames[k], frames[count - k])
    assert view(folder, "--eye-x", eye_range(find_display("sample-a"))[1], "--width", "48") == 0
    assert np.array_equal(frames[count // 2], pixels(folder / "eye.png"))


def test_some_modules_and_another_distance(folder):
    assert view(folder, "--modules", "8:13", "--distance", "1.5", "--width", "40") == 0
    field = LightField(replace(find_display("sample-a").with_resolution(64, 38), observer_z=-1.5), range(8, 13))
    for entry in manifest_of(folder)["views"][8:13]:
        texture = read_layer(folder / entry["file"], "shaded", entry["textures"]["shaded"])
        field.put(int(entry["name"].removeprefix("module_")), texture)
    shot = field.photograph(0.0, 40)
    assert 0 < shot.dark < 40 * 24
    assert np.array_equal(pixels(folder / "eye.png"), to_codes(shot.image))


def test_a_part_of_the_modules_is_dark_elsewhere(tmp_path, capsys):
    words = ["--resolution", "32x20", "--radii", "5%", "--samples", "2"]
    render(tmp_path, "statue", "--display", "sample-a", "--modules", "8:13", *words)
    capsys.readouterr()
    assert view(tmp_path, "--width", "40") == 0
    assert "of the screen is black" in capsys.readouterr().err
    assert view(tmp_path, "--orbit", "2", "--width", "40") == 0


SPOILED = {
    "no manifest": lambda f: (f / "manifest.json").unlink(),
    "a folder": lambda f: ((f / "manifest.json").unlink(), (f / "manifest.json").mkdir()),
    "no JSON": lambda f: (f / "manifest.json").write_text("{"),
    "bytes": lambda f: (f / "manifest.json").write_bytes(b"\xff\xfe\x00"),
    "a list": lambda f: (f / "manifest.json").write_text("[1]"),
    "format": lambda f: edit(f, "format", value=99),
    "camera": lambda f: edit(f, "display", value=None),
    "no views": lambda f: edit(f, "views", value=[]),
    "strange view": lambda f: edit(f, "views", 0, "name", value="module_999"),
    "text": lambda f: edit(f, "display", "screen_width", value="wide"),
    "negative": lambda f: edit(f, "display", "screen_width", value=-1),
    "unknown key": lambda f: edit(f, "display", "more", value=1),
    "no modules": lambda f: edit(f, "display", "modules", value=None),
    "no file": lambda f: edit(f, "views", 3, "file", value=5.0),
    "channels by name": lambda f: edit(f, "views", 3, "textures", "depth", "channels", value={"Z": 1}),
    "no channels": lambda f: edit(f, "views", 3, "textures", "depth", "channels", value=[]),
    "texture size": lambda f: edit(f, "views", 3, "view", "width", value=90),
    "missing EXR": lambda f: (f / "module_007.exr").unlink(),
    "corrupt EXR": lambda f: (f / "module_007.exr").write_bytes(b"v/1\x01rubbish"),
    "cut EXR": lambda f: (f / "module_007.exr").write_bytes((f / "module_007.exr").read_bytes()[:3000]),
    "other EXR": lambda f: (f / "module_007.exr").write_bytes((f / "module_008.exr").read_bytes()),
    "no layer": lambda f: write_exr(f / "module_007.exr", [read_exr(f / "module_007.exr")["depth"]]),
}


@pytest.mark.parametrize("what", SPOILED)
def test_a_spoiled_folder_is_refused_in_one_sentence(folder, capsys, what):
    SPOILED[what](folder)
    assert view(folder, "--width", "20") == 2
    assert sentence(capsys)
    assert not (folder / "eye.png").exists()


@pytest.mark.parametrize("name", ["view.png", "contact.png"])
def test_pictures_of_a_render_are_not_replaced(rendered, monkeypatch, capsys, name):
    before = (rendered / name).read_bytes()
    monkeypatch.chdir(rendered)
    for target in (name, rendered / name, rendered / ".." / rendered.name / name):
        assert view(rendered, "--width", "20", "-o", target) == 2
        assert "is a picture of 'lfssao render', take another name" in sentence(capsys)
    assert (rendered / name).read_bytes() == before


@pytest.mark.parametrize("words", [
    ("--eye-x", "nan"), ("--eye-x", "inf"), ("--eye-x", "left"), ("--width", "0"), ("--width", "99999"),
    ("--orbit", "3"), ("--orbit", "0"), ("--orbit", "1.5"), ("--orbit", "4", "--eye-x", "0"), ("--blend", "cubic"),
    ("--layer", "depth"), ("--layer", "nothing"), ("-o", "view.jpg"), ("-o", ""), ("-o", "/nowhere/view.png"),
    ("--orbit", "-o", "view.bmp"), ("--distance", "0"), ("--distance", "far"), ("--modules", "21"),
])  # fmt: skip
def test_bad_options_are_refused_in_one_sentence(rendered, capsys, words):
    before = sorted(rendered.iterdir())
    assert view(rendered, *words) == 2
    assert len(sentence(capsys)) < 300
    assert sorted(rendered.iterdir()) == before


def test_a_camera_a_display_of_one_module_and_a_missing_folder_are_refused(tmp_path, capsys):
    small = ["--resolution", "32x24", "--radii", "5%", "--samples", "2"]
    for words, reason in ((["--camera"], "--camera"), (["--display", "virtual"], "one module")):
        render(tmp_path, "statue", *words, *small)
        capsys.readouterr()
        assert view(tmp_path) == 2
        said = sentence(capsys)
        assert reason in said
        assert "is not what" not in said  # the manifest is whole
    assert view(tmp_path / "none") == 2
    assert "there is no such folder; 'lfssao render" in sentence(capsys)
