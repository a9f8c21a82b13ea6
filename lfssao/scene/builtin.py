"""The scenes that the program makes itself: the paper's three models, and a gallery of all of them."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.scene.ammonite import ammonite
from lfssao.scene.armadillo import armadillo
from lfssao.scene.assembly import Piece, merged, sky_lit, vertex_normals
from lfssao.scene.implicit import Triple
from lfssao.scene.mesh import Mesh
from lfssao.scene.statue import statue

_CLAY = (0.72, 0.50, 0.30)
_FLOOR = (0.66, 0.64, 0.60)
_WALL = (0.50, 0.55, 0.60)
_BLOCK = (0.46, 0.43, 0.40)
_BLOCK_HEIGHT = 0.34

# Sine and cosine of the turns, about 16 degrees: a Pythagorean triple needs no rounding to be a rotation.
_TURN = (7.0 / 25.0, 24.0 / 25.0)
_NO_TURN = (0.0, 1.0)


def gallery() -> Mesh:
    """All three models side by side on a floor before a low wall, the ammonite in front on a block.

    Returns
    -------
    Mesh
        About 247,000 faces with linear RGB at the vertices; 4.8 scene units wide, 2 high, facing +Z,
        on a floor whose top is y = 0 and which is 0.1 thick.
    """
    creature = armadillo()
    clay = sky_lit(np.array(_CLAY), vertex_normals(creature.vertices, creature.faces))
    # The ammonite's ribs touch the block in single points: it is sunk in a little, so as to stand.
    on_block = _BLOCK_HEIGHT - 0.015
    pieces = [
        _placed(statue(), (-1.34, 0.0, -0.10), _TURN),
        _placed(ammonite(), (-0.06, on_block, 0.42), _TURN),
        _placed(creature, (1.30, 0.0, -0.10), _NO_TURN, clay),
        _slab((-2.40, -0.10, -1.05), (2.40, 0.0, 1.05), _FLOOR),
        _slab((-2.40, 0.0, -1.05), (2.40, 1.25, -0.93), _WALL),
        _slab((-0.62, 0.0, 0.12), (0.62, _BLOCK_HEIGHT, 0.72), _BLOCK),
    ]
    return merged(pieces, "gallery")


BUILTIN: dict[str, Callable[[], Mesh]] = {
    "gallery": gallery,
    "statue": statue,
    "ammonite": ammonite,
    "armadillo": armadillo,
}


def builtin_scene(name: str = "gallery") -> Mesh:
    """Make one of the embedded scenes.

    Parameters
    ----------
    name : str
        A key of `BUILTIN`.

    Returns
    -------
    Mesh
        In world space: right-handed, x to the right, y up, facing +Z, standing on y = 0; scene units.

    Raises
    ------
    InputError
        If there is no such scene.
    """
    if name not in BUILTIN:
        raise InputError(f"there is no embedded scene {name!r}; there are: {', '.join(BUILTIN)}")
    return BUILTIN[name]()


def _placed(mesh: Mesh, to: Triple, turn: tuple[float, float], colors: NDArray[np.float32] | None = None) -> Piece:
    """Mesh turned about the y axis (sine, cosine), then moved; its colours unless others are given."""
    x, y, z = mesh.vertices.T
    sine, cosine = turn
    vertices = np.stack([cosine * x + sine * z + to[0], y + to[1], cosine * z - sine * x + to[2]], axis=1)
    if colors is None:
        assert mesh.paint is not None
        assert mesh.paint.vertex_colors is not None
        colors = mesh.paint.vertex_colors
    return vertices, mesh.faces.astype(np.int64), colors


def _slab(low: Triple, high: Triple, albedo: Triple) -> Piece:
    """Box from low to high, each side with vertices of its own, so that it has a colour of its own."""
    vertices, normals = [], []
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        for outward, end in ((-1.0, low), (1.0, high)):
            # Counter-clockwise from outside: i to j is counter-clockwise about +k.
            first, second = (low, high) if outward > 0.0 else (high, low)
            for a, b in ((first[i], low[j]), (second[i], low[j]), (second[i], high[j]), (first[i], high[j])):
                corner, normal = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
                corner[i], corner[j], corner[k] = a, b, end[k]
                normal[k] = outward
                vertices.append(corner)
                normals.append(normal)
    first_corner = 4 * np.arange(6)[:, None]
    faces = np.concatenate([first_corner + np.array([0, 1, 2]), first_corner + np.array([0, 2, 3])])
    return np.array(vertices), faces, sky_lit(np.array(albedo), np.array(normals))
