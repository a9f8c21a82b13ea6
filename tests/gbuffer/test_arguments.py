"""Arguments of the ray caster that mean nothing: each is refused in a sentence that names it."""

import numpy as np
import pytest
from refusals import is_refused

import lfssao
from lfssao.scene.mesh import Paint

MESH = lfssao.builtin_scene("corner")
DISPLAY = lfssao.find_display("virtual").with_resolution(8, 6)
(VIEW,) = lfssao.module_views(MESH, DISPLAY)
CASTER = lfssao.RayCaster(MESH, VIEW.cast_from_world)

WRONG = [
    *((lambda bad=bad: lfssao.RayCaster(MESH, VIEW.cast_from_world, bad), "threads is .*, it must be") for bad in (
        np.nan, -1, 0, 1.5, 2.0, "two", None, 1e9, 10**9, True,
    )),
    *((lambda bad=bad: lfssao.RayCaster(MESH, bad), "cast_from_world is") for bad in (
        np.eye(4), np.nan * VIEW.cast_from_world, "map", None, np.ma.array(np.eye(3, 4), mask=np.eye(3, 4)),
    )),
    *((lambda bad=bad: CASTER.gbuffer(VIEW, rows=bad), "rows is .*, it must be a part of") for bad in (
        range(-1, 3), range(0, 7), range(4, 2), range(0, 6, 2), 3, "all", [0, 1],
    )),
    *((lambda bad=bad: CASTER.gbuffer(VIEW, bad), "color is") for bad in (["bilinear"], np.zeros(2), 1)),
    *((lambda bad=bad: CASTER.gbuffer(VIEW, normals=bad), "normals is") for bad in (["smooth"], np.zeros(2), True)),
    (lambda: CASTER.gbuffer(VIEW, caster=np.zeros(2)), "caster is"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "words"), WRONG, ids=[words for _, words in WRONG])
def test_what_means_nothing_is_refused(call, words):
    assert is_refused(call, words)


def test_what_is_right_in_another_type_is_taken():
    caster = lfssao.RayCaster(MESH, VIEW.cast_from_world.tolist(), np.int64(2))
    right = CASTER.gbuffer(VIEW).depth
    assert np.array_equal(caster.gbuffer(VIEW).depth, right)
    assert np.array_equal(caster.gbuffer(VIEW, rows=range(2, 5)).depth[2:5], right[2:5])


def test_paint_in_other_types_has_the_same_colors():
    vertices = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    texture = np.random.default_rng(3).random((4, 4, 3)).astype(np.float16)
    colors = np.float16([[1, 0, 0.5]] * 4)
    uv = np.float32([[0, 0], [1, 0], [1, 1], [0, 1]])
    paints = [
        Paint(np.ones((1, 3), kind), np.zeros(2, whole), (texture.astype(kind),), uv.astype(kind), colors.astype(kind))
        for kind, whole in ((np.float32, np.int32), (np.float16, np.uint8), (">f8", ">i8"))
    ]
    view = lfssao.Camera.looking_at(np.array([[-1.0, -1, 0], [1, 1, 0]])).view(12, 9)
    right, *others = (
        lfssao.RayCaster(lfssao.Mesh(vertices, faces, paint), view.cast_from_world).gbuffer(view).color
        for paint in paints
    )
    assert len(np.unique(right)) > 50
    for other in others:
        assert other.dtype == np.float32
        assert np.array_equal(other, right)
