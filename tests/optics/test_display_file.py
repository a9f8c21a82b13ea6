"""Displays as TOML files: the presets with their sources, what is refused and how, the command, the drawing."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from lfssao import Display, Module, display_names, display_text, find_display, parse_display
from lfssao.cli.main import main
from lfssao.errors import InputError
from lfssao.optics.display_file import MOST_MODULES
from lfssao.optics.top_view import draw_top_view

NAMES = ["c80", "convex", "picoarray", "sample-a", "sample-b", "virtual"]
LINE = """
name = "mine"
diffuser = "linear"
[screen]
shape = "flat"
width = 1.0
height = 0.75
[observer]
shape = "line"
height = 0.1
distance = 2.0
[modules]
layout = "line"
count = 3
x = [-1.0, 1.0]
y = 0.2
z = 0.7
resolution = [64, 48]
[roi]
min = [-0.4, -0.3, -0.25]
max = [0.4, 0.3, 0.25]
"""
ROI = ((-0.4, -0.3, -0.25), (0.4, 0.3, 0.25))
LIST = (
    LINE[: LINE.index("[modules]")]
    + """
[modules]
layout = "list"
[[modules.list]]
x = -0.5
z = 0.8
resolution = [100, 50]
[[modules.list]]
x = 0.25
y = -0.1
z = 0.9
resolution = [200, 80]
yaw = -15.0
pitch = 5.0
roll = 1.0
field_of_view = 60.0
k1 = 0.01
k2 = 0.002
[[modules.list]]
x = 1
z = 1
resolution = [100, 50]
homography = [100.0, 0.0, 50.0, 0.0, -66.0, 25.0, 0.1, 0.0, 1.0]
"""
    + LINE[LINE.index("[roi]") :]
)
ARC = (
    LINE.replace('"line"\ncount', '"arc"\nradius = 0.9\ncenter_z = 0.1\nangles = [-30.0, 30.0]\ncount')
    .replace("x = [-1.0, 1.0]\n", "")
    .replace("z = 0.7\n", "")
)


# Presets


def test_the_presets():
    assert display_names() == NAMES
    for name in NAMES:
        assert find_display(name).name == name
        assert main(["display", name]) == 0


@pytest.mark.parametrize("name", NAMES)
def test_every_value_of_a_preset_has_its_source_or_assumed_beside_it(name):
    sources = ("assumed", "published", "LF section", "LF figure", "its model")
    values = [line for line in display_text(name).splitlines() if "=" in line.split("#")[0]]
    assert len(values) > 15
    for line in values:
        if line.startswith("name = "):
            continue  # not a number of the system
        assert any(source in line.partition("#")[2] for source in sources), line
    assert display_text(name).startswith("# ")
    assert set(tomllib.loads(display_text(name))) >= {"name", "screen", "observer", "modules", "roi"}


@pytest.mark.parametrize("name", NAMES)
def test_what_is_printed_is_the_preset(name, capsys, tmp_path):
    assert main(["display", name]) == 0
    printed = capsys.readouterr().out
    assert printed == display_text(name)
    path = tmp_path / "copy.toml"
    path.write_text(printed)
    assert find_display(path) == find_display(str(path)) == find_display(name)
    assert main(["display", str(path)]) == 0
    assert capsys.readouterr().out == printed


# What a file says


def test_modules_on_a_line():
    modules = tuple(Module(x, 0.2, 0.7, 64, 48) for x in (-1.0, 0.0, 1.0))
    assert parse_display(LINE, "f") == Display("mine", 1.0, 0.75, 0.1, -2.0, modules, ROI)
    one = parse_display(LINE.replace("count = 3", "count = 1"), "f")
    assert one.modules == (replace(modules[0], x=0.0),)


def test_modules_one_by_one():
    h = (100.0, 0.0, 50.0, 0.0, -66.0, 25.0, 0.1, 0.0, 1.0)
    assert parse_display(LIST, "f").modules == (
        Module(-0.5, 0.0, 0.8, 100, 50),
        Module(0.25, -0.1, 0.9, 200, 80, -15.0, 5.0, 1.0, 60.0, None, 0.01, 0.002),
        Module(1.0, 0.0, 1.0, 100, 50, homography=h),
    )


def test_modules_on_an_arc():
    left, middle, right = parse_display(ARC, "f").modules
    assert (left.x, left.z) == (pytest.approx(-0.45), pytest.approx(0.1 + 0.9 * 0.75**0.5))
    assert (middle.x, middle.y, middle.z, middle.yaw) == (0.0, 0.2, 1.0, 0.0)
    assert (right.x, right.z, right.field_of_view) == (-left.x, left.z, None)
    facing = parse_display(ARC.replace("y = 0.2", "y = 0.2\nfield_of_view = 50.0\nyaw = 2.0"), "f").modules
    assert [m.yaw for m in facing] == pytest.approx([32.0, 2.0, -28.0])


@pytest.mark.parametrize(("shape", "sign"), [("convex", 1), ("concave", -1)])
def test_curved_screens_and_arcs(shape, sign):
    text = LINE.replace('shape = "flat"', f'shape = "{shape}"\nradius = 4.0').replace('shape = "line"', 'shape = "arc"')
    display = parse_display(text, "f")
    assert (display.screen_curvature, display.observer_curvature) == (sign * 0.25, 0.5)
    display = parse_display(text.replace("distance = 2.0", "distance = 2.0\nradius = 8"), "f")
    assert display.observer_curvature == 0.125


def test_what_may_be_left_out():
    text = LINE.replace('diffuser = "linear"\n', "").replace('shape = "flat"\n', "").replace('shape = "line"\n', "")
    text = text.replace("height = 0.1\n", "").replace("y = 0.2\n", "")
    full = parse_display(LINE, "f")
    modules = tuple(replace(m, y=0.0) for m in full.modules)
    assert parse_display(text, "f") == replace(full, observer_height=0.0, modules=modules)
    assert parse_display(LINE.replace("z = 0.7", "z = 1").replace("[64, 48]", "[64.0, 48]"), "f").modules[0].z == 1.0


# What is refused: a line of the file, what stands there instead (None: nothing), the key that is named

BASES = {"line": LINE, "list": LIST, "arc": ARC}
WRONG_NUMBERS = ["nan", "inf", "-inf", "true", '"1"', "[1.0]", "{}", "1e301", "1979-05-27"]
NUMBERS = {
    "width = 1.0": "screen.width", "height = 0.75": "screen.height", "height = 0.1": "observer.height",
    "distance = 2.0": "observer.distance", "y = 0.2": "modules.y", "z = 0.7": "modules.z",
}  # fmt: skip
LISTS = {
    "x = [-1.0, 1.0]": "modules.x", "resolution = [64, 48]": "modules.resolution",
    "min = [-0.4, -0.3, -0.25]": "roi.min", "max = [0.4, 0.3, 0.25]": "roi.max",
}  # fmt: skip
TABLES = {"screen": "[screen]", "observer": "[observer]", "roi": "[roi]", "modules": "[modules]"}
CASES = [
    *[("line", line, f"{line.split(' ')[0]} = {bad}", key) for line, key in NUMBERS.items() for bad in WRONG_NUMBERS],
    *[
        ("line", line, f"{line.split(' ')[0]} = {bad}", key)
        for line, key in LISTS.items()
        for bad in ("[]", "[1.0]", "[1, 2, 3, 4]", "1", '"a"', "[1, nan, 3]", "[1, nan]", "[true, 2]", "[[1], 2]")
    ],
    # missing
    ("line", 'name = "mine"', None, "name"),
    ("line", "width = 1.0", None, "screen.width"),
    ("line", "height = 0.75", None, "screen.height"),
    ("line", "distance = 2.0", None, "observer.distance"),
    ("line", 'layout = "line"', None, "modules.layout"),
    ("line", "count = 3", None, "modules.count"),
    ("line", "x = [-1.0, 1.0]", None, "modules.x"),
    ("line", "z = 0.7", None, "modules.z"),
    ("line", "resolution = [64, 48]", None, "modules.resolution"),
    ("line", "max = [0.4, 0.3, 0.25]", None, "roi.max"),
    ("list", "z = 0.8", None, "modules.list[0].z"),
    ("list", "x = 0.25", None, "modules.list[1].x"),
    ("list", "resolution = [200, 80]", None, "modules.list[1].resolution"),
    ("arc", "radius = 0.9", None, "modules.radius"),
    ("arc", "angles = [-30.0, 30.0]", None, "modules.angles"),
    ("line", 'shape = "flat"', 'shape = "convex"', "screen.radius"),
    # unknown
    ("line", 'name = "mine"', 'name = "mine"\ncolor = 1', "color"),
    ("line", "width = 1.0", "width = 1.0\nw = 2", "screen.w"),
    ("line", "distance = 2.0", "distance = 2.0\ndist = 2", "observer.dist"),
    ("line", "z = 0.7", "z = 0.7\nfov = 40", "modules.fov"),
    ("line", "max = [0.4, 0.3, 0.25]", "max = [0.4, 0.3, 0.25]\nmid = 1", "roi.mid"),
    ("list", "x = 0.25", "x = 0.25\nzoom = 1", "modules.list[1].zoom"),
    ("arc", "radius = 0.9", "radius = 0.9\nz = 1", "modules.z"),
    # not one of the choices, not of the type
    ("line", 'shape = "flat"', 'shape = "round"', "screen.shape"),
    ("line", 'shape = "line"', 'shape = "dot"', "observer.shape"),
    ("line", 'layout = "line"', 'layout = "grid"', "modules.layout"),
    ("line", '"linear"', '"lambert"', "diffuser"),
    ("line", '"linear"', "3", "diffuser"),
    ("line", 'name = "mine"', 'name = ""', "name"),
    ("line", 'name = "mine"', "name = 1", "name"),
    ("line", 'name = "mine"', 'name = "mine"\nroi = 3', None),
    ("list", 'layout = "list"', 'layout = "line"', "modules.count"),
    # numbers that cannot be
    *[
        ("line", "count = 3", f"count = {n}", "modules.count")
        for n in ("0", "-1", "1.5", "3.0", "true", '"3"', "[3]", MOST_MODULES + 1, 10**60)
    ],
    *[("line", "[64, 48]", f"[{a}]", "modules") for a in ("0, 48", "-64, 48", "64.5, 48", "64, 1e-3")],
    *[("line", "distance = 2.0", f"distance = {n}", "observer.distance") for n in ("0", "-0.0", "-2.0")],
    ("line", 'shape = "line"\nheight = 0.1\ndistance = 2.0', 'shape = "arc"\ndistance = -2.0', "observer.distance"),
    ("line", 'shape = "line"', 'shape = "arc"\nradius = 0', "observer.radius"),
    ("line", 'shape = "flat"', 'shape = "concave"\nradius = -4', "screen.radius"),
    *[("line", 'shape = "flat"', f'shape = "{s}"\nradius = 0.5', "screen.radius") for s in ("convex", "concave")],
    ("line", '"linear"', '"conical"', None),
    ("list", "z = 0.9", "z = -0.9", "modules[1].z"),
    *[("list", "field_of_view = 60.0", f"field_of_view = {n}", "modules[1].field_of_view") for n in ("nan", "true")],
    ("list", "homography = [100.0, 0.0, 50.0, 0.0,", "homography = [1, 2, 3,", "modules.list[2].homography"),
]
ACCEPTED = [case for case in CASES if case[3] is None and case[2] == '"conical"']
REFUSED = [case for case in CASES if case not in ACCEPTED]


def changed(case):
    base, line, other, _ = case
    assert BASES[base].count(line) >= 1, line
    return BASES[base].replace(line, other or "", 1)


@pytest.mark.parametrize("case", REFUSED, ids=lambda case: f"{case[0]}: {case[1]} -> {case[2]}"[:90].replace("\n", ";"))
def test_a_wrong_value_is_refused_with_file_key_and_reason(case, tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(changed(case))
    with pytest.raises(InputError) as caught:
        find_display(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    reason = message.removeprefix(f"{path}: ")
    assert "\n" not in reason
    assert len(reason) < 250
    if case[3] is not None:
        assert reason.removeprefix("display mine: ").startswith((case[3], case[3].replace("modules[", "modules.list[")))


def test_the_bases_and_the_conical_diffuser_are_accepted():
    assert len(ACCEPTED) == 1
    for text in (*BASES.values(), changed(ACCEPTED[0])):
        parse_display(text, "f")


@pytest.mark.parametrize("table", TABLES)
def test_a_missing_table_or_one_that_is_none_is_refused(table):
    data = LINE.split("\n[")
    rest = "\n[".join(part for part in data if not part.startswith(f"{table}]"))
    with pytest.raises(InputError, match=rf"^f: {table}: it is missing"):
        parse_display(rest, "f")
    with pytest.raises(InputError, match=rf"^f: {table}: it must be a table"):
        parse_display(f"{table} = 3\n{rest}", "f")


@pytest.mark.parametrize("entries", ["3", "[1]", "{}"])
def test_a_list_that_is_none_is_refused(entries):
    start, end = LIST.index("[[modules.list]]"), LIST.index("[roi]")
    with pytest.raises(InputError, match=r"^f: modules\.list: it must be an array of tables"):
        parse_display(f"{LIST[:start]}list = {entries}\n{LIST[end:]}", "f")
    with pytest.raises(InputError, match="modules: there are none"):
        parse_display(f"{LIST[:start]}list = []\n{LIST[end:]}", "f")


BROKEN = {
    "no TOML": (b"name = \n", "not a TOML file"),
    "twice": (b"a = 1\na = 2\n", "not a TOML file"),
    "binary": (b"\x00\x01\x02", "not a TOML file"),
    "no UTF-8": ("name = 'é'\n".encode("latin-1"), "cannot be read"),
    "thousands of digits": (LINE.replace("count = 3", "count = " + "9" * 6000).encode(), "not a TOML file"),
    "nested": (b"a = " + b"[" * 20_000 + b"]" * 20_000, "not a TOML file"),
    "empty": (b"", "screen: it is missing"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_no_toml_file_is_refused(name, tmp_path, capsys):
    content, reason = BROKEN[name]
    path = tmp_path / "broken.toml"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        find_display(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert reason in str(caught.value)
    assert main(["display", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_files_that_cannot_be_read_are_refused(tmp_path):
    (tmp_path / "folder.toml").mkdir()
    for name in ("none.toml", "folder.toml", "no\0file.toml"):
        with pytest.raises(InputError, match="it cannot be read"):
            find_display(tmp_path / name)
    with pytest.raises(InputError, match="there is no display 'teapot': choose one of c80, convex, "):
        find_display("teapot")


# The command line


@pytest.mark.parametrize("words", [["display"], ["render", "statue", "-o", "out", "--display"]])
@pytest.mark.parametrize(
    ("line", "other", "key"),
    [
        ("z = 0.7", "z = 0.7\nhomography = [1, 2, 3, 2, 4, 6, 0, 0, 1]", "modules[0].homography"),
        ("count = 3", "count = 1000000000", "modules.count"),
    ],
)
def test_refusals_on_the_command_line(words, line, other, key, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "wrong.toml"
    path.write_text(LINE.replace(line, other, 1))
    assert main([*words, str(path)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("lfssao: ")
    assert "wrong.toml: " in captured.err
    assert f" {key}: " in captured.err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["wrong.toml"]


def test_display_lists_the_presets(capsys):
    assert main(["display"]) == 0
    assert capsys.readouterr().out.split() == NAMES


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["teapot"], "there is no display 'teapot': choose one of c80"),
        ([""], "there is no display ''"),
        (["none.toml"], "none.toml: it cannot be read (No such file"),
        (["teapot", "--plot"], "there is no display 'teapot'"),
        (["--plot"], "--plot needs the NAME of a display"),
        (["virtual", "--plot", "a.jpg"], "--plot a.jpg: its name must end in one of .png, .svg, .pdf"),
        (["virtual", "--plot", "png"], "--plot png: its name must end"),
        (["virtual", "--plot", "no/such/a.png"], "no/such/a.png: it cannot be written"),
        (["virtual", "--plot", "folder.png"], "folder.png: it cannot be written"),
        (["virtual", "extra"], "extra"),
    ],
)
def test_bad_words(words, part, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.png").mkdir()
    assert main(["display", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert part in captured.err
    assert [p.name for p in tmp_path.iterdir()] == ["folder.png"]


# The drawing from above


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
    (tmp_path / "in" / "own.toml").write_text(LINE.replace('"mine"', '"../../x"'))
    assert main(["display", "in/own.toml", "--plot"]) == 0
    assert main(["display", "sample-b", "--plot"]) == 0
    assert capsys.readouterr().out == "own.png\nsample-b.png\n"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["in", "own.png", "sample-b.png"]


@pytest.mark.parametrize("name", NAMES)
def test_plan_shows_modules_screen_observers_roi_and_rays(name):
    display = find_display(name)
    axes = draw_top_view(display).axes[0]
    lines = {line.get_label(): np.array(line.get_data()).T for line in axes.get_lines()}
    count = len(display.modules)
    np.testing.assert_array_equal(
        lines.pop(f"{count} module{'s' * (count > 1)}"), [(m.x, m.z) for m in display.modules]
    )
    screen, observers = lines.pop("screen"), lines.pop("observers")
    for points, curvature, z in (
        (screen, display.screen_curvature, 0.0), (observers, display.observer_curvature, display.observer_z),
    ):  # fmt: skip
        x, depth = points[:, 0], points[:, 1] - z
        np.testing.assert_allclose(curvature * (x * x + depth * depth), 2 * depth, rtol=0, atol=1e-12)
    assert np.abs(screen[[0, -1], 0]).tolist() == [display.screen_width / 2] * 2
    chosen = {0, count // 2, count - 1}
    assert {f"rays of module {k}" for k in chosen} <= set(lines)
    rays = list(lines.values())
    assert 2 * len(chosen) < len(axes.get_lines()) - 3 <= 3 * len(chosen)
    places = np.array([(m.x, m.z) for m in display.modules])
    for eye, lens in rays:
        assert np.abs(places - lens).sum(axis=1).min() < 1e-9 or display.diffuser == "conical"
        behind = eye[1] - display.observer_z
        assert display.observer_curvature * (eye[0] ** 2 + behind**2) == pytest.approx(2 * behind, abs=1e-9)
        assert abs(eye[0]) <= np.abs(observers[:, 0]).max() + 1e-9
    corners = axes.patches[0].get_xy()
    (x0, _, z0), (x1, _, z1) = display.roi
    assert {tuple(corner) for corner in corners.tolist()} == {(x0, z0), (x1, z0), (x1, z1), (x0, z1)}
    assert name in axes.get_title()
    assert display.diffuser in axes.get_title()
    assert "metres" in axes.get_xlabel()
    assert "viewers" in axes.get_ylabel()
    legend = {text.get_text() for text in draw_top_view(display).legends[0].get_texts()}
    assert {"screen", "observers", "region of interest"} <= legend
