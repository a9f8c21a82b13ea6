"""Displays as TOML files: the presets with their sources, what is refused and how, the command, the drawing."""

import json
import re
from copy import deepcopy
from dataclasses import replace
from functools import reduce
from math import inf, nan
from operator import getitem

import numpy as np
import pytest
from jobs import sentence
from PIL import Image

from lfssao import Display, Module, display_names, display_text, find_display, parse_display
from lfssao.cli.main import main
from lfssao.errors import InputError
from lfssao.optics.display_file import MOST_MODULES
from lfssao.viz.display import draw_display

NAMES = ["c80", "convex", "picoarray", "sample-a", "sample-a-conical", "sample-b", "virtual"]
ROI = ((-0.4, -0.3, -0.25), (0.4, 0.3, 0.25))
LINE = {
    "name": "mine",
    "diffuser": "linear",
    "screen": {"shape": "flat", "width": 1.0, "height": 0.75},
    "observer": {"shape": "line", "height": 0.1, "distance": 2.0},
    "modules": {"layout": "line", "count": 3, "x": [-1.0, 1.0], "y": 0.2, "z": 0.7, "resolution": [64, 48]},
    "roi": {"min": ROI[0], "max": ROI[1]},
}
OPTICS = {"yaw": -15.0, "pitch": 5.0, "roll": 1.0, "field_of_view": 60.0, "k1": 0.01, "k2": 0.002}
HOMOGRAPHY = (100.0, 0.0, 50.0, 0.0, -66.0, 25.0, 0.1, 0.0, 1.0)
ONE_BY_ONE = [
    {"x": -0.5, "z": 0.8, "resolution": [100, 50]},
    {"x": 0.25, "y": -0.1, "z": 0.9, "resolution": [200, 80], **OPTICS},
    {"x": 1.0, "z": 1.0, "resolution": [100, 50], "homography": HOMOGRAPHY},
]
LIST = {**LINE, "modules": {"layout": "list", "list": ONE_BY_ONE}}
ANGLES = {"radius": 0.9, "center_z": 0.1, "angles": [-30.0, 30.0]}
ARC = {**LINE, "modules": {"layout": "arc", "count": 3, "y": 0.2, "resolution": [64, 48], **ANGLES}}


def toml(data):
    """A file of tables in one line each: as in JSON, but for the signs between keys and values and for two numbers."""
    lines = [f"{key} = {json.dumps(value, separators=(', ', ' = '))}" for key, value in data.items()]
    return "\n".join(lines).replace("NaN", "nan").replace("Infinity", "inf")


def changed(data, changes):
    """A copy in which other values stand for keys such as modules.list[1].z; None: no such key."""
    copy = deepcopy(data)
    for key, value in changes.items():
        *path, name = (int(part) if part.isdigit() else part for part in re.findall(r"\w+", key))
        table = reduce(getitem, path, copy)
        table[name] = value
        if value is None:
            del table[name]
    return copy


def read(data):
    return parse_display(toml(data), "f")


# Presets


@pytest.mark.parametrize("name", NAMES)
def test_every_value_of_a_preset_has_its_source_or_assumed_beside_it(name):
    sources = ("assumed", "published", "LF section", "LF figure", "its model")
    values = [line for line in display_text(name).splitlines() if "=" in line.split("#")[0]]
    assert len(values) > 15
    for line in values:
        assert line.startswith("name = ") or any(source in line.partition("#")[2] for source in sources), line
    assert display_text(name).startswith("# ")


@pytest.mark.parametrize("name", NAMES)
def test_what_is_printed_is_the_preset(name, capsys, tmp_path):
    assert main(["display", name]) == 0
    printed = capsys.readouterr().out
    assert printed == display_text(name)
    path = tmp_path / "copy.toml"
    path.write_text(printed)
    assert find_display(path) == find_display(str(path)) == find_display(name)
    assert find_display(name).name == name
    assert main(["display", str(path)]) == 0
    assert capsys.readouterr().out == printed


# Contents of a file


