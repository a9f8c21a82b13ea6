"""Meshes and paint: arrays that are none or do not fit are refused; degenerate faces are left out in test_load.py."""

from dataclasses import replace

import numpy as np
import pytest

from lfssao import InputError, Mesh
from lfssao.scene.mesh import Paint


def test_mesh_checks_arrays():
    vertices = np.eye(3)
    faces = np.array([[0, 1, 2]])
    for bad_vertices, bad_faces, words in (
        (vertices[:, :2], faces, r"vertices have shape \(3, 2\)"),
        (vertices, faces[:, :2], r"faces have shape \(1, 2\)"),
        (vertices, faces.astype(float), "expected .* integers"),
        (vertices, faces[:0], "no faces"),
        (vertices, faces + 1, "face 0 names vertex 3"),
    ):
        with pytest.raises(InputError, match=words):
            Mesh(bad_vertices, bad_faces)


ONES = np.ones((1, 3), np.float32)
TEXTURE = np.ones((2, 2, 3), np.float32)
RIGHT = Paint(ONES, np.zeros(2, np.int32), (TEXTURE,), np.zeros((4, 2)), np.ones((4, 3), np.float32))


@pytest.mark.parametrize(("field", "value", "words"), [
    ("factors", np.ones((2, 3)), r"factors has shape \(2, 3\), expected \(1, 3\)"),
    ("factors", np.full((1, 3), np.nan), "factors has a number that is not finite"),
    ("face_material", np.zeros(1, int), r"face_material has shape \(1,\), expected \(2,\)"),
    ("face_material", np.array([0, 1]), "whole numbers below 1"),
    ("face_material", np.array([0, -1]), "whole numbers below 1"),
    ("face_material", np.zeros(2), "whole numbers below 1"),
    ("textures", (TEXTURE[..., :2],), r"texture 0 has shape \(2, 2, 2\)"),
    ("textures", (TEXTURE[:0],), r"texture 0 has shape \(0, 2, 3\)"),
    ("textures", (np.inf * TEXTURE,), "texture 0 has a number that is not finite"),
    ("uv", None, "and uv with it"),
    ("uv", np.zeros((3, 2)), r"uv has shape \(3, 2\), expected \(4, 2\)"),
    ("uv", np.zeros((4, 3)), r"uv has shape \(4, 3\)"),
    ("uv", np.full((4, 2), np.nan), "a texture coordinate is not finite"),
    ("uv", np.full((4, 2), -3e9), "a texture coordinate is not finite, or beyond 2.14748e\\+09"),
    ("vertex_colors", np.ones((6, 3)), r"vertex_colors has shape \(6, 3\), expected \(4, 3\)"),
    ("vertex_colors", np.full((4, 3), np.inf), "vertex_colors has a number that is not finite"),
])  # fmt: skip
def test_paint_that_a_kernel_would_read_beyond_its_end_is_refused(field, value, words):
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    assert Mesh(vertices, faces, RIGHT).paint is RIGHT
    with pytest.raises(InputError, match=words):
        Mesh(vertices, faces, replace(RIGHT, **{field: value}))
