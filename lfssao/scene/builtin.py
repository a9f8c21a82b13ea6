"""The embedded scenes: the paper's three models, a gallery of all three, with and without a wall, and a test view.

They are read from ``meshes``, whose files ``benchmarks/scenes`` makes.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError, check_choice, meant
from lfssao.scene.mesh import Mesh, Paint

BUILTIN = ("gallery", "turntable", "statue", "ammonite", "armadillo", "corner")

# The camera of the test view, in the scene ``corner``: tilted, surface up to all four borders. Eye, target, up, extent,
# near and far plane.
TEST_VIEW = (1.8, 2.5, 2.7), (-0.3, 0.55, -0.9), (0.16, 1.0, 0.05), 4.5, 0.9, 9.0

# Models of the gallery with their positions and the sine and cosine of their turns about y. A Pythagorean triple
# gives a turn of about 16 degrees. The ammonite's ribs touch its block, 0.34 high, in points: it is sunk in a little.
_GALLERY = (
    ("statue", (-1.34, 0.0, -0.10), (7.0 / 25.0, 24.0 / 25.0)),
    ("ammonite", (-0.06, 0.34 - 0.015, 0.42), (7.0 / 25.0, 24.0 / 25.0)),
    ("armadillo", (1.30, 0.0, -0.10), (0.0, 1.0)),
)

_Arrays = dict[str, NDArray[Any]]


def builtin_scene(name: str = "gallery") -> Mesh:
    """Read one of the embedded scenes, ``BUILTIN``; InputError if there is none of that name.

    World space is right-handed, x to the right, y up; the scene faces +Z and stands on y = 0, in scene units. All but
    the armadillo have linear RGB at the vertices.

    >>> len(lfssao.builtin_scene("statue").faces)
    5010
    """
    check_choice("embedded scene", name, BUILTIN)
    arrays = _gallery(name) if name in ("gallery", "turntable") else _read(name)
    faces = arrays["faces"]
    paint = Paint.from_vertex_colors(arrays["colors"], len(faces)) if "colors" in arrays else None
    return Mesh(arrays["vertices"], faces, paint, name=name)


def find_scene(scene: Any, texture: str | Path | None = None) -> Mesh:
    """Return the embedded scene of a name, the mesh of a file (``load_scene``), or of an object.

    Objects are a ``Mesh``, a mesh or a scene of trimesh with its colours, vertices (V, 3) and faces (F, 3) as a pair,
    or anything that has these two as attributes. A name of ``BUILTIN`` wins over a folder of that name. InputError if
    there is none, or a texture does not fit.

    >>> find_scene("statue").name
    'statue'
    >>> len(find_scene(trimesh.creation.box()).faces)
    12
    """
    if isinstance(scene, str) and scene in BUILTIN:
        if texture is not None:
            raise InputError(f"--texture: the embedded scene {scene} takes none")
        return builtin_scene(scene)
    if not isinstance(scene, str | Path) and texture is not None:
        raise InputError("texture: it is for a mesh file")
    if isinstance(scene, Mesh):
        return scene
    if type(scene).__module__.split(".")[0] == "trimesh":
        from lfssao.scene.load import convert_scene  # late, as below

        return convert_scene(scene)
    if not isinstance(scene, str | Path):
        pair = (scene.vertices, scene.faces) if hasattr(scene, "vertices") and hasattr(scene, "faces") else scene
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            wanted = "expected a Mesh, a scene's name, a mesh file, a mesh of trimesh, or vertices and faces"
            raise InputError(f"mesh is of type {type(scene).__name__}, {wanted}")
        return Mesh(pair[0], pair[1])
    if not Path(scene).suffix and not os.path.exists(scene):  # Path's raises where a name is too long
        near = meant(scene, BUILTIN)
        names = ", ".join(BUILTIN)
        raise InputError(f"{scene}: there is no such file, and no embedded scene of that name ({names}){near}")
    from lfssao.scene.load import load_scene  # late: trimesh takes 0.4 s to import, and embedded scenes need none

    return load_scene(scene, texture)


def _read(name: str) -> _Arrays:
    """Arrays of one file: vertices (V, 3) float64, faces (F, 3) int32, colors (V, 3) float32 of a painted mesh."""
    with np.load(Path(__file__).parent / "meshes" / f"{name}.npz") as file:
        return dict(file)


def _gallery(scene: str) -> _Arrays:
    """All three models side by side on a floor, the ammonite in front on a block; in the gallery before a low wall."""
    boxes = _read("gallery")
    if scene == "turntable":  # the second of three boxes
        boxes["faces"] = np.delete(boxes["faces"], np.s_[12:24], axis=0)
    clay = boxes.pop("clay")  # of the armadillo, which has no colours of its own
    pieces = []
    for name, position, turn in _GALLERY:
        model = {"colors": clay} | _read(name)
        pieces.append(model | {"vertices": _placed(model["vertices"], position, turn)})
    pieces.append(boxes)
    first = 0
    for piece in pieces:
        piece["faces"] = piece["faces"] + first
        first += len(piece["vertices"])
    return {key: np.concatenate([piece[key] for piece in pieces]) for key in ("vertices", "faces", "colors")}


def _placed(vertices: NDArray[Any], to: tuple[float, float, float], turn: tuple[float, float]) -> NDArray[np.float64]:
    """Return vertices (V, 3) turned about the y axis by an angle, given as sine and cosine, and then moved."""
    x, y, z = vertices.T
    sine, cosine = turn
    return np.stack([cosine * x + sine * z + to[0], y + to[1], cosine * z - sine * x + to[2]], axis=1)
