"""Meshes: arrays that are none are refused; degenerate faces are left out in test_load.py."""

import numpy as np
import pytest

from lfssao import InputError, Mesh


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
