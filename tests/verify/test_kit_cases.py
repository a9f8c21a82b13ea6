"""The conformance kit: that its specification suffices, that its bits are the same everywhere, and its reader."""

import json
import re
from dataclasses import replace

import kit_digests
import numpy as np
import pytest
from reference import kit as reference
from reference import mapping
from reference.spiral import TURNS

from lfssao.ao.estimators.look_ups import text_options
from lfssao.ao.estimators.registry import ESTIMATORS, find_estimator, of_one_view
from lfssao.samples import METHODS
from lfssao.verify.kit.cases import RECIPES, make_case
from lfssao.verify.kit.folder import read_case, read_index, write_kit
from lfssao.verify.kit.specification import specification
from lfssao.verify.kit.stages import STAGES

DIGESTS = json.loads(kit_digests.PATH.read_text())
# As section 15 of the specification has it.
BOUNDED = ("algorithm1", "algorithm2", "blur", "shade", "light", "frame", "estimator")


# The specification suffices, and the bits are the same on every machine


@pytest.mark.parametrize("name", RECIPES)
def test_an_implementation_of_the_specification_meets_every_bit(kit, name):
    stage, parameters, inputs, outputs = reference.read_case(kit / "cases" / name)
    made = reference.solve(stage, parameters, inputs)
    assert reference.differing(made, outputs) == []
    assert set(outputs) <= set(made)


def test_the_reader_notices_one_wrong_bit(kit):
    stage, parameters, inputs, outputs = reference.read_case(kit / "cases" / "blur_row")
    made = reference.solve(stage, parameters, inputs)
    made["blurred"][0, 3] = np.nextafter(made["blurred"][0, 3], np.float32(1))
    assert reference.differing(made, outputs) == ["blurred"]


def test_digests_are_those_of_every_machine(kit):
    """Cases of samplers and estimators come from registries; one that is new there has no digest yet."""
    index = {entry["name"]: entry["sha256"] for entry in read_index(kit)}
    assert {name: index[name] for name in DIGESTS} == DIGESTS
    assert all(name.startswith(("table_", "estimator_")) for name in set(index) - set(DIGESTS))


def test_a_digest_changes_with_one_bit_of_an_array(tmp_path):
    case = make_case("shade")
    other = {"shaded": np.nextafter(case.outputs["shaded"], np.float32(9))}
    for name, made in (("one", case), ("two", replace(case, outputs=other))):
        write_kit(tmp_path / name, [made])
    one, two = (read_index(tmp_path / name)[0]["sha256"] for name in ("one", "two"))
    assert one != two


def worked_lines(kit, j, i, s):
    """The numbers of the text's worked example, by the reference: a sample of a texel, and the texel's occlusion."""
    stage, parameters, inputs, _ = reference.read_case(kit / "cases" / "algorithm2_crossed_slits")
    kind, m = reference.mapping_of(parameters)
    point = inputs["positions"][j, i]
    offset = mapping.offsets(parameters["radius"], inputs["samples"])[s]
    affine = mapping.affine_rows(kind, m, point)
    linear = mapping.linear_rows(kind, m, offset)
    a, b, c = sums = [x + y for x, y in zip(affine, linear, strict=True)]
    m_z, z_o, u_0, v_0 = m[12:]
    u, v, z, _ = mapping.to_image(kind, m, sums)
    row = int(v)
    column = int(u)
    made = reference.solve(stage, parameters, inputs)["occlusion"][j, i]
    yield f"(x, y, z) = positions[{j}, {i}] = ({', '.join(map(str, point))})"
    yield f"(ox, oy, oz) = offset[{s}] = ({', '.join(map(str, offset))})"
    for name, row_, total in zip("abc", range(3), sums, strict=True):
        yield f"{name} = A({row_}, x, y, z) + L({row_}, ox, oy, oz) = {affine[row_]!s} + {linear[row_]!s} = {total!s}"
    yield f"u = u_0 + a / (m_z - c) = {u_0!s} + {a!s} / {m_z - c!s} = {u_0!s} + {a / (m_z - c)!s} = {u!s}"
    yield f"v = v_0 + b / (z_o - c) = {v_0!s} + {b!s} / {z_o - c!s} = {v_0!s} + {b / (z_o - c)!s} = {v!s}"
    yield f"depth[trunc(v), trunc(u)] = depth[{row}, {column}] = {inputs['depth'][row, column]!s}"
    yield f"image z = c = {z!s}"
    n = len(inputs["samples"])
    yield f"occlusion[{j}, {i}] = Count / n = {round(made * n)} / {n} = {made!s}"


def test_the_worked_example_is_what_the_reference_computes(kit):
    text = specification()["SPECIFICATION.md"]
    for line in worked_lines(kit, 11, 9, 2):
        assert f"\n    {line}\n" in text


def test_the_texts_table_of_turns_is_the_references():
    text = " ".join(re.findall(r"^ {4}((?:\d+ ?)+)$", specification()["ESTIMATORS.md"], re.MULTILINE))
    assert len(TURNS) == 99
    assert " ".join(map(str, TURNS)) in text


# The cases


