"""Frames: where a turntable and files of matrices put the scene, and that each frame is a still of the moved mesh."""

import json
import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from jobs import digests_of, manifest_of, render
from PIL import Image, ImageSequence

from lfssao.cli.main import main
from lfssao.errors import InputError
from lfssao.files.exr import read_exr
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.display_file import find_display
from lfssao.rendering.animation import MOST_FRAMES, frame_bounds, read_transforms, swept_bounds, turntable
from lfssao.rendering.job import Job
from lfssao.rendering.passes import render_view
from lfssao.rendering.run import Renderer
from lfssao.rendering.settings import Settings
from lfssao.rendering.views import module_views
from lfssao.scene.builtin import builtin_scene
from lfssao.scene.mesh import Mesh, moved

BOX = np.array([[-1.0, 0.0, 2.0], [3.0, 5.0, 4.0]])
SOLID = trimesh.creation.box(bounds=BOX)
CUBE = Mesh(SOLID.vertices, SOLID.faces)
SMALL = ["ammonite", "--display", "sample-a", "--modules", "9:11", "--resolution", "32x24", "--radii", "0.05,0.1"]


@given(st.integers(1, 400), st.data())
def test_a_turntable_is_one_turn_about_the_boxs_middle(count, data):
    k = data.draw(st.integers(0, count - 1))
    transforms = turntable(BOX, count)
    assert len(transforms) == count
    assert np.array_equal(transforms[0], np.eye(3, 4))
    middle = np.array([1.0, 2.5, 3.0])
    assert transforms[k] @ [*middle, 1] == pytest.approx(middle, abs=1e-14)
    angle = 2 * math.pi * k / count
    # Counter-clockwise seen from above: from +Z, where viewers stand, towards +X.
    wanted = middle + np.array([2 * math.sin(angle), 1, 2 * math.cos(angle)])
    assert transforms[k] @ [1.0, 3.5, 5.0, 1.0] == pytest.approx(wanted, abs=1e-13)


def test_quarter_turns_are_exact():
    assert turntable(BOX, 4)[1].tolist() == [[0, 0, 1, -2], [0, 1, 0, 0], [-1, 0, 0, 4]]


def test_a_mesh_moves_by_the_written_order_of_operations():
    rng = np.random.default_rng(5)
    transform = rng.normal(size=(3, 4))
    mesh = Mesh(rng.normal(size=(30, 3)), rng.integers(0, 30, (20, 3)), normals=rng.normal(size=(30, 3)))
    out = moved(mesh, transform)
    for before, after in zip(mesh.vertices.tolist(), out.vertices.tolist(), strict=True):
        for (a, b, c, d), value in zip(transform.tolist(), after, strict=True):
            assert value == ((a * before[0] + b * before[1]) + c * before[2]) + d
    # A normal stays at right angles to what it was at right angles to, and its length does not matter.
    m = [[Fraction(x) for x in row[:3]] for row in transform.tolist()]
    for n, turned in zip(mesh.normals.tolist(), out.normals, strict=True):
        across = np.cross(n, [1.0, 2.0, 3.0])
        image = np.array([float(sum(a * Fraction(x) for a, x in zip(row, across.tolist(), strict=True))) for row in m])
        assert abs(turned @ image) <= 1e-12 * np.linalg.norm(turned) * np.linalg.norm(image)
    assert (out.faces.tolist(), out.name) == (mesh.faces.tolist(), mesh.name)
    assert moved(mesh, np.eye(3, 4)) is mesh


def test_swept_bounds_hold_all_frames():
    transforms = turntable(CUBE.bounds, 8)
    low, high = swept_bounds(frame_bounds(CUBE, transforms))
    reach = math.sqrt(2**2 + 1**2)
    assert (low[1], high[1]) == (0, 5)
    assert 2 <= high[0] - 1 <= reach
    assert 2 <= 3 - low[2] <= reach
    for transform in transforms:
        box = moved(CUBE, transform).bounds
        assert (low <= box[0]).all()
        assert (box[1] <= high).all()
    with pytest.raises(InputError, match="frame 1: mesh: vertex 4 is beyond 1e\\+30"):
        frame_bounds(CUBE, [np.eye(3, 4), np.diag([1e30, 1, 1, 1])[:3]])


