"""Depth that its normals contradict, depth of other kinds, and values that a depth buffer was cleared to."""

import warnings
import zlib

import numpy as np
import pytest

from lfssao import Camera, InputError
from lfssao.errors import InputWarning
from lfssao.optics.view import WorldToImage
from lfssao.rendering.conversion import buffers_of
from lfssao.rendering.view_file import Description, _of_mapping

WIDTH = 64
HEIGHT = 48
NEAR = 0.5
FAR = 50.0
TEXELS = WIDTH * HEIGHT


def view_of(near=NEAR, far=FAR, projection="perspective"):
    return Camera(projection, (0, 0, 0), (0, 0, -1), (0, 1, 0), 0.9, near, far).view(WIDTH, HEIGHT)


class Room:
    """A floor and a wall, tilted at random, below an open sky: in float64, by planes and rays alone."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        focal = HEIGHT / 0.9
        x, y = np.meshgrid((np.arange(WIDTH) + 0.5 - WIDTH / 2) / focal, (HEIGHT / 2 - 0.5 - np.arange(HEIGHT)) / focal)
        rays = np.stack([x, y, -np.ones_like(x)], axis=-1)
        faces = np.array([[0.1, 1, 0.3], [1, 0.2, 0.4]]) + rng.uniform(-0.1, 0.1, (2, 3))
        faces /= np.sqrt((faces**2).sum(axis=1, keepdims=True))
        with np.errstate(divide="ignore"):
            z = -np.array([1.0, 1.5])[:, None, None] / (rays @ faces.T).transpose(2, 0, 1)
        z = np.where((z > NEAR) & (z < 5), z, np.inf)
        self.z, self.surface = z.min(axis=0), np.isfinite(z).any(axis=0)
        self.positions = np.where(self.surface[..., None], rays * np.where(self.surface, self.z, 0)[..., None], 0)
        self.normals = np.where(self.surface[..., None], faces[z.argmin(axis=0)], 0).astype(np.float32)
        self.length = np.sqrt((rays**2).sum(axis=-1))

    def depth(self, kind, sky=None):
        z = np.where(self.surface, self.z, 1)
        kinds = {"linear": (z, 0), "radial": (z * self.length, 0), "window": ((1 - NEAR / z) / (1 - NEAR / FAR), 1)}
        kinds["reversed"] = 1 - kinds["window"][0], 0
        for constant in (0.02, 0.1, 1.0, 10.0):
            kinds[constant] = np.log(constant * z + 1) / np.log(constant * FAR + 1), 1
        values, usual = kinds[kind]
        return np.where(self.surface, values, usual if sky is None else sky).astype(np.float32)


def told(kind, view=None, **more):
    """How a kind is said, of logarithmic depth by its constant."""
    known = {"depth_kind": kind} if isinstance(kind, str) else {"depth_kind": "logarithmic", "depth_constant": kind}
    return Description(view or view_of(), **known, **more)


def read(textures, said):
    """Buffers and the sentences on them."""
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("always")
        made = buffers_of({name: np.float32(texture) for name, texture in textures.items()}, said)
    assert all(note.category is InputWarning for note in noted)
    return made, [str(note.message) for note in noted]


@pytest.fixture
def room(request):
    """A room of each test's own."""
    made = Room(zlib.crc32(request.node.name.encode()))
    assert 0.2 < made.surface.mean() < 0.95
    return made


@pytest.mark.parametrize("kind", ["linear", "radial", "window", "reversed", 0.1, 1.0, 10.0])
def test_depth_of_any_kind_gives_the_points_of_the_planes(room, kind):
    textures = {"depth": room.depth(kind), "normals": room.normals}
    made, notes = read(textures, told(kind))
    assert np.array_equal(np.isfinite(made.depth), room.surface)
    off = np.abs(made.positions - room.positions)[room.surface]
    assert off.max() < 8 * 2e-5 if kind in ("window", "reversed") else off.max() < 8 * 4e-7
    assert notes == []


@pytest.mark.parametrize(("stored", "said", "fits"), [
    ("radial", "linear", "depth_kind = 'radial'"),
    ("linear", "radial", "depth_kind = 'linear'"),
    (1.0, "window", "depth_kind = 'logarithmic' and depth_constant = 1.0"),
    (10.0, "linear", "depth_kind = 'logarithmic' and depth_constant = 10.0"),
    (0.1, 10.0, "depth_constant = 0.1"),
    ("window", "reversed", "depth_kind = 'window'"),
])  # fmt: skip
@pytest.mark.parametrize("witness", ["normals", "positions"])
def test_depth_that_normals_or_positions_contradict_is_refused_with_the_kind_that_fits(
    room, stored, said, fits, witness
):
    textures = {"depth": room.depth(stored), witness: getattr(room, witness)}
    with pytest.raises(InputError, match=f"it fits with .*{fits}"):
        read(textures, told(said))


def test_of_logarithms_that_are_alike_the_best_is_named(room):
    textures = {"depth": room.depth(0.02), "normals": room.normals}
    with pytest.raises(InputError, match=r"it fits with depth_kind = 'logarithmic' and depth_constant = 0\.02$"):
        read(textures, told("window"))


