"""Putting made pieces together: normals at vertices, soft light baked into their colours, one mesh of several."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.scene.mesh import Mesh, Paint

Array = NDArray[Any]
Piece = tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float32]]


def vertex_normals(vertices: Array, faces: Array) -> Array:
    """Return unit normals at the vertices, means of the faces' weighted with their areas, (V, 3) float64."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    p = b - a
    q = c - a
    sums = []
    for i, j in ((1, 2), (2, 0), (0, 1)):
        across = p[:, i] * q[:, j] - p[:, j] * q[:, i]
        # bincount adds in the order of the faces; a vectorised sum would depend on the machine.
        sums.append(np.bincount(faces.ravel(), np.repeat(across, 3), len(vertices)))
    length = np.sqrt(sums[0] * sums[0] + sums[1] * sums[1] + sums[2] * sums[2])
    return np.stack([s / np.where(length > 0.0, length, 1.0) for s in sums], axis=1)


def sky_lit(albedo: Array, normals: Array) -> NDArray[np.float32]:
    """Colours under a soft sky that is brightest above and a little in front and to the left.

    Parameters
    ----------
    albedo : (3,) or (V, 3) array
        Linear RGB, 0 to 1.
    normals : (V, 3) float64
        Unit normals.

    Returns
    -------
    (V, 3) float32
        Linear RGB, 0 to 1.
    """
    light = 0.58 + 0.26 * normals[:, 1] + 0.10 * normals[:, 2] - 0.16 * normals[:, 0]
    return np.minimum(np.maximum(albedo * light[:, None], 0.0), 1.0).astype(np.float32)


def merged(pieces: Sequence[Piece], name: str) -> Mesh:
    """One mesh of pieces, each vertices (V, 3), faces (F, 3) and linear RGB at the vertices (V, 3)."""
    starts = np.cumsum([0, *[len(vertices) for vertices, _, _ in pieces]])
    faces = np.concatenate([f + start for (_, f, _), start in zip(pieces, starts, strict=False)])
    vertices = np.concatenate([vertices for vertices, _, _ in pieces])
    colors = np.concatenate([colors for _, _, colors in pieces])
    return Mesh(vertices, faces.astype(np.int32), Paint.from_vertex_colors(colors, len(faces)), name=name)
