"""Meshes from files, through trimesh, with everything that could be wrong found here and said in one sentence."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.scene.mesh import Mesh, Paint
from lfssao.srgb import to_linear


def load_scene(path: str | Path, texture: str | Path | None = None) -> Mesh:
    """All triangles of a file in its own coordinates, as one mesh.

    Parameters
    ----------
    path : str or Path
        Any mesh file that trimesh reads: OBJ, PLY, STL, OFF, GLB, ...; the transforms of a scene are applied.
    texture : str or Path, optional
        An image for a mesh whose file has texture coordinates but names no image.

    Returns
    -------
    Mesh
        With the diffuse colours of textures, materials, vertices or faces, where the file has them.

    Raises
    ------
    InputError
        If the file is missing, cannot be read or holds no triangles, or the mesh is broken (``Mesh``).
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    image = None if texture is None else _read_image(Path(texture))
    parts = [_Part(geometry, image) for geometry in _read(path)]
    if not parts:
        raise InputError(f"{path}: the file holds no triangles")
    if image is not None and not any(part.uv is not None for part in parts):
        raise InputError(f"{path}: a texture was given, but the mesh has no texture coordinates")
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    return Mesh(
        vertices=np.concatenate([part.vertices for part in parts]),
        faces=np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)]),
        paint=_join_paint(parts),
        name=str(path),
    )


def _read(path: Path) -> list[Any]:
    """The file's meshes as trimesh has them, transforms applied."""
    import trimesh  # late: takes half a second to import

    try:
        # process=False: trimesh would merge vertices and renumber faces.
        scene = trimesh.load_scene(path, process=False)
        geometries = scene.dump()
    except Exception as error:  # whatever the format's reader stumbled over
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: it cannot be read as a mesh ({reason})") from error
    return [g for g in geometries if isinstance(g, trimesh.Trimesh) and len(g.faces)]


def _read_image(path: Path) -> NDArray[np.uint8]:
    """An image file as (h, w, 3) sRGB codes."""
    from PIL import Image  # late: only needed with textures

    try:
        with Image.open(path) as image:
            return np.asarray(image.convert("RGB"))
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file") from error
    except OSError as error:
        raise InputError(f"{path}: it cannot be read as an image ({error})") from error


def _is_placeholder(image: Any) -> bool:
    """Whether an image is the grey one that trimesh makes up for a file that names none."""
    from trimesh.visual.material import empty_material  # late: trimesh is loaded by now

    grey = empty_material().image
    return bool(image.size == grey.size and image.mode == grey.mode and image.tobytes() == grey.tobytes())


class _Part:
    """One geometry of a file: plain arrays of its triangles and what colours them."""

    def __init__(self, geometry: Any, image: NDArray[np.uint8] | None) -> None:
        self.vertices = np.asarray(geometry.vertices, np.float64)
        self.faces = np.asarray(geometry.faces, np.int64)
        self.factor = np.ones(3, np.float32)
        self.image = image
        self.uv: NDArray[np.float64] | None = None
        self.vertex_colors: NDArray[np.float32] | None = None
        visual = geometry.visual
        if visual.kind == "texture":
            self._take_texture(visual)
        elif visual.kind == "vertex":
            self.vertex_colors = to_linear(np.asarray(visual.vertex_colors)[:, :3])
        elif visual.kind == "face":
            self._take_face_colors(np.asarray(visual.face_colors)[:, :3])

    @property
    def colored(self) -> bool:
        return self.image is not None or self.vertex_colors is not None or bool((self.factor != 1).any())

    def _take_texture(self, visual: Any) -> None:
        if visual.uv is not None and len(visual.uv) == len(self.vertices):
            self.uv = np.asarray(visual.uv, np.float64)
        material = visual.material
        found = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
        if self.image is None and found is not None and not _is_placeholder(found):
            self.image = np.asarray(found.convert("RGB"))
        if self.uv is None or not np.isfinite(self.uv).all():
            self.uv = self.image = None
        factor = getattr(material, "baseColorFactor", None)
        if factor is not None:  # glTF's factor is linear, but trimesh keeps it as 8-bit numbers
            self.factor = np.asarray(factor, np.float32)[:3] / np.float32(255)
        elif getattr(material, "diffuse", None) is not None and found is None:
            self.factor = to_linear(np.asarray(material.diffuse, np.uint8)[:3])

    def _take_face_colors(self, colors: NDArray[np.uint8]) -> None:
        """Give each face its own three vertices in its colour."""
        self.vertices = self.vertices[self.faces].reshape(-1, 3)
        self.faces = np.arange(len(self.vertices)).reshape(-1, 3)
        self.vertex_colors = to_linear(np.repeat(colors, 3, axis=0))


def _join_paint(parts: list[_Part]) -> Paint | None:
    """The paint of all parts, one material each; None where no part has colour."""
    if not any(part.colored for part in parts):
        return None
    uv = vertex_colors = None
    if any(part.uv is not None for part in parts):
        uv = np.concatenate([np.zeros((len(p.vertices), 2)) if p.uv is None else p.uv for p in parts])
    if any(part.vertex_colors is not None for part in parts):
        vertex_colors = np.concatenate(
            [np.ones((len(p.vertices), 3), np.float32) if p.vertex_colors is None else p.vertex_colors for p in parts]
        )
    return Paint(
        factors=np.stack([part.factor for part in parts]),
        face_material=np.repeat(np.arange(len(parts), dtype=np.int32), [len(part.faces) for part in parts]),
        textures=tuple(None if part.image is None else to_linear(part.image) for part in parts),
        uv=uv,
        vertex_colors=vertex_colors,
    )
