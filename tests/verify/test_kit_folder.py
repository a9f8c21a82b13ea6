"""A kit as a folder: written whole or not at all, read back with its bits, refused where it is damaged."""

import json
import re

import numpy as np
import pytest
from jobs import sentence

from lfssao.cli.main import main
from lfssao.errors import InputError
from lfssao.files.exr import read_exr
from lfssao.verify.kit.cases import RECIPES, make_case
from lfssao.verify.kit.folder import read_case, read_index, read_kit, write_kit
from lfssao.verify.kit.specification import specification


def test_a_kit_reads_back(kit):
    cases = list(read_kit(kit))
    assert [case.name for case in cases] == list(RECIPES)
    for case in cases[::5]:
        made = make_case(case.name)
        assert_same_case(case, made)
    assert {name: (kit / name).read_text() for name in specification()} == specification()


def assert_same_case(actual, expected):
    assert (actual.stage, actual.title, actual.parameters) == (expected.stage, expected.title, expected.parameters)
    for group in ("inputs", "outputs"):
        pairs = getattr(actual, group), getattr(expected, group)
        assert list(pairs[0]) == list(pairs[1])
        for name, array in pairs[0].items():
            assert (array.dtype, array.shape) == (pairs[1][name].dtype, pairs[1][name].shape)
            assert array.tobytes() == pairs[1][name].tobytes()
    assert set(actual.bounds) == set(expected.bounds)


def test_exr_and_npy_files_hold_the_same_pixels(kit):
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
    for name, array in {**case.inputs, **case.outputs}.items():
        np.testing.assert_array_equal(np.load(kit / "cases" / "frame" / f"{name}.npy"), array)


def test_a_kit_replaces_a_kit_and_nothing_else(small_kit, tmp_path):
    (small_kit / "stale").write_text("from the earlier kit")
    write_kit(small_kit, [make_case("shade")])
    assert [entry["name"] for entry in read_index(small_kit)] == ["shade"]
    assert not (small_kit / "stale").exists()
    (tmp_path / "mine").mkdir()
    write_kit(tmp_path / "mine", [make_case("shade")])
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="is not empty, and what it holds is not a kit"):
        write_kit(tmp_path / "other", [])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["kit", "mine", "other"]
    assert (tmp_path / "other" / "thesis.tex").exists()


def test_a_kit_that_fails_leaves_nothing_and_the_earlier_one(few, small_kit, tmp_path):
    def cases():
        yield make_case("shade")
        raise KeyboardInterrupt

    for folder in (small_kit, tmp_path / "new"):
        with pytest.raises(KeyboardInterrupt):
            write_kit(folder, cases())
    assert [path.name for path in tmp_path.iterdir()] == ["kit"]
    assert [case.name for case in read_kit(small_kit)] == [entry["name"] for entry in read_index(few)]


def test_the_command_refuses_folders_in_one_sentence(capsys, tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").write_text("")
    for folder in ("file", "file/below", "full"):
        assert main(["kit", str(tmp_path / folder)]) == 2
        assert sentence(capsys)
    assert main(["kit"]) == 2


def test_a_newer_format_is_refused(small_kit):
    for path in (small_kit / "cases" / "frame" / "case.json", small_kit / "kit.json"):
        value = json.loads(path.read_text())
        path.write_text(json.dumps({**value, "format": 4}))
        with pytest.raises(InputError, match="is of format 4, and this version of lfssao reads up to 3"):
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
    {"file": "a" * 256}, {"sha256": "0"}, {"sha256": None},
]  # fmt: skip


@pytest.mark.parametrize("change", BAD_ARRAYS, ids=str)
def test_wrong_descriptions_of_arrays_are_refused(small_kit, change):
    path = small_kit / "cases" / "frame" / "case.json"
    value = json.loads(path.read_text())
    value["inputs"]["depth"] |= change
    path.write_text(json.dumps(value))
    with pytest.raises(InputError):
        read_case(path.parent)


def test_bounds_of_another_shape_than_the_output_are_refused(small_kit):
    path = small_kit / "cases" / "frame" / "case.json"
    value = json.loads(path.read_text())
    value["bounds"]["ao_1"]["upper"] = value["outputs"]["shaded"]
    path.write_text(json.dumps(value))
    with pytest.raises(InputError, match="the bounds of ao_1 are not of the shape"):
        read_case(path.parent)
