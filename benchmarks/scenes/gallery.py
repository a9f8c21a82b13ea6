"""The gallery's own parts: its floor, wall and block, and the clay that the armadillo is made of there."""

import numpy as np
from assembly import Piece, merged, sky_lit, vertex_normals
from implicit import Triple
from numpy.typing import NDArray

from lfssao.scene.mesh import Mesh

_CLAY = (0.72, 0.50, 0.30)
_FLOOR = (0.66, 0.64, 0.60)
_WALL = (0.50, 0.55, 0.60)
_BLOCK = (0.46, 0.43, 0.40)


def clay(mesh: Mesh) -> NDArray[np.float32]:
    """Linear RGB of sky-lit clay at the vertices of a mesh, (V, 3)."""
    return sky_lit(np.array(_CLAY), vertex_normals(mesh.vertices, mesh.faces))


def boxes() -> Mesh:
    """Floor whose top is y = 0, low wall behind, and the block in front that the ammonite stands on."""
    pieces = [
        _slab((-2.40, -0.10, -1.05), (2.40, 0.0, 1.05), _FLOOR),
        _slab((-2.40, 0.0, -1.05), (2.40, 1.25, -0.93), _WALL),
        _slab((-0.62, 0.0, 0.12), (0.62, 0.34, 0.72), _BLOCK),
    ]
    return merged(pieces, "boxes")


def _slab(low: Triple, high: Triple, albedo: Triple) -> Piece:
    """Box from low to high, each side with vertices of its own, so that it has a colour of its own."""
    vertices = []
    normals = []
    for k in range(3):
        i = (k + 1) % 3
        j = (k + 2) % 3
        for outward, end in ((-1.0, low), (1.0, high)):
            # Counter-clockwise from outside: i to j is counter-clockwise about +k.
            first, second = (low, high) if outward > 0.0 else (high, low)
            for a, b in ((first[i], low[j]), (second[i], low[j]), (second[i], high[j]), (first[i], high[j])):
                corner = [0.0, 0.0, 0.0]
                normal = [0.0, 0.0, 0.0]
                corner[i], corner[j], corner[k] = a, b, end[k]
                normal[k] = outward
                vertices.append(corner)
                normals.append(normal)
    first_corner = 4 * np.arange(6)[:, None]
    faces = np.concatenate([first_corner + np.array([0, 1, 2]), first_corner + np.array([0, 2, 3])])
    return np.array(vertices), faces, sky_lit(np.array(albedo), np.array(normals))