@pytest.mark.parametrize(("kind", "near", "far"), [("window", NEAR, 4 * NEAR), ("reversed", 4 * NEAR, FAR)])
def test_planes_that_normals_contradict_are_refused_with_the_ratio_that_fits(room, kind, near, far):
    textures = {"depth": room.depth(kind), "normals": room.normals}
    ratio = rf"(9\.[5-9]|1(\.0)?)e\+02 times as far as the near plane, which is {far / near:.3g}"
    with pytest.raises(InputError, match=rf"it fits with a far plane about {ratio}"):
        read(textures, told(kind, view_of(near, far)))


def test_normals_of_another_surface_are_refused_and_rough_ones_are_not(room):
    rng = np.random.default_rng(3)
    rough = room.normals + rng.normal(0, 0.3, room.normals.shape) * room.surface[..., None]
    rough /= np.maximum(np.sqrt((rough**2).sum(axis=-1, keepdims=True)), 1e-9)
    read({"depth": room.depth("linear"), "normals": rough}, told("linear"))
    turned = np.where(room.surface[..., None], np.float32([0, 0, 1]), 0)
    with pytest.raises(InputError, match="degrees off the surface of depth"):
        read({"depth": room.depth("linear"), "normals": turned}, told("linear"))


@pytest.mark.parametrize(("kind", "sky"), [
    ("linear", 1e10), ("linear", -1.0), ("linear", 65504.0), ("radial", 65504.0), ("radial", -1e10), ("radial", 30.0),
    ("radial", 1e10), ("window", 1e10), (1.0, 1e10), (1.0, -1e10), ("linear", np.finfo(np.float32).max),
])  # fmt: skip
def test_a_cleared_value_is_no_surface_and_is_named(room, kind, sky):
    made, notes = read({"depth": room.depth(kind, sky)}, told(kind))
    assert np.array_equal(np.isfinite(made.depth), room.surface)
    words = f"depth: {np.float32(sky)!s} at {TEXELS - room.surface.sum()} of {TEXELS} texels is taken for no surface"
    assert len(notes) == 1
    assert notes[0].startswith(words)
    assert read({"depth": room.depth(kind, sky)}, told(kind, background=float(np.float32(sky))))[1] == []


@pytest.mark.parametrize("sky", [300.0, 65504.0, 1e10])
def test_without_a_far_plane_a_value_ten_times_as_far_as_all_the_rest_is_no_surface(room, sky):
    made, notes = read({"depth": room.depth("linear", sky)}, told("linear", view_of(far=1e30)))
    assert np.array_equal(np.isfinite(made.depth), room.surface)
    assert len(notes) == 1


def test_a_value_between_the_planes_is_a_surface_unless_something_else_says_it_is_none(room):
    depth = room.depth("linear", 20.0)
    made, notes = read({"depth": depth}, told("linear"))
    assert np.isfinite(made.depth).all()
    assert "is taken for a surface: background = 20.0" in notes[0]
    more = {"depth": depth, "normals": room.normals}, {"depth": depth, "positions": room.positions}
    for textures, said in (*((each, told("linear")) for each in more), (more[0], told("linear", background=20.0))):
        made, notes = read(textures, said)
        assert np.array_equal(np.isfinite(made.depth), room.surface)
        assert len(notes) == (said.background is None)


def test_distances_beyond_the_far_plane_that_differ_are_of_surfaces(room):
    with pytest.raises(InputError, match=r"depth: [\d.]+ % of it lies beyond the far plane, at 2$"):
        read({"depth": room.depth("linear", np.inf)}, told("linear", view_of(far=2.0)))


@pytest.mark.parametrize("sky", [1e10, 65504.0, 0.8, -1e10, -3.0])
def test_a_modules_depth_behind_its_lens_or_its_observers_is_no_surface(sky):
    mapping = WorldToImage.crossed_slits(np.eye(3, 4), z_m=0.8, z_o=-2, u_0=4, v_0=3)
    depth = np.linspace(-0.2, 0.2, 48).reshape(6, 8)
    depth[:2] = sky
    made, notes = read({"depth": depth}, Description(_of_mapping((8, 6, 0), mapping)))
    assert np.isinf(made.depth[:2]).all()
    assert np.array_equal(made.depth[2:], np.float32(depth[2:]))
    assert len(notes) == 1
    depth[:2, ::2] = 0.9
    with pytest.raises(InputError, match="is no depth"):
        read({"depth": depth}, Description(_of_mapping((8, 6, 0), mapping)))


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_leaves_smaller_than_the_texels_are_not_judged_by_their_slopes(projection):
    """Each texel shows another leaf, turned towards the viewer at random: planes that flatten it all fit better."""
    rng = np.random.default_rng(8)
    depth = rng.uniform(0.8, 0.95, (HEIGHT, WIDTH))
    normals = np.stack([*rng.uniform(-0.5, 0.5, (2, HEIGHT, WIDTH)), np.ones((HEIGHT, WIDTH))], axis=-1)
    normals /= np.sqrt((normals**2).sum(axis=-1, keepdims=True))
    for kind in ("window", "linear"):
        made, notes = read({"depth": depth, "normals": normals}, told(kind, view_of(projection=projection)))
        assert np.isfinite(made.depth).all()
        assert notes == []
