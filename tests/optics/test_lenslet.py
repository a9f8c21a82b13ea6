"""Lenslet displays: rays against those of LF's first author, edges, which texel is whose, files and what is refused."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from jobs import sentence
from lenslet_files import LENSES

from lfssao import (
    InputError,
    Mesh,
    RayCaster,
    display_names,
    display_text,
    find_display,
    find_views,
    module_views,
    parse_display,
)
from lfssao.cli.main import main
from lfssao.optics.view import View

NEAR_EYE = find_views("near-eye")
SMALL = parse_display(LENSES, "small.toml")
FLIP = np.diag([1.0, 1.0, -1.0, 1.0])[:3]  # the world is physical space, its z towards the viewers


def authors_ray(column, row):
    """The eye's place and the slopes, along x and y, of the ray of a raster point of the panel; millimetres.

    Generated as src/ExampleICIP2020/DisplayLensletCapture.cpp of github.com/LeksiDor/LFDisplay does through the lenses'
    middles, from the numbers of its data/lensletdisplay.yaml: panel 21.6 mm and 2160 texels wide, 6.316 mm behind the
    lenses, these 20 mm from the eye, pitches 1.2 mm of lenses and 1.58 mm of elemental images, no shifts. The ray is
    eye + z slope, z from the eye's plane on.
    """
    place = (column / 2160 - 0.5) * 21.6, (0.5 - row / 2160) * 21.6
    lens = tuple(1.2 * round(p / 1.58) for p in place)
    slope = tuple((p - c) / 6.316 for p, c in zip(place, lens, strict=True))
    return tuple(c - 20 * s for c, s in zip(lens, slope, strict=True)), slope


def lens_of(display, column, row):
    """Number of the lens that has a texel, and where in the panel its texels begin."""
    (found,) = (
        k
        for k in range(display.count)
        if all(s.start <= at < s.stop for s, at in zip(display.place(k), (row, column), strict=True))
    )
    return found, display.place(found)[1].start, display.place(found)[0].start


@pytest.mark.parametrize("z", [0.3, 0.6])
def test_rays_are_those_of_the_author(z):
    """Points of his rays, z metres from the eye, land where the rays come from; 0.05 texels are allowed."""
    rng = np.random.default_rng(1)
    corners = [(0, 0), (2159, 2159), (52, 53), (1000, 1001), (1158, 1159), (1080, 1080)]
    for column, row in [*corners, *rng.integers(0, 2160, (40, 2)).tolist()]:
        eye, slope = authors_ray(column + 0.5, row + 0.5)
        x, y = ((e + 1000 * z * s) / 1000 for e, s in zip(eye, slope, strict=True))
        index, left, top = lens_of(NEAR_EYE, column, row)
        u, v, _ = NEAR_EYE.view(index, FLIP).world_to_image([x, y, -(z - 0.02)])
        assert abs(u + left - (column + 0.5)) < 1e-6
        assert abs(v + top - (row + 0.5)) < 1e-6


def board(left, bottom, z):
    """A board with a lower left corner, large to the right and above, world units."""
    corners = [(left, bottom, z), (left + 1, bottom, z), (left + 1, bottom + 1, z), (left, bottom + 1, z)]
    return Mesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.mark.parametrize(("column", "row"), [(1085, 1075), (1020, 1150), (700, 1400), (20, 2140)])
@pytest.mark.parametrize("side", [-1, 1])
def test_an_edge_is_within_a_twentieth_of_a_texel(column, row, side):
    """A board whose edges pass 0.05 texels left and below of a texel's middle, or right and above, by his rays."""
    z, (eye, slope) = 0.4, authors_ray(column + 0.5 + 0.05 * side, row + 0.5 - 0.05 * side)
    x, y = ((e + 1000 * z * s) / 1000 for e, s in zip(eye, slope, strict=True))
    mesh = board(x, y, -(z - 0.02))
    index, left, top = lens_of(NEAR_EYE, column, row)
    view = NEAR_EYE.view(index, FLIP)
    covered = np.isfinite(RayCaster(mesh, view.cast_from_world).gbuffer(view).depth)
    at = row - top, column - left
    assert covered[at] == (side < 0)
    assert covered[at[0] - 1, at[1] + 1]  # the board is on the right and above
    assert not covered[at[0] + 1, at[1] - 1]