def test_every_stage_sampler_and_estimator_has_a_case():
    stages = {recipe.stage for recipe in RECIPES.values()}
    assert stages == set(STAGES)
    assert {f"table_{method}" for method in METHODS["ball"]} <= set(RECIPES)
    assert {f"estimator_{name}" for name in of_one_view() if name != "lf"} <= set(RECIPES)
    for stage in STAGES:
        assert f"| `{stage}` |" in specification()["SPECIFICATION.md"]
    for name in of_one_view():
        assert f"\n### Estimator `{name}`\n" in specification()["ESTIMATORS.md"] or name == "lf"


def test_the_text_has_the_type_of_every_option():
    words = {bool: "true or false", int: "whole number", str: "string"}
    table = specification()["ESTIMATORS.md"].partition("| options | their type |")[2].partition("\n\n")[0]
    rows = [row.strip("| ").split(" | ") for row in table.splitlines()[2:]]
    assert [kind for _, kind in rows] == [*words.values(), "number, binary64"]
    for name, estimator in ESTIMATORS.items():
        for option, default in text_options(estimator).items():
            kinds = [kind for row, kind in rows if re.search(rf"`{option}`( of [a-z` ]*`{name}`|[,;]|$)", row)]
            assert kinds == ([words[type(default)]] if type(default) in words else []), (name, option)


@pytest.mark.parametrize("name", RECIPES)
def test_a_case_is_small_and_its_outputs_lie_within_their_bounds(kit, name):
    case = read_case(kit / "cases" / name)
    arrays = {**case.inputs, **case.outputs}
    assert all(array.size <= 64 * 48 * 3 for array in arrays.values())
    for key, array in arrays.items():
        assert key in ("lines", "x") or not np.isnan(array).any()  # a line that is none is four NaN
        if array.dtype == np.float32:  # shaders flush subnormal numbers
            assert not ((array != 0) & (np.abs(array) < np.finfo(np.float32).tiny)).any()
    cancels = "vo-area" in str(case.parameters.get("estimator")) and case.parameters["mapping"]["kind"] == "matrix"
    assert bool(case.bounds) == (case.stage in BOUNDED and not cancels)
    for output, bounds in case.bounds.items():
        lower = bounds.lower
        upper = bounds.upper
        made = case.outputs[output]
        assert lower.dtype == upper.dtype == made.dtype
        assert ((lower <= made) & (made <= upper)).all()
        assert np.isfinite(lower).all()
        assert np.isfinite(upper).all()


@pytest.mark.parametrize("name", [name for name in RECIPES if name.startswith("estimator_")])
def test_an_option_that_is_changed_shows_in_its_case(kit, name):
    case = read_case(kit / "cases" / name)
    options = text_options(find_estimator(case.parameters["estimator"]))
    plain = STAGES["estimator"]({**case.parameters, "options": options}, case.inputs)["occlusion"]
    assert (plain != case.outputs["occlusion"]).any() == (case.parameters["options"] != options)


@pytest.mark.parametrize(("name", "singular"), [
    ("behind_lens_and_observers", [1]), ("conical_beyond", [1, 2]), ("convex_missed", [2, 3]), ("folded", [4]),
    ("algorithm2_concave", [3]), ("outside", [5]), ("behind_homography", [4]), ("behind_camera", [1]),
])  # fmt: skip
def test_singular_cases_have_their_singularity(name, singular):
    """By the numbers of samples in the texture, of status 1, 2, 3, 4, and outside the texture."""
    case = make_case(name)
    statuses = reference.solve(case.stage, case.parameters, case.inputs)["statuses"]
    assert statuses[0] > 50
    assert all(statuses[k] > 50 for k in singular)


@pytest.mark.parametrize(("name", "statuses"), [
    ("crossed_slits", [0, 1]), ("conical", [0, 1, 2]), ("grazed", [0, 2, 3]), ("folded", [0, 1, 2, 4]),
    ("horizon", [0, 1, 2, 4]), ("camera", [0, 1]), ("observers_missed", [0, 2, 3]), ("observers_first", [0, 1, 2, 3]),
])  # fmt: skip
def test_cases_of_borders_have_points_on_both_sides(name, statuses):
    case = make_case(f"border_{name}")
    assert sorted(set(case.outputs["answers"].tolist())) == statuses
    assert np.isfinite(case.outputs["image"]).all()


def test_an_infinite_far_plane_is_null_and_depths_of_it_stand_for_no_distance():
    case = make_case("passes_sao_infinite_far_plane")
    assert case.parameters["view"]["lens"][5] is None
    depth = case.inputs["depth"]
    occlusion = case.outputs["occlusion"]
    assert (depth[np.isfinite(depth)] >= 1).sum() > 10
    assert not occlusion[depth >= 1].any()
    assert len(np.unique(occlusion[depth < 1])) > 20


def test_samples_of_the_case_ties_lie_on_borders_and_at_the_surfaces_depth():
    case = make_case("ties")
    table = case.outputs["offsets"]
    depth = case.inputs["depth"]
    height, width = depth.shape
    on_border = ties = 0
    for place in case.inputs["positions"].reshape(-1, 3):
        for u, v, z in place + table:
            if 0 <= u < width and 0 <= v < height:
                on_border += u == int(u)
                ties += depth[int(v), int(u)] == z
    assert on_border > 200
    assert ties > 50
    assert 0 < case.outputs["occlusion"].mean() < 1
