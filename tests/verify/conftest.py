"""Rendered folders and kits that several tests read."""

import shutil

import numpy as np
import pytest
from compare_folders import changed, poke, rendered

from lfssao import Camera, RayCaster, builtin_scene, default_radii, find_display, module_views
from lfssao.ao.textures import Buffers
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
    write_kit(folder, map(make_case, ("algorithm2_conical", "blur_usual", "frame", "samples_latin")))
    return folder


@pytest.fixture
def small_kit(few, tmp_path):
    """A kit of a few cases that a test may change."""
    return shutil.copytree(few, tmp_path / "kit")


@pytest.fixture(scope="session")
def seen():
    """Two scenes from a module and one by a camera, each with a radius."""
    made = []
    display = find_display("sample-a").with_resolution(64, 48)
    for name in ("gallery", "statue", "camera"):
        mesh = builtin_scene("gallery" if name == "camera" else name)
        camera = Camera.looking_at(mesh.bounds).view(64, 48)
        view = camera if name == "camera" else module_views(mesh, display, range(4, 5))[0]
        gbuffer = RayCaster(mesh, view.cast_from_world).gbuffer(view, None, "geometric")
        made.append((Buffers.of(gbuffer, view), default_radii(mesh)[1]))
    return made
