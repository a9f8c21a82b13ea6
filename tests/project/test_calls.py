"""Calls from Python: names and files in place of objects, and one sentence on an argument of another type."""

from types import SimpleNamespace
from typing import get_overloads, get_type_hints

import numpy as np
import pytest
import trimesh
from jobs import python
from jobs import render as render_files

import lfssao
from lfssao.cli.main import main
from lfssao.errors import InputError
from lfssao.optics.display_file import display_text
from lfssao.rendering.settings import settings_of

MESH = lfssao.builtin_scene("statue")
DISPLAY = lfssao.find_display("sample-a").with_resolution(40, 24)
VIEW = lfssao.module_views(MESH, DISPLAY, [10])[0]
TEXTURES = (np.ones((24, 40)), np.ones((24, 40, 3)))
MAPPING = VIEW.world_to_image

WRONG = {
    "mesh is of type Display": lambda: lfssao.module_views(DISPLAY, MESH),
    "mesh is of type View": lambda: lfssao.RayCaster(VIEW, np.eye(3, 4)),
    "display is of type NoneType": lambda: lfssao.find_display(None),
    "settings is of type str": lambda: lfssao.render(MESH, DISPLAY, "lf"),
    "caster is of type Mesh": lambda: lfssao.render_view(MESH, VIEW, lfssao.Settings((0.1,))),
    "view is of type Settings": lambda: lfssao.render_view(
        lfssao.RayCaster(MESH, VIEW.cast_from_world), lfssao.Settings((0.1,)), VIEW
    ),
    "buffers is of type Mesh": lambda: lfssao.estimate("lf", MESH, 0.1),
    "buffers is of type View": lambda: lfssao.bent_normals("gtao", VIEW, 0.1),
    "box is": lambda: lfssao.Camera.looking_at(MESH),
    "radii is 0.1, expected a list of numbers": lambda: lfssao.Settings(0.1),
    "modules is 10, it must be a range or a list": lambda: lfssao.render(MESH, DISPLAY, modules=10),
    "physical_from_world is 0": lambda: DISPLAY.view(np.eye(3, 4), 0),
    "world_box is": lambda: lfssao.fit_roi(MESH, DISPLAY),
    "radii: at least one is needed; default_radii": lfssao.Settings,
    "path is of type list": lambda: lfssao.write_exr([], "a.exr"),
    "parts is of type Part": lambda: lfssao.write_exr(
        "a.exr", lfssao.Part("a", ("A",), np.ones((1, 1, 1), np.float32))
    ),
    "occluders is of type str": lambda: lfssao.ray_cast_occlusion("statue", None, 0.1),
    "buffers is of type float": lambda: lfssao.ray_cast_occlusion(lfssao.Occluders(MESH), 0.1, None),
    "view is of type Mesh": lambda: lfssao.RayCaster(MESH, VIEW.cast_from_world).gbuffer(MESH),
    "gbuffer is of type View": lambda: lfssao.Buffers.of(VIEW, None),
    "world_to_image is of type ndarray": lambda: lfssao.algorithm2(
        *TEXTURES, np.ones((1, 3)), VIEW.world_to_image, 1.0
    ),
    r"radius is array\(": lambda: lfssao.algorithm2(*TEXTURES, MAPPING, 1.0, np.ones((1, 3))),
    "mesh is of type int, expected a Mesh, a scene's name, a mesh file": lambda: lfssao.render(5),
    "mesh is of type PointCloud of trimesh": lambda: lfssao.render(trimesh.PointCloud([[0.0, 0, 0]])),
    "mesh is of type tuple": lambda: lfssao.render((1, 2, 3)),
    r"mesh: vertices have shape \(1,\), expected \(V, 3\)": lambda: lfssao.render((1, 2)),
    "texture: it is for a mesh file": lambda: lfssao.find_scene(MESH, "a.png"),
    "there is no setting 'radius' \\(did you mean 'radii'": lambda: lfssao.render(MESH, radius=[1]),
    "radii is '1%', expected a list of numbers, or of per cent": lambda: lfssao.render(MESH, radii="1%"),
    "radius is 'x', expected a number or per cent": lambda: lfssao.render(MESH, radii=["x"]),
    "radius is '-1%', expected": lambda: lfssao.render(MESH, radii=["-1%"]),
    "samples is 0, it must be a whole number": lambda: lfssao.render(MESH, samples=0),
    "estimator lf: samples is '8', expected numbers": lambda: lfssao.render(MESH, samples="8"),
    "did you mean 'jittered'": lambda: lfssao.render(MESH, sampling="jitered"),
    "seed is -1": lambda: lfssao.render(MESH, seed=-1),
    "samples is a set, and a sampling or a seed": lambda: lfssao.render(MESH, samples=np.eye(3), sampling="latin"),
    "samples, sampling, seed: estimator sao takes no samples": lambda: lfssao.render(MESH, estimator="sao", seed=3),
    "settings are given, and blur": lambda: lfssao.render(MESH, settings=lfssao.Settings((0.1,)), blur=2),
    "no embedded scene of that name": lambda: lfssao.render("stature", "sample-a"),
    r"modules \[3, 21\]": lambda: lfssao.render("statue", "sample-a", modules=[3, 21]),
}


def small(**words):
    return lfssao.render(MESH, DISPLAY.with_resolution(100, 60), modules=[10], **words)[0]


