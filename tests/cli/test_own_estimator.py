"""An estimator of one's own on the command line: written, checked, rendered, and compared where its file is given."""

import json
import shutil

import pytest

from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.cli.main import main
from lfssao.cli.terminal import NOT_COMPARED

JOB = "statue", "--camera", "--resolution", "48x36", "--radii", "6%", "--layers", "depth,positions,ao"


@pytest.fixture(autouse=True)
def known(monkeypatch):
    monkeypatch.setattr(ESTIMATORS, "data", dict(ESTIMATORS.data))


def forgotten():
    """As a new process: it knows no estimator of one's own."""
    ESTIMATORS.data.pop("mine", None)


def test_a_file_of_ones_own_from_its_start_to_its_verdict(tmp_path, capsys):
    assert main(["estimators", "--template", "sum"]) == 0
    mine = tmp_path / "mine.py"
    mine.write_text(capsys.readouterr().out)
    assert main(["estimators", str(mine)]) == 0
    said = capsys.readouterr().out
    assert "bias=0.0: by how much a surface must be nearer" in said
    assert "reads of a view: position, surface, sample_offset, at, along" in said
    assert "its intervals on 24 texels" in said
    for name, more in (("a", ()), ("c", ("--parameter", "bias=0.1"))):
        forgotten()
        assert main(["render", *JOB, "--estimator", str(mine), *more, "-o", str(tmp_path / name)]) == 0
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    assert json.loads((tmp_path / "a" / "manifest.json").read_text())["settings"]["estimator"] == "mine"

    def compared(name, *more):
        forgotten()
        capsys.readouterr()
        code = main(["compare", str(tmp_path / name), str(tmp_path / "a"), *more])
        return code, "".join(capsys.readouterr())

    code, said = compared("b")
    assert (code, "give its file by --estimator" in said) == (NOT_COMPARED, True)
    assert compared("b", "--estimator", str(mine))[0] == 0
    code, said = compared("c", "--estimator", str(mine))
    # Depths that are off by as much turn the same texels.
    assert (code, "diagnosis: bias + 0.1003 in place of 0, or depth + " in said) == (2, True)
    assert "explains 100.00 %" in said
    mine.write_text(mine.read_text() + "# more\n")
    code, said = compared("b", "--estimator", str(mine))
    assert code == NOT_COMPARED
    assert "is another one than the reference was made with" in said


def test_workers_of_a_scheduler_do_not_know_it(tmp_path, capsys):
    assert main(["estimators", "--template", "sum"]) == 0
    mine = tmp_path / "mine.py"
    mine.write_text(capsys.readouterr().out)
    words = "--estimator", str(mine), "--scheduler", "local", "-o", str(tmp_path / "out")
    assert main(["render", *JOB, *words]) == 2
    assert "--scheduler: its workers do not know an estimator of one's own" in capsys.readouterr().err


def test_compare_asks_for_a_file_and_not_for_a_name(tmp_path, capsys):
    assert main(["compare", str(tmp_path), str(tmp_path), "--estimator", "sao"]) == NOT_COMPARED
    assert "--estimator: sao" in capsys.readouterr().err
