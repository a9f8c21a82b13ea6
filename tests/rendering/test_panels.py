"""The texture of a panel behind lenses: equal to its lenses one by one, and when it is written."""

from math import sqrt

import numpy as np
import pytest
from jobs import manifest_of, render, sentence
from lenslet_files import LENSES

from lfssao import Settings, algorithm1, find_scene, find_views, make_samples, read_exr
from lfssao import render as textures_of
from lfssao.cli.main import main

COUNT = 15
SIZE = (5, 3)
# Borders of the images of a row or column of lenses: three or one of 12 texels, and what is left of 40 or 30.
COLUMNS = [0, 2, 14, 26, 38, 40]
ROWS = [0, 9, 21, 30]


@pytest.fixture
def job(tmp_path):
    (tmp_path / "small.toml").write_text(LENSES)
    return "statue", "--display", str(tmp_path / "small.toml"), "--radii", "5%,10%"


def place(index):
    row, column = divmod(index, 5)
    return slice(*ROWS[row : row + 2]), slice(*COLUMNS[column : column + 2])


@pytest.mark.parametrize("more", [(), ("--guard", "2", "--normals"), ("--neighbours", "3")], ids=str)
def test_a_panel_has_the_bits_of_its_lenses_side_by_side(job, more, tmp_path):
    folder = render(tmp_path / "out", *job, *more)
    panel = read_exr(folder / "panel.exr")
    guard = 2 if "--guard" in more else 0
    wanted = {"shaded", "depth", "positions", "color", "ao_1", "ao_2", "merged", "blurred"}
    assert set(panel) == (wanted | {"normals"} if "--normals" in more else wanted)
    for index in range(COUNT):
        lens = read_exr(folder / f"lens_{index:03d}.exr")
        for name, part in panel.items():
            own = lens[name].pixels
            cut = lens[name].guard
            assert cut == (guard if name in ("depth", "positions", "color", "normals") else 0)
            own = own[cut : len(own) - cut, cut : own.shape[1] - cut]
            assert part.channels == lens[name].channels
            np.testing.assert_array_equal(part.pixels[place(index)], own)
    assert {part.pixels.shape[:2] for part in panel.values()} == {(30, 40)}
    assert np.isfinite(panel["depth"].pixels).mean() > 0.2
    assert panel["ao_2"].pixels.max() > 0.3


def matrices():
    """World to texels of each lens's image, and depth, (4, 4), made here from the display's numbers.

    The scene is fitted into the ROI of 0.08 x 0.08 x 0.1 metres, whose middle is at z = 0.1. A lens's depth is 0 at 0.9
    and 1 at 1.1 times the ROI's least and greatest z.
    """
    box = find_scene("statue").bounds
    metres = (np.array([0.08, 0.08, 0.1]) / (box[1] - box[0])).min()
    middle = box.mean(axis=0)
    near = 0.9 * 0.05
    far = 1.1 * 0.15
    for index in range(COUNT):
        row, column = divmod(index, 5)
        x = 0.01125 * (column - 2)
        y = 0.01125 * (1 - row)
        # Physical x, y and z of the world, as seen from the lens.
        seen = np.array([
            [metres, 0, 0, -metres * middle[0] - x],
            [0, metres, 0, -metres * middle[1] - y],
            [0, 0, -metres, metres * middle[2] + 0.1],
            [0, 0, 0, 1],
        ])  # fmt: skip
        rows, columns = place(index)
        c_u = 20 + 1000 * x - columns.start
        c_v = 15 - 1000 * y - rows.start
        a = far / (far - near)
        yield np.array([[20, 0, c_u, 0], [0, -20, c_v, 0], [0, 0, a, -a * near], [0, 0, 1, 0]]) @ seen


def diagonal():
    box = find_scene("statue").bounds
    return sqrt(((box[1] - box[0]) ** 2).sum())


def test_occlusion_of_a_panel_is_that_of_each_part_by_its_lens(job, tmp_path):
    """Algorithm 1 on parts of the panel's depth, cut here: each lens is asked alone."""
    folder = render(tmp_path / "out", *job, "--rotate", "none", "--samples", "16")
    panel = read_exr(folder / "panel.exr")
    samples = make_samples("latin", 16)
    for index, matrix in enumerate(matrices()):
        rows, columns = place(index)
        depth = np.ascontiguousarray(panel["depth"].pixels[rows, columns, 0])
        made = algorithm1(depth, np.linalg.inv(matrix), matrix, samples, 0.05 * diagonal()).texture
        off = made != panel["ao_1"].pixels[rows, columns, 0]
        assert off.mean() < 0.02  # matrices rounded otherwise decide a sample otherwise, now and then


def occlusion_by_all_lenses(panel, samples, radius):
    """Share of each texel's samples that lie behind the surface in each lens's image into which they fall.

    A sample counts if it falls into one or more. By loops over lenses alone, in float64.
    """
    depths = [panel["depth"].pixels[place(k)][..., 0].astype(np.float64) for k in range(COUNT)]
    positions = panel["positions"].pixels.astype(np.float64)
    surface = np.isfinite(positions[..., 0])
    points = np.concatenate([positions[surface][:, None] + radius * samples, np.ones((surface.sum(), 16, 1))], axis=2)
    asked, hidden = np.zeros((2, *points.shape[:2]), int)
    for matrix, depth in zip(matrices(), depths, strict=True):
        a, b, c, q = np.moveaxis(points @ matrix.T, 2, 0)
        column = np.floor(a / q).astype(int)
        row = np.floor(b / q).astype(int)
        falls = (row >= 0) & (row < depth.shape[0]) & (column >= 0) & (column < depth.shape[1])
        asked += falls
        hidden[falls] += depth[row[falls], column[falls]] < (c / q)[falls]
    made = np.zeros(surface.shape)
    made[surface] = ((asked > 0) & (hidden == asked)).mean(axis=1)
    return made, surface, (asked > 0).mean()


