"""``assert_conforms`` and the pytest plugin of the kit."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lfssao.errors import InputError
from lfssao.testing import assert_conforms
from lfssao.verify.case import Case
from lfssao.verify.kit.cases import make_case
from lfssao.verify.kit.folder import read_case

TESTS = Path(__file__).parents[1]


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
    lower = case.bounds["blurred"].lower
    upper = case.bounds["blurred"].upper
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


USER_TESTS = """
import numpy as np
import pytest
from PIL import Image
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
    assert "9 failed, 2 passed" in done.stdout, done.stdout + done.stderr
    assert "case blur_row, output blurred: 9 of 9 numbers are outside the bounds" in done.stdout


def test_a_failure_has_a_picture_and_the_end_a_summary_by_stage(few, tmp_path):
    (tmp_path / "test_mine.py").write_text(
        "import pytest\nfrom lfssao.testing import assert_conforms\n"
        "@pytest.mark.lfssao_stages('blur', 'algorithm2')\n"
        "def test_mine(lfssao_case):\n"
        "    (name, right), *_ = lfssao_case.outputs.items()\n"
        "    own = right.copy()\n"
        "    own[2:5, 3:6] += lfssao_case.stage == 'blur'\n"
        "    assert_conforms(own, lfssao_case)\n"
    )
    done = run_pytest(tmp_path, "--lfssao-kit", str(few), "--basetemp", str(tmp_path / "made"))
    assert re.search(r"algorithm2: 1 of 1\nblur: 0 of 1\n", done.stdout), done.stdout + done.stderr
    (path,) = (tmp_path / "made").rglob("blur_usual.png")
    assert str(path) in done.stdout
    with Image.open(path) as picture:
        own, right, outside = np.split(np.asarray(picture.convert("RGB")), [360, 728], axis=1)[0:3]
    shape = make_case("blur_usual").outputs["blurred"].shape
    scale = 360 / max(shape)
    row = round(3.5 * scale)
    column = round(4.5 * scale)
    assert outside[row, 8 + column].tolist() == [255, 255, 255]
    assert outside[-2, -2].tolist() == [0, 0, 0]
    assert own[row, column, 0] > right[row, 8 + column, 0]


def mine(folder, *arguments):
    """Files of one test each, with these markers."""
    for number, each in enumerate(arguments):
        text = f"import pytest\n@pytest.mark.lfssao_stages({each})\ndef test_mine(lfssao_case):\n    pass\n"
        (folder / f"test_{number}.py").write_text(text)
    return folder


def chosen(output):
    """By the number of a file, the cases that its test had."""
    found = {}
    for number, case in re.findall(r"test_(\d)\.py::test_mine\[(\w+)\]", output):
        found.setdefault(int(number), set()).add(case)
    return list(found.values())


CAMERAS = {
    "turned_algorithm1", "turned_algorithm2_matrix", "algorithm1_perspective", "algorithm1_orthographic",
    "behind_camera", "algorithm2_matrix", "far_algorithm1", "ties",
}  # fmt: skip


def test_stages_and_kinds_choose_cases(few, tmp_path):
    expected = {
        "kinds='display'": {"algorithm2_conical"},
        "kinds=['display', 'crossed slits']": {"algorithm2_conical", "frame"},
        "'blur', 'frame', kinds=('crossed slits',)": {"frame"},
        "": {"algorithm2_conical", "blur_usual", "frame", "samples_latin"},
    }
    done = run_pytest(mine(tmp_path, *expected), "-rA", "--lfssao-kit", str(few))
    assert done.returncode == 0, done.stdout
    assert chosen(done.stdout) == list(expected.values())


def test_without_a_folder_they_choose_of_the_embedded_cases(tmp_path):
    done = run_pytest(mine(tmp_path, "'algorithm1', 'algorithm2', kinds=('matrix',)"), "--collect-only")
    assert done.returncode == 0, done.stdout
    assert chosen(done.stdout) == [CAMERAS]


def test_what_does_not_exist_is_a_collection_error_that_lists_what_does(few, tmp_path):
    sentences = {
        "'algoritm2'": "there is no stage 'algoritm2' (did you mean 'algorithm2'?): choose one of algorithm2, blur, "
                       "frame, samples",
        "'merge'": "there is no stage 'merge': choose one of algorithm2, blur, frame, samples",
        "'algorithm2', kinds=('slits',)": "there is no kind 'slits': choose one of display",
        "'blur', kinds=('display',)": "there is no kind 'display': choose one of none",
        "kind='display'": "there is no parameter 'kind' (did you mean 'kinds'?): choose one of kinds",
    }  # fmt: skip
    done = run_pytest(mine(tmp_path, *sentences), "--lfssao-kit", str(few))
    assert done.returncode == 2
    for number, sentence in enumerate(sentences.values()):
        assert f"test_{number}.py::test_mine: lfssao_stages: {sentence}\n" in done.stdout


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