@pytest.mark.parametrize("changes", [
    {},
    {"middle": "corner"},
    {"width": 41, "height": 31},
    {"image_pitch": 0.0133, "middle": "corner"},
    {"image_pitch": 0.07, "lens_pitch": 0.07},
], ids=str)  # fmt: skip
def test_each_texel_belongs_to_the_lens_in_whose_image_its_middle_lies(changes):
    display = replace(SMALL, **changes)
    owner = np.full((display.height, display.width), -1)
    for k in range(display.count):
        assert (owner[display.place(k)] == -1).all()
        owner[display.place(k)] = k
    assert (owner >= 0).all()
    columns = display.size[0]
    for row, column in itertools.product(range(display.height), range(display.width)):
        x = ((column + 0.5) / display.width - 0.5) * display.panel_width
        y = (0.5 - (row + 0.5) / display.height) * display.panel_height
        lens = np.array(display.lenses[owner[row, column]][:2])
        image = lens * display.image_pitch / display.lens_pitch
        assert np.abs(np.array([x, y]) - image).max() <= display.image_pitch / 2 + 1e-12
        assert divmod(owner[row, column], columns) == (
            len({display.place(k)[0].start for k in range(display.count) if display.place(k)[0].start < row + 0.5}) - 1,
            len({display.place(k)[1].start for k in range(display.count) if display.place(k)[1].start < column + 0.5})
            - 1,
        )
    middle = np.abs(np.array(display.lenses)[:, :2]).min(axis=0)
    np.testing.assert_allclose(middle, [display.lens_pitch / 2 * (display.middle == "corner")] * 2, atol=1e-15)


def test_a_point_has_an_image_behind_each_lens_that_sees_it():
    """By similar triangles: from a lens at c to the panel, c + (x - c) gap / z."""
    point = np.array([0.005, -0.003, -0.1])
    for k, (x, y, _) in enumerate(SMALL.lenses):
        u, v, depth = SMALL.view(k, FLIP).world_to_image(point)
        rows, columns = SMALL.place(k)
        assert u + columns.start == pytest.approx(20 + 1000 * (x + (0.005 - x) * 0.2), abs=1e-9)
        assert v + rows.start == pytest.approx(15 - 1000 * (y + (-0.003 - y) * 0.2), abs=1e-9)
        assert 0 < depth < 1


def test_guard_bands_scales_and_places():
    moved = np.column_stack([np.diag([0.025, 0.025, -0.025]), [0.1, -0.2, 0.3]])
    point = np.array([0.01, 0.02, 0.09])
    for index in (0, 7, 14):
        wanted = SMALL.view(index, FLIP).world_to_image(point * [1, 1, -1])
        world = (point - moved[:, 3]) / np.diag(moved)
        view = SMALL.view(index, moved, guard=3)
        np.testing.assert_allclose(view.world_to_image(world) - [3, 3, 0], wanted, rtol=0, atol=1e-9)
        rows, columns = SMALL.place(index)
        assert (view.width, view.height) == (columns.stop - columns.start + 6, rows.stop - rows.start + 6)
        assert isinstance(view, View)
        assert view.screen_to_world is not None


# Files


def test_the_preset_has_its_sources():
    assert display_names("lenslet") == ["near-eye"]
    assert NEAR_EYE.size == (15, 15)
    values = [line for line in display_text("near-eye").splitlines() if "=" in line.split("#")[0]]
    assert all("published" in line for line in values if not line.startswith(("kind", "name")))
    # 13 whole images of 158 texels and the 53 that are left on each side.
    widths = [NEAR_EYE.place(k)[1].stop - NEAR_EYE.place(k)[1].start for k in range(15)]
    assert widths == [53, *[158] * 13, 53]


