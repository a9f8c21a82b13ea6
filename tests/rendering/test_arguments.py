"""Arguments of renders, photographs and files that mean nothing: each is refused in a sentence that names it."""

import numpy as np
import pytest
from refusals import is_refused

import lfssao
from lfssao import Part, Settings

MESH = lfssao.builtin_scene("corner")
DISPLAY = lfssao.find_display("sample-a").with_resolution(8, 6)
VIEW = lfssao.module_views(MESH, DISPLAY, [10])[0]
BALL = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, -0.5]])
PIXELS = np.zeros((6, 8, 1), np.float32)
HOLED = np.ma.array(PIXELS, mask=np.arange(48).reshape(PIXELS.shape) == 5)
NO_THREADS = [np.nan, -1, 0, 1.5, "two", None, 1e9, True]
NO_MODULES = [[0.5], ["left"], [np.nan], [None], [-1], [21], "10", [], range(0), np.zeros((1, 1), int), [True]]
NO_SIZES = [np.nan, 0, -1, 1.5, 1e30, "8", None, True]


def settings(**changes):
    return Settings(**{"radii": (0.5,), **changes})


def lit(channels=1):
    return lfssao.LightField(DISPLAY, [10], channels)


def written(pixels=PIXELS, **more):
    return lfssao.write_exr("a.exr", [Part(**{"name": "a", "channels": ("Z",), "pixels": pixels, **more})])