def test_modules_on_a_line():
    modules = tuple(Module(x, 0.2, 0.7, 64, 48) for x in (-1.0, 0.0, 1.0))
    assert read(LINE) == Display("mine", 1.0, 0.75, 0.1, -2.0, modules, ROI)
    assert read(changed(LINE, {"modules.count": 1})).modules == (replace(modules[0], x=0.0),)


def test_modules_one_by_one():
    assert read(LIST).modules == (
        Module(-0.5, 0.0, 0.8, 100, 50),
        Module(0.25, -0.1, 0.9, 200, 80, **OPTICS),
        Module(1.0, 0.0, 1.0, 100, 50, homography=HOMOGRAPHY),
    )


def test_modules_on_an_arc():
    left, middle, right = read(ARC).modules
    assert (left.x, left.z) == (pytest.approx(-0.45), pytest.approx(0.1 + 0.9 * 0.75**0.5))
    assert (middle.x, middle.y, middle.z, middle.yaw) == (0.0, 0.2, 1.0, 0.0)
    assert (right.x, right.z, right.field_of_view) == (-left.x, left.z, None)
    facing = read(changed(ARC, {"modules.field_of_view": 50.0, "modules.yaw": 2.0})).modules
    assert [m.yaw for m in facing] == pytest.approx([32.0, 2.0, -28.0])


@pytest.mark.parametrize(("shape", "sign"), [("convex", 1), ("concave", -1)])
def test_curved_screens_and_arcs(shape, sign):
    data = changed(LINE, {"screen.shape": shape, "screen.radius": 4.0, "observer.shape": "arc"})
    assert (read(data).screen_curvature, read(data).observer_curvature) == (sign * 0.25, 0.5)
    assert read(changed(data, {"observer.radius": 8})).observer_curvature == 0.125


def test_what_may_be_left_out():
    left_out = ("diffuser", "screen.shape", "observer.shape", "observer.height", "modules.y")
    full = read(LINE)
    modules = tuple(replace(m, y=0.0) for m in full.modules)
    assert read(changed(LINE, dict.fromkeys(left_out))) == replace(full, observer_height=0.0, modules=modules)
    assert read(changed(LINE, {"diffuser": "conical"})).diffuser == "conical"
    assert read(changed(LINE, {"modules.z": 1, "modules.resolution": [64.0, 48]})).modules[0].z == 1.0


# Refusals

BASES = {"line": LINE, "list": LIST, "arc": ARC}
OPTIONAL = ["diffuser", "shape", "y", "center_z", "yaw", "pitch", "roll", "field_of_view", "homography", "k1", "k2"]
WRONG = {
    float: [nan, inf, -inf, True, "1", [1.0], {}],
    list: [[], [1.0], [1, 2, 3, 4], 1, "a", [1, nan, 3], [1, nan], [[1], 2]],
    int: [0, -1, 1.5, 3.0, True, "3", [3], MOST_MODULES + 1, 10**60],
    str: ["", 1],
    dict: [3, [1]],
    "array of tables": [3, [1], {}],
}


def keys_of(data, path=""):
    for name, value in data.items():
        yield f"{path}{name}", value
        entries = {f"[{k}]": entry for k, entry in enumerate(value)} if name == "list" else {"": value}
        for place, entry in entries.items():
            if isinstance(entry, dict):
                yield from keys_of(entry, f"{path}{name}{place}.")


def refusal(data, changes):
    """The reason why a file with these changes is refused; it begins with the key."""
    with pytest.raises(InputError, match=r"^f: .{,250}\Z") as caught:
        read(changed(data, changes))
    return str(caught.value).removeprefix("f: ").removeprefix("display mine: ")


@pytest.mark.parametrize(
    ("base", "key", "value"), [(base, *pair) for base, data in BASES.items() for pair in keys_of(data)]
)
def test_a_wrong_a_missing_and_an_unknown_value_is_refused_by_its_key(base, key, value):
    name = key.split(".")[-1]
    kind = list if isinstance(value, tuple) else type(value)
    for wrong in WRONG["array of tables" if name == "list" else kind]:
        assert refusal(BASES[base], {key: wrong}).startswith((f"{key}: it ", f"{key} is ")), wrong
    unknown = key.removesuffix(name) + "color"
    assert refusal(BASES[base], {unknown: 1}).startswith(f"{unknown}: there is no key 'color'")
    if name not in OPTIONAL and key != "observer.height":
        assert refusal(BASES[base], {key: None}) == f"{key}: it is missing"


