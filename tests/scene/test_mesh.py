"""Meshes: arrays that are none are refused, and degenerate faces left out."""

import numpy as np
import pytest

from lfssao import InputError, Mesh, Paint


def test_mesh_checks_arrays():
    vertices, faces = np.eye(3), np.array([[0, 1, 2]])
    for bad_vertices, bad_faces, words in (
        (vertices[:, :2], faces, r"vertices have shape \(3, 2\)"),
        (vertices, faces[:, :2], r"faces have shape \(1, 2\)"),
        (vertices, faces.astype(float), "expected .* integers"),
        (vertices, faces[:0], "no faces"),
        (vertices, faces + 1, "face 0 names vertex 3"),
    ):
        with pytest.raises(InputError, match=words):
            Mesh(bad_vertices, bad_faces)


def test_degenerate_faces_go_with_their_materials():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    faces = [[0, 1, 2], [0, 1, 1], [1, 3, 2]]
    paint = Paint(np.eye(3, dtype=np.float32), np.array([0, 1, 2], np.int32), (None, None, None), None, None)
    mesh = Mesh(vertices, faces, paint)
    assert mesh.degenerate == 1
    assert mesh.faces.tolist() == [[0, 1, 2], [1, 3, 2]]
    assert mesh.paint.face_material.tolist() == [0, 2]
