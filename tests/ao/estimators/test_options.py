"""The command line's and the library's choice of an estimator."""

import numpy as np
import pytest
from jobs import manifest_of, python

from lfssao import Buffers, RayCaster, builtin_scene, estimate, find_display, module_views, read_exr
from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.cli.main import main
from lfssao.rendering.settings import diagonal

SMALL = ["render", "ammonite", "--display", "virtual", "--resolution", "24x18", "--radii", "2%"]


def render(folder, *options):
    assert main([*SMALL, "-o", str(folder), *options]) == 0
    manifest = manifest_of(folder)
    return manifest, {name: part.pixels for name, part in read_exr(folder / manifest["views"][0]["file"]).items()}


@pytest.fixture(scope="module")
def ammonite():
    mesh = builtin_scene("ammonite")
    view = module_views(mesh, find_display("virtual").with_resolution(24, 18))[0]
    return mesh, view, RayCaster(mesh, view.cast_from_world)


@pytest.mark.parametrize("name", ["lf", "hemisphere"])
def test_the_command_writes_what_the_estimator_makes_and_says_with_what(ammonite, tmp_path, name):
    manifest, parts = render(tmp_path, "--estimator", name)
    _, view, caster = ammonite
    entry = ESTIMATORS[name]
    seen = caster.gbuffer(view, None, "geometric" if entry.normals else None)
    expected = estimate(name, Buffers.of(seen, view).turned("hash"), manifest["settings"]["radii"][0])
    assert np.array_equal(parts["ao_1"][..., 0], expected.texture)
    assert manifest["settings"]["estimator"] == name
    assert manifest["settings"]["parameters"] == entry.parameters
    assert manifest["views"][0]["samples_outside"] == [expected.outside]
    points, weights = entry.default_samples()
    assert (points is None) == (manifest["settings"]["samples"] is None)
    assert points is None or manifest["settings"]["samples"] == points.tolist()
    assert (weights is None) == (manifest["settings"]["weights"] is None)
    assert ("normals" in parts) == entry.normals


def test_the_default_is_lf_with_eight_points_of_the_latin_square(tmp_path):
    manifest, parts = render(tmp_path / "a")
    assert manifest["sampling"] == {"method": "latin", "count": 8, "seed": 0}
    assert manifest["settings"]["estimator"] == "lf"
    asked = ["--estimator", "lf", "--sampling", "latin", "--samples", "8", "--seed", "0"]
    assert np.array_equal(render(tmp_path / "b", *asked)[1]["ao_1"], parts["ao_1"])
    manifest, other = render(tmp_path / "c", "--seed", "5")
    assert manifest["sampling"] == {"method": "latin", "count": 8, "seed": 5}
    assert not np.array_equal(other["ao_1"], parts["ao_1"])


