"""The background, where there is no surface, is judged and named apart, first."""

import json

import numpy as np
import pytest
from compare_folders import changed, compare, remade, single

import lfssao
from lfssao.verify.compare.background import background_values
from lfssao.verify.verdict import Verdict

MODULE = "module_004"
SKY = [1e10, 0.0, 65504.0]


def with_sky(reference, target, value, layers=("depth",), more=lambda pixels: pixels):
    """A copy in which layers have a value where the reference sees no surface."""
    empty = ~np.isfinite(single(reference, MODULE, "depth"))

    def change(parts):
        for layer in layers:
            remade(layer, lambda pixels: np.where(empty, value, more(pixels)).astype(np.float32))(parts)

    return changed(reference, target, MODULE, change)


def halved(first, second):
    """Values of the left and the right half of a module's textures, (1, 48, 1)."""
    return np.where(np.arange(48) < 24, first, second)[None, :, None]


def result_of(report, layer="depth"):
    (found,) = [r for r in report.results if (r.module, r.layer) == (MODULE, layer)]
    return found


@pytest.mark.parametrize("value", SKY)
def test_a_background_is_named_with_the_option_that_accepts_it(reference, tmp_path, value, capsys):
    mine = with_sky(reference, tmp_path / "mine", value)
    report = lfssao.compare(mine, reference)
    found = result_of(report)
    words = f"background is {value:g} in place of infinity"
    empty = np.count_nonzero(~np.isfinite(single(reference, MODULE, "depth")))
    assert (found.verdict, found.outside) == (Verdict.OUTSIDE, empty)
    assert (
        found.diagnosis.words(MODULE)
        == f"{words} in {MODULE}, whose surface is right; compare again with --background {value:g}"
    )
    assert [cause.kind for cause in report.causes] == ["background"]
    wrong = [r for r in report.results if r.verdict.code > 1]
    assert wrong == [found]  # later stages are judged without it
    assert compare(mine, reference) == 2
    assert words in capsys.readouterr().out
    assert compare(mine, reference, "--background", str(value)) == 0


@pytest.mark.parametrize("value", [np.finfo("f4").max, 1 / 3, -1e10])
def test_the_option_that_is_advised_accepts_the_background(reference, tmp_path, value):
    mine = with_sky(reference, tmp_path / "mine", value)
    found = result_of(lfssao.compare(mine, reference, layers=["depth"])).diagnosis
    advised = found.words(MODULE).partition("; compare again with ")[2]
    assert compare(mine, reference, *advised.split()) == 0


def test_a_wrong_surface_is_explained_beside_its_background(reference, tmp_path):
    mine = with_sky(reference, tmp_path / "mine", 1e10, more=lambda pixels: pixels + np.float32(0.05))
    found = result_of(lfssao.compare(mine, reference, layers=["depth"])).diagnosis
    assert (found.fits, found.candidates[0].kind) == (True, "depth bias")
    assert found.words(MODULE).startswith(
        "background is 1e+10 in place of infinity; compare again with --background 1e+10; depth + 0.05"
    )
    accepted = result_of(lfssao.compare(mine, reference, layers=["depth"], background=1e10)).diagnosis
    assert accepted.words(MODULE).startswith("depth + 0.05")


def test_positions_and_depth_have_one_background(reference, tmp_path):
    mine = with_sky(reference, tmp_path / "mine", 0.0, ("depth", "positions"))
    report = lfssao.compare(mine, reference)
    (cause,) = report.causes
    assert (
        cause.words
        == f"background is 0 in place of infinity in depth and positions of {MODULE}; compare again with --background 0"
    )
    assert json.loads(json.dumps(report.as_dict()))["causes"][0]["layers"] == ["depth", "positions"]
    assert lfssao.compare(mine, reference, background=0).exit_code == 0


