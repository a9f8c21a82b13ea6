"""Somebody's buffers and matrices in the usual conventions, made here from what ``render`` wrote, read back."""

import json

import numpy as np
import pytest
from jobs import manifest_of, render

from lfssao import InputError, read_exr
from lfssao.ao.estimators.registry import estimate
from lfssao.rendering.conversion import buffers_of
from lfssao.rendering.view_file import read_description

GUARD = 3
CAMERAS = {"perspective": ["--fov=28"], "orthographic": []}


class Seen:
    """A camera's G-buffer in float64 and its place, by the manifest's numbers alone."""

    def __init__(self, folder, projection):
        place = ["--eye=-3,2,4", "--up=0.2,1,0", "--guard", "3", "--normals", "--layers", "depth,positions,normals"]
        render(folder, "statue", "--camera", projection, *CAMERAS[projection], *place, "--resolution", "40x30")
        self.parts = {name: part.pixels for name, part in read_exr(folder / "camera.exr").items()}
        self.folder = folder
        view = manifest_of(folder)["views"][0]["view"]
        self.eye = np.vstack([view["cast_from_world"], [0, 0, 0, 1]])  # x right, y up, z forward
        self.focal, self.near, self.far = view["lens"][1], *view["lens"][4:6]
        self.orthographic = projection == "orthographic"
        self.surface = np.isfinite(self.parts["depth"][..., 0])
        d = self.parts["depth"][..., 0].astype(np.float64)
        n = self.near
        f = self.far
        with np.errstate(invalid="ignore"):
            self.z = np.where(self.surface, n + d * (f - n) if self.orthographic else n * f / (f - d * (f - n)), np.inf)

    def projection(self, clip, right_handed, endless):
        """glFrustum, glOrtho and their kin of other depths, for eyes that look along +z, or along -z."""
        n = self.near
        f = self.far
        half = (20 / self.focal, 15 / self.focal)
        p = np.zeros((4, 4))
        p[0, 0], p[1, 1] = 1 / half[0], (-1 if "vulkan" in clip else 1) / half[1]
        if self.orthographic:
            p[2, 2:], p[3, 3] = (1 / (f - n), -n / (f - n)), 1
        else:
            p[2, 2:], p[3, 2] = (1, -n) if endless else (f / (f - n), -n * f / (f - n)), 1
        if "opengl" in clip:
            p[2] = 2 * p[2] - p[3]
        if "reversed" in clip:
            p[2] = (0 if "opengl" in clip else 1) * p[3] - p[2]
        return p * [1, 1, -1, 1] if right_handed else p

    def depth(self, kind, right_handed, endless):
        """The depth buffer's values of each kind and of its background."""
        z = self.z
        n = self.near
        f = np.inf if endless and not self.orthographic else self.far
        with np.errstate(invalid="ignore"):
            window = (z - n) / (f - n) if self.orthographic else (1 - n / z) / (1 - n / f)
        kinds = {"window": (window, 1), "window-gl": (2 * window - 1, 1), "reversed": (1 - window, 0)}
        kinds |= {"linear": (z, 0), "view-z": (-z if right_handed else z, 0)}
        values, background = kinds[kind]
        return np.where(self.surface, values, background)


@pytest.fixture(scope="module", params=CAMERAS)
def seen(request, tmp_path_factory):
    return Seen(tmp_path_factory.mktemp(request.param), request.param)


def octahedral(n):
    """Meyer et al. 2010."""
    x, y, z = np.moveaxis(n / np.maximum(np.abs(n).sum(-1, keepdims=True), 1e-9), -1, 0)
    folded = (1 - np.abs(y)) * np.where(x >= 0, 1, -1), (1 - np.abs(x)) * np.where(y >= 0, 1, -1)
    return np.stack([np.where(z < 0, folded[0], x), np.where(z < 0, folded[1], y)], -1)


ENCODED = {
    "xyz": lambda n: n,
    "unorm": lambda n: 0.5 * n + 0.5,
    "octahedral": octahedral,
    "octahedral unorm": lambda n: 0.5 * octahedral(n) + 0.5,
}
USUAL = {"clip": "opengl", "depth_kind": "window", "normals_kind": "xyz", "positions_space": "world"}
USUAL |= {"normals_space": "world", "rows": "above", "layout": "rows"}


