"""Pictures of all views of a quilt: where each view is, codes, names, and when they are written."""

import numpy as np
import pytest
from jobs import render, sentence
from PIL import Image
from quilt_files import QUILT

from lfssao import read_exr
from lfssao.cli.main import main

MINE = QUILT.replace("aspect = 0.75", "aspect = 0.5625").replace("0.05", "0.04")
# View 0 below on the left, from there to the right and upwards: rows of the picture from above.
ROWS = [[3, 4, 5], [0, 1, 2]]


@pytest.fixture
def job(tmp_path):
    (tmp_path / "mine.toml").write_text(MINE)
    return "statue", "--display", str(tmp_path / "mine.toml"), "--radii", "5%,10%"


def tile(path, row, column):
    with Image.open(path) as image:
        pixels = np.asarray(image)
    assert pixels.shape[:2] == (64, 72)
    return pixels[32 * row :][:32, 24 * column :][:, :24].astype(np.float64)


def srgb(linear):
    return 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def layer(folder, view, name):
    return read_exr(folder / f"view_{view:03d}.exr")[name].pixels.astype(np.float64)


@pytest.mark.parametrize("guard", [(), ("--guard", "3")])
def test_view_0_is_below_on_the_left_and_the_last_above_on_the_right(job, guard, tmp_path):
    folder = render(tmp_path / "out", *job, *guard, "--quilt", "shaded,ao_2,color")
    assert sorted(path.name for path in folder.glob("*_qs*")) == [
        f"{name}_qs3x2a0.5625.png" for name in ("ao_2", "color", "shaded")
    ]
    for row, views in enumerate(ROWS):
        for column, view in enumerate(views):
            shaded = tile(folder / "shaded_qs3x2a0.5625.png", row, column)
            assert shaded.any()
            assert np.abs(shaded - srgb(layer(folder, view, "shaded"))).max() <= 0.501
            occlusion = tile(folder / "ao_2_qs3x2a0.5625.png", row, column)
            assert np.abs(occlusion - 255 * layer(folder, view, "ao_2")[..., 0]).max() <= 0.5
            color = tile(folder / "color_qs3x2a0.5625.png", row, column)
            crop = slice(3, -3) if guard else slice(None)
            assert np.abs(color - srgb(layer(folder, view, "color")[crop, crop])).max() <= 0.501


def test_only_a_job_of_all_views_has_it_and_a_later_one_makes_it_anew(job, tmp_path, capsys):
    folder = tmp_path / "out"
    name = "shaded_qs3x2a0.5625.png"
    for views in ("0:3", "3:6"):
        render(folder, *job, "--modules", views)
        assert not (folder / name).exists()
    render(folder, *job, "--resume")
    assert f"contact.png, {name}\n" in capsys.readouterr().out
    whole = (folder / name).read_bytes()
    (folder / name).write_bytes(b"of another job")
    render(folder, *job)
    assert (folder / name).read_bytes() == whole
    render(tmp_path / "none", *job, "--layers", "depth")
    assert not list((tmp_path / "none").glob("*_qs*"))


def test_each_frame_has_its_own(job, tmp_path):
    render(tmp_path, *job, "--frames", "2")
    first, second = (tmp_path / f"frame_{k:04d}" / "shaded_qs3x2a0.5625.png" for k in range(2))
    assert first.read_bytes() != second.read_bytes()


def test_refusals(job, tmp_path, capsys):
    for words, reason in {
        (*job, "--quilt", "merged", "--modules", "0:5"): "--quilt is for all views of a quilt: it needs --display of",
        ("statue", "--quilt", "merged"): "--quilt is for all views of a quilt: it needs --display of one, and no ",
        ("statue", "--camera", "--quilt", "merged"): "--quilt is for all views of a quilt: it needs --display of one",
        (*job, "--quilt", "depth"): "--quilt: there is no layer 'depth': choose one of merged, blurred, shaded, color",
        (*job, "--quilt", "ao_3"): "--quilt: there is no layer 'ao_3'",
        (*job, "--quilt", "merged", "--layers", "ao"): "--quilt: there is no layer 'merged': choose one of ao_1, ao_2",
    }.items():
        assert main(["render", *words, "-o", str(tmp_path / "out")]) == 2
        assert sentence(capsys).startswith(reason)
    assert not (tmp_path / "out").exists()
