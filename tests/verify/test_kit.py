"""The conformance kit: that its specification suffices, that its bits are the same everywhere, and its reader."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import kit_digests
import numpy as np
import pytest
from reference import kit as reference

from lfssao.ao.estimators.registry import ESTIMATORS, find_estimator
from lfssao.cli.main import main
from lfssao.errors import InputError
from lfssao.rendering.exr import read_exr
from lfssao.samples import METHODS
from lfssao.testing import assert_conforms
from lfssao.verify.case import Case
from lfssao.verify.kit.cases import RECIPES, case_names, make_case
from lfssao.verify.kit.folder import read_case, read_index, read_kit, write_kit
from lfssao.verify.kit.specification import specification
from lfssao.verify.kit.stages import STAGES

TESTS = Path(__file__).parents[1]
DIGESTS = json.loads(kit_digests.PATH.read_text())
# As section 15 of the specification has it.
BOUNDED = ("algorithm1", "algorithm2", "blur", "shade", "frame")
BOUNDED_ESTIMATORS = ("point", "hemisphere", "vo-points", "vo-points-normal")
FEW = ("algorithm2_conical", "blur_usual", "frame", "samples_latin")


@pytest.fixture(scope="module")
def kit(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / "kit"
    assert main(["kit", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    folder = tmp_path_factory.mktemp("few") / "kit"
    write_kit(folder, map(make_case, FEW), "text")
    return folder


@pytest.fixture
def small_kit(few, tmp_path):
    """A kit of a few cases that a test may change."""
    return shutil.copytree(few, tmp_path / "kit")


# The specification suffices, and the bits are the same on every machine


@pytest.mark.parametrize("name", case_names())
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
        write_kit(tmp_path / name, [made], "")
    one, two = (read_index(tmp_path / name)[0]["sha256"] for name in ("one", "two"))
    assert one != two


# The cases


def test_every_stage_sampler_and_estimator_has_a_case():
    stages = {recipe.stage for recipe in RECIPES.values()}
    assert stages == set(STAGES)
    assert {f"table_{method}" for method in METHODS["ball"]} <= set(RECIPES)
    assert {f"estimator_{name}" for name in ESTIMATORS if name != "lf"} <= set(RECIPES)
    text = specification()
    for stage in STAGES:
        assert f"| `{stage}` |" in text
    for name in ESTIMATORS:
        assert f"\n### Estimator `{name}`\n" in text or name == "lf"


@pytest.mark.parametrize("name", case_names())
def test_a_case_is_small_and_its_outputs_lie_within_their_bounds(kit, name):
    case = read_case(kit / "cases" / name)
    arrays = {**case.inputs, **case.outputs}
    assert all(array.size <= 64 * 48 * 3 for array in arrays.values())
    for key, array in arrays.items():
        assert key == "lines" or not np.isnan(array).any()  # a line that is none is four NaN
        if array.dtype == np.float32:  # shaders flush subnormal numbers
            assert not ((array != 0) & (np.abs(array) < np.finfo(np.float32).tiny)).any()
    bounded = case.stage in BOUNDED or case.parameters.get("estimator") in BOUNDED_ESTIMATORS
    assert bool(case.bounds) == bounded
    for output, bounds in case.bounds.items():
        lower, upper, made = bounds.lower, bounds.upper, case.outputs[output]
        assert lower.dtype == upper.dtype == made.dtype
        assert ((lower <= made) & (made <= upper)).all()
        assert np.isfinite(lower).all()
        assert np.isfinite(upper).all()


@pytest.mark.parametrize("name", [name for name in case_names() if name.startswith("estimator_")])
def test_an_option_that_is_changed_shows_in_its_case(kit, name):
    case = read_case(kit / "cases" / name)
    options = dict(find_estimator(case.parameters["estimator"]).parameters)
    plain = STAGES["estimator"]({**case.parameters, "options": options}, case.inputs)["occlusion"]
    assert (plain != case.outputs["occlusion"]).any() == (case.parameters["options"] != options)


def statuses_of(name):
    """Numbers of samples of an AO case: in the texture, of status 1, 2, 3, 4, outside the texture."""
    case = make_case(name)
    return reference.solve(case.stage, case.parameters, case.inputs)["statuses"]


@pytest.mark.parametrize(
    ("name", "singular"),
    [("behind_lens_and_observers", [1]), ("conical_beyond", [1, 2]), ("convex_missed", [2, 3]), ("folded", [4]),
     ("algorithm2_concave", [3]), ("outside", [5]), ("behind_homography", [4]), ("behind_camera", [1])],
)  # fmt: skip
def test_singular_cases_have_their_singularity(name, singular):
    statuses = statuses_of(name)
    assert statuses[0] > 50
    assert all(statuses[k] > 50 for k in singular)


@pytest.mark.parametrize(
    ("name", "expected"),
    [("crossed_slits", [0, 1]), ("conical", [0, 1, 2]), ("grazed", [0, 2, 3]), ("folded", [0, 1, 2, 4]),
     ("horizon", [0, 1, 2, 4]), ("camera", [0, 1]), ("observers_missed", [0, 2, 3]), ("observers_first", [0, 1, 2, 3])],
)  # fmt: skip
def test_cases_of_borders_have_points_on_both_sides_of_them(name, expected):
    case = make_case(f"border_{name}")
    assert sorted(set(case.outputs["answers"].tolist())) == expected
    if name in ("crossed_slits", "conical", "folded", "horizon"):
        z_m, z_o = (
            case.parameters["mapping"]["numbers"][k] for k in ((12, 13) if name == "crossed_slits" else (14, 16))
        )
        assert {z_m, z_o} <= set(case.inputs["points"][:, 2].tolist())
    assert np.isfinite(case.outputs["image"]).all()


def side_of(name, numbers, x, y, z):
    """A number that is 0 on the border that a case of borders is of, negative beyond it."""
    if name == "camera":
        return numbers[12] * x + numbers[13] * y + numbers[14] * z + numbers[15]
    assert numbers[:12] == [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]  # physical space is the world
    m_x, _, m_z, y_o, z_o, screen, observers = (lens := numbers[12:])[:7]
    dx, dz = x - m_x, m_z - z
    if name == "horizon":
        s_x, s_y = m_x + dx * m_z / dz, y_o + (y - y_o) * z_o / (z_o - z)
        return lens[14] * s_x + lens[15] * s_y + lens[16]
    if name == "folded":  # texels are 16 a metre from the distortion's centre, 16 of them its unit: 1 = r^2 / 4
        return 4 - (m_x + dx * m_z / dz) ** 2 - (y_o + (y - y_o) * z_o / (z_o - z)) ** 2
    if name == "conical":  # 1 + kappa, made a difference of squares where kappa is negative
        below, above = (y - y_o) * z_o / (z_o - z) + y_o - numbers[13], (y - y_o) * z_o / (z_o - z)
        return below**2 + m_z**2 - (z / z_o) ** 2 * (above**2 + z_o**2) if z > 0 else 1
    if name == "observers_first":  # the line meets the observers' outside the screen's circle
        at = m_x + dx * (m_z - z_o) / dz
        return screen * (at * at + z_o * z_o) - 2 * z_o
    # How far a line through the lens passes the circle's middle by, in radii
    k, low = (screen, 0) if name == "grazed" else (observers, z_o)
    aside = dx * (m_z - low - 1 / k) + dz * m_x
    return 1 - k * k * aside * aside / (dx * dx + dz * dz)


@pytest.mark.parametrize(
    ("name", "on", "beyond"),
    [("grazed", {0}, 3), ("observers_missed", {2, 3}, 2), ("folded", {4}, 4), ("horizon", {4}, 4), ("camera", {1}, 1),
     ("observers_first", set(), 3), ("conical", set(), 1)],
)  # fmt: skip
def test_cases_of_borders_have_points_that_are_on_them_exactly(name, on, beyond):
    """By fractions, of points between observers and lens; a line that touches a circle meets it.

    No point of binary digits is where screen and observers meet, nor is any on the conical diffuser's border. Points
    where the observers' arc is touched are on it or beyond the screen.
    """
    case = make_case(f"border_{name}")
    numbers = [Fraction(n) for n in case.parameters["mapping"]["numbers"]]
    found = {1: set(), 0: set(), -1: set()}
    for point, status in zip(case.inputs["points"].tolist(), case.outputs["answers"].tolist(), strict=True):
        x, y, z = (Fraction(n) for n in point)
        if name == "camera" or numbers[16] < z < numbers[14]:
            side = side_of(name, numbers, x, y, z)
            found[(side > 0) - (side < 0)].add(status)
    assert found[0] == on
    assert found[-1] == {beyond}
    assert 0 in found[1]


def test_an_infinite_far_plane_is_null_and_depths_of_it_stand_for_no_distance():
    case = make_case("passes_sao_infinite_far_plane")
    assert case.parameters["view"]["lens"][5] is None
    depth, occlusion = case.inputs["depth"], case.outputs["occlusion"]
    assert (depth[np.isfinite(depth)] >= 1).sum() > 10
    assert not occlusion[depth >= 1].any()
    assert len(np.unique(occlusion[depth < 1])) > 20


def test_samples_of_the_case_ties_lie_on_borders_and_at_the_surfaces_depth():
    case = make_case("ties")
    table, depth = case.outputs["offsets"], case.inputs["depth"]
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


# Files


def test_a_kit_reads_back(kit):
    cases = list(read_kit(kit))
    assert [case.name for case in cases] == case_names()
    for case in cases[::5]:
        made = make_case(case.name)
        assert_same_case(case, made)
    assert (kit / "SPECIFICATION.md").read_text() == specification()


def assert_same_case(actual, expected):
    assert (actual.stage, actual.title, actual.parameters) == (expected.stage, expected.title, expected.parameters)
    for group in ("inputs", "outputs"):
        pairs = getattr(actual, group), getattr(expected, group)
        assert list(pairs[0]) == list(pairs[1])
        for name, array in pairs[0].items():
            assert (array.dtype, array.shape) == (pairs[1][name].dtype, pairs[1][name].shape)
            assert array.tobytes() == pairs[1][name].tobytes()
    assert set(actual.bounds) == set(expected.bounds)


def test_exr_files_hold_the_same_pixels(kit):
    case = read_case(kit / "cases" / "frame")
    inputs, outputs = (read_exr(kit / "cases" / "frame" / f"{name}.exr") for name in ("inputs", "outputs"))
    assert set(inputs) == {"depth", "positions", "image"}
    assert set(outputs) == set(case.outputs)
    part = inputs["positions"]
    order = [part.channels.index(name) for name in ("P.X", "P.Y", "P.Z")]
    assert part.pixels[..., order].tobytes() == case.inputs["positions"].tobytes()
    assert inputs["depth"].channels == ("Z",)
    assert outputs["ao_2"].channels == ("ao_2.AO",)
    assert outputs["ao_2"].pixels.tobytes() == case.outputs["ao_2"].tobytes()


def test_numpy_reads_the_arrays(kit):
    case = read_case(kit / "cases" / "frame")
    for name, array in {**case.inputs, **case.outputs}.items():
        np.testing.assert_array_equal(np.load(kit / "cases" / "frame" / f"{name}.npy"), array)


def test_json_numbers_read_back_exactly(kit):
    case = make_case("algorithm2_calibrated")
    described = json.loads((kit / "cases" / case.name / "case.json").read_text())["parameters"]
    assert described == case.parameters
    assert all(type(number) is float for number in described["mapping"]["numbers"])


# Writing


def test_a_kit_replaces_a_kit_and_nothing_else(small_kit, tmp_path):
    (small_kit / "stale").write_text("from the earlier kit")
    write_kit(small_kit, [make_case("shade")], "new")
    assert [entry["name"] for entry in read_index(small_kit)] == ["shade"]
    assert not (small_kit / "stale").exists()
    (tmp_path / "mine").mkdir()
    write_kit(tmp_path / "mine", [make_case("shade")], "empty folders are taken")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="is not empty, and what it holds is not a kit"):
        write_kit(tmp_path / "other", [], "")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["kit", "mine", "other"]
    assert (tmp_path / "other" / "thesis.tex").exists()


def test_a_kit_that_fails_leaves_nothing_and_the_earlier_one(small_kit, tmp_path):
    def cases():
        yield make_case("shade")
        raise KeyboardInterrupt

    for folder in (small_kit, tmp_path / "new"):
        with pytest.raises(KeyboardInterrupt):
            write_kit(folder, cases(), "")
    assert [path.name for path in tmp_path.iterdir()] == ["kit"]
    assert [case.name for case in read_kit(small_kit)] == list(FEW)


def test_the_command_refuses_folders_in_one_sentence(capsys, tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").write_text("")
    for folder in ("file", "file/below", "full"):
        assert main(["kit", str(tmp_path / folder)]) == 2
        captured = capsys.readouterr()
        assert captured.out == ""
        assert captured.err.count("\n") == 1
    assert main(["kit"]) == 2


# Reading what is wrong


def test_a_newer_format_is_refused(small_kit):
    for path in (small_kit / "cases" / "frame" / "case.json", small_kit / "kit.json"):
        value = json.loads(path.read_text())
        path.write_text(json.dumps({**value, "format": 2}))
        with pytest.raises(InputError, match="is of format 2, and this version of lfssao reads up to 1"):
            list(read_kit(small_kit))


def test_changed_arrays_are_refused(small_kit):
    path = small_kit / "cases" / "frame" / "depth.npy"
    whole = path.read_bytes()
    for data in (whole[:-4], whole + b"1234", whole[:-1] + b"\7", b"\7" + whole[1:], b"", None):
        path.unlink()
        if data is not None:
            path.write_bytes(data)
        with pytest.raises(InputError, match=re.escape(str(path))):
            read_case(path.parent)
        path.write_bytes(whole)
    assert read_case(path.parent).name == "frame"


BAD_ARRAYS = [
    {"shape": [10**9]}, {"shape": [-1, 18]}, {"shape": [18.0, 22]}, {"shape": [22, 18]}, {"shape": "18"}, {"shape": []},
    {"shape": [2**20] * 4}, {"dtype": "object"}, {"dtype": "float16"}, {"dtype": "float64"}, {"file": "../kit.json"},
    {"file": "/etc/passwd"}, {"file": "nothing.npy"}, {"file": "positions.npy"}, {"file": ""}, {"file": "a\0b"},
    {"sha256": "0"}, {"sha256": None},
]  # fmt: skip


@pytest.mark.parametrize("change", BAD_ARRAYS, ids=str)
def test_wrong_descriptions_of_arrays_are_refused(small_kit, change):
    path = small_kit / "cases" / "frame" / "case.json"
    value = json.loads(path.read_text())
    value["inputs"]["depth"] |= change
    path.write_text(json.dumps(value))
    with pytest.raises(InputError):
        read_case(path.parent)


def test_mutated_json_never_crashes_the_reader(small_kit):
    rng = np.random.default_rng(1)
    sentences = []
    for path in (small_kit / "kit.json", small_kit / "cases" / "blur_usual" / "case.json"):
        whole = path.read_bytes()
        for _ in range(150):
            data = bytearray(whole)
            for place in rng.integers(0, len(data), rng.integers(1, 4)):
                data[place] = rng.choice(list(b'{}[]",:0129-eEtfn\0\xff \\'))
            path.write_bytes(data[: rng.integers(1, len(data))] if rng.random() < 0.2 else data)
            try:
                list(read_kit(small_kit))
            except InputError as error:
                sentences.append(str(error))
        path.write_bytes(whole)
    assert len(sentences) > 150
    assert not any("\n" in sentence for sentence in sentences)
    assert len(list(read_kit(small_kit))) == len(FEW)


# assert_conforms


@pytest.mark.parametrize("name", ["algorithm2_crossed_slits", "frame", "blur_usual", "samples_latin"])
def test_the_expected_outputs_conform(name):
    case = make_case(name)
    main_output = next(iter(case.outputs.values()))
    for strict in (False, True):
        assert_conforms(main_output, name, strict=strict)
        assert_conforms(case.outputs, case, strict=strict)


def test_bounds_admit_what_strict_does_not(small_kit):
    case = read_case(small_kit / "cases" / "blur_usual")
    near = np.nextafter(case.outputs["blurred"], np.float32(1))
    assert_conforms(near, case)
    assert_conforms(near, small_kit / "cases" / "blur_usual")
    with pytest.raises(AssertionError, match="192 of 192 numbers are not the bits of the reference"):
        assert_conforms(near, case, strict=True)
    lower, upper = case.bounds["blurred"].lower, case.bounds["blurred"].upper
    assert_conforms(lower, case)
    assert_conforms(upper, case)
    for beyond in (np.nextafter(lower, np.float32(-1)), np.nextafter(upper, np.float32(2)), near * np.float32(np.nan)):
        with pytest.raises(AssertionError, match=r"192 of 192 numbers are outside the bounds; the first is \[0, 0\]"):
            assert_conforms(beyond, case)


def test_faults_are_named_from_the_first_stage_on():
    case = make_case("frame")
    mine = {name: array.copy() for name, array in case.outputs.items()}
    mine["merged"][3, 4] += np.float32(0.5)
    mine["shaded"][0, 1, 2] = -3
    with pytest.raises(AssertionError) as caught:
        assert_conforms(mine, case)
    first, second = str(caught.value).splitlines()
    assert first.startswith("case frame, output merged: 1 of 192 numbers are outside the bounds; the first is [3, 4]: ")
    assert second.startswith("case frame, output shaded: 1 of 576 numbers")


def test_arrays_that_are_no_output_are_refused():
    case = make_case("merge_three")
    merged = case.outputs["merged"]
    for mine, reason in (
        (merged.astype(np.float64), "float64, expected"), (merged[1:], "expected (12, 16)"),
        ({"blurred": merged}, "no output blurred"), ({}, "output merged is missing"),
    ):  # fmt: skip
        with pytest.raises(AssertionError, match=re.escape(reason)):
            assert_conforms(mine, case)
    with pytest.raises(InputError, match="there is no case 'merge_two'"):
        assert_conforms(merged, "merge_two")


def test_zeros_of_both_signs_differ_under_strict():
    zeros = np.zeros((2, 2), np.float32)
    case = Case("zeros", "merge", "", {}, {}, {"merged": zeros})
    assert_conforms(zeros, case)
    with pytest.raises(AssertionError, match="4 of 4 numbers are not the bits"):
        assert_conforms(-zeros, case)


# The plugin

USER_TESTS = """
import numpy as np
import pytest
from lfssao.testing import assert_conforms

