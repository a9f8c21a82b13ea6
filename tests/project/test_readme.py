"""README's Python runs as it stands, and no public name hides behind a module of the same name."""

import importlib
import pkgutil
import re
from pathlib import Path

import numpy as np

import lfssao
from lfssao.optics.kernels import projection

README = Path(__file__).parents[2] / "README.md"


def library_blocks():
    """The Python examples of README's section on the library."""
    section = re.search(r"^## The library\n(.*?)^## ", README.read_text(), re.MULTILINE | re.DOTALL)
    return re.findall(r"^```python\n(.*?)^```", section[1], re.MULTILINE | re.DOTALL)


def test_no_module_has_the_name_of_a_public_function():
    """Importing it would put the module in the function's place: lfssao.render(...) would not be callable."""
    modules = {info.name for info in pkgutil.iter_modules(lfssao.__path__)}
    for name in modules:
        importlib.import_module(f"lfssao.{name}") if name != "__main__" else None
    assert not modules & set(lfssao.__all__)
    assert callable(lfssao.render)


def test_the_librarys_examples_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bunny.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n")
    first, second = library_blocks()
    names = {}
    exec(compile(first, "README", "exec"), names)
    shown = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert shown == ["module_009", "module_010", "module_011"]
    made = names["textures"]
    names |= {"depth": made.gbuffer.depth, "positions": made.gbuffer.positions, "rgb": made.image}
    names |= {"samples": lfssao.make_samples(), "other_ao": made.ao[0]}
    exec(compile(second, "README", "exec"), names)
    assert names["shaded"].shape == (*made.gbuffer.depth.shape, 3)
    assert np.isfinite(names["shaded"]).all()


def test_files_that_readme_names_are_there():
    named = set(re.findall(r"`((?:[a-z_]+/)+[a-z_0-9]+\.py)`", README.read_text()))
    assert len(named) > 15
    assert [name for name in named if not any((README.parent / home / name).exists() for home in ("", "lfssao"))] == []


def test_the_mappings_lines_are_those_of_the_kernels():
    """Each formula, up to its comment, stands in the docstring of the projection."""
    block = re.search(r"^```text\n(.*M \(x, y, z, 1\).*?)^```", README.read_text(), re.MULTILINE | re.DOTALL)
    formulas = [re.split(r" {4,}", line)[0] for line in block[1].splitlines()]
    assert len(formulas) == 6
    assert [formula for formula in formulas if formula not in projection.__doc__] == []
