"""Examples in docstrings: all run, and every public name has one."""

import doctest
import importlib
from pathlib import Path

import numpy as np
import pytest
import trimesh

import lfssao
import lfssao.samples
import lfssao.testing
from lfssao.ao.estimators.registry import ESTIMATORS

PACKAGE = Path(lfssao.__file__).parent
MODULES = [
    ".".join(("lfssao", *path.relative_to(PACKAGE).with_suffix("").parts))
    for path in sorted(PACKAGE.rglob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8")
]
NAMES = {"lfssao": lfssao, "np": np, "Path": Path, "trimesh": trimesh}
PUBLIC = [(home, name) for home in (lfssao, lfssao.testing, lfssao.samples) for name in home.__all__]


@pytest.mark.parametrize("name", MODULES)
def test_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(ESTIMATORS, "data", dict(ESTIMATORS.data))
    np.save("mine.npy", np.float32([[0.5]]))
    failed, run = doctest.testmod(importlib.import_module(name), extraglobs=NAMES)
    assert failed == 0 < run


@pytest.mark.parametrize(("home", "name"), PUBLIC, ids=[name for _, name in PUBLIC])
def test_a_public_name_has_an_example(home, name):
    found = getattr(home, name)
    assert not callable(found) or ">>> " in found.__doc__
