"""Views of somebody's own renderer: TOML files, views of rendered folders, and what is refused."""

import json
import re

import numpy as np
import pytest
from jobs import manifest_of, render

from lfssao import Camera, InputError, find_display, fit_roi
from lfssao.optics.kernels import rays
from lfssao.rendering.manifest import describe_view
from lfssao.rendering.view_file import read_description

SIZE = (40, 30, 3)
ROWS = [[700.5, 1, 2, 3], [4, 5, 6.25, 7], [8, 9, -1, 0.1]]
SLITS = {"kind": "crossed slits", "M": ROWS, "z_m": 0.7, "z_o": -2, "u_0": 512.5, "v_0": 384}
MATRIX = {"kind": "matrix", "M": [[30.0, 0, -20, 0], [0, -30, -15, 0], [0, 0, -1.25, -1.25], [0, 0, -1, 0]]}
MODULE = {"kind": "module", "display": "convex", "module": 2, "physical_from_world": ROWS}
EYE = np.eye(4).tolist()
LENS = [[1.5, 0, 0.1, 0], [0, 2, -0.2, 0], [0, 0, -1.5, -2.5], [0, 0, -1, 0]]
FLAT = [[1.5, 0, 0, 0], [0, 2, 0, 0], [0, 0, -0.1, -1], [0, 0, 0, 1]]
CAMERA = {"kind": "camera", "view": EYE, "projection": LENS, "clip": "opengl"}
PLACE = {"m_x": 0.1, "m_y": 0, "m_z": 0.8, "y_o": 0.2, "z_o": -2,
         "homography": [900.0, 1, 500, 2, -900, 250, 0, 0.01, 1]}  # fmt: skip
BOX = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
DISPLAY = {"kind": "display", "M": ROWS, **PLACE}


def written(folder, values):
    """A TOML file of values: its lists and texts are those of JSON."""
    path = folder / "M.toml"
    path.write_text("".join(f"{name} = {json.dumps(value)}\n" for name, value in values.items()).replace("NaN", "nan"))
    return path


@pytest.mark.parametrize("words", [["--camera"], ["--display", "convex", "--modules", "2:3"], ["--display", "virtual"]])
def test_a_view_of_a_folder_is_the_one_that_was_rendered(tmp_path, words, monkeypatch):
    render(tmp_path, "statue", *words, "--resolution", "34x24", "--guard", "3", "--layers", "depth")
    entry = manifest_of(tmp_path)["views"][0]
    monkeypatch.chdir(tmp_path.parent)
    described = [{"kind": "folder", "folder": tmp_path.name, "name": entry["name"]}]
    if entry["name"] == "module_002":
        affine = entry["view"]["cast_from_world"]
        described += [{"kind": "module", "display": "convex", "module": 2, "physical_from_world": affine}]
    for path in (tmp_path, *(written(tmp_path, values) for values in described)):
        assert describe_view(read_description(path, entry["name"], SIZE).view) == entry["view"]


@pytest.mark.parametrize("make", [
    lambda: Camera("perspective", (1, 2, 5), (0, 0, 0), (0, 1, 0), 2.0, 1.0, 9.0).view(34, 24, 3),
    lambda: Camera("orthographic", (1, 2, 5), (0, 0, 0), (0, 1, 0), 2.0, 1.0, 9.0).view(34, 24, 3),
    lambda: find_display("virtual").with_resolution(34, 24).view(0, fit_roi(BOX, find_display("virtual").roi), 3),
    lambda: find_display("convex").with_resolution(34, 24).view(3, fit_roi(BOX, find_display("convex").roi), 3),
])  # fmt: skip
def test_a_mapping_gives_the_rays_back(tmp_path, make):
    """The points of each ray land on its texel, at the depth that the mapping says; world directions are the view's."""
    view = make()
    arguments = json.loads(
        re.sub(r"(\w+)=", r'"\1": ', repr(view.world_to_image).partition("(")[2][:-1].join("{}")).replace("'", '"')
    )
    kind = repr(view.world_to_image).partition("(")[0].rpartition(".")[2].replace("_", " ")
    made = read_description(written(tmp_path, {"kind": kind, **arguments}), "", SIZE).view
    assert (made.screen_to_world is None) == (view.screen_to_world is None)
    for u, v, share in ((0.5, 0.5, 0.2), (20.0, 15.0, 0.7), (38.5, 3.5, 0.4)):
        ox, oy, oz, dx, dy, dz, near, far = rays.texel_ray(made.rays, u, v)
        z = near + share * (far - near)
        world = made.world_from_cast @ [ox + z * dx, oy + z * dy, oz + z * dz, 1.0]
        np.testing.assert_allclose(view.world_to_image(world)[:2], [u, v], rtol=0, atol=1e-8)
        assert made.world_to_image(world) == pytest.approx(view.world_to_image(world), abs=1e-8)
        own, theirs = (w.world_from_cast[:, :3] @ rays.texel_ray(w.rays, u, v)[3:6] for w in (made, view))
        np.testing.assert_allclose(np.cross(own, theirs), 0, atol=1e-9)
        assert own @ theirs > 0


