"""Without embreex every texture has the same bits, and only what asks for Embree by name is refused."""

import json
import os

import golden
import pytest
from jobs import PATH, python


@pytest.fixture(scope="module")
def hidden(tmp_path_factory):
    """The environment of a process that finds no embreex."""
    folder = tmp_path_factory.mktemp("hidden")
    (folder / "embreex.py").write_text("raise ImportError('hidden')\n")
    return {"PYTHONPATH": f"{folder}{os.pathsep}{PATH}"}


@pytest.mark.slow
def test_textures_have_the_golden_digests(hidden):
    """Those of a flat display, of a curved one, and of cameras."""
    groups = ("sample-a", "convex", "cameras")
    expected = json.loads(golden.GOLDEN.read_text())
    assert json.loads(python(golden.__file__, *groups, **hidden).stdout) == {name: expected[name] for name in groups}


def test_embrees_own_answers_are_refused(hidden, tmp_path):
    words = "ammonite", "--caster", "embree", "-o", tmp_path / "out"
    done = python("-m", "lfssao", "render", *words, code=2, **hidden)
    assert done.stderr.count("\n") == 1
    assert "Embree needs the package embreex, which is not installed here" in done.stderr
    assert not (tmp_path / "out").exists()


def test_the_ground_truth_needs_it_only_where_it_is_asked_for(hidden):
    script = """
import numpy as np
import lfssao
mesh = lfssao.Mesh(np.array([[0.0, 0, 1], [1, 0, 1], [0, 1, 1]]), np.array([[0, 1, 2]]))
view = lfssao.Camera("perspective", (0, 0, 2), (0, 0, 0), (0, 1, 0), 1.0, 1.0, 3.0).view(2, 1)
up = np.tile([0.0, 0.0, 1.0], (1, 2, 1))
buffers = lfssao.Buffers(view, np.zeros((1, 2)), np.full((1, 2, 3), 0.1), up)
occluders = lfssao.Occluders(mesh)
print(lfssao.ray_cast_occlusion(occluders, buffers, 1.0).texture.min() > 0)
try:
    lfssao.ray_cast_occlusion(occluders, buffers, 1.0, intersector="embree")
except lfssao.MissingPackageError as error:
    print(error)
"""
    covered, said = python("-c", script, **hidden).stdout.splitlines()
    assert covered == "True"
    assert said.startswith("Embree needs the package embreex, which is not installed here")