@pytest.mark.parametrize(("base", "changes", "key"), [
    ("line", {"diffuser": "lambert"}, "diffuser"),
    ("line", {"screen.shape": "round"}, "screen.shape"),
    ("line", {"screen.shape": "convex"}, "screen.radius"),
    ("line", {"screen.shape": "convex", "screen.radius": 0.5}, "screen.radius"),
    ("line", {"screen.shape": "concave", "screen.radius": 0.5}, "screen.radius"),
    ("line", {"screen.shape": "concave", "screen.radius": -4}, "screen.radius"),
    ("line", {"observer.shape": "dot"}, "observer.shape"),
    ("line", {"observer.shape": "arc", "observer.radius": 0}, "observer.radius"),
    ("line", {"observer.shape": "arc", "observer.distance": -2.0}, "observer.distance"),
    *(("line", {"observer.distance": distance}, "observer.distance") for distance in (0, -0.0, -2.0)),
    ("line", {"modules.layout": "grid"}, "modules.layout"),
    ("list", {"modules.layout": "line"}, "modules.count"),
    ("list", {"modules.list": []}, "modules"),
    ("arc", {"modules.z": 1}, "modules.z"),
    *(("line", {"modules.resolution": size}, "modules[0].resolution") for size in ([0, 48], [-64, 48])),
    *(("line", {"modules.resolution": size}, "modules.resolution") for size in ([64.5, 48], [64, 1e-3])),
    ("list", {"modules.list[1].z": -0.9}, "modules[1].z"),
])  # fmt: skip
def test_a_value_that_cannot_be_is_refused_by_its_key(base, changes, key):
    assert refusal(BASES[base], changes).startswith(f"{key}: ")


