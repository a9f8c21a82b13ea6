"""README is read in ten minutes, its commands and its Python run as they stand, and its files are there."""

import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import numpy as np
import pytest
from pages import run_page
from PIL import Image

import lfssao
from lfssao.bench.stability.cases import CASES
from lfssao.optics.view import WorldToImage

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
HELP = ROOT / "lfssao" / "cli" / "help"


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
    assert len(README.split()) <= 1_500


def test_its_commands_and_its_python_run_as_they_stand(tmp_path, monkeypatch):
    """All in turn in one folder, with few of the stiff cases; its picture is what the command above it makes."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("lfssao.bench.stability.cases.CASES", [case for case in CASES if case.name == "ordinary"])
    names, _ = run_page(re.sub("<!-- test -->.*<!-- end -->", "", README, flags=re.DOTALL))
    (cause,) = re.findall(r"`(radius x [0-9.]+)\s+explains`", README)
    assert " ".join(cause.split()) in Path("report.html").read_text()
    made = {"out/contact.png", "right.png", "mine.toml", "latin.csv"}
    assert [name for name in made if not (tmp_path / name).exists()] == []
    shown, rendered = (np.asarray(Image.open(home / "view.png")) for home in (ROOT / ".pictures", tmp_path / "out"))
    assert np.array_equal(shown[40:], rendered[40:])  # below the titles, whose letters are those of the system's Pillow
    assert names["shaded"].shape == (600, 1000, 3)
    assert np.isfinite(names["shaded"]).all()
    assert names["ao"].max() > 0.5


@pytest.mark.parametrize("text", [README, *(p.read_text(encoding="utf-8") for p in HELP.iterdir())])
def test_files_that_are_named_are_there(text):
    named = re.findall(r"`((?:[a-z_]+/)+[a-z_0-9]+\.py)`", text) + re.findall(r"\]\(([^):#]+)(?:#[^)]*)?\)", text)
    assert named or text != README
    assert [name for name in named if not any((ROOT / home / name).exists() for home in ("", "lfssao"))] == []
    for name, heading in re.findall(r"\]\(([^):#]+)#([^)]*)\)", text):
        headings = re.findall("^#+ (.*)$", (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)
        assert heading in [each.lower().replace(" ", "-") for each in headings]


def test_the_mappings_lines_are_those_of_its_docstrings():
    """Each formula of the help, up to its comment, stands where the mapping is made."""
    lines = [line.strip() for line in (HELP / "ao.txt").read_text(encoding="utf-8").splitlines()]
    first = next(k for k, line in enumerate(lines) if line.startswith("(X, Y, Z) = M"))
    said = f"{WorldToImage.crossed_slits.__doc__} {WorldToImage.matrix.__doc__}"
    formulas = [re.split(r" {4,}", line)[0] for line in lines[first : first + 6]]
    parts = [part for formula in formulas for part in re.split(r", +defined for |,  ", formula)]
    assert len(parts) == 10
    assert [part for part in parts if part not in said] == []