IDENTITY = np.eye(4).tolist()


def test_transforms_are_read_from_json_and_npy(tmp_path):
    matrices = np.random.default_rng(1).normal(size=(3, 4, 4))
    matrices[:, 3] = [0, 0, 0, 1]
    (tmp_path / "a.json").write_text(json.dumps(matrices.tolist()))
    np.save(tmp_path / "a.npy", matrices)
    np.save(tmp_path / "b.NPY.npy", np.array([IDENTITY], np.int64))
    for name in ("a.json", "a.npy"):
        found = read_transforms(tmp_path / name)
        assert [t.tolist() for t in found] == matrices[:, :3].tolist()
    assert read_transforms(tmp_path / "b.NPY.npy")[0].tolist() == IDENTITY[:3]


@pytest.mark.parametrize(("text", "part"), [
    ("[", "it is not a JSON file"),
    ("[" * 100_000, "it is not a JSON file"),
    ("{}", "does not hold a list of 4x4"),
    ("[]", "does not hold a list of 4x4"),
    (json.dumps(IDENTITY), "does not hold a list of 4x4"),
    (json.dumps([IDENTITY[:3]]), "does not hold a list of 4x4"),
    (json.dumps([IDENTITY, IDENTITY[:3]]), "does not hold a list of 4x4"),
    ("[[[1e3" + "0" * 4000 + ",0,0,0]]]", "does not hold a list of 4x4"),
    (json.dumps([[["1"] * 4] * 4]), "does not hold a list of 4x4"),
    ("[[[true,1,1,1],[1,1,1,1],[1,1,1,1],[null,0,0,1]]]", "does not hold a list of 4x4"),
    (json.dumps([IDENTITY, [*IDENTITY[:3], [0, 0, 1, 1]]]), r"matrix 1 is not affine, its last row is \[0"),
    (json.dumps([[[math.nan] * 4, *IDENTITY[1:]]]), "matrix 0 holds a number that is not finite"),
    (json.dumps([[[0, 0, 0, 0], *IDENTITY[1:]]]), "matrix 0 is singular"),
    (json.dumps([IDENTITY] * (MOST_FRAMES + 1)), "it holds 10001 matrices"),
])  # fmt: skip
def test_files_that_hold_no_transforms(tmp_path, text, part):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(InputError, match=part) as caught:
        read_transforms(tmp_path / "a.json")
    assert str(tmp_path / "a.json") in str(caught.value)


def test_files_that_are_no_files(tmp_path):
    np.savez(tmp_path / "a.npz", frames=np.eye(4)[None])
    (tmp_path / "a.npz").rename(tmp_path / "a.npy")
    for name, part in (("a.npy", "an NPY file"), ("c.npy", "no such file"), ("c.txt", ".json or an .npy")):
        with pytest.raises(InputError, match=part):
            read_transforms(tmp_path / name)


@pytest.fixture(scope="module")
def animated(tmp_path_factory):
    """Two frames in place, one moved after each."""
    folder = tmp_path_factory.mktemp("frames")
    shifted = np.eye(4)
    shifted[0, 3], shifted[2, 3] = 0.25, -0.125
    (folder / "path.json").write_text(json.dumps([IDENTITY, shifted.tolist(), IDENTITY, shifted.tolist()]))
    render(folder / "out", *SMALL, "--frames", str(folder / "path.json"))
    return folder / "out", read_transforms(folder / "path.json")


def test_trees_are_built_where_the_scene_has_moved_and_kept_where_it_stays(tmp_path):
    mesh = builtin_scene("ammonite")
    views = tuple(module_views(mesh, find_display("sample-a").with_resolution(32, 24), range(2)))
    still = np.eye(3, 4)
    moved_once = np.eye(3, 4) + np.eye(3, 4, 3)
    transforms = (still, still.copy(), moved_once, still)
    boxes = (mesh.bounds,) * 4
    job = Job(mesh, views, Settings((0.05,)), tmp_path, {"display": None}, ((), ()), boxes, transforms)
    renderer = Renderer(job, 1)
    casters = [renderer.prepare(item) for item in job.items()]
    assert [one is next_ for one, next_ in pairwise(casters)] == [True, True, True, False, True, False, True]


