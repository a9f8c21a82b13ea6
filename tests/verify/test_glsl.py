"""The oracle against another renderer: compute shaders written from the kit's specification, on any driver.

Inside the bounds on any driver; equal bits on Mesa's llvmpipe, whose operations are rounded as IEEE 754 has it.
"""

import re

import glsl_renderer
import numpy as np
import pytest
from glsl_renderer import without_opengl
from jobs import manifest_of, render
from reference.kit import read_case as read_arrays
from reference.kit import solve as solve_by_text

from lfssao.cli.main import main
from lfssao.files.exr import read_exr
from lfssao.testing import assert_conforms
from lfssao.verify.kit.cases import RECIPES, make_case
from lfssao.verify.kit.folder import read_case, write_kit

pytestmark = pytest.mark.slow
CASES = [recipe.name for recipe in RECIPES.values() if recipe.stage in glsl_renderer.STAGES]


@pytest.fixture(scope="module")
def renderer(context):
    return glsl_renderer.Renderer(context)


@pytest.fixture(scope="module")
def kit(tmp_path_factory):
    folder = tmp_path_factory.mktemp("glsl") / "kit"
    write_kit(folder, map(make_case, CASES))
    return folder / "cases"


def solve(renderer, folder):
    """A case of a kit, read and solved without lfssao."""
    stage, parameters, inputs, _ = read_arrays(folder)
    return renderer.solve(stage, parameters, inputs)


@pytest.mark.parametrize("name", CASES)
def test_the_shaders_conform(context, renderer, kit, name):
    case = read_case(kit / name)
    made = solve(renderer, kit / name)
    main = next(iter(case.outputs))
    assert_conforms(made[main], case)
    if "llvmpipe" in context.info["GL_RENDERER"]:
        assert set(case.outputs) <= set(made)
        assert_conforms({output: made[output] for output in case.outputs}, case, strict=True)


# Whole frames, judged by the command


JOBS = {
    "display": ("statue", "--display", "sample-a", "--modules", "3:5"),
    "turned samples": ("statue", "--display", "sample-a", "--modules", "3:5", "--rotate", "hash", "--seed", "5"),
    "curved display with a guard band": ("ammonite", "--display", "convex", "--modules", "20:21", "--guard", "4"),
    "camera": ("statue", "--camera"),
}


def render_frame(renderer, view, settings, parts):
    """All layers of one view from its G-buffer, by the numbers of the manifest."""
    numbers = view["world_to_image"]
    parameters = {
        "radii": settings["radii"], "sigma": settings["blur_sigma"], "guard": view["guard"],
        "mapping": {"kind": view["world_to_image_kind"], "numbers": numbers},
    }  # fmt: skip
    if view["screen_to_world"] is not None:
        parameters |= {"screen_to_world": view["screen_to_world"], "world_to_screen": numbers}
    depth, positions, color = (parts[layer].pixels for layer in ("depth", "positions", "color"))
    inputs = {
        "depth": depth[..., 0], "positions": positions, "image": color, "samples": np.array(settings["samples"])
    }  # fmt: skip
    if settings["rotation"] == "hash":
        size = {"height": view["height"], "width": view["width"]}
        words = {"rotation": "hash", **size, "seed": settings["rotation_seed"]}
        inputs["turns"] = solve_by_text("turns", words, {})["turns"]
    return {"depth": depth, "positions": positions, "color": color, **renderer.frame(parameters, inputs)}


@pytest.mark.parametrize("job", JOBS)
def test_the_command_finds_whole_frames_right(context, renderer, tmp_path, job):
    reference = tmp_path / "reference"
    mine = tmp_path / "mine"
    render(reference, *JOBS[job], "--resolution", "48x36", "--radii", "2%,5%", "--blur", "1.5")
    manifest = manifest_of(reference)
    mine.mkdir()
    for entry in manifest["views"]:
        parts = read_exr(reference / f"{entry['name']}.exr")
        for layer, texture in render_frame(renderer, entry["view"], manifest["settings"], parts).items():
            np.save(mine / f"{entry['name']}_{layer}.npy", texture)
    assert main(["compare", str(mine), str(reference)]) == 0
    if "llvmpipe" in context.info["GL_RENDERER"]:
        assert main(["compare", str(mine), str(reference), "--exact"]) == 0
    name = next(mine.glob("*_merged.npy"))
    np.save(name, np.load(name)[::-1])
    assert main(["compare", str(mine), str(reference)]) == 2


class Changed(glsl_renderer.Renderer):
    """The renderer with other words in its shaders."""

    def __init__(self, context, pattern, replacement):
        self.change, self.changes = (pattern, replacement), 0
        super().__init__(context)
        assert self.changes, f"nothing in a shader is like {pattern}"

    def source(self, path):
        text, count = re.subn(*self.change, super().source(path))
        self.changes += count
        return text


