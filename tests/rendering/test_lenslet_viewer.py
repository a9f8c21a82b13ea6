"""An eye that looks through lenses: texels by a scalar program of LF's first author's equations, and the command."""

from dataclasses import replace
from math import floor

import numpy as np
import pytest
from jobs import render, sentence
from lenslet_files import LENSES
from PIL import Image

from lfssao import InputError, find_views, parse_display, read_exr
from lfssao.cli.main import main
from lfssao.rendering.lenslet_viewer import LensletView

NEAR_EYE = find_views("near-eye")
SMALL = parse_display(LENSES, "small.toml")


def numbered(display):
    """A view in which each texel of the panel has a number of its own, from 1."""
    panel = 1 + np.arange(display.width * display.height, dtype=np.float32).reshape(display.height, display.width, 1)
    view = LensletView(display, channels=1)
    for k in range(display.count):
        view.put(k, panel[display.place(k)])
    return view


def seen_texel(eye, point):
    """The panel's texel that an eye sees through a point of the lenses; millimetres, None off the panel.

    By src/ExampleICIP2020/DisplayLensletShow.cpp of github.com/LeksiDor/LFDisplay and the numbers of its
    data/lensletdisplay.yaml: lenses of focal length 6.427 mm, 1.2 mm apart, 20 mm before the eye.
    """
    at = []
    for e, p in zip(eye, point, strict=True):
        slope = (p - e) / 20
        lens = 1.2 * floor(p / 1.2 + 0.5)
        at.append(p + (slope - (p - lens) / 6.427) * 6.316)
    column = floor((0.5 + at[0] / 21.6) * 2160)
    row = floor((0.5 - at[1] / 21.6) * 2160)
    return None if not (0 <= column < 2160 and 0 <= row < 2160) else row * 2160 + column + 1


@pytest.mark.parametrize("eye", [(0.0, 0.0), (1.3, -0.7), (-40.0, 25.0)])
def test_an_eye_sees_the_texels_of_the_author(eye):
    shot = numbered(NEAR_EYE).photograph(eye[0] / 1000, eye[1] / 1000, width=37)
    assert shot.image.shape == (37, 37, 1)
    side = 21.6 * 1.2 / 1.58
    dark = 0
    for j in range(37):
        for i in range(37):
            point = side * ((i + 0.5) / 37 - 0.5), side * (0.5 - (j + 0.5) / 37)
            wanted = seen_texel(eye, point)
            dark += wanted is None
            assert shot.image[j, i, 0] == (wanted or 0)
    assert shot.dark == dark
    assert 0 < dark < 37 * 37


def test_eyes_in_the_box_see_each_lens_show_its_own_image():
    view = numbered(SMALL)
    box = SMALL.eye_box
    assert box > 0
    owner = np.concatenate([np.full(SMALL.width * SMALL.height, -1), [-1]])
    for k in range(SMALL.count):
        rows, columns = SMALL.place(k)
        owner[(1 + np.arange(SMALL.height)[rows, None] * SMALL.width + np.arange(SMALL.width)[columns]).ravel()] = k
    width = 400
    x = SMALL.screen_width * ((np.arange(width) + 0.5) / width - 0.5)
    lens = np.clip(np.floor(x / SMALL.lens_pitch + 0.5) + 2, 0, 4).astype(int)
    for eye, own in ((0.99 * box, True), (-0.99 * box, True), (1.15 * box, False)):
        row = view.photograph(eye, 0.0, width).image[150, :, 0].astype(int)
        seen = owner[row][row > 0] % 5
        assert (seen == lens[row > 0]).all() == own
    assert replace(SMALL, lens_pitch=0.1, image_pitch=0.012).eye_box < 0


def test_lenses_without_textures_are_dark():
    view = LensletView(SMALL, [7, 8], channels=1)
    view.put(7, np.ones((12, 12, 1), np.float32))
    assert view.missing == [8]
    shot = view.photograph(0.0, 0.0, width=151)
    lit = shot.image[..., 0] > 0
    rows = np.flatnonzero(lit.any(axis=1))
    columns = np.flatnonzero(lit.any(axis=0))
    # The middle lens: 11.25 of 37.5 x 28.125 millimetres in the picture's middle.
    assert (columns[0], columns[-1]) == (53, 97)
    assert (rows[0], rows[-1]) == (34, 78)
    assert shot.dark == np.count_nonzero(~lit)
    for index, texture, reason in (
        (7, np.ones((12, 12, 1)), "lens 7 is not one of"),
        (8, np.ones((12, 11, 1)), "has shape"),
        (8, np.full((12, 12, 1), np.nan), "a value that is not finite"),
    ):
        with pytest.raises(InputError, match=reason):
            view.put(index, texture)
    for wrong in ((np.inf, 0.0, 9), (0.0, np.nan, 9), (0.0, 0.0, 0)):
        with pytest.raises(InputError):
            view.photograph(*wrong)


# The command line


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("lenses")
    (path / "small.toml").write_text(LENSES)
    job = "statue", "--display", str(path / "small.toml"), "--radii", "10%", "--resolution", "160x120"
    return render(path / "out", *job)


def test_view_shows_what_an_eye_sees(folder, tmp_path, capsys):
    target = tmp_path / "eye.png"
    panel = read_exr(folder / "panel.exr")["merged"].pixels
    words = "view", str(folder), "--layer", "merged", "--width", "100", "-o", str(target)
    assert main([*words, "--eye-x", "0.02", "--eye-y", "-0.01"]) == 0
    assert "each lens shows its own image alone to eyes within x, y = -0.0" in capsys.readouterr().out
    display = SMALL.with_resolution(160, 120)
    view = LensletView(display, channels=1)
    for k in range(display.count):
        view.put(k, panel[display.place(k)])
    shot = view.photograph(0.02, -0.01, 100)
    # Visibility of the panel where it is seen, black where it is not.
    lit = LensletView(display, channels=1)
    for k in range(display.count):
        lit.put(k, np.ones_like(panel[display.place(k)]))
    wanted = lit.photograph(0.02, -0.01, 100).image - shot.image
    with Image.open(target) as image:
        found = np.asarray(image)[..., 0].astype(np.float64)
    assert np.abs(found - 255 * wanted[..., 0]).max() <= 0.501
    assert main([*words, "--eye-x", "-0.02"]) == 0
    with Image.open(target) as image:
        assert (np.asarray(image)[..., 0] != found).mean() > 0.05


def test_an_animation_and_a_distance(folder, tmp_path):
    assert main(["view", str(folder), "--orbit", "4", "--width", "60"]) == 0
    with Image.open(folder / "orbit.png") as image:
        assert image.n_frames == 4
    pictures = []
    for distance in ("0.3", "0.2"):
        target = tmp_path / f"{distance}.png"
        assert main(["view", str(folder), "--distance", distance, "--width", "60", "-o", str(target)]) == 0
        pictures.append(target.read_bytes())
    assert pictures[0] != pictures[1]


def test_refusals(folder, tmp_path, capsys):
    shown = str(folder)
    out = ("-o", str(tmp_path / "a.png"))
    for words, reason in {
        ("--blend", "nearest", *out): "--blend is for displays of modules: an eye sees the lenses of small as they are",
        ("--distance", "1e-3", "--orbit"): "--orbit: there is no eye that sees each lens of small show its own",
        ("--modules", "15", *out): "modules 15:16 are not a part of 0:15, the lenses of small",
    }.items():
        assert main(["view", shown, *words]) == 2
        assert sentence(capsys).startswith(reason)
    assert not list(tmp_path.iterdir())