def test_matrices_of_float32_off_the_axis_make_a_view(tmp_path):
    turned = np.float32([[0.6, 0, 0.8, 0.1], [0, 1, 0, 0.2], [-0.8, 0, 0.6, -5], [0, 0, 0, 1]]).astype(float).tolist()
    view = read_description(written(tmp_path, {**CAMERA, "view": turned}), "", SIZE).view
    point = np.array([0.3, -0.2, 0.4, 1.0])
    x, y, z, w = np.array(LENS) @ turned @ point
    texel = [3 + 34 * (x / w + 1) / 2, 3 + 24 * (1 - y / w) / 2, (z / w + 1) / 2]
    np.testing.assert_allclose(view.world_to_image(point[:3]), texel, rtol=0, atol=1e-6)


@pytest.mark.parametrize("slope", [-1.0, -1.0 + 2.0**-22])
def test_a_far_plane_at_infinity(tmp_path, slope):
    """Depth is 1 - near / z, and with the small number that Lengyel (2007) takes off the slope almost."""
    endless = [*LENS[:2], [0, 0, slope, -2.0], LENS[3]]
    view = read_description(written(tmp_path, {**CAMERA, "projection": endless}), "", SIZE).view
    for z in (2.0, 1e3, 1e12):
        assert view.world_to_image(np.array([0.0, 0.0, -z]))[2] == pytest.approx(
            1 - 1 / z, rel=1e-6 if slope > -1 else 1e-15
        )


