"""Quilts: matrices against two public programs', parallax, files and what is refused."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from jobs import manifest_of, sentence
from jobs import render as render_files
from quilt_files import QUILT

from lfssao import (
    InputError,
    LightField,
    Mesh,
    RayCaster,
    Settings,
    display_names,
    display_text,
    find_display,
    find_views,
    module_views,
    parse_display,
    read_exr,
    render,
)
from lfssao.cli.main import main

PORTRAIT = find_views("looking-glass-portrait")
GO = find_views("looking-glass-go")
FLIP = np.diag([1.0, 1.0, -1.0, 1.0])[:3]  # the world is physical space, its z towards the viewers


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(QUILT)
    return path


def clip_matrix(view):
    """OpenGL's: world to x, y and z from -1 to 1 of w."""
    a, b, c, q = view.world_to_image.numbers.reshape(4, 4)
    return np.array([2 * a / view.width - q, q - 2 * b / view.height, 2 * c - q, q])


# Matrices of public programs

ROWS = [[0, 8.144346428, 0, 0], [0, 0, -6.241400070, 0.080392780], [0, 0, -1, 0.653583801]]
GO_ROWS = [[0, 8.144346428, 0, 0], [0, 0, -6.467585170, 0.064675705], [0, 0, -1, 0.540784603]]


@pytest.mark.parametrize(("quilt", "index", "x", "rest"), [
    (PORTRAIT, 0, [10.859128571, 0, 3.423870087, 0], ROWS),
    (PORTRAIT, 13, [10.859128571, 0, 1.491213102, 0], ROWS),
    (PORTRAIT, 47, [10.859128571, 0, -3.423870087, 0], ROWS),
    (GO, 20, [14.478838094, 0, 1.708755856, 0], GO_ROWS),
])  # fmt: skip
def test_matrices_are_those_of_holoplay_core(quilt, index, x, rest):
    """Projection times view of docs.lookingglassfactory.com/keyconcepts/camera, which HoloPlay Core's samples compute.

    A scalar program with Python's math.tan computed these numbers apart: with s half the screen's height, d = -s /
    tan(fov / 2), o = d tan((k / (n - 1) - 1/2) cone), the view moves by (o, 0, d), and perspective(fov, aspect, near,
    far) has o / (s aspect) added to its number in row 0, column 2. Planes are 0.9 and 1.1 times the ROI's distances.
    """
    np.testing.assert_allclose(clip_matrix(quilt.view(index, FLIP)), [x, *rest], rtol=0, atol=1e-6)


@pytest.mark.parametrize(("index", "shear"), [(0, 3.863202805), (13, 1.671379745), (47, -3.863202805)])
def test_matrices_are_those_of_looking_glass_webxr(index, shear):
    """Projection times view of LookingGlassXRDevice.js in github.com/Looking-Glass/looking-glass-webxr.

    Computed apart as those above: angle = ((i + 1/2) / n - 1/2) cone, the eye at tan(angle) times the focal distance
    h / 2 / tan(fov / 2), and a frustum from left to right of -near tan(angle) -+ aspect near tan(fov / 2). The cone of
    its default calibration is 40 degrees.
    """
    quilt = replace(PORTRAIT, view_cone=40.0, spacing="middles")
    wanted = [[10.859128571, 0, shear, 0], *ROWS]
    np.testing.assert_allclose(clip_matrix(quilt.view(index, FLIP)), wanted, rtol=0, atol=1e-6)


# Parallax


def board(left, right, z):
    """A board from x = left to right, as high as the screen and more, world units."""
    corners = [(left, -0.1, z), (right, -0.1, z), (right, 0.1, z), (left, 0.1, z)]
    return Mesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.mark.parametrize("guard", [0, 3])
@pytest.mark.parametrize("z", [0.0, 0.03, -0.03])
def test_a_board_in_the_screen_stays_and_others_move(z, guard):
    """An edge at x = 0.01: seen from e across the screen at x + (x - e) z / (D - z), z towards the viewers."""
    quilt = PORTRAIT.with_resolution(240, 4)
    box = np.array(((-0.05, -0.07, -0.04), (0.05, 0.07, 0.04)))
    quilt = replace(quilt, roi=tuple(map(tuple, box.tolist())))
    views = module_views(board(0.01, 0.05, z), quilt, guard=guard, bounds=box)
    caster = RayCaster(board(0.01, 0.05, z), views[0].cast_from_world)
    texels = 240 / quilt.screen_width
    eyes = quilt.distance * np.tan(np.radians(35 * (np.arange(48) / 47 - 0.5)))
    edges = 120 + guard + texels * (0.01 + (0.01 - eyes) * z / (quilt.distance - z))
    seen = []
    for view in views:
        caster = caster.of_view(view)
        covered = np.isfinite(caster.gbuffer(view).depth[2 + guard])
        seen.append(np.flatnonzero(covered)[0])
    np.testing.assert_array_equal(seen, np.ceil(edges - 0.5))
    assert (len(set(seen)) == 1) == (z == 0)
    assert [view.name for view in (views[0], views[-1])] == ["view_000", "view_047"]


