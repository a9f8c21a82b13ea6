"""The layer of bent normals: what is asked for is made, written, read back, taken up again, compared and not viewed."""

import numpy as np
import pytest
from bits import assert_same_bits
from exr_parts import read_parts, write_parts
from jobs import manifest_of, render, sentence

from lfssao import (
    Buffers,
    InputError,
    RayCaster,
    Settings,
    bent_normals,
    compare,
    find_display,
    module_views,
    read_exr,
    render_view,
)
from lfssao.cli.main import main
from lfssao.samples import texel_turns
from lfssao.verify.verdict import Verdict

RADII = ("--radii", "0.3,0,1.5")
GTAO = ("--estimator", "gtao", "--parameter", "slices=3")
LAYERS = "depth,positions,normals,ao,bent"
PLACES = {"camera": ["--camera", "--guard", "3"], "module_002": ["--display", "convex", "--modules", "2:3"]}


@pytest.fixture(scope="module", params=PLACES)
def rendered(request, tmp_path_factory):
    words = ["statue", "--resolution", "40x30", *RADII, *GTAO, "--rotate", "hash", *PLACES[request.param]]
    return render(tmp_path_factory.mktemp("bent") / "whole", *words, "--layers", LAYERS), request.param


def test_settings_ask_for_it_and_for_what_it_reads():
    asked = Settings((0.1,), estimator="gtao", layers=("bent",))
    assert asked.kept == ("bent",)
    assert asked.computed == ("depth", "positions", "normals", "bent")
    assert "bent" not in Settings((0.1,), estimator="gtao").computed
    with pytest.raises(InputError, match="layers: estimator lf has no bent normals: choose one of gtao, visib"):
        Settings((0.1,), layers=("ao", "bent"))


@pytest.mark.parametrize("estimator", ["gtao", "visibility-bitmask"])
def test_textures_are_bent_normals_of_each_radius(statue, estimator):
    (view,) = module_views(statue, find_display("virtual").with_resolution(48, 36), None, 4)
    caster = RayCaster(statue, view.cast_from_world)
    options = {"thickness": 0.2} if "mask" in estimator else {}
    how = {"estimator": estimator, "rotation": "hash", "rotation_seed": 5, "parameters": options, "units": "world"}
    settings = Settings((0.3, 0.1, 0.3), layers=("bent", "normals"), **how)
    made = render_view(caster, view, settings)
    assert (made.ao, made.outside, made.merged) == ((), (), None)
    assert set(made.seconds) == {"ray_cast", "bent"}
    g = caster.gbuffer(view, None, "geometric")
    buffers = Buffers(view, g.depth, g.positions, g.normals, texel_turns("hash", *g.depth.shape, 5, np.float32))
    for radius, texture in zip(settings.radii, made.bent, strict=True):
        whole = bent_normals(estimator, buffers, radius, units="world", **options)
        assert_same_bits(texture, np.ascontiguousarray(whole[4:-4, 4:-4]))
    assert np.abs(made.bent[0] - made.bent[1]).max() > 0.1
    far = statue.bounds + np.array([90.0, 0, 0])
    (view,) = module_views(statue, find_display("virtual").with_resolution(8, 6), None, 0, far)
    empty = render_view(caster, view, settings)
    assert [texture.any() for texture in empty.bent] == [False] * 3


def test_files_have_a_part_a_radius_by_render_and_by_ao(rendered, tmp_path, capsys):
    folder, name = rendered
    parts = read_exr(folder / f"{name}.exr")
    file = folder / f"{name}.exr"
    assert list(parts) == ["depth", "positions", "normals", "ao_1", "ao_2", "ao_3", "bent_1", "bent_2", "bent_3"]
    assert set(parts["bent_1"].channels) == {"bent_1.X", "bent_1.Y", "bent_1.Z"}
    assert parts["bent_1"].guard == 0
    length = np.linalg.norm(parts["bent_1"].pixels, axis=-1)
    guard = parts["depth"].guard
    height, width = length.shape
    seen = np.isfinite(parts["depth"].pixels[guard : guard + height, guard : guard + width, 0])
    assert np.array_equal(length > 0, seen)
    assert np.abs(length[seen] - 1).max() < 1e-6
    assert not parts["bent_2"].pixels.any()  # of a radius of 0
    given = ["--depth", str(file), "--positions", str(file), "--normals", str(file), "--buffers", str(folder)]
    words = [*given, "--view", name, *RADII, *GTAO, "--rotate", "hash"]
    assert main(["ao", *words, "--layers", "bent", "-o", str(tmp_path)]) == 0
    again = read_exr(tmp_path / f"{name}.exr")
    assert list(again) == ["bent_1", "bent_2", "bent_3"]
    for each in again.values():
        assert_same_bits(each.pixels, parts[each.name].pixels)
    capsys.readouterr()
    assert main(["ao", *words, "--layers", "bent,shaded", "-o", str(tmp_path / "no")]) == 2
    assert sentence(capsys) == "--layers: shaded needs a texture that is not given: --image FILE"
    assert main(["view", str(folder), "--layer", "bent_1", "--width", "32", "-o", str(tmp_path / "a.png")]) == 2
    assert "bent_1" in sentence(capsys) or name == "camera"