@pytest.mark.parametrize(("values", "changes", "reason"), [
    (SLITS, {"kind": None}, "there is no kind 'None': choose one of camera, module, folder, crossed"),
    (SLITS, {"kind": "slits"}, "there is no kind 'slits': choose one of"),
    (SLITS, {"z_m": None}, "z_m is missing"),
    (SLITS, {"zo": 1}, "there is no key 'zo' (did you mean 'z_o'?): choose one of kind, M, z_m, z_o, u_0, v_0, rows"),
    (SLITS, {"z_o": 0.7}, "z_o is 0.7 and z_m is 0.7, they must be z_o < z_m"),
    *((SLITS, {"u_0": wrong}, "u_0 is ") for wrong in ("1", True, [1.0], float("nan"), 10**400)),
    *((SLITS, {"M": wrong}, "M is ") for wrong in (3, EYE, [[1], [2, 3]], np.ravel(ROWS).tolist())),
    (SLITS, {"z_o": 0.1}, "z_o is 0.1 and z_m is 0.7, they must be z_o < 0 < z_m"),
    (SLITS, {"M": [ROWS[0], ROWS[0], ROWS[2]]}, "M has no inverse"),
    (SLITS, {"depth_kind": "window"}, "depth_kind is 'window', a module's depth is 'image'"),
    (SLITS, {"positions_space": "view"}, "the renderer's eye space is not known: give kind = 'camera'"),
    (SLITS, {"rows": "up"}, "rows: there is no choice 'up': choose one of above, below"),
    (MATRIX, {"M": ROWS}, "M is [[700.5, 1, 2, 3], [4, 5, 6.25, 7], [8, 9, -1, 0.1]], it must be 4 x 4 finite numbers"),
    (MATRIX, {"M": [[1, 2, 3, 4]] * 4}, "the matrix of the view is singular"),
    (MATRIX, {"M": np.eye(4)[[0, 1, 3, 2]].tolist()}, "the planes of the view are "),
    (CAMERA, {"clip": "gl"}, "there is no clip 'gl': choose one of opengl, d3d, vulkan, opengl reversed"),
    (CAMERA, {"clip": "opengl reversed"}, "projection: depth falls with the distance by clip = 'opengl reversed'"),
    (CAMERA, {"layout": "columns"}, "the view is skewed"),
    (CAMERA, {"projection": [*LENS[:2], [0, 0, -1.5, 2.5], LENS[3]]}, "projection: depth falls with the distance"),
    (CAMERA, {"projection": np.zeros((4, 4)).tolist()}, "the matrix of the view is singular"),
    (CAMERA, {"projection": [LENS[0], [0, 1e-320, 0, 0], *LENS[2:]]}, "the matrix of the view is singular"),
    (CAMERA, {"layout": "row"}, "there is no layout 'row' (did you mean 'rows'?): choose one of rows, columns"),
    (CAMERA, {"view": np.eye(4)[[0, 1, 3, 2]].tolist()}, "view: its last row, with layout = 'rows', is not 0 0 0 1"),
    (CAMERA, {"view": (np.eye(4) + np.eye(4, k=-3)).tolist()}, "view: its last row, with layout = 'rows'"),
    (CAMERA, {"view": np.diag([2, 1, 1, 1]).tolist()}, "view: it scales or skews"),
    (CAMERA, {"projection": [[1.5, 0.3, 0.1, 0], *LENS[1:]]}, "the view is skewed: right, down and depth must be at"),
    (CAMERA, {"projection": [*LENS[:2], [0.2, 0, -1.5, -2.5], LENS[3]]}, "the view is skewed: right, down and depth"),
    (CAMERA, {"fov": 3}, "there is no key 'fov': choose one of kind, view, projection, clip, layout, rows"),
    (CAMERA, {"depth_kind": "logarithmic"}, "depth_constant, C of ln(C z + 1) / ln(C far + 1), is of depth_kind"),
    (CAMERA, {"depth_kind": "linear", "depth_constant": 1}, "depth_constant, C of ln(C z + 1) / ln(C far + 1), is"),
    *((CAMERA, {"depth_kind": "logarithmic", "depth_constant": wrong}, "depth_constant is ") for wrong in (0, -1, "a")),
    (CAMERA, {"depth_kind": "logarithmic", "depth_constant": 1, "projection": [*LENS[:2], [0, 0, -1, -1], LENS[3]]},
     "depth_kind is 'logarithmic', and the projection has no far plane"),
    (CAMERA, {"depth_kind": "radial", "projection": FLAT}, "depth_kind is 'radial', an orthographic camera has no eye"),
    *((CAMERA, {"background": wrong}, "background is ") for wrong in (1e39, "0", float("nan"), [1])),
    (CAMERA, {"view": np.diag([1e308, 1e308, 1e308, 1]).tolist()}, "view: it scales or skews"),
    (CAMERA, {"projection": np.diag([1e308, 1e308, 1e308, 1]).tolist()}, "the matrix of the view is singular"),
    (MATRIX, {"M": [[8, 0, 4, -1e150], [0, -8, 3, 0], [0, 0, 1.25, -1.25], [0, 0, 1e-200, 1e154]]}, ""),
    (SLITS, {"M": [[1e308, 0, 0, 1e308], [0, 1e308, 0, 0], [0, 0, 1e-308, 0]]}, ""),
    (MODULE, {"display": "virtual", "module": 0,
              "physical_from_world": [[1, 0, 0, 0], [0, 1, 0, 1e308], [0, 0, 1, 0]]}, "its numbers are too large"),
    (MODULE, {"module": 10**400}, "module is 1000"),
    (MODULE, {"module": 99}, "module is 99, convex has 0 to "),
    (MODULE, {"display": "round"}, "there is no display 'round'"),
    (MODULE, {"physical_from_world": [ROWS[0]] * 3}, "physical_from_world has no inverse"),
    (MODULE, {"physical_from_world": [*ROWS[:2], [0, 0, 1e-320, 0]]}, "physical_from_world has no inverse"),
    (DISPLAY, {"homography": None}, "homography is missing"),
    (DISPLAY, {"homography": [1, 0, 0, 0, 1, 0, 1, 0, 0]}, "the homography is singular"),
    (DISPLAY, {"homography": [1, 0, 0]}, "homography is [1, 0, 0], it must be 9 finite numbers"),
    (DISPLAY, {"diffuser": "flat"}, "there is no diffuser 'flat': choose one of linear, conical"),
    (DISPLAY, {"diffuser": "conical", "screen_curvature": 1}, "diffuser: 'conical' needs a flat screen"),
    (DISPLAY, {"m_z": -0.8}, "z_o is -2 and m_z is -0.8, they must be z_o < 0 < m_z"),
    (DISPLAY, {"k2": 0.1}, "unit is 0, it must be positive"),
])  # fmt: skip
def test_a_wrong_value_is_refused_in_a_sentence_with_file_and_key(tmp_path, values, changes, reason):
    path = written(tmp_path, {name: value for name, value in {**values, **changes}.items() if value is not None})
    with pytest.raises(InputError, match=rf"^{re.escape(f'{path}: {reason}')}.{{,200}}\Z"):
        read_description(path, "", SIZE)


@pytest.mark.parametrize(("view", "changes", "reason"), [
    ("camra", {}, "there is no view 'camra' (did you mean 'camera'?)"),
    ("camera", {"world_to_image": [1.0] * 12}, "world_to_image is [1.0, 1.0"),
    ("camera", {"screen_to_world": ROWS}, "screen_to_world is [["),
    ("camera", {"screen_to_world": None}, "its manifest is not what 'lfssao render' writes"),
    ("camera", {"world_to_image_kind": "lens"}, "its manifest is not what 'lfssao render' writes"),
    ("camera", {"width": 41}, "its view camera has 41x30 texels, 3 of them a guard band on each side, the textures"),
])  # fmt: skip
def test_a_folder_without_the_view_is_refused(tmp_path, view, changes, reason):
    camera = Camera("perspective", (1, 2, 5), (0, 0, 0), (0, 1, 0), 2.0, 1.0, 9.0).view(34, 24, 3)
    text = json.dumps({"format": 1, "views": [{"name": "camera", "view": {**describe_view(camera), **changes}}]})
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(InputError, match=re.escape(reason)):
        read_description(tmp_path, view, SIZE)
