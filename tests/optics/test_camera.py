"""Cameras: matrices and rays undo each other, and what a camera sees of its target."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs import manifest_of, render, sentence

from lfssao import Camera, InputError
from lfssao.cli.main import main
from lfssao.files.exr import read_exr
from lfssao.optics.kernels import rays
from lfssao.testing import cameras


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_a_camera_before_a_deep_box_shows_it_with_a_margin_of_a_twenty_second(projection):
    """The near face, which a perspective shows larger, spans all but 1 / 22 of the picture above and below."""
    box = np.array([[-0.1, -1.0, -4.0], [0.1, 1.0, 4.0]])
    view = Camera.looking_at(box, projection).view(200, 220)
    top, bottom = view.world_to_image(np.array([[0.0, 1.0, 4.0], [0.0, -1.0, 4.0]]))[:, 1]
    assert (top, bottom) == pytest.approx((10, 210), abs=1e-9)


SIZES = [(60, 240), (90, 160), (96, 128), (100, 100), (128, 96), (160, 90), (240, 60)]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_a_scene_fills_the_picture_but_for_a_small_margin_at_every_size(projection, size):
    """Scenes of random vertices, wide and tall ones, and the corners of their boxes: the nearest ones are largest."""
    random = np.random.default_rng(7)
    for _ in range(20):
        vertices = random.normal(0, 3, 3) + random.uniform(-1, 1, (40, 3)) * 10 ** random.uniform(-1, 1, 3)
        box = np.array([vertices.min(axis=0), vertices.max(axis=0)])
        view = Camera.looking_at(box, projection, size).view(*size)
        corners = np.array(np.meshgrid(*box.T)).reshape(3, -1).T
        inside, whole = (view.world_to_image(points) / [*size, 1] for points in (vertices, corners))
        for places in (inside, whole):
            assert places[:, :2].min() > 0.04
            assert places[:, :2].max() < 0.96
            assert ((places[:, 2] > 0) & (places[:, 2] < 1)).all()
        assert np.ptp(whole[:, :2], axis=0).max() == pytest.approx(1 / 1.1)
        if projection == "orthographic":
            assert np.ptp(inside[:, :2], axis=0).max() == pytest.approx(1 / 1.1)


@pytest.mark.parametrize("size", [(24, 96), (96, 24)])
def test_the_command_shows_the_whole_scene_in_any_shape(tmp_path, size):
    """A square of 2 x 2 behind others: its borders are where the picture's are, less the margin."""
    (tmp_path / "square.obj").write_text("v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n")
    words = ["--resolution", "x".join(map(str, size)), "--camera", "orthographic", "--layers", "depth"]
    assert main(["render", str(tmp_path / "square.obj"), *words, "-o", str(tmp_path / "out")]) == 0
    depth = read_exr(tmp_path / "out" / "camera.exr")["depth"].pixels[..., 0]
    seen = np.argwhere(np.isfinite(depth))
    height, width = np.ptp(seen, axis=0) + 1
    assert abs(height - min(size) / 1.1) <= 1
    assert abs(width - min(size) / 1.1) <= 1


@given(cameras(), st.tuples(*[st.floats(0, 1)] * 3), st.integers(1, 2000), st.integers(1, 2000))
def test_screen_to_world_undoes_world_to_image(camera, share, width, height):
    view = camera.view(width, height)
    u = share[0] * width
    v = share[1] * height
    ox, oy, oz, dx, dy, dz, near, far = rays.texel_ray(view.rays, u, v)
    assert (near, far) == (camera.near, camera.far)
    z = near + share[2] * (far - near)
    back = view.world_from_cast
    world = back[:, :3] @ np.array([ox + z * dx, oy + z * dy, oz + z * dz]) + back[:, 3]
    image = view.world_to_image(world)
    size = max(width, height)
    np.testing.assert_allclose(image[:2], [u, v], rtol=0, atol=1e-9 * size)
    assert image[2] == pytest.approx(rays.image_depth(view.rays, z), abs=1e-9)
    assert -1e-9 <= image[2] <= 1 + 1e-9
    a = view.screen_to_world @ np.array([*image, 1.0])
    np.testing.assert_allclose(a[:3] / a[3], world, rtol=0, atol=1e-9 * np.abs(world - camera.eye).max())