def test_other_estimators_are_refused_and_resume_has_the_same_bits(rendered, tmp_path, capsys):
    folder, name = rendered
    words = ["statue", "--resolution", "40x30", *RADII, "--rotate", "hash", *PLACES[name], "--layers", LAYERS]
    render(tmp_path / "no", *words, "--estimator", "hbao", code=2)
    assert sentence(capsys) == ("layers: estimator hbao has no bent normals: choose one of gtao, visibility-bitmask")
    again = manifest_of(render(folder, *words, *GTAO, "--resume"))
    assert "verify" in again["views"][0]["seconds"]


@pytest.mark.parametrize(("change", "verdict"), [("ulp", Verdict.INSIDE), ("turned", Verdict.OUTSIDE)])
def test_compare_judges_it_by_intervals(rendered, tmp_path, change, verdict):
    folder, name = rendered
    assert compare(folder, folder).exit_code == 0
    parts = read_parts(folder / f"{name}.exr")
    for spec, pixels in parts:
        if spec.get_string_attribute("name") == "bent_1":
            there = pixels != 0
            moved = np.nextafter(pixels, np.float32(0)) if change == "ulp" else np.roll(pixels, 1, axis=-1)
            pixels[there] = moved[there]
    (tmp_path / "mine").mkdir()
    write_parts(tmp_path / "mine" / f"{name}.exr", parts)
    made = compare(tmp_path / "mine", folder)
    assert {each.layer: each.verdict for each in made.results if each.verdict is not Verdict.EQUAL_BITS} == {
        "bent_1": verdict
    }
    assert made.exit_code == verdict.code
    assert made.notes == ()


def test_compare_says_that_normals_are_missing_for_its_interval(rendered, tmp_path, capsys):
    folder, name = rendered
    parts = read_parts(folder / f"{name}.exr")
    words = ["statue", "--resolution", "40x30", *RADII, *GTAO, "--rotate", "hash", *PLACES[name]]
    some = render(tmp_path / "some", *words, "--layers", LAYERS.replace("normals,", ""))
    kept = [part for part in parts if part[0].get_string_attribute("name") != "normals"]
    for spec, pixels in kept:
        if spec.get_string_attribute("name") == "bent_1":
            pixels[pixels != 0] = np.nextafter(pixels[pixels != 0], np.float32(0))
    (tmp_path / "mine").mkdir()
    write_parts(tmp_path / "mine" / f"{name}.exr", kept)
    capsys.readouterr()
    assert main(["compare", str(tmp_path / "mine"), str(some)]) == 2
    note = "no interval is known of bent_1: the reference was rendered without layers they are made of"
    assert note in capsys.readouterr().out


@pytest.mark.parametrize(("axis", "verdict"), [(0, Verdict.INSIDE), (1, Verdict.OUTSIDE)])
def test_half_floats_are_judged_by_what_half_floats_hold(rendered, tmp_path, axis, verdict):
    folder, name = rendered
    parts = read_exr(folder / f"{name}.exr")
    for layer in ("bent_1", "normals"):
        np.save(tmp_path / f"{name}_{layer}.npy", np.roll(parts[layer].pixels, axis, axis=-1).astype(np.float16))
    made = compare(tmp_path, folder, layers=("bent_1", "normals"))
    assert {each.layer: each.verdict for each in made.results} == {"bent_1": verdict, "normals": verdict}
