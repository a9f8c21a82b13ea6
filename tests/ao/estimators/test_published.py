"""Published shaders: their files are read, lengths in world units or radii, and what is wrong is named."""

import pytest
from jobs import manifest_of, render

from lfssao.ao.estimators.published import find_published, published_names, published_text
from lfssao.ao.estimators.registry import find_estimator
from lfssao.errors import InputError
from lfssao.samples import ROTATIONS


@pytest.mark.parametrize("name", published_names())
def test_shaders_are_described_with_the_source_of_each_value(name):
    shader = find_published(name)
    estimator = find_estimator(shader.estimator)
    assert set(shader.parameters) == set(estimator.parameters)
    assert shader.rotate in ROTATIONS
    values = [line for line in published_text(name).splitlines() if "=" in line and not line.startswith("#")]
    assert all(
        "#" in line for line in values if not line.endswith(("= false", "= 0.0", '= "none"')) and "est" not in line
    )


def test_lengths_are_in_world_units_or_radii_of_the_shader():
    shader = find_published("r3d")  # R = 0.5
    assert shader.parameters_in("world") == shader.parameters
    made = shader.parameters_in("radii")
    assert (made["beta"], made["epsilon"], made["intensity"]) == (0.04, 0.08, 0.4)
    assert (made["taps"], made["gauss"], made["sharpness"]) == (16, 0.0, 2048.0)
    assert find_published("learnopengl").parameters_in("radii")["bias"] == 0.05


def settings_of(folder, *words):
    scene = "statue", "--camera", "--resolution", "16x12", "--radii", "5%", "--layers", "ao"
    return manifest_of(render(folder, *scene, *words))["settings"]


def test_like_sets_what_is_not_given(tmp_path):
    shader = find_published("learnopengl")
    made = settings_of(tmp_path / "a", "--like", "learnopengl")
    assert (made["estimator"], made["rotation"], len(made["samples"])) == ("oriented-hemisphere", "tiles", 64)
    assert made["parameters"] == shader.parameters_in("radii")
    words = "--like", "g3d", "--units", "world", "--parameter", "beta=0.5", "--rotate", "r2", "--estimator", "sao"
    made = settings_of(tmp_path / "b", *words)
    assert made["parameters"] == {**find_published("g3d").parameters, "beta": 0.5, "angle_sum": "exact"}
    assert (made["units"], made["rotation"]) == ("world", "r2")
    render(tmp_path / "c", "--like", "g3d", "--estimator", "lf", code=2)
    for samples in (0, -3, 10**9):
        (tmp_path / "mine.toml").write_text(f'estimator = "lf"\nradius = 1.0\nsamples = {samples}\n')
        render(tmp_path / "d", "--like", str(tmp_path / "mine.toml"), code=2)


@pytest.mark.parametrize(("text", "words"), [
    ("radius = 1.0", "estimator is missing"),
    ('estimator = "sao"\nradius = -1.0', "radius is -1, it must be positive"),
    ('estimator = "sao"\nradius = 1', "radius is 1, it must be of type float"),
    ('estimator = "sa0"\nradius = 1.0', "there is no estimator 'sa0'"),
    ('estimator = "sao"\nradius = 1.0\nspin = 2.0', "there is no key 'spin'"),
    ('estimator = "alchemy"\nradius = 1e200', "radius is 1e.200, its power 2 is out of range"),
    ('estimator = "sao"\nradius = 1.0\n[parameters]\nbeta = 1' + "0" * 400, "estimator sao: beta is 1000"),
    ('estimator = "sao"\nradius = 1.0\nsamples = 0x' + "f" * 5000, "it is not a TOML file"),
    ('estimator = "sao"\nradius = 1.0\nrotate = "angles.npy"', "there is no rotation 'angles.npy'"),
    ('estimator = "sao"\nradius = 1.0\n[parameters]\nbeat = 2.0', "estimator sao has no parameter 'beat'"),
])  # fmt: skip
def test_a_wrong_file_is_refused_by_name(tmp_path, text, words):
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(InputError, match=f"mine.toml: {words}"):
        find_published(str(tmp_path / "mine.toml"))
    with pytest.raises(InputError, match="there is no shader 'g3'"):
        find_published("g3")