@given(camera=cameras())
def test_a_camera_sees_its_target_in_the_middle_and_its_extent_from_top_to_bottom(camera):
    view = camera.view(300, 200)
    forward = np.subtract(camera.target, camera.eye)
    right = np.cross(forward, camera.up)
    up = np.cross(right, forward)
    top = np.array(camera.target) + up / np.linalg.norm(up) * camera.extent / 2
    np.testing.assert_allclose(view.world_to_image(camera.target)[:2], [150, 100], rtol=0, atol=1e-9)
    np.testing.assert_allclose(view.world_to_image(top)[:2], [150, 0], rtol=0, atol=1e-8)
    aside = np.array(camera.target) + right / np.linalg.norm(right) * camera.extent / 2
    np.testing.assert_allclose(view.world_to_image(aside)[:2], [250, 100], rtol=0, atol=1e-8)
    for distance, depth in ((camera.near, 0), (camera.far, 1)):
        point = np.array(camera.eye) + forward / np.linalg.norm(forward) * distance
        assert view.world_to_image(point)[2] == pytest.approx(depth, abs=1e-9)


def test_impossible_cameras_are_refused():
    good = {"projection": "perspective", "eye": (0, 0, 5), "target": (0, 0, 0), "up": (0, 1, 0), "extent": 2.0}
    good |= {"near": 1.0, "far": 9.0}
    for wrong, words in (
        ({"projection": "fisheye"}, "there is no camera 'fisheye'"),
        ({"eye": (0, math.nan, 5)}, "camera: eye is .*, it must be 3 finite numbers"),
        ({"extent": 0.0}, "extent is 0.0"),
        ({"near": 9.0}, "near and far are 9.0 and 9.0"),
        ({"up": (0, 0, 1)}, "above or below it along up"),
    ):
        with pytest.raises(InputError, match=words):
            Camera(**{**good, **wrong})


