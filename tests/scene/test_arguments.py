"""Arguments of meshes that mean nothing: each is refused in a sentence that names it."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import is_refused

import lfssao
from lfssao import Mesh, Paint

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
FACES = np.array([[0, 1, 2]])
MASK = np.eye(3) > 0
IMAGE = np.ones((2, 2, 3), np.float32)
PAINT = Paint(np.ones((1, 3), np.float32), np.zeros(1, np.int32), (IMAGE,), np.zeros((3, 2)))


def painted(**changes):
    return Mesh(CORNERS, FACES, replace(PAINT, **changes))


WRONG = [
    (lambda: Mesh(np.ma.array(CORNERS, mask=MASK), FACES), "mesh: vertices is a masked array"),
    (lambda: Mesh(CORNERS, np.ma.array(FACES, mask=[[0, 0, 1]])), "mesh: faces is a masked array"),
    (lambda: Mesh(CORNERS, FACES, normals=np.ma.array(CORNERS, mask=MASK)), "mesh: normals is a masked array"),
    *((lambda bad=bad: Mesh(bad, FACES), "mesh: vertices") for bad in (
        "corners", None, [[0, 0, 0], [1]], 5, CORNERS[0],
    )),
    *((lambda bad=bad: Mesh(CORNERS, bad), "mesh: ") for bad in (
        "faces", None, [[0, 1, 2], [0]], 5, FACES * 1.0, [True],
    )),
    *((lambda bad=bad: Mesh(CORNERS, FACES, normals=bad), "mesh: normals") for bad in ("up", 1.0, CORNERS[:2])),
    (lambda: Mesh(CORNERS, FACES, "red"), "mesh: paint is of type str"),
    # Kernels read paint without looking
    *((lambda bad=bad: painted(face_material=bad), "face_material") for bad in (
        np.ones(1, np.int32), -np.ones(1, np.int32), np.zeros(2, np.int32), np.zeros(1), "0", None,
        np.ma.array([0], mask=[True]),
    )),
    *((lambda bad=bad: painted(factors=bad), "factors") for bad in (np.ones((2, 3), np.float32), "red", None)),
    *((lambda bad=bad: painted(uv=bad), "uv|coordinate") for bad in (
        np.zeros((2, 2)), np.full((3, 2), np.nan), None, "uv", np.ma.array(np.zeros((3, 2)), mask=np.eye(3, 2)),
    )),
    *((lambda bad=bad: painted(vertex_colors=bad), "vertex_colors") for bad in (IMAGE, "red", [1, 2])),
    *((lambda bad=bad: painted(textures=bad), "texture") for bad in (
        IMAGE, None, (IMAGE[..., :2],), (IMAGE[:0],), ("brick.png",), (np.ma.array(IMAGE, mask=IMAGE > 0),),
    )),
    *((lambda bad=bad: Paint.from_vertex_colors(bad, 1), "colors is") for bad in (
        "red", None, np.ma.array(CORNERS, mask=MASK),
    )),
    *((lambda bad=bad: painted(samplers=bad), "sampler") for bad in (
        "repeat", (), (("repeat", "clamp"),), (("repeat", "wrap", False),), (("clamp", "clamp", 1),),
        ([["mirror"], "mirror", True],),
    )),
    *((lambda bad=bad: Paint.from_vertex_colors(CORNERS, bad), "face_count is") for bad in (np.nan, 1.5, "1", None, 0)),
    *((lambda bad=bad: lfssao.load_scene(bad), "path is of type") for bad in (5, None, ["a.obj"])),
    (lambda: lfssao.builtin_scene(["statue"]), "there is no embedded scene"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "words"), WRONG, ids=[words for _, words in WRONG])
def test_what_means_nothing_is_refused(call, words):
    assert is_refused(call, words)


def test_what_is_right_in_another_type_is_taken():
    mesh = Mesh(CORNERS.tolist(), FACES.tolist(), PAINT, CORNERS.tolist())
    assert mesh.normals.dtype == np.float64
    assert painted(face_material=np.zeros(1, np.uint8)).paint.uv is PAINT.uv
    bare = replace(PAINT, textures=(None,), uv=np.full((3, 2), np.nan))  # which nothing reads
    assert Mesh(CORNERS, FACES, bare).paint is bare