def test_each_sample_may_ask_each_lens_that_sees_it(job, tmp_path):
    folder = render(tmp_path / "out", *job, "--samples", "16", "--neighbours", "14")
    panel = read_exr(folder / "panel.exr")
    samples = make_samples("latin", 16)
    made, surface, seen = occlusion_by_all_lenses(panel, samples, 0.1 * diagonal())
    off = np.abs(made - panel["ao_2"].pixels[..., 0])[surface]
    assert (off > 1e-6).mean() < 0.02
    assert off.max() < 0.2
    outside = sum(entry["samples_outside"][1] for entry in manifest_of(folder)["views"])
    assert outside / (16 * surface.sum()) == pytest.approx(1 - seen, abs=1e-3)
    alone = render(tmp_path / "alone", *job, "--samples", "16", "--rotate", "none")
    own = read_exr(alone / "panel.exr")["ao_2"].pixels[..., 0]
    assert (np.abs(made - own)[surface] > 1e-6).mean() > 0.3


def test_the_library_renders_lens_by_lens(tmp_path, job):
    folder = render(tmp_path / "out", *job)
    display = find_views(tmp_path / "small.toml")
    mesh = find_scene("statue")
    radii = 0.05 * diagonal(), 0.1 * diagonal()
    panel = read_exr(folder / "panel.exr")
    lenses = textures_of(mesh, display, Settings(radii), [7, 2])
    for index, textures in zip([7, 2], lenses, strict=True):
        assert textures.view.name == f"lens_{index:03d}"
        for name, texture in (("depth", textures.gbuffer.depth), ("merged", textures.merged)):
            np.testing.assert_array_equal(panel[name].pixels[place(index)][..., 0], texture)


def test_only_a_job_of_all_lenses_has_it_and_a_later_one_makes_it_anew(job, tmp_path, capsys):
    folder = tmp_path / "out"
    for lenses in ("0:8", "8:15"):
        render(folder, *job, "--modules", lenses)
        assert not (folder / "panel.exr").exists()
    capsys.readouterr()
    render(folder, *job, "--resume")
    assert "15 EXR files, manifest.json, contact.png, panel.exr\n" in capsys.readouterr().out
    whole = (folder / "panel.exr").read_bytes()
    (folder / "panel.exr").write_bytes(b"of another job")
    render(folder, *job)
    assert (folder / "panel.exr").read_bytes() == whole
    render(folder, *job, "--modules", "0:8")
    assert not (folder / "panel.exr").exists()


def test_the_manifest_and_the_file_say_what_it_is(job, tmp_path):
    folder = render(tmp_path / "out", *job, "--resolution", "80x60", "--layers", "merged,depth")
    manifest = manifest_of(folder)
    panel = read_exr(folder / "panel.exr")
    assert (manifest["display"], manifest["lenslet"]["name"], manifest["lenslet"]["width"]) == (None, "small", 80)
    assert [entry["name"] for entry in manifest["views"]] == [f"lens_{k:03d}" for k in range(COUNT)]
    assert {name: part.pixels.shape for name, part in panel.items()} == {"depth": (60, 80, 1), "merged": (60, 80, 1)}
    said = panel["depth"].attributes
    assert said["display"] == "small"
    assert said["depth"].startswith("screen space z")
    assert not {"sha256", "made_from", "module", "surface_texels"} & set(said)


def test_each_frame_has_its_own(job, tmp_path):
    render(tmp_path, *job, "--frames", "2")
    first, second = (tmp_path / f"frame_{k:04d}" / "panel.exr" for k in range(2))
    assert first.read_bytes() != second.read_bytes()


def test_lenses_ask_those_of_their_own_frame(job, tmp_path):
    """Two frames, and the same in the other order, which have the same box."""
    near = np.eye(4)
    far = np.eye(4)
    far[0, 3] = 0.3
    for name, frames in (("forth", [near, far]), ("back", [far, near])):
        np.save(tmp_path / f"{name}.npy", np.array(frames))
        more = "--frames", str(tmp_path / f"{name}.npy"), "--neighbours", "4", "--layers", "merged"
        render(tmp_path / name, *job, *more)
    first = [read_exr(tmp_path / "forth" / f"frame_{k:04d}" / "panel.exr")["merged"].pixels for k in range(2)]
    second = [read_exr(tmp_path / "back" / f"frame_{1 - k:04d}" / "panel.exr")["merged"].pixels for k in range(2)]
    np.testing.assert_array_equal(first, second)
    assert (first[0] != first[1]).any()


def test_refusals(job, tmp_path, capsys):
    for words, reason in {
        (*job, "--quilt", "merged"): "--quilt is for all views of a quilt: it needs --display of one, and no --modules",
        (*job, "--modules", "15"): "modules 15:16 are not a part of 0:15, the lenses of small",
        (*job, "--neighbours", "15"): "neighbours is 15: small has 14 lenses besides lens 0",
        (*job, "--resolution", "2x2"): "display small: image_pitch: it is 0.012, less than a texel, 0.02 metres",
    }.items():
        assert main(["render", *words, "-o", str(tmp_path / "no")]) == 2
        assert sentence(capsys).startswith(reason)
    assert not (tmp_path / "no").exists()