def test_a_view_of_several_is_that_view_alone(statue):
    quilt = PORTRAIT.with_resolution(24, 32)
    settings = Settings((0.1,))
    both, (alone,) = render(statue, quilt, settings, [0, 47]), render(statue, quilt, settings, [47])
    assert (both[0].gbuffer.depth != alone.gbuffer.depth).any()
    for name in ("depth", "positions"):
        np.testing.assert_array_equal(getattr(both[1].gbuffer, name), getattr(alone.gbuffer, name))
    np.testing.assert_array_equal(both[1].merged, alone.merged)


def test_depth_lies_between_the_planes_and_ao_is_algorithm_1(statue):
    (textures,) = render(statue, PORTRAIT.with_resolution(24, 32), Settings((0.1,)), [5])
    depth = textures.gbuffer.depth[np.isfinite(textures.gbuffer.depth)]
    assert 0 < depth.min() < depth.max() < 1
    assert textures.view.screen_to_world is not None
    assert textures.view.depth_kind.endswith("perspective")


# Files


def test_presets():
    assert display_names("quilt") == ["looking-glass-go", "looking-glass-portrait"]
    assert (PORTRAIT.columns * PORTRAIT.width, PORTRAIT.rows * PORTRAIT.height) == (3360, 3360)
    assert (GO.columns * GO.width, GO.rows * GO.height) == (4092, 4092)
    assert (PORTRAIT.file_name("quilt"), GO.file_name("a")) == ("quilt_qs8x6a0.75.png", "a_qs11x6a0.5625.png")
    for name in display_names("quilt"):
        values = [line for line in display_text(name).splitlines() if "=" in line.split("#")[0]]
        sources = "published", "assumed", "the maker calls it"
        assert all(any(word in line for word in sources) for line in values if not line.startswith(("kind", "name")))


@pytest.mark.parametrize("quilt", [PORTRAIT, GO], ids=["portrait", "go"])
def test_every_view_shows_all_of_the_roi(quilt):
    corners = np.array(list(itertools.product(*np.transpose(quilt.roi)))) * [1, 1, -1]
    for index in range(quilt.count):
        u, v, depth = quilt.view(index, FLIP).world_to_image(corners).T
        assert 0 < u.min() < u.max() < quilt.width
        assert 0 < v.min() < v.max() < quilt.height
        assert 0 < depth.min() < depth.max() < 1


def test_the_world_may_have_any_scale_and_place():
    """A map of scale 1/40 about a place, as of scenes in other units: the same texels, and planes 40 times as far."""
    moved = np.column_stack([np.diag([0.025, 0.025, -0.025]), [0.1, -0.2, 0.3]])
    point = np.array([0.01, 0.02, -0.03])
    for index in (0, 30):
        wanted = PORTRAIT.view(index, FLIP).world_to_image(point * [1, 1, -1])
        view = PORTRAIT.view(index, moved)
        world = (point - moved[:, 3]) / np.diag(moved)
        np.testing.assert_allclose(view.world_to_image(world), wanted, rtol=0, atol=1e-9)
        assert view.lens[4] == pytest.approx(40 * PORTRAIT.view(index, FLIP).lens[4], rel=1e-12)


def test_the_command_prints_and_lists_them(capsys, small):
    assert main(["display", "looking-glass-go"]) == 0
    assert capsys.readouterr().out == display_text("looking-glass-go")
    assert main(["display", str(small)]) == 0
    assert capsys.readouterr().out == QUILT
    assert main(["display"]) == 0
    assert "views. 0.12 x 0.161 m, quilt of 8 x 6 views\n" in capsys.readouterr().out
    assert main(["display", str(small), "--plot"]) == 2
    assert "small: it is a quilt" in sentence(capsys)
    small.write_text(QUILT.replace("height = 0.16", "height = 160"))
    assert main(["display", str(small)]) == 0
    assert "small: its screen is 120 x 160 metres large: did you mean millimetres?" in capsys.readouterr().err