ROW = r"\(m\[4 \* row\] \* x \+ m\[4 \* row \+ 1\] \* y\) \+ m\[4 \* row \+ 2\] \* z"
LEGAL = {
    "fused and reordered at the compiler's will": (r"\bprecise\b", ""),
    "a product and a sum fused": (ROW, "fma(m[4 * row + 2], z, fma(m[4 * row + 1], y, m[4 * row] * x))"),
    "a sum in another order": (ROW, "m[4 * row] * x + (m[4 * row + 1] * y + m[4 * row + 2] * z)"),
    "the offset turned first": (r"turned_row\(row, x, y, z, (.*?), (.*?)\) :",
                                r"linear_row(row, x * \1 - y * \2, x * \2 + y * \1, z) :"),
    "a quotient by the reciprocal": (r"sums\.x / \(m\[12\] - sums\.z\)", "sums.x * (1.0 / (m[12] - sums.z))"),
    "the fraction by the reciprocal": (r"float\(count\) / float\(samples\)", "float(count) * (1.0 / float(samples))"),
    "a light and its AO multiplied out": (r"ambient \* visible \+ direct",
                                          "ambient - ambient * occlusion[k / 3] + direct"),
    "a light mixed": (r"\(ambient \+ direct\) \* visible", "mix(max(d, 0.0), 1.0, ambient) * visible"),
    "image - image ao": (r"image\[k\] \* visible", "image[k] - image[k] * occlusion[k / 3]"),
}  # fmt: skip


@pytest.mark.parametrize("change", LEGAL)
def test_what_a_shading_language_may_do_stays_inside_the_bounds(context, kit, change):
    renderer = Changed(context, *LEGAL[change])
    for name in CASES:
        case = read_case(kit / name)
        if case.bounds:
            assert_conforms(solve(renderer, kit / name)[next(iter(case.outputs))], case)


WRONG = {
    "rows and columns exchanged": (r"int\(image\.y\) \* size\.x \+ int\(image\.x\)",
                                   "int(image.x) * size.x + int(image.y)", "algorithm2_crossed_slits"),
    "turned the other way": (r"\+ s \* \(m\[4 \* row \+ 1\] \* x - m\[4 \* row\] \* y\)",
                             "- s * (m[4 * row + 1] * x - m[4 * row] * y)", "turned_algorithm2"),
    "not turned": (r"turns\[texel\], turns\[size\.x \* size\.y \+ texel\]", "1.0, 0.0", "turned_algorithm1"),
    "half a texel": (r"int\(image\.x\)", "int(image.x + 0.5)", "algorithm2_crossed_slits"),
    "v flipped": (r"int\(image\.y\) \*", "(size.y - 1 - int(image.y)) *", "algorithm2_crossed_slits"),
    "corners for centres": (r"float\(place\.x\) \+ 0\.5", "float(place.x)", "algorithm1_perspective"),
    "the last sample left out": (r"s < samples; \+\+s", "s < samples - 1; ++s", "algorithm2_crossed_slits"),
    "behind for before": (r"< image\.z\)", "> image.z)", "algorithm2_crossed_slits"),
    "clamped where outside": (r"image\.x >= 0\.0 && ", "", "outside"),
    "statuses not looked at": (r"there = there && ", "there = ", "behind_lens_and_observers"),
    "no distortion": (r"k1 != 0\.0 \|\| k2 != 0\.0", "false", "algorithm2_calibrated"),
    "k2 for r^2": (r"k1 \+ r \* k2", "k1 + k2", "algorithm2_calibrated"),
    "the linear diffuser for the conical": (r"number\(7\) == 0\.0", "true", "algorithm2_conical"),
    "the screen not projected": (r"s\.z != 0\.0", "false", "algorithm2_convex"),
    "the near root": (r"b \+ root", "b - root", "algorithm2_convex"),
    "the observers' line for their arc": (r"crossing\(number\(6\)", "crossing(0.0", "algorithm2_concave"),
    "the sum for the maximum": (r"largest = max\(largest, (.*)\);", r"largest += \1;", "merge_three"),
    "the first layer left out": (r"largest = layers\[texel\]", "largest = 0.0", "merge_one"),
    "a border of zeros": (r"clamp\(place \+ direction \* \(tap - reach\), ivec2\(0\), size - 1\)",
                          "place + direction * (tap - reach); if (any(lessThan(from, ivec2(0)))) continue; "
                          "from = min(from, size - 1)", "blur_usual"),
    "a tap left out": (r"tap <= 2 \* reach", "tap < 2 * reach", "blur_usual"),
    "visibility for occlusion": (r"1\.0 - occlusion", "occlusion", "shade"),
    "lit from both sides": (r"d < 0\.0 \? 0\.0 : d", "abs(d)", "light_ambient"),
    "AO on all for on the ambient term": (r"on_all \?", "!on_all ?", "light_ambient"),
}  # fmt: skip


@pytest.mark.parametrize("bug", WRONG)
def test_a_wrong_shader_is_found_by_the_bounds(context, kit, bug):
    *change, name = WRONG[bug]
    case = read_case(kit / name)
    made = solve(Changed(context, *change), kit / name)[next(iter(case.outputs))]
    with pytest.raises(AssertionError, match=f"case {name}, output"):
        assert_conforms(made, case)


def test_a_tie_is_found_by_the_bits(context, kit):
    """<= for <: rounding may turn one into the other, so the bounds admit both; strict does not."""
    made = solve(Changed(context, r"\] < image\.z\)", "] <= image.z)"), kit / "ties")["occlusion"]
    case = read_case(kit / "ties")
    assert_conforms(made, case)
    with pytest.raises(AssertionError, match="are not the bits of the reference"):
        assert_conforms(made, case, strict=True)


def test_a_missing_context_skips_here_and_fails_under_ci(monkeypatch):
    monkeypatch.delenv("CI", raising=False)
    with pytest.raises(pytest.skip.Exception, match=r"no OpenGL 4\.3 context by EGL: no driver"):
        without_opengl("no driver")
    monkeypatch.setenv("CI", "true")
    with pytest.raises(pytest.fail.Exception, match="no driver"):
        without_opengl("no driver")