WRONG = [
    *((lambda bad=bad: lfssao.render(MESH, DISPLAY, settings(), [10], bad), "threads is") for bad in NO_THREADS),
    *((lambda bad=bad: lfssao.render(MESH, DISPLAY, modules=bad), "modules .* are not a part of|modules is") for
      bad in NO_MODULES),
    *((lambda bad=bad: lfssao.module_views(MESH, DISPLAY, bad), "modules .* are not a part of|modules is") for
      bad in (*NO_MODULES, 10)),
    *((lambda bad=bad: lfssao.module_views(MESH, DISPLAY, [10], bad), "guard is") for bad in (
        np.nan, -1, 1e30, 1.5, "2", None, True,
    )),
    *((lambda bad=bad: lfssao.module_views(MESH, DISPLAY, [10], 0, bad), "bounds is") for bad in (
        MESH.bounds[::-1], "box", np.nan * MESH.bounds, np.ma.array(MESH.bounds, mask=MESH.bounds > 0),
    )),
    *((lambda bad=bad: lfssao.render_view(lfssao.RayCaster(MESH, VIEW.cast_from_world), VIEW, settings(), bad), words)
      for bad, words in [
          (3, "neighbours is of type int"), ([3], "neighbour 0 is 3"),
          ([(VIEW, PIXELS[..., 0])], "mapping of neighbour"),
          ([(VIEW.world_to_image, np.full((6, 8), np.nan, np.float32))], "depth of neighbour 0 is NaN"),
          ([(VIEW.world_to_image, HOLED[..., 0])], "depth of neighbour 0 is a masked"),
      ]),
    # Settings
    *((lambda bad=bad: settings(radii=bad), "radi.* is") for bad in (
        "0.1", None, ["0.1"], [np.nan], [True], [[0.1]], [None], {"a": 1}, [1j], np.ma.array([0.1, 0.2], mask=[0, 1]),
    )),
    *((lambda bad=bad: settings(blur=bad), "blur is") for bad in (np.nan, -1, 1e30, "1", None, True, [1.0])),
    *((lambda bad=bad: settings(samples=bad), "samples|a sample") for bad in (
        "many", 5, np.nan * BALL, np.ma.array(BALL, mask=BALL > 0), [[1, 2, 3], [1]], 8 * ["x"],
    )),
    *((lambda bad=bad: settings(estimator="vo-points", samples=BALL, weights=bad), "weights") for bad in (
        "heavy", [1.0], [0.0, 0.0], [2.0, -1.0], [np.nan, 1.0], np.ma.array([1.0, 2.0], mask=[1, 0]),
    )),
    (lambda: settings(estimator="vo-points", weights=[1.0, 2.0]), "weights are given, and no samples"),
    *((lambda bad=bad: settings(neighbours=bad), "neighbours is") for bad in (np.nan, -1, 1.5, "1", None, True)),
    *((lambda bad=bad: settings(rotation_seed=bad), "rotation_seed is") for bad in (np.nan, -1, 0.5, "0", None, True)),
    *((lambda bad=bad: settings(rotation=bad), "rotation") for bad in (
        5, HOLED[..., 0], np.full((6, 8), np.nan), ["x"],
    )),
    *((lambda bad=bad: settings(layers=bad), "layers") for bad in (5, "ao", (), [["ao"]], {"ao"})),
    *((lambda bad=bad: settings(parameters=bad), "parameters is") for bad in (5, "sigma=1", None)),
    (lambda: settings(estimator=["lf"]), "there is no estimator"),
    (lambda: settings(caster=np.zeros(2)), "caster: there is no choice"),
    # The viewer
    *((lambda bad=bad: lfssao.LightField(DISPLAY, bad), "modules .* are not a part of|modules is") for
      bad in (*NO_MODULES, 10)),
    *((lambda bad=bad: lit(bad), "channels is") for bad in NO_SIZES if bad != 1e30),
    *((lambda bad=bad: lit().put(bad, PIXELS), "is not one of") for bad in (np.nan, 10.0, "10", None, [10], 9)),
    *((lambda bad=bad: lit().put(10, *bad), "the texture of module 10") for bad in (
        (), (HOLED,), ("white",), (None,), (PIXELS[..., 0],), (PIXELS[:5],), (np.nan + PIXELS,),
    )),
    (lambda: lit(2).put(10, PIXELS, PIXELS[:, :4]), "the texture of module 10"),
    *((lambda bad=bad: lit().photograph(0.0, bad), "width is") for bad in NO_SIZES),
    *((lambda bad=bad: lit().photograph(bad), "eye x is") for bad in (np.nan, "left", None, True, [0.0])),
    (lambda: lit().photograph(0.0, 8, ["linear"]), "there is no blend"),
    *((lambda bad=bad: lfssao.eye_point(DISPLAY, bad), "eye x is") for bad in (np.nan, "left", None, True, [0.0])),
    *((lambda bad=bad: lfssao.eye_view(DISPLAY, np.eye(3, 4), 0.0, bad), "width is") for bad in NO_SIZES),
    *((lambda bad=bad: lfssao.eye_view(DISPLAY, bad, 0.0), "physical_from_world") for bad in (
        np.eye(4), np.full((3, 4), np.nan), np.zeros((3, 4)), "map", None, np.ma.array(np.eye(3, 4), mask=np.eye(3, 4)),
    )),
    *((lambda bad=bad: lfssao.eye_range(DISPLAY, bad), "modules") for bad in (*NO_MODULES, 10)),
    # Files
    (lambda: written(HOLED), "part a is a masked array"),
    *((lambda bad=bad: written(bad), "part a: pixels is of type") for bad in (PIXELS.tolist(), None, "white")),
    *((lambda bad=bad: written(name=bad), "name is of type") for bad in (None, 5)),
    *((lambda bad=bad: written(channels=bad), "channels is of type|a name is of type") for bad in (None, "Z", (5,))),
    *((lambda bad=bad: written(guard=bad), "guard is") for bad in (np.nan, -1, 1.5, "1", None, True, 3, 1e30)),
    *((lambda bad=bad: written(compression=bad), "there is no compression") for bad in (None, "jpeg", 5, ["zip"])),
    *((lambda bad=bad: written(attributes=bad), "attribute|a name") for bad in (
        None, 5, {5: 1}, {"a": None}, {"a": [1, 2]}, {"a": 1e300}, {"a": {}}, {"a": 1j},
    )),
    (lambda: lfssao.write_exr("a.exr", ["part"]), "a part is of type str"),
    *((lambda bad=bad: lfssao.read_exr(bad), "path is of type") for bad in (5, None, ["a.exr"])),
    (lambda: lfssao.read_exr("a.exr", 5), "names is 5"),
    (lambda: lfssao.render(MESH, DISPLAY, settings(layers=("depth",)), [10])[0].save(5), "path is of type int"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "words"), WRONG, ids=[words for _, words in WRONG])
def test_what_means_nothing_is_refused(call, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert is_refused(call, words)
    assert list(tmp_path.iterdir()) == []


def test_what_is_right_in_another_type_is_taken(tmp_path):
    right = lfssao.render(MESH, DISPLAY, Settings((0.5,), neighbours=1, blur=1.0), [10])[0].blurred
    for whole in (np.int64, np.array):
        chosen = Settings([whole(1) * 0.5], neighbours=whole(1), blur=whole(1), layers=["blurred"])
        assert np.array_equal(lfssao.render(MESH, DISPLAY, chosen, np.array([10]), whole(1))[0].blurred, right)
    field = lfssao.LightField(DISPLAY, {np.int64(10)}, np.int64(1))
    field.put(np.int64(10), np.ma.array(PIXELS))
    assert field.missing == []
    assert lfssao.eye_view(DISPLAY, np.eye(3, 4).tolist(), np.float32(0), np.int64(8)).width == 8
    lfssao.write_exr(
        tmp_path / "a.exr", [Part("a", ["Z"], PIXELS, {"n": np.float64(0.5), "k": 2, "w": "ü"}, np.int64(2))]
    )
    assert lfssao.read_exr(tmp_path / "a.exr", {"a"})["a"].guard == 2