@pytest.mark.parametrize(("line", "reason"), [
    ("columns = 0", "f: columns: it is 0, it must be a whole number from 1 to 1000"),
    ("rows = 2.5", "f: rows: it is 2.5, it must be"),
    ("resolution = [24, 0]", "f: display small: height is 0"),
    ("resolution = [24.5, 32]", "f: resolution: it is [24.5, 32.0], it must be two whole numbers of texels"),
    ("resolution = [2147483, 1000]", "f: display small: texels of all views is 12884898000"),
    ("aspect = 0", "f: display small: aspect: it is 0.0, it must be from 0.001 to 1000"),
    ("screen_height = -0.1", "f: display small: screen_height: it is -0.1, it must be from 1e-06 to 1e+06"),
    ("field_of_view = 180", "f: display small: field_of_view: it is 180.0, it must be from 0.01 to 179.9"),
    ("view_cone = nan", "f: view_cone is nan, it must be a finite number"),
    ("view_cone = 5e-324", "f: display small: view_cone: it is 5e-324, it must be from 0.01 to 179.9"),
    ("roi = {min = [0, 0, 0], max = [1, 1, 1e308]}", "f: display small: roi: min must be less than max in x, y and z"),
    ("spacing = 'even'", "f: display small: there is no spacing 'even': choose one of ends, middles"),
    ("roi = {min = [0, 0, 0], max = [1, 0, 1]}", "f: display small: roi: min must be less than max in x, y and z"),
    ("roi = {min = [0, 0, -0.7], max = [1, 1, 1]}", "f: display small: roi.min: z = -0.7 reaches the eyes at z = "),
    ("roi = {min = [0, 0, 0], max = [1, 1, 1], mid = 1}", "f: roi.mid: there is no key 'mid'"),
    ("kind = 'lenslets'", "f: kind: there is no kind 'lenslets' (did you mean 'lenslet'?): choose one of "),
    ("colums = 3", "f: colums: there is no key 'colums'"),
])  # fmt: skip
def test_a_file_that_is_wrong(line, reason):
    key = line.split(" = ")[0]
    lines = [line if each.startswith(f"{key} =") else each for each in QUILT.splitlines()]
    with pytest.raises(InputError) as caught:
        parse_display("\n".join(lines if line in lines else [line, *lines]), "f")
    assert str(caught.value).startswith(reason)


def test_what_needs_modules_refuses_a_quilt(statue):
    for call in (find_display, lambda name: LightField(name, [0])):
        with pytest.raises(InputError, match="portrait: it is a quilt of cameras' views, here a display of modules is"):
            call("looking-glass-portrait")
    with pytest.raises(InputError, match="modules 47:49 are not a part of 0:48, the views of looking-glass-portrait"):
        module_views(statue, "looking-glass-portrait", range(47, 49))
    with pytest.raises(InputError, match="view is 48"):
        PORTRAIT.view(48, FLIP)


# The command line


def test_render_view_by_view(small, tmp_path, capsys):
    """All views, and some of them in a job of their own: the same files."""
    job = "statue", "--display", str(small), "--radii", "5%"
    whole = render_files(tmp_path / "whole", *job)
    names = [f"view_{k:03d}" for k in range(6)]
    manifest = manifest_of(whole)
    assert [entry["name"] for entry in manifest["views"]] == names
    assert (manifest["display"], manifest["quilt"]["columns"], manifest["quilt"]["name"]) == (None, 3, "small")
    assert read_exr(whole / "view_002.exr")["shaded"].attributes["display"] == "small"
    some = render_files(tmp_path / "some", *job, "--modules", "4:6")
    for name in names[4:]:
        assert (some / f"{name}.exr").read_bytes() == (whole / f"{name}.exr").read_bytes()
    assert not list(some.glob("*_qs*"))
    (whole / "view_003.exr").unlink()
    before = (whole / "view_000.exr").stat().st_mtime_ns
    render_files(whole, *job, "--resume")
    assert (whole / "view_003.exr").is_file()
    assert (whole / "view_000.exr").stat().st_mtime_ns == before
    capsys.readouterr()
    for words, reason in {
        ("view", str(whole)): "it describes a quilt of cameras' views, which an eye sees by --html alone",
        ("render", *job, "--neighbours", "1", "-o", str(tmp_path / "no")): "small: it is a quilt of cameras' views",
        ("render", *job, "--modules", "6", "-o", str(tmp_path / "no")): "not a part of 0:6, the views of small",
    }.items():
        assert main(words) == 2
        assert reason in sentence(capsys)
    assert not (tmp_path / "no").exists()


def test_compare_takes_the_files_of_views(small, tmp_path, capsys):
    job = "statue", "--display", str(small), "--modules", "0:2", "--radii"
    right = render_files(tmp_path / "right", *job, "5%")
    wrong = render_files(tmp_path / "wrong", *job, "6%")
    assert main(["compare", str(right), str(right)]) == 0
    assert main(["compare", str(wrong), str(right), "--layers", "ao_1", "--no-diagnosis"]) == 2
    assert "first that differs: view_000, ao_1 (outside the interval)" in capsys.readouterr().out
