"""Mappings of somebody's own renderer: TOML files, views of rendered folders, and what is refused."""

import json
import re

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from lfssao import InputError
from lfssao.rendering.view_file import read_mapping

ROWS = [[700.5, 1, 2, 3], [4, 5, 6.25, 7], [8, 9, -1, 0.1]]
CAMERA = [*ROWS, [0, 0, 1, 3.0]]
SLITS = {"kind": "crossed slits", "M": ROWS, "z_m": 0.7, "z_o": -2, "u_0": 512.5, "v_0": 384}
MATRIX = {"kind": "matrix", "M": CAMERA}
PLACE = {
    "m_x": 0.1,
    "m_y": 0,
    "m_z": 0.8,
    "y_o": 0.2,
    "z_o": -2,
    "homography": [900.0, 1, 500, 2, -900, 250, 0, 0.01, 1],
}
DISPLAY = {"kind": "display", "M": ROWS, **PLACE}


def written(folder, values):
    """A TOML file of values: its lists and texts are those of JSON."""
    path = folder / "M.toml"
    path.write_text("".join(f"{name} = {json.dumps(value)}\n" for name, value in values.items()).replace("NaN", "nan"))
    return path


@given(st.lists(st.one_of(st.sampled_from([0.0, 1.0, -2.5, 1e-9]), st.floats(-1e6, 1e6)), min_size=16, max_size=16))
def test_the_inverse_of_a_matrix_is_the_exact_one_rounded_once(tmp_path_factory, numbers):
    matrix = np.reshape(numbers, (4, 4)).tolist()
    with mpmath.workprec(9000):
        assume(mpmath.det(mpmath.matrix(matrix)) != 0)
        wanted = [[float(entry) for entry in row] for row in (mpmath.matrix(matrix) ** -1).tolist()]
    assume(np.isfinite(wanted).all())
    path = written(tmp_path_factory.mktemp("matrix"), {"kind": "matrix", "M": matrix})
    assert read_mapping(path, "")[1].tolist() == wanted


def test_an_inverse_that_is_given_is_taken(tmp_path):
    back = np.arange(16.0).reshape(4, 4).tolist()
    assert read_mapping(written(tmp_path, {**MATRIX, "screen_to_world": back}), "")[1].tolist() == back


@pytest.mark.parametrize(("values", "changes", "reason"), [
    (SLITS, {"kind": None}, "kind is None, it must be one of crossed slits, matrix, display"),
    (SLITS, {"kind": "slits"}, "kind is 'slits', it must be one of crossed slits, matrix, display"),
    (SLITS, {"z_m": None}, "z_m is missing"),
    (SLITS, {"zo": 1}, "there is no key 'zo': the nearest is 'z_o' of kind, M, z_m, z_o, u_0, v_0"),
    (SLITS, {"screen_to_world": CAMERA}, "there is no key 'screen_to_world': choose one of kind, M, z_m"),
    (SLITS, {"z_o": 0.7}, "z_o is 0.7 and z_m is 0.7, they must be z_o < z_m"),
    *((SLITS, {"u_0": wrong}, "u_0 is ") for wrong in ("1", True, [1.0], float("nan"), 10**400)),
    *((SLITS, {"M": wrong}, "M is ") for wrong in (3, CAMERA, [[1], [2, 3]], np.ravel(ROWS).tolist())),
    (MATRIX, {"M": ROWS}, "M is [[700.5, 1, 2, 3], [4, 5, 6.25, 7], [8, 9, -1, 0.1]], it must be 4 x 4 finite numbers"),
    (MATRIX, {"M": [[1, 2, 3, 4]] * 4}, "M has no inverse"),
    (MATRIX, {"M": (1e-320 * np.eye(4)).tolist()}, "M has no inverse of finite numbers"),
    (MATRIX, {"screen_to_world": ROWS}, "screen_to_world is [["),
    (DISPLAY, {"homography": None}, "homography is missing"),
    (DISPLAY, {"homography": [1, 0, 0, 0, 1, 0, 1, 0, 0]}, "the homography is singular"),
    (DISPLAY, {"homography": [1, 0, 0]}, "homography is [1, 0, 0], it must be 9 finite numbers"),
    (DISPLAY, {"diffuser": "flat"}, "diffuser: 'flat' is not one of linear, conical"),
    (DISPLAY, {"diffuser": "conical", "screen_curvature": 1}, "diffuser: 'conical' needs a flat screen"),
    (DISPLAY, {"m_z": -0.8}, "z_o is -2 and m_z is -0.8, they must be z_o < 0 < m_z"),
    (DISPLAY, {"k2": 0.1}, "unit is 0, it must be positive"),
])  # fmt: skip
def test_a_wrong_value_is_refused_in_a_sentence_with_file_and_key(tmp_path, values, changes, reason):
    path = written(tmp_path, {name: value for name, value in {**values, **changes}.items() if value is not None})
    with pytest.raises(InputError, match=rf"^{re.escape(f'{path}: {reason}')}.{{,150}}\Z"):
        read_mapping(path, "")


@pytest.mark.parametrize(("view", "changes", "reason"), [
    ("camra", {}, "there is no view 'camra': the nearest is 'camera'"),
    ("camera", {"world_to_image": [1.0] * 12}, "world_to_image is [1.0, 1.0"),
    ("camera", {"screen_to_world": ROWS}, "screen_to_world is [[700.5"),
    ("camera", {"world_to_image_kind": "lens"}, "it is not what 'lfssao render' writes"),
])  # fmt: skip
def test_a_folder_without_the_view_is_refused(tmp_path, view, changes, reason):
    right = {"world_to_image_kind": "matrix", "world_to_image": np.ravel(CAMERA).tolist(), "screen_to_world": None}
    text = json.dumps({"format": 1, "views": [{"name": "camera", "view": {**right, **changes}}]})
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(InputError, match=re.escape(reason)):
        read_mapping(tmp_path, view)
