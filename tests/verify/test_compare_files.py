"""Files of other names in ``lfssao compare``: patterns, and one file of all modules."""

import numpy as np
import pytest
from compare_folders import LAYERS, MODULES, changed, compare, different, single, write_image

import lfssao
from lfssao.files.exr import Part, read_exr, write_exr
from lfssao.verify.verdict import Verdict


@pytest.mark.parametrize(("place", "form"), [("{number}", "{}"), ("{number}", "{:04d}"), ("{module}", "module_{:03d}")])
def test_files_by_patterns(tmp_path, capsys, reference, place, form):
    for module in MODULES:
        start = f"frame {form.format(int(module[-3:]))}"
        parts = read_exr(reference / f"{module}.exr")
        write_exr(tmp_path / f"{start}.exr", [part for name, part in parts.items() if name != "merged"])
        write_image(tmp_path / f"{start}=ao.tif", single(reference, module, "merged"))
    files = [f"frame {place}.exr", f"frame {place}=ao.tif=merged"]
    words = [word for pattern in files for word in ("--files", pattern)]
    assert compare(tmp_path, reference, *words, "--exact") == 0
    report = lfssao.compare(tmp_path, reference, files={files[0]: "", files[1].removesuffix("=merged"): "merged"})
    assert (report.exit_code, len(report.results), different(report)) == (0, 3 * len(LAYERS), {})
    assert compare(tmp_path, reference, *words[:2]) == 2  # merged is missing
    write_exr(tmp_path / f"frame {form.format(7)}.exr", list(parts.values()))
    capsys.readouterr()
    assert compare(tmp_path, reference, *words) == 1
    assert f"warning: frame {form.format(7)}.exr is of no module" in capsys.readouterr().out


def test_patterns_that_fit_no_file_or_two_are_refused(tmp_path, capsys, reference):
    for name in ("frame_3", "frame_03", "frame"):
        write_exr(tmp_path / f"{name}.exr", list(read_exr(reference / "module_003.exr").values()))
    for mine, pattern, words in (
        (tmp_path, "frame_{number}.exr", "frame_03.exr and frame_3.exr are both 'frame_{number}.exr' of module_003"),
        (tmp_path, "view_{module}.exr=merged", "no file is 'view_{module}.exr'"),
        (tmp_path, "frame.exr", "no file is 'frame.exr'"),
        (tmp_path / "frame.exr", "frame_{number}.exr", "compare like with like"),
    ):
        assert compare(mine, reference, "--files", pattern) == 4
        said = capsys.readouterr().err
        assert words in said
        assert said.count("\n") == 1


@pytest.mark.parametrize("as_parts", [True, False])
def test_one_file_of_all_modules(tmp_path, reference, as_parts):
    parts = []
    for module in MODULES:
        for name, part in read_exr(reference / f"{module}.exr").items():
            full = tuple(f"{module}.{c}" if "." in c else f"{module}.{name}.{c}" for c in part.channels)
            parts.append(Part(f"{module}.{name}", part.channels if as_parts else full, part.pixels))
    if not as_parts:
        pixels = np.concatenate([part.pixels for part in parts], axis=-1)
        parts = [Part("", tuple(channel for part in parts for channel in part.channels), pixels)]
    (tmp_path / "mine").mkdir()
    write_exr(tmp_path / "mine" / "everything.exr", parts)
    for mine in (tmp_path / "mine", tmp_path / "mine" / "everything.exr"):
        report = lfssao.compare(mine, reference)
        assert (report.exit_code, len(report.results), different(report)) == (0, 3 * len(LAYERS), {})
    wrong = changed(
        reference, tmp_path / "wrong", "module_004", lambda p: {k: v for k, v in p.items() if k != "merged"}
    )
    (wrong / "module_005.exr").unlink()
    write_exr(wrong / "everything.exr", parts)  # a module's own file comes first
    assert different(lfssao.compare(wrong, reference)) == {("module_004", "merged"): Verdict.MISSING}
