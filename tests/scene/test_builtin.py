"""The embedded scenes: their size, that they are closed, how they stand, and that they are modelled with these bits."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from jobs import manifest_of, python, render

import lfssao
from lfssao.errors import InputError
from lfssao.files.exr import read_exr
from lfssao.scene.builtin import BUILTIN, builtin_scene

MAKE = Path(__file__).resolve().parents[2] / "benchmarks" / "scenes" / "make.py"
MESHES = Path(lfssao.__file__).parent / "scene" / "meshes"

MODELS = ("statue", "ammonite", "armadillo")
ALL = ("gallery", "turntable", *MODELS, "corner")


@pytest.fixture(scope="module")
def scenes():
    return {name: builtin_scene(name) for name in ALL}


@pytest.mark.parametrize(("name", "faces", "tolerance", "least", "most"), [
    ("statue", 5011, 0.02, 0.40, 0.60), ("ammonite", 29520, 0.0, 0.15, 0.30), ("armadillo", 212574, 0.02, 0.55, 0.75),
])  # fmt: skip
def test_models_have_the_papers_faces_are_closed_look_outwards_and_stand(scenes, name, faces, tolerance, least, most):
    """The paper's counts (section 7), and how far ours may be away; the volume, which is negative inside out."""
    mesh = scenes[name]
    assert abs(len(mesh.faces) - faces) <= tolerance * faces
    assert mesh.degenerate == 0
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert least < solid.volume < most
    (left, bottom, back), (right, top, front) = mesh.bounds
    assert bottom == 0.0
    assert 1.0 < top < 2.1
    assert -1.0 < left < 0.0 < right < 1.0
    assert -1.0 < back < 0.0 < front < 1.0


def test_gallery_holds_all_models_and_three_boxes_that_look_outwards(scenes):
    gallery = scenes["gallery"]
    assert gallery.degenerate == 0
    assert len(gallery.faces) == sum(len(scenes[name].faces) for name in MODELS) + 3 * 12
    (left, bottom, back), (right, top, front) = gallery.bounds
    assert (bottom, top) == (-0.1, scenes["statue"].bounds[1, 1])
    assert (left, right, back, front) == (-2.4, 2.4, -1.05, 1.05)
    boxes = gallery.faces[-36:].reshape(3, 12, 3)
    sizes = (4.8 * 0.1 * 2.1, 4.8 * 1.25 * 0.12, 1.24 * 0.34 * 0.60)
    for faces, size in zip(boxes, sizes, strict=True):
        box = trimesh.Trimesh(gallery.vertices, faces, process=False)
        assert box.volume == pytest.approx(size, rel=1e-12)
    turntable = scenes["turntable"]
    assert np.array_equal(turntable.vertices, gallery.vertices)
    assert np.array_equal(turntable.faces, np.delete(gallery.faces, np.s_[-24:-12], axis=0))


def test_corner_fills_the_test_view_and_has_slivers_contacts_and_a_wall_behind(scenes, tmp_path):
    """A tilted view: no background, in the middle neither, and a surface within R of another's edge."""
    corner = scenes["corner"]
    a, b, c = (corner.vertices[corner.faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    longest = np.linalg.norm(c - b, axis=1)
    assert (area / longest < 0.004).sum() == 24  # height over the longest side
    words = "corner", "--camera", "--resolution", "64x48", "--layers", "depth", "--normals", "geometric"
    described = manifest_of(render(tmp_path, *words))["views"][0]["view"]
    linear = np.array(described["cast_from_world"])[:, :3]
    assert (np.abs(linear) > 0.04).all()  # each axis of the world is seen in all three of the view
    assert np.isfinite(read_exr(tmp_path / "camera.exr")["depth"].pixels).all()


@pytest.mark.parametrize("name", ["gallery", "statue", "ammonite", "corner"])
def test_paint_is_a_colour_at_each_vertex(scenes, name):
    mesh = scenes[name]
    colors = mesh.paint.vertex_colors
    assert colors.shape == mesh.vertices.shape
    assert colors.dtype == np.float32
    assert colors.min() > 0.0
    assert colors.max() < 1.0  # nothing is clipped
    assert colors.max() - colors.min() > 0.3  # shaded, not plain
    assert scenes["armadillo"].paint is None


@pytest.mark.slow
def test_modelling_makes_the_same_arrays_again(tmp_path):
    python(MAKE, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(path.name for path in MESHES.iterdir())
    for path in MESHES.iterdir():
        with np.load(path) as stored, np.load(tmp_path / path.name) as made:
            assert made.files == stored.files
            for key in stored.files:
                assert (made[key].dtype, made[key].shape) == (stored[key].dtype, stored[key].shape)
                assert made[key].tobytes() == stored[key].tobytes()


def test_the_names_are_those_that_are_documented():
    assert set(BUILTIN) == set(ALL)
    assert builtin_scene().name == "gallery"
    with pytest.raises(InputError, match=r"'teapot'.*gallery, turntable, statue, ammonite, armadillo, corner"):
        builtin_scene("teapot")
