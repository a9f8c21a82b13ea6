"""Rendered folders and kits that several tests read."""

import shutil

import numpy as np
import pytest
from compare_folders import changed, poke, rendered

from lfssao.cli.main import main
from lfssao.verify.kit.cases import make_case
from lfssao.verify.kit.folder import write_kit


@pytest.fixture(scope="session")
def reference(tmp_path_factory):
    return rendered(tmp_path_factory.mktemp("compare") / "reference")


@pytest.fixture(scope="session")
def failing(tmp_path_factory, reference):
    """A conforming module, one that fails in a stage, one with a file that cannot be read."""
    mine = tmp_path_factory.mktemp("compare") / "mine"
    changed(reference, mine, "module_004", poke("merged", (16, 24), np.nan))
    (mine / "module_005.exr").write_bytes(b"rubbish")
    return mine


@pytest.fixture(scope="session")
def kit(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / "kit"
    assert main(["kit", str(folder)]) == 0
    return folder


@pytest.fixture(scope="session")
def few(tmp_path_factory):
    folder = tmp_path_factory.mktemp("few") / "kit"
    write_kit(folder, map(make_case, ("algorithm2_conical", "blur_usual", "frame", "samples_latin")), "text")
    return folder


@pytest.fixture
def small_kit(few, tmp_path):
    """A kit of a few cases that a test may change."""
    return shutil.copytree(few, tmp_path / "kit")
