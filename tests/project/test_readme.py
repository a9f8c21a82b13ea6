"""README is read in ten minutes, its commands and its Python run as they stand, and its files are there."""

import importlib
import inspect
import pkgutil
import re
import shlex
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import pytest
from jobs import python

import lfssao
import lfssao.samples
import lfssao.testing
from lfssao.bench.stability.cases import CASES
from lfssao.cli.main import main
from lfssao.optics.view import WorldToImage

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
HELP = ROOT / "lfssao" / "cli" / "help"


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.MULTILINE | re.DOTALL)


def test_no_module_has_the_name_of_a_public_function():
    """Importing it would put the module in the function's place: lfssao.render(...) would not be callable."""
    modules = {info.name for info in pkgutil.iter_modules(lfssao.__path__)}
    public = {name for name in lfssao.__all__ if inspect.ismodule(getattr(lfssao, name))}
    assert public == {"reference", "samples", "testing", "viz"}
    for name in modules:
        importlib.import_module(f"lfssao.{name}") if name != "__main__" else None
    assert not (modules & set(lfssao.__all__)) - public
    assert callable(lfssao.render)


def test_it_is_read_in_ten_minutes():
    assert len(README.encode()) <= 14_000
    assert len(README.split()) <= 2_200


def test_its_commands_and_its_python_run_as_they_stand(tmp_path, monkeypatch, capsys):
    """All commands in turn in one folder, with few of the stiff cases; a comment says another exit code than 0."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("lfssao.bench.stability.cases.CASES", [case for case in CASES if case.name == "ordinary"])
    lines = re.findall(r"^(?:.*&& \.venv/bin/)?lfssao (.*)$", "".join(blocks("sh")), re.MULTILINE)
    assert len(lines) == 17
    for line in lines:
        command, _, comment = line.partition("#")
        words, _, target = command.partition(">")
        expected = int(re.search(r"exit code (\d): ", f"{comment} exit code 0: ")[1]) if "compare" in words else 0
        with Path(target.strip() or "printed.txt").open("w") as file, redirect_stdout(file):
            assert main(shlex.split(words)) == expected, line
    (cause,) = re.findall(r"`(radius x [^`]*)`", README)
    assert " ".join(cause.split()) in Path("report.html").read_text()
    made = {"out/contact.png", "right.png", "geometry.png", "mine.toml", "latin.csv", "poisson.png"}
    assert [name for name in made if not (tmp_path / name).exists()] == []
    names = {}
    exec(compile("".join(blocks("python")), "README", "exec"), names)
    printed = capsys.readouterr().out
    assert "depth ('Z',) (600, 1000, 1)" in printed
    assert names["shaded"].shape == (600, 1000, 3)
    assert np.isfinite(names["shaded"]).all()
    assert names["ao"].max() > 0.5


def test_its_pages_of_the_interface_have_all_names(tmp_path):
    command = re.search(r"EAGER_IMPORT=1 (pdoc [^`]*)`", README)[1].split()
    assert python("-m", *command, "-o", str(tmp_path), EAGER_IMPORT="1").stderr == ""
    rooms = lfssao.testing, lfssao.samples, lfssao.viz  # come with the page of lfssao
    named = [*command[3:], *(room.__name__ for room in rooms)]
    pages = {name: (tmp_path / f"{name.replace('.', '/')}.html").read_text(encoding="utf-8") for name in named}
    for module in (lfssao, *rooms):
        names = [name for name in module.__all__ if not inspect.ismodule(getattr(module, name))]
        assert [name for name in names if f'id="{name}"' not in pages[module.__name__]] == []
    assert 'id="algorithm1"' in pages[lfssao.reference.__name__]


@pytest.mark.parametrize("text", [README, *(p.read_text(encoding="utf-8") for p in HELP.iterdir())])
def test_files_that_are_named_are_there(text):
    named = re.findall(r"`((?:[a-z_]+/)+[a-z_0-9]+\.py)`", text) + re.findall(r"\]\(([^):]+)\)", text)
    assert named or text != README
    assert [name for name in named if not any((ROOT / home / name).exists() for home in ("", "lfssao"))] == []


def test_the_mappings_lines_are_those_of_its_docstrings():
    """Each formula of the help, up to its comment, stands where the mapping is made."""
    lines = [line.strip() for line in (HELP / "ao.txt").read_text(encoding="utf-8").splitlines()]
    first = next(k for k, line in enumerate(lines) if line.startswith("(X, Y, Z) = M"))
    said = f"{WorldToImage.crossed_slits.__doc__} {WorldToImage.matrix.__doc__}"
    formulas = [re.split(r" {4,}", line)[0] for line in lines[first : first + 6]]
    parts = [part for formula in formulas for part in re.split(r", +defined for |,  ", formula)]
    assert len(parts) == 10
    assert [part for part in parts if part not in said] == []