def test_frames_are_folders_with_all_that_a_still_has(animated):
    folder, transforms = animated
    assert sorted(path.name for path in folder.iterdir()) == ["animation.png", *(f"frame_000{k}" for k in range(4))]
    for k in range(4):
        names = sorted(path.name for path in (folder / f"frame_000{k}").iterdir())
        assert names == ["contact.png", "manifest.json", "module_009.exr", "module_010.exr"]
        manifest = manifest_of(folder / f"frame_000{k}")
        assert manifest["frame"] == {"number": k, "count": 4, "world_from_scene": transforms[k].tolist()}
        assert manifest["seconds"]["passes"]["build_bvh"] > 0


def test_the_animation_shows_each_frames_last_picture_of_the_sheet(animated):
    folder, _ = animated
    with Image.open(folder / "animation.png") as moving:
        shown = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(moving)]
    assert len(shown) == 4
    for k, picture in enumerate(shown):
        with Image.open(folder / f"frame_000{k}" / "contact.png") as sheet:
            rows = np.asarray(sheet.convert("RGB"))[:, -12 - 480 : -12]
        height = len(picture)
        found = [top for top in range(len(rows) - height) if np.array_equal(rows[top : top + height], picture)]
        assert found == [22 + height + 12 + 22]  # of the second of two modules, under both captions
    assert not np.array_equal(shown[0], shown[1])


def test_each_frame_shows_the_moved_mesh_through_the_same_views(animated):
    folder, transforms = animated
    mesh = builtin_scene("ammonite")
    bounds = swept_bounds(frame_bounds(mesh, transforms))
    settings = Settings((0.05, 0.1))
    for k in range(4):
        out = moved(mesh, transforms[k])
        view = module_views(out, find_display("sample-a").with_resolution(32, 24), range(10, 11), 0, bounds)[0]
        textures = render_view(RayCaster(out, view.cast_from_world), view, settings)
        parts = read_exr(folder / f"frame_000{k}" / "module_010.exr")
        for name, wanted in (("positions", textures.gbuffer.positions), ("shaded", textures.shaded)):
            assert parts[name].pixels.tobytes() == wanted.tobytes()


def test_still_has_no_frame_and_one_frame_in_place_is_the_still(tmp_path):
    for name, more in (("still", []), ("one", ["--frames", "1"])):
        render(tmp_path / name, "statue", "--resolution", "100x60", *more)
    assert manifest_of(tmp_path / "still")["frame"] is None
    still, one = (manifest_of(folder)["views"] for folder in (tmp_path / "still", tmp_path / "one" / "frame_0000"))
    for a, b in zip(still, one, strict=True):
        assert (a["textures"], a["view"]) == (b["textures"], b["view"])


def test_a_frame_is_read_like_a_still(animated, capsys):
    assert main(["view", str(animated[0] / "frame_0001"), "--width", "32"]) == 0
    (animated[0] / "frame_0001" / "eye.png").unlink()
    assert main(["view", str(animated[0])]) == 2
    assert "it holds frames: choose one, such as" in capsys.readouterr().err


def test_frames_go_on_where_they_were_interrupted(animated, tmp_path):
    folder, _ = animated
    before = [digests_of(folder / f"frame_000{k}") for k in range(4)]
    (folder / "frame_0002" / "module_009.exr").unlink()
    (folder / "frame_0002" / "manifest.json").unlink()
    (folder / "frame_0003" / "contact.png").unlink()
    render(folder, *SMALL, "--frames", str(folder.parent / "path.json"), "--resume")
    assert [digests_of(folder / f"frame_000{k}") for k in range(4)] == before
    assert (folder / "frame_0003" / "contact.png").exists()


def test_frames_of_a_camera_share_its_place(tmp_path):
    render(tmp_path, "ammonite", "--camera", "--resolution", "32x24", "--radii", "0.05", "--frames", "2")
    views = [manifest_of(tmp_path / f"frame_000{k}")["views"][0] for k in range(2)]
    assert views[0]["view"] == views[1]["view"]
    assert views[0]["textures"]["depth"] != views[1]["textures"]["depth"]