def in_convention(seen, folder, right_handed=True, endless=False, dtype=np.float32, told=None, **changes):
    """Textures and the description of them."""
    said = {**USUAL, **changes}
    eye = np.diag([1, 1, -1 if right_handed else 1, 1]) @ seen.eye
    matrices = {"view": eye, "projection": seen.projection(said["clip"], right_handed, endless)}
    matrices = {name: (m if said["layout"] == "rows" else m.T).tolist() for name, m in matrices.items()}
    values = {"kind": "camera", **said, **(told or {}), **matrices}
    path = folder / "B.toml"
    path.write_text("".join(f"{k} = {json.dumps(v)}\n" for k, v in values.items()))
    p, n = (np.where(seen.surface[..., None], seen.parts[name], 0) for name in ("positions", "normals"))
    if said["positions_space"] == "view":
        p = p @ eye[:3, :3].T + eye[:3, 3]
    if said["normals_space"] == "view":
        n = n @ eye[:3, :3].T
    made = {"depth": seen.depth(said["depth_kind"], right_handed, endless), "positions": p}
    made["normals"] = ENCODED[said["normals_kind"]](n)
    flip = -1 if said["rows"] == "below" else 1
    made = {name: texture[::flip].astype(dtype).astype(np.float32) for name, texture in made.items()}
    size = (*seen.surface.shape[::-1], GUARD)
    return made, path, size


CONVENTIONS = {
    "OpenGL": {"depth_kind": "window-gl", "rows": "below", "normals_space": "view", "positions_space": "view"},
    "OpenGL's window": {"rows": "below", "normals_kind": "octahedral"},
    "Direct3D": {"clip": "d3d", "right_handed": False, "layout": "columns", "normals_kind": "unorm"},
    "reversed": {"clip": "d3d reversed", "right_handed": False, "depth_kind": "reversed", "endless": True},
    "Vulkan": {"clip": "vulkan", "depth_kind": "linear", "normals_space": "view", "normals_kind": "octahedral unorm"},
    "reversed Vulkan": {"clip": "vulkan reversed", "depth_kind": "view-z", "endless": True},
    "left-handed": {"clip": "opengl reversed", "right_handed": False, "depth_kind": "view-z", "rows": "below"},
}


@pytest.mark.parametrize("convention", CONVENTIONS.values(), ids=CONVENTIONS)
@pytest.mark.parametrize("rebuilt", [False, True])
def test_buffers_of_any_convention_are_those_of_render(seen, tmp_path, convention, rebuilt):
    made, path, size = in_convention(seen, tmp_path, **convention)
    if rebuilt:
        del made["positions"]
    buffers = buffers_of(made, read_description(path, "", size))
    surface = seen.surface
    assert np.array_equal(np.isfinite(buffers.depth), surface)
    n = seen.near
    f = seen.far
    kind = convention.get("depth_kind", "window")
    wanted = seen.parts["depth"][..., 0].astype(np.float64)
    off = {"rtol": 0, "atol": 2e-7}
    linear = kind in ("linear", "view-z") or (kind == "reversed" and not seen.orthographic)
    assert buffers.view.linear == linear
    if linear:  # distances keep their digits, and reversed depth has them
        wanted = seen.z
        off = {"rtol": 2.0**-24 if kind != "reversed" else 2e-6, "atol": 0}
    elif convention.get("endless") and not seen.orthographic:
        wanted = wanted * (1 - n / f)
    np.testing.assert_allclose(buffers.depth[surface], wanted[surface], **off)
    near = 2e-6 * seen.z[surface].max() * (1 if seen.orthographic else seen.z[surface].max() / n)
    np.testing.assert_allclose(buffers.positions[surface], seen.parts["positions"][surface], rtol=0, atol=near)
    np.testing.assert_allclose(buffers.normals[surface], seen.parts["normals"][surface], rtol=0, atol=1e-6)
    assert (buffers.normals[~surface] == 0).all()
    assert np.isinf(buffers.positions[~surface]).all()


