"""The test view's room: surfaces up to all four borders of a tilted camera, contacts, slivers, and a wall behind."""

import numpy as np
from assembly import Piece, merged, sky_lit, vertex_normals
from implicit import Triple
from numpy.typing import NDArray

from lfssao.scene.mesh import Mesh

_PLASTER = (0.62, 0.60, 0.57)
_WOOD = (0.55, 0.40, 0.26)
_STEEL = (0.45, 0.50, 0.56)
_SIDES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
_BLADES = 24


def corner() -> Mesh:
    """A room of 6 x 4 x 6 without its front wall, y up; 3 boxes, stairs of 5 steps, a leaning plank and 24 blades."""
    level = np.eye(3)
    turned = _about_y(3.0 / 5.0, 4.0 / 5.0)
    lean = np.array([[12.0, -5.0, 0.0], [5.0, 12.0, 0.0], [0.0, 0.0, 13.0]]) / 13.0  # about z, to the left wall
    pieces = [
        _box((0.0, 2.0, 0.0), (3.0, 2.0, 3.0), level, _PLASTER, inwards=True),
        _box((-0.7, 0.5, -0.9), (0.6, 0.5, 0.4), turned, _WOOD),
        _box((-0.75, 1.2, -0.95), (0.25, 0.2, 0.3), level, _STEEL),  # on the first one
        _box((0.62, 0.2, 0.7), (0.2, 0.2, 0.2), _about_y(5.0 / 13.0, 12.0 / 13.0), _STEEL),
        _box((-2.45, 1.25, 0.3), (0.03, 1.35, 0.35), lean, _WOOD),
        *(_box((1.9, 0.1 * k + 0.1, -2.875 + 0.25 * (4 - k)), (0.8, 0.1 * k + 0.1, 0.125), level, _PLASTER)
          for k in range(5)),
        _blades(),
    ]  # fmt: skip
    return merged(pieces, "corner")


def _about_y(sine: float, cosine: float) -> NDArray[np.float64]:
    return np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])


def _painted(corners: NDArray[np.float64], albedo: Triple) -> Piece:
    """Triangles, (F, 3, 3), whose corners are vertices of their own."""
    vertices = corners.reshape(-1, 3)
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    return vertices, faces, sky_lit(np.array(albedo), vertex_normals(vertices, faces))


def _box(middle: Triple, half: Triple, turn: NDArray[np.float64], albedo: Triple, inwards: bool = False) -> Piece:
    """A turned box; one that looks inwards has no side towards +Z."""
    signs = np.array([[x, y, z] for z in (-1.0, 1.0) for y in (-1.0, 1.0) for x in (-1.0, 1.0)]) * np.array(half)
    x, y, z = ((signs[:, 0] * row[0] + signs[:, 1] * row[1]) + signs[:, 2] * row[2] for row in turn)
    corners = np.stack([x, y, z], axis=1) + np.array(middle)
    sides = _SIDES[[0, 2, 3, 4, 5]][:, ::-1] if inwards else _SIDES
    return _painted(corners[np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])], albedo)


def _blades() -> Piece:
    """Slivers: upright triangles 0.006 wide and up to 0.9 high, in a row that runs away from the viewer."""
    k = np.arange(_BLADES) / (_BLADES - 1.0)
    x = 1.15 - 1.1 * k * k
    z = 1.4 - 2.2 * k
    y = 0.3 + 0.6 * k
    foot = np.zeros(_BLADES)
    triangles = [[x - 0.003, foot, z], [x + 0.003, foot, z], [x + 0.05, y, z]]
    return _painted(np.moveaxis(np.array(triangles), -1, 0), _STEEL)