def test_the_command_prints_and_lists_it(capsys, tmp_path):
    assert main(["display", "near-eye"]) == 0
    assert capsys.readouterr().out == display_text("near-eye")
    assert main(["display"]) == 0
    assert capsys.readouterr().out.splitlines()[-1].endswith("0.0164 x 0.0164 m, panel behind 15 x 15 lenses")
    assert main(["display", "near-eye", "--plot", str(tmp_path / "a.png")]) == 2
    assert "near-eye: it is a lenslet display, here a display of modules is needed" in sentence(capsys)
    with pytest.raises(InputError, match=r"there is no kind 'lenses' .*: choose one of modules, quilt, lenslet"):
        display_names("lenses")


@pytest.mark.parametrize(("line", "reason"), [
    ("lens_pitch = 0", "f: display small: lens_pitch: it is 0.0, it must be from 1e-09 to 1e+06 metres"),
    ("image_pitch = 0.0", "f: display small: image_pitch: it is 0.0, it must be"),
    ("image_pitch = 0.0009", "f: display small: image_pitch: it is 0.0009, less than a texel, 0.001 metres"),
    ("gap = -0.02", "f: display small: gap: it is -0.02, it must be"),
    ("focal_length = nan", "f: focal_length is nan, it must be a finite number"),
    ("observer_distance = 0", "f: display small: observer_distance: it is 0.0, it must be"),
    ("panel_width = 1e9", "f: display small: panel_width: it is 1000000000.0, it must be"),
    ("resolution = [40, 0]", "f: display small: height is 0"),
    ("resolution = [40.5, 30]", "f: resolution: it is [40.5, 30.0], it must be two whole numbers of texels"),
    ("resolution = [2147483, 1001]", "f: display small: texels of the panel is 2149630483"),
    ("middle = 'edge'", "f: display small: there is no middle 'edge': choose one of lens, corner"),
    ("roi = {min = [0, 0, 0.1], max = [1, 0, 1]}", "f: display small: roi: min must be less than max in x, y and z"),
    ("roi = {min = [0, 0, -0.1], max = [1, 1, 1]}", "f: display small: roi.min: z = -0.1 is not behind the lenses"),
    ("roi = {min = [0, 0, 0.1], max = [1, 1, 1], mid = 1}", "f: roi.mid: there is no key 'mid'"),
    ("columns = 3", "f: columns: there is no key 'columns'"),
])  # fmt: skip
def test_a_file_that_is_wrong(line, reason):
    key = line.split(" = ")[0]
    lines = [line if each.startswith(f"{key} =") else each for each in LENSES.splitlines()]
    with pytest.raises(InputError) as caught:
        parse_display("\n".join(lines if line in lines else [line, *lines]), "f")
    assert str(caught.value).startswith(reason)


def test_millimetres_in_place_of_metres(capsys, tmp_path):
    for pitch in ("0.01125", "11.25"):
        (tmp_path / "a.toml").write_text(LENSES.replace("lens_pitch = 0.01125", f"lens_pitch = {pitch}"))
        assert main(["display", str(tmp_path / "a.toml")]) == 0
    assert sorted(capsys.readouterr().err.splitlines()) == [
        "lfssao: display small: its lenses are 11.25 metres apart: did you mean millimetres?"
    ]


def test_too_many_lenses():
    """499 x 375: middles of texels reach 249.4 and 187.1 pitches from the panel's."""
    with pytest.raises(InputError, match="small: lenses is 187125, it must be"):
        replace(SMALL, width=1000, height=1000, image_pitch=8.01e-5)


def test_what_needs_modules_refuses_a_panel(statue):
    with pytest.raises(InputError, match="near-eye: it is a lenslet display, here a display of modules is needed"):
        find_display("near-eye")
    with pytest.raises(InputError, match="modules 225:226 are not a part of 0:225, the lenses of near-eye"):
        module_views(statue, "near-eye", range(225, 226))
    with pytest.raises(InputError, match="lens is 225"):
        NEAR_EYE.view(225, FLIP)
