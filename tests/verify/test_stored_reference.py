"""Worst texels of stored textures: the reference is shown as it would be read, inside its own interval."""

import json
import re

import numpy as np
import pytest
from compare_folders import compare, with_a_wrong_code

from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.bounds.error_model import MODELS
from lfssao.verify.bounds.stored import TextureFormat
from lfssao.verify.compare.layers import Layer
from lfssao.verify.compare.result import Tolerance, result_of
from lfssao.verify.verdict import Judgement, Verdict

NUMBER = r"([-+.\de]+|inf|nan)"
SHOWN = re.compile(
    rf"\(\d+, 0\) {NUMBER}, reference {NUMBER}(?: \({NUMBER} before it is stored\))?"
    rf", interval {NUMBER} to {NUMBER}: why"
)
# Greatest step of each format between 0 and 1: how far the reference may be from what is read of it, twice.
STEPS = {"half": 2.0**-11, "unorm8": 1 / 255, "unorm16": 1 / 65535, "srgb8": 2.4 / 1.055 / 255}


@pytest.mark.parametrize(("format", "largest"), [("unorm8", 255), ("unorm16", 65535), ("half", None), ("float", None)])
def test_depth_was_at_most_half_a_step_from_what_is_read_and_may_have_been_as_far(format, largest):
    codes = np.arange(1, 255)
    dtype = {"half": np.float16, "float": np.float32}.get(format)
    steps = 1 + codes * 2.0**-10 if largest is None else codes / largest
    following = np.nextafter(steps.astype(dtype), dtype(9)).astype(np.float64) if dtype else (codes + 1) / largest
    found = TextureFormat(format, depth=True).half_steps(steps.astype(np.float32))
    np.testing.assert_allclose(found, (following - steps) / 2, rtol=1e-6)


@pytest.mark.parametrize("model", ["shader", "strict"])
@pytest.mark.parametrize("visibility", [False, True])
@pytest.mark.parametrize("format", ["float", *STEPS])
def test_the_reference_is_printed_inside_its_interval(format, visibility, model):
    """Ten random values a texture, each with the interval of itself or of up to a thousandth around it."""
    random = np.random.default_rng(11)
    stored = TextureFormat(format, visibility)
    changed_numbers = 0
    for width in np.repeat([0, 1e-9, 1e-3], 40):
        right = random.uniform(0, 1, (1, 10)).astype(np.float32)
        right[0, :2] = 0, 1
        lower, upper = (right + side * width * random.random(right.shape) for side in (-1, 1))
        ends = np.float32(lower), np.maximum(np.float32(upper), right)
        bounds = stored.bounds(Bounds(np.minimum(ends[0], right), ends[1]), MODELS[model])
        mine = Layer("ao_1", ("Y",), (np.full_like(right, 9),), None, stored)
        judged = Judgement(Verdict.OUTSIDE, "", right != 9, right != 9, bounds)
        reference = Layer("ao_1", ("Y",), (right,), None)
        worst = result_of("module_000", mine, reference, judged, Tolerance(), lambda _: "why").worst
        assert len(worst) == 10
        for texel in worst:
            own, shown, before, low, high = SHOWN.fullmatch(str(texel)).groups()
            assert float(own) == 9
            assert float(low) <= float(shown) <= float(high)
            known = right[0, texel.column]
            assert np.float32(float(before or shown)) == known
            assert abs(float(shown) - known) <= STEPS.get(format, 2.0**-24) / 2 + 2.0**-24
            changed_numbers += before is not None
    assert (changed_numbers > 300) == ((format, visibility) != ("float", False))  # of 1,200


def test_a_reference_that_is_not_stored_is_shown_as_it_is():
    right = np.float32([[0.1, 0.2]])
    sides = (Layer("ao_1", ("Y",), (texture,), None) for texture in (right + 1, right))
    judged = Judgement(Verdict.OUTSIDE, "", right > 0, right > 0, Bounds(right, right))
    for texel in result_of("module_000", *sides, judged, Tolerance(), str).worst:
        assert (texel.reference, texel.before) == ((right[0, texel.column],), None)
        assert "stored" not in str(texel)


def test_text_and_json_show_the_reference_as_it_is_read(tmp_path, capsys, reference):
    mine, (column, row), right, code = with_a_wrong_code(reference, tmp_path / "mine")
    assert compare(mine, reference, "--no-diagnosis", "--json", tmp_path / "a.json") == 2
    own, read = (np.float32(number / 255).item() for number in (code + 10, code))
    words = f"  ({column}, {row}) {own:.9g}, reference {read:.9g} ({right:.9g} before it is stored), interval "
    assert words in capsys.readouterr().out
    made = json.loads((tmp_path / "a.json").read_text())
    (told,) = (r["worst"][0] for r in made["results"] if (r["layer"], r["outside"]) == ("merged", 1))
    assert (told["reference"], told["before"]) == ([read], [right])
    assert told["lower"][0] <= read <= told["upper"][0]