BOX = np.array([[-1.0, -2.0, -3.0], [4.0, 2.0, 1.0]])


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_a_placed_camera_is_the_usual_one_but_for_what_is_said(projection):
    usual = Camera.looking_at(BOX, projection)
    placed = Camera.placed(BOX, projection, up=(0.0, 2.0, 0.0))
    assert Camera.placed(BOX, projection) == usual
    assert (placed.eye, placed.target, placed.extent) == (usual.eye, usual.target, usual.extent)
    assert (placed.near, placed.far) == pytest.approx((usual.near, usual.far))
    moved = Camera.placed(BOX, projection, (9.0, 3.0, 7.0), (1.5, 0.5, -1.0), (0.0, 0.0, 1.0))
    assert (moved.eye, moved.target, moved.up) == ((9.0, 3.0, 7.0), (1.5, 0.5, -1.0), (0.0, 0.0, 1.0))
    corners = np.array([[BOX[i, 0], BOX[j, 1], BOX[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    z = moved.view(30, 20).world_to_image(corners)[:, 2]
    assert 0 < z.min() < z.max() < 1


def test_a_field_of_view_is_that_of_the_rays():
    view = Camera.placed(BOX, eye=(1.5, 0.0, 20.0), fov=40.0).view(30, 20)
    _, _, _, _, dy, _, _, _ = rays.texel_ray(view.rays, 15.0, 0.0)
    assert abs(dy) == pytest.approx(math.tan(math.radians(20)))


@pytest.mark.parametrize(("how", "words"), [
    ({"fov": 180.0}, "0 to 180"), ({"projection": "orthographic", "fov": 40.0}, "of a perspective"),
    ({"eye": (0.0, 0.0, 9.0), "target": (0.0, 0.0, 10.0)}, "lies behind the eye"),
    ({"eye": (0.0, 9.0, 0.0), "target": (0.0, 0.0, 0.0)}, "along up"),
])  # fmt: skip
def test_what_no_camera_can_be_placed_by(how, words):
    with pytest.raises(InputError, match=words):
        Camera.placed(BOX, **how)


# Stereo


@pytest.mark.parametrize("guard", [0, 5])
def test_two_eyes_see_the_targets_plane_at_one_place(guard):
    """By similar triangles: a point z before the eye is seen in the plane of d at e + (x - e) d / z, e = -+s / 2."""
    camera = Camera("perspective", (1, 2, 7), (1, 2, 3), (0, 1, 0), extent=2, near=1, far=9)
    left, right = camera.stereo(80, 60, 0.3, guard)
    assert (left.name, right.name, left.width, left.guard) == ("left", "right", 80 + 2 * guard, guard)
    for x, y, z in ((0.2, 0.1, 4.0), (0.2, 0.1, 2.5), (-0.4, 0.3, 8.0)):
        for view, eye in ((left, -0.15), (right, 0.15)):
            u, v, _ = view.world_to_image([1 + x, 2 + y, 7 - z])
            assert u - guard == pytest.approx(40 + 30 * (eye + (x - eye) * 4 / z), abs=1e-12)
            assert v - guard == pytest.approx(30 - 30 * y * 4 / z, abs=1e-12)
    middle = camera.view(80, 60, guard)
    np.testing.assert_array_equal(middle.lens[[0, 1, 3, 4, 5, 6, 7]], left.lens[[0, 1, 3, 4, 5, 6, 7]])


def test_the_command_writes_both_and_mirrors_a_scene_that_is_its_own_mirror_image(tmp_path, capsys):
    """Two triangles about x = 0, one before the target and one behind it."""
    (tmp_path / "own.obj").write_text(
        "v -1 -1 1\nv 1 -1 1\nv 0 1 1\nv -2 -2 -1\nv 2 -2 -1\nv 0 2 -1\nf 1 2 3\nf 4 5 6\n"
    )
    job = str(tmp_path / "own.obj"), "--camera", "--resolution", "64x48"
    folder = render(tmp_path / "out", *job, "--stereo", "0.4", "--radii", "10%")
    assert sorted(path.name for path in folder.glob("*.exr")) == ["left.exr", "right.exr"]
    assert manifest_of(folder)["stereo"] == 0.4
    left, right = (read_exr(folder / f"{name}.exr")["depth"].pixels[..., 0] for name in ("left", "right"))
    assert (left != right).any()
    np.testing.assert_array_equal(left, right[:, ::-1])
    capsys.readouterr()
    for words, reason in {
        (*job, "--stereo", "0"): "--stereo: 0 is not a number above 0",
        (job[0], "--stereo", "0.1"): "--stereo is of the two eyes of a camera: it needs --camera",
        (*job[:2], "orthographic", "--stereo", "0.1"): "--stereo: camera: separation is 0.1, it must be a positive",
    }.items():
        assert main(["render", *words, "-o", str(tmp_path / "no")]) == 2
        assert sentence(capsys).startswith(reason)
    assert main(["render", str(tmp_path / "own.obj"), "--camera", "--resolution", "64x48", "-o", str(folder)]) == 0
    assert f"{folder}: left.exr, right.exr are left there of another job" in capsys.readouterr().err


@pytest.mark.parametrize("separation", [0, -0.1, math.inf, math.nan, "1", None])
def test_eyes_are_a_positive_distance_apart(separation):
    camera = Camera("perspective", (0, 0, 4), (0, 0, 0), (0, 1, 0), 2, 1, 9)
    with pytest.raises(InputError, match="camera: separation is "):
        camera.stereo(80, 60, separation)
    with pytest.raises(InputError, match="camera: aspect is "):
        camera.view(80, 60, aspect=separation or 0.0)


def test_an_eye_is_moved_by_a_number():
    with pytest.raises(InputError, match="shift is nan, it must be a finite number"):
        Camera("perspective", (0, 0, 4), (0, 0, 0), (0, 1, 0), 2, 1, 9).view(80, 60, shift=math.nan)