@pytest.mark.parametrize("name", ["sao", "alchemy", "hbao", "hemisphere", "lf"])
def test_exact_conventions_give_the_occlusion_of_render(seen, tmp_path, name):
    """Window depth is image z, and world positions and normals keep theirs; numbers of the view may lose a bit."""
    made, path, size = in_convention(seen, tmp_path, rows="below")
    mine = buffers_of(made, read_description(path, "", size))
    own = {"depth": seen.parts["depth"][..., 0], "positions": seen.parts["positions"], "normals": seen.parts["normals"]}
    right = buffers_of(own, read_description(seen.folder, "camera", size))
    for texture, wanted in own.items():
        assert getattr(mine, texture).tobytes() == getattr(right, texture).tobytes() == wanted.tobytes()
    occlusion = estimate(name, right, 0.3).texture
    off = np.abs(estimate(name, mine, 0.3).texture - occlusion)
    assert occlusion.max() > 0.1
    assert np.mean(off[seen.surface] <= 1e-5) > 0.98


def test_half_floats_are_read_too(seen, tmp_path):
    made, path, size = in_convention(seen, tmp_path, depth_kind="linear", dtype=np.float16)
    buffers = buffers_of(made, read_description(path, "", size))
    assert np.array_equal(np.isfinite(buffers.depth), seen.surface)
    np.testing.assert_allclose(buffers.normals[seen.surface], seen.parts["normals"][seen.surface], rtol=0, atol=1e-3)


@pytest.mark.parametrize("axis", [0, 1])
def test_positions_beside_their_texels_and_depths_that_are_not_theirs_are_counted(seen, tmp_path, axis):
    made, path, size = in_convention(seen, tmp_path)
    said = read_description(path, "", size)
    count = seen.surface.sum()
    beside = np.roll(made["positions"], 2, axis)
    moved = seen.surface & np.roll(seen.surface, 2, axis)
    moved[:, ::2] = False
    share = 100 * (count - moved.sum()) / count
    with pytest.raises(InputError, match=rf"positions: {share:.3g} % of them land on their own texels"):
        buffers_of({**made, "positions": np.where(moved[..., None], beside, made["positions"])}, said)
    nearer = np.where(moved, 0.5 * made["depth"], made["depth"])
    with pytest.raises(InputError, match=f"depth: {share:.3g} % of it is that of the positions"):
        buffers_of({**made, "depth": nearer.astype(np.float32)}, said)


WRONG = [
    ({"rows": "below"}, {"rows": "above"}, "positions: ", "it fits with rows = 'below'"),
    ({"depth_kind": "reversed"}, {"depth_kind": "window"}, "depth: 0 at column 0, row 0", "depth_kind = 'reversed'"),
    ({"depth_kind": "window-gl"}, {"depth_kind": "window"}, "depth: ", "depth_kind = 'window-gl'"),
    ({"depth_kind": "linear"}, {"depth_kind": "window"}, "depth: ", "depth_kind = 'linear'"),
    ({"depth_kind": "view-z"}, {"depth_kind": "linear"}, "depth: ", "depth_kind = 'view-z'"),
    ({"depth_kind": "linear"}, {"depth_kind": "image"}, "depth: ", "depth_kind = 'linear'"),
    ({"positions_space": "view"}, {"positions_space": "world"}, "positions: ", "positions_space = 'view'"),
    ({"normals_space": "view"}, {"normals_space": "world"}, "normals: ", "normals_space = 'view'"),
    ({"normals_kind": "unorm"}, {"normals_kind": "xyz"}, "normals: ", "normals_kind = 'unorm'"),
    ({"rows": "below", "normals_kind": "unorm"}, {"rows": "above", "normals_kind": "xyz"}, "positions: ",
     "rows = 'below' and normals_kind = 'unorm'"),
]  # fmt: skip


@pytest.mark.parametrize(("true", "told", "fault", "fits"), WRONG)
def test_what_fits_better_is_told(seen, tmp_path, true, told, fault, fits):
    made, path, size = in_convention(seen, tmp_path, told=told, **true)
    with pytest.raises(InputError) as refused:
        buffers_of(made, read_description(path, "", size))
    assert str(refused.value).startswith(fault)
    assert str(refused.value).endswith(fits)