BROKEN = {
    "no TOML": (b"name = \n", "not a TOML file"),
    "twice": (b"a = 1\na = 2\n", "not a TOML file"),
    "binary": (b"\x00\x01\x02", "not a TOML file"),
    "no UTF-8": ("name = 'é'\n".encode("latin-1"), "cannot be read"),
    "thousands of digits": (b"name = " + b"9" * 6000, "not a TOML file"),
    "nested": (b"a = " + b"[" * 20_000 + b"]" * 20_000, "not a TOML file"),
    "empty": (b"", "screen: it is missing"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_no_toml_file_is_refused(name, tmp_path):
    content, reason = BROKEN[name]
    path = tmp_path / "broken.toml"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        find_display(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_that_cannot_be_read_are_refused(tmp_path):
    (tmp_path / "folder.toml").mkdir()
    for name, reason in (("none", "no such file"), ("folder", "a folder, not a file"), ("no\0file", "no such file")):
        with pytest.raises(InputError, match=reason):
            find_display(tmp_path / f"{name}.toml")
    with pytest.raises(InputError, match="there is no display 'teapot': choose one of c80, convex, "):
        find_display("teapot")


# The command line


def test_display_lists_the_presets(capsys):
    assert main(["display"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert display_names() == NAMES
    assert [line.split(":")[0] for line in lines] == [*NAMES, *display_names("quilt"), *display_names("lenslet")]
    assert lines[3].endswith("companion of LF's first author. 1 x 0.6 m, 21 modules, linear diffuser")


@pytest.mark.parametrize(("words", "part"), [
    (["display", "teapot"], "there is no display 'teapot': choose one of c80"),
    (["display", ""], "there is no display ''"),
    (["display", "none.toml"], "none.toml: there is no such file"),
    (["display", "wrong.toml"], "wrong.toml: modules.count: "),
    (["render", "statue", "-o", "out", "--display", "wrong.toml"], "wrong.toml: modules.count: "),
    (["display", "teapot", "--plot"], "there is no display 'teapot'"),
    (["display", "--plot"], "--plot needs the NAME of a display"),
    (["display", "virtual", "--plot", "a.jpg"], "--plot a.jpg: its name must end in one of .png, .svg, .pdf"),
    (["display", "virtual", "--plot", "png"], "--plot png: its name must end"),
    (["display", "virtual", "--plot", "no/such/a.png"], "no/such/a.png: it cannot be written"),
    (["display", "virtual", "--plot", "folder.png"], "folder.png: it cannot be written"),
    (["display", "virtual", "extra"], "extra"),
])  # fmt: skip
def test_bad_words(words, part, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "wrong.toml").write_text(toml(changed(LINE, {"modules.count": 10**9})))
    assert main(words) == 2
    assert part in sentence(capsys)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder.png", "wrong.toml"]


# The drawing


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_plot_writes_a_picture(ending, tmp_path, capsys):
    path = tmp_path / f"plan.{ending}"
    assert main(["display", "convex", "--plot", str(path)]) == 0
    assert capsys.readouterr().out == f"{path}\n"
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    if ending == "png":
        with Image.open(path) as image:
            pixels = np.asarray(image.convert("RGB"))
        assert min(pixels.shape[:2]) > 300
        assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 50
    else:
        assert path.read_bytes().startswith(b"<?xml" if ending == "svg" else b"%PDF")


def test_plot_has_a_name_by_default(tmp_path, monkeypatch, capsys):
    """That of NAME, in the folder one is in; whatever the file says its name is."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "own.toml").write_text(toml({**LINE, "name": "../../x"}))
    assert main(["display", "in/own.toml", "--plot"]) == 0
    assert main(["display", "sample-b", "--plot"]) == 0
    assert capsys.readouterr().out == "own.png\nsample-b.png\n"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["in", "own.png", "sample-b.png"]


def assert_on_circle(points, curvature, z):
    x, depth = np.transpose(points) - [[0.0], [z]]
    np.testing.assert_allclose(curvature * (x * x + depth * depth), 2 * depth, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_drawing_shows_modules_screen_observers_roi_and_rays(name):
    display = find_display(name)
    figure = draw_display(display)
    axes = figure.axes[0]
    lines = {line.get_label(): line.get_xydata() for line in axes.get_lines()}
    places = np.array([(m.x, m.z) for m in display.modules])
    count = len(places)
    np.testing.assert_array_equal(lines.pop(f"{count} module{'s' * (count > 1)}"), places)
    screen = lines.pop("screen")
    observers = lines.pop("observers")
    assert_on_circle(screen, display.screen_curvature, 0.0)
    assert np.abs(screen[[0, -1], 0]).tolist() == [display.screen_width / 2] * 2
    assert_on_circle(observers, display.observer_curvature, display.observer_z)
    chosen = {0, count // 2, count - 1}
    assert {f"rays of module {k}" for k in chosen} <= set(lines)
    assert 2 * len(chosen) < len(lines) <= 3 * len(chosen)
    eyes, lenses = np.stack(list(lines.values()), axis=1)
    assert np.abs(lenses[:, None] - places).sum(axis=2).min(axis=1).max() < 1e-9
    assert_on_circle(eyes, display.observer_curvature, display.observer_z)
    assert np.abs(eyes[:, 0]).max() <= np.abs(observers[:, 0]).max() + 1e-9
    (x0, _, z0), (x1, _, z1) = display.roi
    assert {tuple(corner) for corner in axes.patches[0].get_xy().tolist()} == {
        (x, z) for x in (x0, x1) for z in (z0, z1)
    }
    side = figure.axes[1]
    rays = [line.get_xydata() for line in side.get_lines() if str(line.get_label()).startswith(("rays", "_"))]
    eyes = [y for y, z in (ray[0] for ray in rays) if z < 0]
    np.testing.assert_allclose(eyes, display.observer_height, rtol=0, atol=1e-9)
    spread = np.ptp([ray[1][0] for ray in rays if len(ray) == 2])
    assert spread > display.screen_height  # they spread behind the screen, and no lens gathers them
    said = (figure.get_suptitle(), axes.get_xlabel(), axes.get_ylabel(), side.get_xlabel(), side.get_title())
    for part, text in zip(
        (f"{name}: {display.diffuser}", "x, metres", "viewers", "y, metres", "side"), said, strict=True
    ):
        assert part in text
    legend = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"screen", "observers", "region of interest"} <= legend
