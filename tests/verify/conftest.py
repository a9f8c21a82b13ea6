"""Folders that several tests of the comparison read."""

import numpy as np
import pytest
from compare_folders import changed, poke, rendered


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
