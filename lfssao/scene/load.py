"""Meshes from files; a broken file is refused in one sentence."""

import warnings
from collections.abc import Callable
from pathlib import Path

from lfssao.errors import InputError, check_type
from lfssao.files.whole import check_file
from lfssao.scene.assets import Assets, reason_of
from lfssao.scene.by_trimesh import read_by_trimesh, take_scene
from lfssao.scene.gltf import read_gltf
from lfssao.scene.images import read_image
from lfssao.scene.mesh import Mesh
from lfssao.scene.obj import read_obj
from lfssao.scene.off import read_off
from lfssao.scene.part import Part, join
from lfssao.scene.ply import read_ply
from lfssao.scene.stl import read_stl

# The reader of each ending; trimesh reads the others.
_READERS: dict[str, Callable[[Path, bytes, Assets], list[Part]]] = {
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".obj": read_obj,
    ".off": read_off,
    ".ply": read_ply,
    ".stl": read_stl,
}


def load_scene(path: str | Path, texture: str | Path | None = None) -> Mesh:
    """Return all triangles of a file in its own coordinates, as one mesh.

    It may be an OBJ, PLY, OFF or STL, a glTF 2.0 (.gltf, .glb: the default scene in its rest pose), or any other mesh
    file, but no archive, that trimesh reads; transforms are applied.
    The texture is an image for a mesh with texture coordinates; it takes the place of images that the file names. The
    mesh has the diffuse colours of textures, materials, vertices or faces, where the file has them. An OBJ's image
    takes the place of its Kd (exporters write a Kd of 0 or 0.8 with it); glTF's factors multiply.

    InputError if the file is missing, cannot be read or holds no triangles; if it names an image that is missing or
    cannot be read and no texture is given; if a texture is given to a mesh without texture coordinates; if the mesh is
    broken (``Mesh``).

    >>> _ = trimesh.creation.box().export("box.off")
    >>> len(lfssao.load_scene("box.off").faces)
    12
    """
    check_type("path", path, str | Path)
    path = Path(path)
    check_file(path)
    if texture is not None:
        check_type("texture", texture, str | Path)
    assets = Assets(path, None if texture is None else read_image(Path(texture)))
    parts = [part for part in _read(path, assets) if len(part.faces)]
    if not parts:
        raise InputError(f"{path}: the file holds no triangles")
    if assets.given is not None and all(part.uv is None for part in parts):
        raise InputError(f"{path}: a texture was given, but the mesh has no texture coordinates")
    for part in parts:
        if assets.given is not None:
            part.image = None if part.uv is None else assets.given
        part.check(str(path))
    _mend_normals(parts, assets)
    return Mesh(**join(parts), name=str(path), notes=tuple(assets.notes()))


def convert_scene(scene: object) -> Mesh:
    """Return all triangles of a mesh or a scene of trimesh, with their colours; InputError if there are none."""
    assets = Assets(Path())  # of no file
    parts = take_scene(scene, assets)
    if not parts:
        raise InputError(f"mesh is of type {type(scene).__name__} of trimesh, it holds no triangles")
    for part in parts:
        part.check("trimesh")
    _mend_normals(parts, assets)
    return Mesh(**join(parts), name="trimesh", notes=tuple(assets.notes()))


def _mend_normals(parts: list[Part], assets: Assets) -> None:
    count = sum(part.mend_normals() for part in parts)
    if count:
        assets.note(f"normals of {count} of its vertices are 0 or not finite: those of their faces take their place")


def _read(path: Path, assets: Assets) -> list[Part]:
    """Return the parts of a file, by the reader of its ending."""
    try:
        with warnings.catch_warnings():
            # Libraries warn of what is checked here, except for NumPy's reading of numbers up to a word that is none.
            warnings.simplefilter("ignore")
            warnings.filterwarnings("error", message="string or file could not be read to its end")
            data = path.read_bytes()
            if not data:
                raise InputError(f"{path}: the file is empty")
            return _READERS.get(path.suffix.lower(), read_by_trimesh)(path, data, assets)
    except InputError:
        raise
    except Exception as error:  # any that the format's reader raises
        raise InputError(f"{path}: it cannot be read as a mesh ({reason_of(path, error)})") from error