def test_all_estimators_are_listed(capsys):
    assert main(["estimators"]) == 0
    said = capsys.readouterr().out
    for name, entry in ESTIMATORS.items():
        assert f"{name}: {entry.title} ({entry.source})" in said.splitlines()
        assert all(f"{parameter}={value}" in said for parameter, value in entry.parameters.items())
        assert main(["estimators", name]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert lines[0] == f"{name}: {entry.title} ({entry.source})"
        assert lines[1] == f"    {entry.formula}"
        assert "ao" in entry.formula
        assert lines[2].endswith("weighting {}, falloff {}".format(*entry.integrand))
        for line, (parameter, value) in zip(lines[3:], entry.parameters.items(), strict=True):
            assert line.strip().startswith(f"{parameter}={value}: {entry.said('meaning')[parameter]}")


def test_the_default_imports_no_other_estimator_and_none_of_its_kernels(tmp_path):
    script = "import sys, lfssao.cli.main; assert lfssao.cli.main.main(sys.argv[1:]) == 0; print(*sys.modules)"
    loaded = python("-c", script, *SMALL, "-o", tmp_path / "out").stdout.split()
    estimators = {name.removeprefix("lfssao.ao.estimators.") for name in loaded if "lfssao.ao.estimators." in name}
    assert estimators == {"estimator", "lf", "published", "registry"}
    kernels = {name.rpartition(".")[2] for name in loaded if name.startswith("lfssao.") and ".kernels." in name}
    assert "ssao" in kernels
    others = {"alchemy", "float_view", "multiresolution", "point", "sums", "truth"}
    assert not kernels & others


def test_lengths_in_world_units_are_said_and_used(ammonite, tmp_path, capsys):
    assert main(["estimators", "sao"]) == 0
    lines = {line.split("=")[0].strip(): line for line in capsys.readouterr().out.splitlines()}
    assert lines["beta"].endswith("; beta R with --units world")
    assert lines["epsilon"].endswith("; epsilon R^2 with --units world")
    assert not lines["gauss"].endswith("world")
    radius = 0.2 * diagonal(ammonite[0])
    world = {"beta": 0.02 * radius, "intensity": 0.7 * radius, "epsilon": 0.03 * radius**2, "quad_edge": 0.02 * radius}
    given = [word for name, value in world.items() for word in ("--parameter", f"{name}={value!r}")]
    sao = ["--estimator", "sao", "--radii", "20%"]
    manifest, parts = render(tmp_path / "world", *sao, "--units", "world", *given)
    assert manifest["settings"]["units"] == "world"
    assert manifest["settings"]["parameters"]["beta"] == world["beta"]
    given = [word for text in ("beta=0.02", "intensity=0.7", "epsilon=0.03") for word in ("--parameter", text)]
    _, expected = render(tmp_path / "radii", *sao, *given)
    np.testing.assert_allclose(
        parts["ao_1"], expected["ao_1"], atol=0.01
    )  # a step of packing, where rounding crosses it
    assert np.mean(parts["ao_1"] == expected["ao_1"]) > 0.9
    assert expected["ao_1"].max() > 0.1


# Angles from a file


@pytest.fixture(scope="module")
def hashed_by_shader():
    """SAO's hash as a shader in float32 makes it, 18 rows of 24 texels."""
    rows, columns = np.mgrid[:18, :24]
    return np.float32((30 * columns) ^ (rows + 10 * columns * rows))


def test_whole_radians_of_a_file_turn_as_the_hash_of_that_name(tmp_path, hashed_by_shader):
    np.save(tmp_path / "up.npy", hashed_by_shader)
    np.save(tmp_path / "down.npy", hashed_by_shader[::-1])
    sao = ["--estimator", "sao", "--layers", "depth,positions,ao", "--radii", "20%"]
    _, named = render(tmp_path / "named", *sao)
    for name, more in (("up", ()), ("up", ("--rotate-rows", "above")), ("down", ("--rotate-rows", "below"))):
        manifest, parts = render(tmp_path / "out", *sao, "--rotate", str(tmp_path / f"{name}.npy"), *more)
        assert np.abs(parts["ao_1"] - named["ao_1"]).max() == 0
        assert manifest["settings"]["rotation"] == "angles"
    wrong = render(tmp_path / "wrong", *sao, "--rotate", str(tmp_path / "down.npy"))[1]
    assert not np.array_equal(wrong["ao_1"], named["ao_1"])


def test_a_reference_with_angles_of_a_file_is_judged_by_them(tmp_path, hashed_by_shader, capsys):
    """The same samples of lf, whose bounds are known, and the same not turned."""
    np.save(tmp_path / "angles.npy", hashed_by_shader)
    lf = ["--layers", "depth,positions,ao"]
    render(tmp_path / "right", *lf, "--rotate", str(tmp_path / "angles.npy"))
    render(tmp_path / "same", *lf, "--rotate", "sao-hash")
    render(tmp_path / "other", *lf, "--rotate", "none")
    assert main(["compare", str(tmp_path / "same"), str(tmp_path / "right")]) == 0
    capsys.readouterr()
    assert main(["compare", str(tmp_path / "other"), str(tmp_path / "right")]) == 2
    assert "samples are not turned" in capsys.readouterr().out


@pytest.mark.parametrize(("angles", "options", "said"), [
    (np.zeros((18, 23)), (), "it has 23x18 texels, textures with guard have 24x18, a tile is a square of up to 256x"),
    (np.zeros((18, 24, 4)), (), "it has 4 channels, angles are one, vectors two or three"),
    (np.full((4, 4, 3), 2000.0), (), "a vector has a number that is not from -1024 to 1024"),
    (np.full((4, 4, 2), np.nan), (), "a vector has a number that is not from -1024 to 1024"),
    (np.zeros((4, 4, 3), np.uint8), (), "vectors are uint8 (4, 4, 3), expected float32 or float64"),
    (np.ones((4, 4, 3)), (), "a vector has a z other than 0, and estimator lf reads x and y alone"),
    (np.full((18, 24), np.nan), (), "an angle is not a number of radians"),
    (np.zeros((18, 24), np.uint8), (), "angles are uint8 (18, 24), expected radians"),
    (np.zeros((18, 24)), ("--estimator", "multiresolution"), "samples of estimator multiresolution do not turn"),
    (None, (), "angles.npy: there is no such file"),
    (None, ("--rotate", "hash", "--rotate-rows", "below"), "--rotate-rows is for a file"),
])  # fmt: skip
def test_angles_that_do_not_fit_are_refused(tmp_path, capsys, angles, options, said):
    if angles is not None:
        np.save(tmp_path / "angles.npy", angles)
    assert main([*SMALL, "-o", str(tmp_path / "out"), "--rotate", str(tmp_path / "angles.npy"), *options]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