def test_words_of_the_command_give_its_bits(tmp_path):
    words = ["--radii", "3%,0.2", "--samples", "16", "--sampling", "jittered", "--seed", "7", "--blur", "2"]
    words += ["--resolution", "100x60", "--modules", "10"]
    render_files(tmp_path, "statue", *words)
    theirs = lfssao.read_exr(tmp_path / "module_010.exr")
    ours = small(radii=["3%", 0.2], samples=16, sampling="jittered", seed=7, blur=2.0)
    for name, texture in (("ao_1", ours.ao[0]), ("ao_2", ours.ao[1]), ("blurred", ours.blurred)):
        assert np.array_equal(theirs[name].pixels[..., 0], texture)
    assert not np.array_equal(small(radii=["3%"], samples=16, sampling="jittered", seed=8).merged, ours.ao[0])


@pytest.mark.parametrize(("words", "line"), [
    ({}, ""), ({"seed": 5}, "--seed 5"), ({"estimator": "sao"}, "--estimator sao"),
    ({"estimator": "hemisphere", "samples": 6, "seed": 3}, "--estimator hemisphere --samples 6 --seed 3"),
    ({"rotation": "none", "samples": 4}, "--rotate none --samples 4"),
])  # fmt: skip
def test_settings_are_those_of_the_command(monkeypatch, tmp_path, words, line):
    made = []
    monkeypatch.setattr("lfssao.cli.render.run", lambda job, *_: made.append(job.settings) or (None for _ in ()))
    assert main(["render", "statue", "-o", str(tmp_path), *line.split()]) == 0
    ours = settings_of(MESH, **words)
    for name, value in vars(made[0]).items():
        assert np.array_equal(getattr(ours, name), value), name


def test_the_display_has_a_default_and_meshes_many_forms():
    rendered = lfssao.render("statue")
    assert (len(rendered), rendered._views[0].width) == (21, lfssao.find_display("sample-a").modules[0].width)
    box = trimesh.creation.box()
    box.visual.vertex_colors = [255, 0, 0, 255]
    moved = trimesh.Scene()
    moved.add_geometry(box, transform=trimesh.transformations.translation_matrix([5, 0, 0]))
    assert lfssao.find_scene(moved).bounds.tolist() == [[4.5, -0.5, -0.5], [5.5, 0.5, 0.5]]
    assert lfssao.find_scene(box).paint.vertex_colors[0].tolist() == [1, 0, 0]
    pair = box.vertices.tolist(), box.faces.tolist()
    for thing in (box, pair, list(pair), SimpleNamespace(vertices=pair[0], faces=pair[1])):
        assert np.array_equal(lfssao.find_scene(thing).faces, box.faces)


def test_checkers_see_textures_and_public_rooms_come_with_the_package():
    number, part = get_overloads(lfssao.Rendered.__getitem__)
    found = [get_type_hints(each)["return"] for each in (number, part)]
    assert found == [lfssao.Textures, list[lfssao.Textures]]
    assert isinstance(lfssao.render("statue"), lfssao.Rendered)
    assert issubclass(lfssao.InputWarning, UserWarning)
    script = """import lfssao
assert {"testing", "samples", "viz", "Rendered", "Case", "InputWarning"} <= set(dir(lfssao))
assert callable(lfssao.testing.assert_sampler)
assert callable(lfssao.samples.sample_set)
assert callable(lfssao.viz.explore)"""
    python("-c", script)


@pytest.mark.parametrize("said", WRONG)
def test_a_wrong_argument_is_named(said):
    with pytest.raises(InputError, match=said):
        WRONG[said]()


def test_names_and_files_stand_for_scenes_displays_and_textures(tmp_path):
    (tmp_path / "own.toml").write_text(display_text("sample-a"))
    assert lfssao.find_scene(MESH) is MESH
    assert lfssao.default_radii("statue") == lfssao.default_radii(MESH)
    named = lfssao.module_views("statue", str(tmp_path / "own.toml"), [10])[0]
    assert np.array_equal(named.cast_from_world, VIEW.cast_from_world)
    for thing in (lfssao.RayCaster("statue", np.eye(3, 4)), lfssao.Occluders("statue")):
        assert np.array_equal(thing.mesh.vertices, MESH.vertices)
    own = str(tmp_path / "own.toml")
    same = lfssao.find_display("sample-a")
    assert lfssao.LightField(own, [10]).display.modules == same.modules
    assert lfssao.eye_range(own) == lfssao.eye_range(same)
    assert lfssao.eye_point(own, 0.4) == lfssao.eye_point(same, 0.4)
    views = [lfssao.eye_view(display, np.eye(3, 4), 0.4) for display in (own, same)]
    assert np.array_equal(views[0].lens, views[1].lens)


def test_three_lines_render_modules_when_they_are_asked_for_and_save_them_as_the_command_does(tmp_path, monkeypatch):
    made = []
    real = lfssao.rendering.passes.render_view
    monkeypatch.setattr("lfssao.rendering.passes.render_view", lambda *all_: made.append(all_[1].name) or real(*all_))
    textures = lfssao.render("statue", DISPLAY, modules=[10, 2])
    assert (len(textures), made) == (2, [])
    textures[0].save(str(tmp_path / "out.exr"))
    assert made == ["module_010"]
    assert [each.view.name for each in textures[:]] == ["module_010", "module_002"]

    folder = tmp_path / "job"
    render_files(folder, "statue", "--display", "sample-a", "--resolution", "40x24", "--modules", "10:11")
    ours, theirs = (lfssao.read_exr(str(path)) for path in (tmp_path / "out.exr", folder / "module_010.exr"))
    assert list(ours) == list(theirs)
    assert all(np.array_equal(ours[name].pixels, theirs[name].pixels) for name in ours)
