"""Sets of cameras in MPEG's axes: where a camera is and looks, codes of disparity and colour, and refusals."""

import json
from pathlib import Path

import numpy as np
import pytest
from jobs import render, sentence
from PIL import Image

from lfssao import InputError, read_exr
from lfssao.cli.main import main
from lfssao.rendering.view_file import read_description

SIZE = (64, 48, 0)
CAMERA = {
    "NameColor": "v00_texture.png",
    "NameDepth": "v00_depth.png",
    "Position": [1, 2, 3],
    "Rotation": [10, -20, 30],
    "Depth_range": [0.5, 50],
    "Resolution": [64, 48],
    "Projection": "Perspective",
    "Focal": [60, 50],
    "Principle_point": [33, 23],
    "BitDepthColor": 8,
    "BitDepthDepth": 16,
}
OTHER = {**CAMERA, "NameColor": "v01_texture.png", "NameDepth": "v01_depth.png", "Rotation": [0, 0, 0]}


def written(folder, *cameras, **more):
    path = folder / "cameras.json"
    path.write_text(json.dumps({**more, "cameras": list(cameras)}))
    return path


# Places of cameras


@pytest.mark.parametrize(("point", "along", "u", "v"), [
    ((5, 2.5, 3.5), 3.954264341, 42.539172327, 31.655424706),
    ((4, 3, 2), 2.597405503, 46.930686552, 60.965928070),
    ((6, 2, 4.5), 5.140113107, 43.379648119, 21.090257214),
])  # fmt: skip
def test_points_land_where_the_test_models_formulas_say(point, along, u, v, tmp_path):
    """Computed apart, by Python's math alone, as TMIV does (Transformation.h, and its perspective projection).

    With p = (Rz(yaw) Ry(pitch) Rx(roll))^T (point - position), u = c_u - f_u p_y / p_x and v = c_v - f_v p_z / p_x.
    """
    view = read_description(written(tmp_path, CAMERA), "v00_depth", SIZE).view
    found = view.world_to_image(np.array(point, np.float64))
    assert found[:2].tolist() == pytest.approx([u, v], abs=1e-6)
    assert float(view.cast_z(found[2])) == pytest.approx(along, abs=1e-6)


def test_a_camera_that_is_not_turned_looks_along_x_with_y_on_the_left(tmp_path):
    view = read_description(written(tmp_path, CAMERA, OTHER), "v01_depth", SIZE).view
    u, v, _ = np.transpose(view.world_to_image(np.array([[3.0, 2, 3], [3, 2.5, 3], [3, 2, 3.5]])))
    assert u.tolist() == [33, 33 - 60 / 4, 33]
    assert v.tolist() == [23, 23, 23 - 50 / 4]


@pytest.mark.parametrize("name", ["v01", "v01_texture.png", "v01_texture", "v01_depth", "1"])
def test_a_camera_is_chosen_by_a_name_of_its_own_or_its_files_or_its_number(name, tmp_path):
    path = written(tmp_path, CAMERA, {**OTHER, "Name": "v01"}, Axial_system="OMAF")
    wanted = read_description(path, "v01_depth", SIZE).view
    np.testing.assert_array_equal(read_description(path, name, SIZE).view.lens, wanted.lens)
    other = read_description(path, "v00_depth", SIZE).view
    assert (other.cast_from_world != wanted.cast_from_world).any()


# Contents of files


@pytest.mark.parametrize("bits", [8, 10, 16])
def test_codes_are_of_normalised_disparity(bits, tmp_path, capsys):
    """1 / z = code / most (1 / near - 1 / far) + 1 / far, from 50 on no surface, and the largest code at 0.5."""
    random = np.random.default_rng(3)
    most = 2**bits - 1
    codes = random.integers(0, most, (48, 64), endpoint=True)
    codes[:2, :20], codes[3, :2] = 0, most
    Image.fromarray(codes.astype(np.uint8 if bits == 8 else np.uint16)).save(tmp_path / "v01_depth.png")
    path = written(tmp_path, CAMERA, {**OTHER, "BitDepthDepth": bits})
    words = "--buffers", str(path), "--radii", "0.1", "--layers", "depth,positions", "-o", str(tmp_path / "out")
    assert main(["ao", "--depth", str(tmp_path / "v01_depth.png"), *words]) == 0
    made = read_exr(tmp_path / "out" / "v01_depth.exr")
    depth = made["depth"].pixels[..., 0].astype(np.float64)
    positions = made["positions"].pixels.astype(np.float64)
    with np.errstate(divide="ignore"):
        wanted = np.where(codes > 0, 1 / (codes / most * (1 / 0.5 - 1 / 50) + 1 / 50), np.inf)
    np.testing.assert_allclose(depth, wanted, rtol=1e-6)
    column, row = np.meshgrid(np.arange(64) + 0.5, np.arange(48) + 0.5)
    seen = codes > 0
    for axis, place in enumerate((1 + wanted, 2 - wanted * (column - 33) / 60, 3 - wanted * (row - 23) / 50)):
        np.testing.assert_allclose(positions[..., axis][seen], place[seen], rtol=2e-6, atol=2e-6)