@pytest.mark.lfssao_stages("merge")
def test_merge(lfssao_case):
    assert_conforms(lfssao_case.inputs["layers"].max(axis=0), lfssao_case)

@pytest.mark.lfssao_stages("shade", "blur")
def test_shade(lfssao_case):
    assert_conforms(np.zeros_like(next(iter(lfssao_case.outputs.values()))), lfssao_case)
"""


def run_pytest(folder, *options):
    env = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONPATH": str(TESTS.parent)}
    command = [sys.executable, "-m", "pytest", "-q", "--no-header", "-p", "lfssao.verify.testing.plugin", *options]
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, check=False)


def test_the_fixture_runs_a_test_for_each_case_of_its_stages(kit, tmp_path):
    (tmp_path / "test_mine.py").write_text(USER_TESTS)
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = --strict-markers\nfilterwarnings = error\n")
    done = run_pytest(tmp_path, "--lfssao-kit", str(kit))
    assert "7 failed, 2 passed" in done.stdout, done.stdout + done.stderr
    assert "case blur_row, output blurred: 9 of 9 numbers are outside the bounds" in done.stdout


def test_the_plugin_alone_loads_nothing_heavy(tmp_path):
    (tmp_path / "test_mine.py").write_text(
        "import sys\ndef test_nothing():\n"
        "    heavy = {'numpy', 'numba', 'OpenImageIO', 'hypothesis', 'lfssao.verify.kit'} & set(sys.modules)\n"
        "    assert 'lfssao.verify.testing.plugin' in sys.modules and not heavy, heavy\n"
    )
    done = run_pytest(tmp_path)
    assert done.returncode == 0, done.stdout


def test_the_plugin_is_declared():
    assert '[project.entry-points.pytest11]\nlfssao = "lfssao.verify.testing.plugin"\n' in (
        TESTS.parent / "pyproject.toml"
    ).read_text(encoding="utf-8")
