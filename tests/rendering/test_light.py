"""Renders with a light: the layer shaded alone changes, by options, words and arrays with the same bits."""

import numpy as np
import pytest
from bits import assert_same_bits
from compare_folders import single
from jobs import digests_of, manifest_of, render, sentence
from PIL import Image
from reference import passes

import lfssao
from lfssao.cli.main import main
from lfssao.files.srgb import to_codes

SMALL = "--display", "sample-a", "--resolution", "64x48", "--modules", "10", "--radii", "3%", "--guard", "2"
LIGHT = "--light=-1,2,3", "--ambient", "0.3", "--occlude", "all"
SETTINGS = {"direction": [-1, 2, 3], "ambient": 0.3, "occlude": "all"}


def layers(folder, *names):
    return [single(folder, "module_010", name) for name in names]


@pytest.mark.parametrize("scene", ["statue", "armadillo"])
def test_a_light_changes_the_layer_shaded_alone(tmp_path, scene):
    """The armadillo has no colour: its image is white."""
    plain = render(tmp_path / "plain", scene, *SMALL)
    lit = render(tmp_path / "lit", scene, *SMALL, *LIGHT)
    (before,), (after,) = digests_of(plain), digests_of(lit)
    assert {name for name in after if before.get(name) != after[name]} == {"shaded", "normals"}
    depth, normals, blurred, shaded = layers(lit, "depth", "normals", "blurred", "shaded")
    image = layers(lit, "color")[0] if scene == "statue" else np.repeat(np.isfinite(depth), 3, 2).astype(np.float32)
    inner = slice(2, -2), slice(2, -2)
    wanted = passes.light(image[inner], blurred[..., 0], normals[inner], (-1, 2, 3), 0.3, "all")
    assert_same_bits(shaded, wanted)
    assert manifest_of(lit)["settings"]["light"] == SETTINGS
    assert "light" not in manifest_of(plain)["settings"]
    alone = passes.light(image[inner], np.zeros_like(blurred[..., 0]), normals[inner], (-1, 2, 3), 0.3, "all")
    shown = np.asarray(Image.open(lit / "contact.png"))[22:382, 12:492]  # below its name
    for k in range(3):  # boxes of 7.5 pixels a texel
        assert abs(shown[..., k].mean() - to_codes(alone)[..., k].mean()) < 2
    display = lfssao.find_display("sample-a").with_resolution(64, 48)
    of_words = lfssao.render(scene, display, radii=["3%"], modules=[10], light=lfssao.Light((-1, 2, 3), 0.3, "all"))
    by_ambient = lfssao.render(
        scene, display, radii=["3%"], modules=[10], light=lfssao.Light((-1, 2, 3)), layers=("shaded",)
    )
    (first,), (second,) = of_words, by_ambient
    color, (ao, facing) = first.image, (first.blurred, first.gbuffer.normals)
    assert_same_bits(first.shaded, passes.light(color, ao, facing, (-1, 2, 3), 0.3, "all"))
    assert_same_bits(second.shaded, passes.light(color, ao, facing, (-1, 2, 3), 0.5, "ambient"))
    assert (second.layers, second.gbuffer.normals) == (("shaded",), None)


def test_a_job_resumes_by_its_own_light_alone(tmp_path, capsys):
    folder = render(tmp_path / "lit", "statue", *SMALL, *LIGHT)
    (folder / "manifest.json").unlink()
    render(folder, "statue", *SMALL, *LIGHT, "--resume")
    capsys.readouterr()
    for words in (LIGHT[:3], ["--normals"]):
        render(folder, "statue", *SMALL, *words, "--resume", code=2)
        assert "it was rendered with other parameters (light)" in sentence(capsys)


def test_the_textures_of_others_are_lit(tmp_path, capsys):
    folder = render(tmp_path / "lit", "statue", *SMALL, *LIGHT)
    whole = str(folder / "module_010.exr")
    made = tmp_path / "made"
    words = "ao", "--depth", whole, "--positions", whole, "--normals", whole, "--buffers", str(folder)
    more = "--radii", repr(manifest_of(folder)["settings"]["radii"][0]), *LIGHT, "-o", str(made)
    assert main([*words, "--image", whole, *more]) == 0
    assert_same_bits(*layers(folder, "shaded"), *layers(made, "shaded"))
    assert manifest_of(made)["settings"]["light"] == SETTINGS
    capsys.readouterr()
    assert main([*words, *more]) == 2
    assert sentence(capsys) == "--light: it lights --image FILE by --normals FILE, give both"


OF_A_LIGHT = "--ambient and --occlude are of a light: they need --light"


@pytest.mark.parametrize(("words", "said"), [
    (("--ambient", "0.3"), OF_A_LIGHT), (("--occlude", "all"), OF_A_LIGHT),
    (("--light", "0,0,0"), "--light: direction is (0.0, 0.0, 0.0), expected X, Y, Z, a vector of a length from "
                           "1e-15 to 1e+15"),
    (("--light", "1,2"), "--light: '1,2' is not three numbers X,Y,Z, such as 3,2,5 (see lfssao render --help)"),
    (("--light", "1,2,3", "--ambient", "1.5"), "--ambient: 1.5 is not a share from 0 to 1 (see lfssao render --help)"),
])  # fmt: skip
def test_a_wrong_light_is_one_sentence(tmp_path, capsys, words, said):
    render(tmp_path / "out", "corner", *SMALL, *words, code=2)
    assert sentence(capsys) == said