@pytest.mark.parametrize("bits", [8, 10])
def test_codes_of_colour_are_srgb(bits, tmp_path):
    codes = np.random.default_rng(4).integers(0, 2**bits, (48, 64, 3))
    Image.fromarray(np.full((48, 64), 30000, np.uint16)).save(tmp_path / "v00_depth.png")
    np.save(tmp_path / "v00_texture.npy", codes.astype(np.uint8 if bits == 8 else np.uint16))
    picture = tmp_path / "v00_texture.npy"
    if bits == 8:
        picture = tmp_path / "v00_texture.png"
        Image.fromarray(codes.astype(np.uint8)).save(picture)
    path = written(tmp_path, {**CAMERA, "BitDepthColor": bits})
    words = "--buffers", str(path), "--radii", "0.1", "-o", str(tmp_path / "out"), "--image", str(picture)
    assert main(["ao", "--depth", str(tmp_path / "v00_depth.png"), *words]) == 0
    color = read_exr(tmp_path / "out" / "v00_depth.exr")["color"].pixels
    share = codes / (2**bits - 1)
    wanted = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(color, wanted, rtol=1e-6)


def test_what_render_made_comes_back_in_mpegs_axes(tmp_path):
    """The scene's x, y and z are MPEG's -y, z and -x: positions to half a step of 16 bits, AO of the same size."""
    job = "statue", "--camera", "--eye", "1,2,7", "--target", "0.5,1,0", "--fov", "30", "--resolution", "64x48"
    parts = read_exr(render(tmp_path / "scene", *job, "--radii", "0.3") / "camera.exr")
    distance = np.sqrt(0.5**2 + 1 + 7**2)
    yaw = np.degrees(np.arctan2(0.5, 7))
    pitch = np.degrees(np.arcsin(1 / distance))
    focal = 48 / (2 * np.tan(np.radians(15)))
    camera = {**CAMERA, "Position": [-7, -1, 2], "Rotation": [yaw, pitch, 0], "Depth_range": [4, 12]}
    path = written(tmp_path, {**camera, "Focal": [focal] * 2, "Principle_point": [32, 24]})
    positions = parts["positions"].pixels.astype(np.float64)
    seen = np.isfinite(positions[..., 0])
    forward = np.array([-0.5, -1, -7]) / distance
    z = ((positions[seen] - [1, 2, 7]) * forward).sum(axis=1)
    assert 4 < z.min() < z.max() < 12
    codes = np.zeros(seen.shape, np.uint16)
    codes[seen] = np.rint(65535 * (1 / z - 1 / 12) / (1 / 4 - 1 / 12))
    Image.fromarray(codes).save(tmp_path / "v00_depth.png")
    words = "--buffers", str(path), "--radii", "0.3", "-o", str(tmp_path / "out")
    assert main(["ao", "--depth", str(tmp_path / "v00_depth.png"), *words]) == 0
    made = read_exr(tmp_path / "out" / "v00_depth.exr")
    there = made["positions"].pixels.astype(np.float64)
    assert (np.isfinite(there[..., 0]) == seen).all()
    back = np.stack([-there[seen, 1], there[seen, 2], -there[seen, 0]], axis=-1)
    assert np.abs(back - positions[seen]).max() < 2e-4
    mine, right = (found["merged"].pixels[..., 0][seen].mean() for found in (made, parts))
    assert mine == pytest.approx(right, rel=0.05)


# Refusals


