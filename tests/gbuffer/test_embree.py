"""Without embreex every texture has the same bits, and only what asks for Embree by name is refused."""

import json
import os

import pytest
from golden import GOLDEN
from jobs import PATH, python


@pytest.fixture(scope="module")
def hidden(tmp_path_factory):
    """The environment of a process that finds no embreex."""
    folder = tmp_path_factory.mktemp("hidden")
    (folder / "embreex.py").write_text("raise ImportError('hidden')\n")
    return {"PYTHONPATH": f"{folder}{os.pathsep}{PATH}"}


@pytest.mark.slow
def test_textures_have_the_golden_digests(hidden):
    """One module of a flat display, one of a curved one, and a camera."""
    script = """
import json
from golden import digests_of, scene, settings, through_a_camera, through_a_module
from lfssao.gbuffer.embree import embree_installed
assert not embree_installed()
mesh = scene("statue")
print(json.dumps({
    "sample-a": digests_of(through_a_module(mesh, "sample-a", settings(mesh))),
    "convex": digests_of(through_a_module(mesh, "convex", settings(mesh))),
    "cameras": digests_of(through_a_camera(mesh, "perspective", settings(mesh))),
}))
"""
    expected = json.loads(GOLDEN.read_text())
    assert json.loads(python("-c", script, **hidden).stdout) == {
        "sample-a": expected["sample-a"]["sample-a statue"],
        "convex": expected["convex"]["convex statue"],
        "cameras": expected["cameras"]["perspective statue"],
    }


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