def test_a_background_of_occlusion_is_named(reference, tmp_path):
    mine = with_sky(reference, tmp_path / "mine", 1.0, ("ao_2",))
    found = result_of(lfssao.compare(mine, reference), "ao_2")
    assert found.diagnosis.words(MODULE) == f"background is 1 in place of 0 in {MODULE}, whose surface is right"


@pytest.mark.parametrize(("value", "text", "advice"), [
    (np.nan, "NaN", ""), (1.0, "1", "; compare again with --background 1"),
])  # fmt: skip
def test_backgrounds_are_told_by_what_they_stand_for_and_nan_without_an_option(
    reference, tmp_path, value, text, advice
):
    mine = with_sky(reference, tmp_path / "mine", value, ("depth", "positions", "ao_1"))
    report = lfssao.compare(mine, reference)
    words = [cause.words for cause in report.causes]
    assert words == [f"background is {text} in place of infinity in depth and positions of {MODULE}{advice}",
                     f"background is {text} in place of 0 in ao_1 of {MODULE}"]  # fmt: skip
    assert [r.layer for r in report.results if r.verdict.code > 1] == ["depth", "positions", "ao_1"]


def test_two_backgrounds_of_a_texture_are_named_with_their_numbers_of_texels(reference, tmp_path):
    mine = with_sky(reference, tmp_path / "mine", halved(65504, 0))
    report = lfssao.compare(mine, reference)
    left, right = (np.count_nonzero(np.isinf(half)) for half in np.hsplit(single(reference, MODULE, "depth"), 2))
    words = f"background is 0 on {right} texels and 65504 on {left} in place of infinity in depth of {MODULE}"
    assert [cause.words for cause in report.causes] == [words]
    assert [(found.layer, found.outside) for found in report.results if found.outside] == [("depth", left + right)]


def test_two_backgrounds_of_several_modules_are_told_once(reference, tmp_path):
    mine = with_sky(reference, tmp_path / "mine", halved(65504, 0))
    empty = np.isinf(single(reference, "module_005", "depth"))
    other = remade("depth", lambda pixels: np.where(empty, halved(0, 65504), pixels).astype(np.float32))
    (cause,) = lfssao.compare(changed(mine, tmp_path / "both", "module_005", other), reference).causes
    assert cause.words == "background is 0 and 65504 in place of infinity in depth of 2 modules"


def test_a_background_beside_the_right_one_is_named_and_accepted(reference, tmp_path):
    mine = with_sky(reference, tmp_path / "mine", halved(np.inf, 0))
    (cause,) = lfssao.compare(mine, reference).causes
    words = f"background is 0 in place of infinity in depth of {MODULE}"
    assert cause.words == f"{words}; compare again with --background 0"
    assert compare(mine, reference, "--background", "0") == 0
    twice = with_sky(reference, tmp_path / "twice", halved(65504, 0))
    (cause,) = lfssao.compare(twice, reference, background=0).causes
    assert cause.words.startswith(words.replace(" 0 ", " 65504 "))


@pytest.mark.parametrize(("name", "values"), [
    ("depth", {np.inf: 90, 2.5: 10}),  # which the surface has, too: the wall is seen from elsewhere
    ("depth", {np.inf: 97, 3.0: 3}),  # silhouettes
    ("depth", {1e10: 96, 3.0: 4}),
    ("depth", {1e10: 40, 0.0: 30, 7.0: 20, 8.0: 10}),
    ("ao_1", {0.0: 50, 1.0: 50}),  # occlusion of a surface that the reference does not see
])  # fmt: skip
def test_values_that_may_be_of_a_surface_are_no_background(name, values):
    depth = np.float32([[2.5] * 100, [np.inf] * 100])
    mine = np.float32([[2.5] * 100, np.repeat(list(values), list(values.values()))])
    assert background_values(name, mine, depth) == {}


def test_nan_is_no_background_that_is_accepted(reference):
    with pytest.raises(lfssao.InputError, match="background is NaN"):
        lfssao.compare(reference, reference, background=float("nan"))