@pytest.mark.parametrize(("changes", "reason"), [
    ({"Projection": "Equirectangular"}, "cameras[0].Projection: there is no Projection 'Equirectangular': choose one"),
    ({"Resolution": [64, 47]}, "cameras[0].Resolution: it is 64x47, the textures have 64x48 texels and a guard band"),
    ({"Resolution": [64.5, 48]}, "cameras[0].Resolution: it is [64.5, 48.0], it must be two whole numbers of texels"),
    ({"Depth_range": [5, 0.5]}, "cameras[0].Depth_range: it is 5 to 0.5, it must be 0 < near < far"),
    ({"Depth_range": [0, 50]}, "cameras[0].Depth_range: it is 0 to 50, it must be 0 < near < far"),
    ({"Depth_range": [1e-200, 1e-190]}, "cameras[0].Depth_range: it is 1e-200 to 1e-190, it must be 0 < near < far"),
    ({"Focal": [0, 50]}, "cameras[0].Focal: it is [0.0, 50.0], it must be positive"),
    ({"Focal": [1e308, 50]}, "the matrix of the view is singular"),
    ({"Position": [1e308, 1e308, 1e308]}, "the matrix of the view is singular"),
    ({"Focal": 60}, "cameras[0].Focal is 60, it must be 2 finite numbers"),
    ({"Position": [1, 2]}, "cameras[0].Position is [1, 2], it must be 3 finite numbers"),
    ({"Rotation": None}, "cameras[0].Rotation is None, it must be 3 finite numbers"),
    ({"BitDepthDepth": 17}, "cameras[0].BitDepthDepth: it is 17, it must be a whole number from 1 to 16"),
    ({"BitDepthColor": "8"}, "cameras[0].BitDepthColor: it is '8', it must be a whole number from 1 to 16"),
    ({"NameDepth": 3}, "cameras[0].NameDepth: it is 3, it must be a text"),
])  # fmt: skip
def test_a_camera_that_is_wrong(changes, reason, tmp_path):
    path = written(tmp_path, {**CAMERA, **changes})
    with pytest.raises(InputError) as caught:
        read_description(path, "v00_texture", SIZE)
    assert str(caught.value).startswith(f"{path}: {reason}")


@pytest.mark.parametrize("key", [key for key in CAMERA if not key.startswith("Name")])
def test_a_key_that_is_missing(key, tmp_path):
    path = written(tmp_path, {name: value for name, value in CAMERA.items() if name != key})
    with pytest.raises(InputError) as caught:
        read_description(path, "v00_depth", SIZE)
    assert str(caught.value) == f"{path}: cameras[0].{key}: it is missing"


@pytest.mark.parametrize(("text", "reason"), [
    ("[]", "it has no list 'cameras', and is no set of them"),
    ('{"cameras": {}}', "it has no list 'cameras'"),
    ('{"cameras": [1]}', "cameras: it must be an array of tables"),
    ("{", "it is not a JSON file"),
    (json.dumps({"cameras": [CAMERA], "Axial_system": "COLMAP"}), "Axial_system: there is no Axial_system 'COLMAP'"),
    (json.dumps({"cameras": [OTHER]}), "there is no camera 'v00_depth'"),
    (json.dumps({"cameras": [CAMERA, CAMERA]}), "cameras: 2 of them are called 'v00_depth': give a number from 0 on"),
    (json.dumps({"cameras": []}), "there is no camera 'v00_depth'"),
])  # fmt: skip
def test_what_is_no_set_or_has_not_the_camera(text, reason, tmp_path):
    path = tmp_path / "cameras.json"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_description(path, "v00_depth", SIZE)
    assert str(caught.value).startswith(f"{path}: {reason}")


def test_codes_need_bits_that_hold_them(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Image.fromarray(np.full((48, 64), 1024, np.uint16)).save("v00_depth.png")
    written(tmp_path, {**CAMERA, "BitDepthDepth": 10})
    words = "ao", "--depth", "v00_depth.png", "--radii", "0.1", "-o", "out", "--buffers"
    assert main([*words, "cameras.json"]) == 2
    assert sentence(capsys) == "--depth: v00_depth.png: it has a code 1024, which 10 bits do not hold"
    rows = [[60, 0, 33, 0], [0, -50, 23, 0], [0, 0, 2, -1], [0, 0, 1, 0]]
    Path("matrix.toml").write_text(f'kind = "matrix"\nM = {rows}\ndepth_kind = "reversed"\n')
    assert main([*words, "matrix.toml"]) == 2
    assert sentence(capsys).startswith(
        "--depth: v00_depth.png: it is of uint16, expected float32 or half, or depth_bits in"
    )
    Path("matrix.toml").write_text(f'kind = "matrix"\nM = {rows}\ndepth_kind = "reversed"\ndepth_bits = 17\n')
    assert main([*words, "matrix.toml"]) == 2
    assert "depth_bits is 17" in sentence(capsys)
    Path("matrix.toml").write_text(f'kind = "matrix"\nM = {rows}\ndepth_kind = "reversed"\ndepth_bits = 11\n')
    assert main([*words, "matrix.toml"]) == 0
    (depth,) = np.unique(read_exr("out/v00_depth.exr")["depth"].pixels)
    assert depth == pytest.approx(1 / (1024 / 2047 * (1 / 0.5 - 1) + 1), rel=1e-6)  # planes at 0.5 and 1
