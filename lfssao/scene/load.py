"""Meshes from files, through trimesh; a broken file is refused in one sentence."""

import io
import logging
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from trimesh.exchange.load import mesh_loaders
from trimesh.visual.color import to_rgba
from trimesh.visual.material import empty_material

from lfssao.core.affine import cofactors, transform_points
from lfssao.core.files import check_file
from lfssao.core.memory import check_expansion
from lfssao.core.srgb import to_linear
from lfssao.errors import InputError, check_type
from lfssao.scene.assets import Assets, bytes_of, reason_of
from lfssao.scene.formats import CHECKS, readable
from lfssao.scene.gltf import check_gltf
from lfssao.scene.mesh import Mesh, Paint

# Its warnings are for whoever listens to them, and none of Python's handlers of last resort.
logging.getLogger("trimesh").addHandler(logging.NullHandler())

_GLTF = (".glb", ".gltf")
_ARCHIVES = ("3mf", "3dxml", "zae")  # trimesh would expand them to any size, if lxml is there


def load_scene(path: str | Path, texture: str | Path | None = None) -> Mesh:
    """Return all triangles of a file in its own coordinates, as one mesh.

    It may be any mesh file, but no archive, that trimesh reads: OBJ, PLY, STL, OFF, GLB, ...; transforms are applied.
    The texture is an image for a mesh with texture coordinates; it takes the place of images that the file names. The
    mesh has the diffuse colours of textures, materials, vertices or faces, where the file has them. An OBJ's image
    takes the place of its Kd (exporters write a Kd of 0 or 0.8 beside it); glTF's factors multiply.

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
    image = None if texture is None else _read_image(Path(texture))
    assets = Assets(path)
    geometries = _read(path, assets)
    if not geometries:
        raise InputError(f"{path}: the file holds no triangles")
    if image is None:
        assets.check_images()
    # Each vertex in float64, with copies as parts are put in place and joined.
    assets.check("its meshes", 200 * sum(len(mesh.vertices) + len(mesh.faces) for mesh, _, _ in geometries))
    parts = [_Part(path, *geometry, image, assets) for geometry in geometries]
    if image is not None and not any(part.uv is not None for part in parts):
        raise InputError(f"{path}: a texture was given, but the mesh has no texture coordinates")
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    normals = [part.normals for part in parts if part.normals is not None]
    return Mesh(
        vertices=np.concatenate([part.vertices for part in parts]),
        faces=np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)]),
        paint=_join_paint(parts),
        normals=np.concatenate(normals) if len(normals) == len(parts) else None,
        name=str(path),
        notes=(*assets.notes(), *dict.fromkeys(part.note for part in parts if part.note)),
    )


def _read(path: Path, assets: Assets) -> list[tuple[Any, NDArray[np.float64], NDArray[np.float64] | None]]:
    """The file's meshes as trimesh has them, each with its (4, 4) transform and the normals that the file has."""
    ending = path.suffix.lower()
    kind = ending[1:]
    try:
        with warnings.catch_warnings():
            # Libraries warn of what is checked here, except for NumPy's reading of numbers up to a word that is none.
            warnings.simplefilter("ignore")
            warnings.filterwarnings("error", message="string or file could not be read to its end")
            data = path.read_bytes()
            if not data:
                raise InputError(f"{path}: the file is empty")
            data = readable(ending, data)
            declared = CHECKS[ending](path, data) if ending in CHECKS else 0
            if ending in _GLTF:
                check_gltf(path, data, assets)
            if kind not in mesh_loaders or kind in _ARCHIVES:
                raise InputError(
                    f"{path}: it cannot be read as a mesh (files ending in '{path.suffix}' have no reader)"
                )
            # process=False: trimesh would merge vertices and renumber faces.
            given = mesh_loaders[kind](file_obj=io.BytesIO(data), file_type=kind, resolver=assets, process=False)
            given = {"process": False, **given}
            scene = trimesh.load_scene(given)
            placed = [scene.graph[node] for node in scene.graph.nodes_geometry]
    except InputError:
        raise
    except Exception as error:  # whatever the format's reader stumbled over
        raise InputError(f"{path}: it cannot be read as a mesh ({reason_of(path, error)})") from error
    meshes = []
    for transform, name in placed:
        mesh = scene.geometry[name]
        if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
            # Not mesh.vertex_normals, which trimesh computes where the file has none.
            normals = given.get("geometry", {name: given})[name].get("vertex_normals")
            meshes.append((mesh, transform, normals if np.shape(normals) == mesh.vertices.shape else None))
    found = sum(len(mesh.faces) for mesh, _, _ in meshes)
    if found < declared:
        raise InputError(f"{path}: it declares {declared} faces, of which {found} can be read")
    return meshes


def _read_image(path: Path) -> NDArray[np.float32]:
    """An image file as (h, w, 3) linear RGB."""
    check_file(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow's of large images
            with Image.open(path) as image:
                check_expansion("its texels", bytes_of(image), path.stat().st_size)
                return _texture(image)
    except Exception as error:  # each of Pillow's readers has errors of its own
        raise InputError(f"{path}: it cannot be read as an image ({reason_of(path, error)})") from error


def _texture(image: Any) -> NDArray[np.float32]:
    """Pixels of a Pillow image as (h, w, 3) linear RGB; transparency is left out."""
    if image.mode in ("I", "F"):
        raise ValueError(f"pixels of mode {image.mode} have no known range")
    if image.mode.startswith("I;16"):  # Pillow would clip 16-bit grey at 255
        grey = (np.asarray(image).astype(np.uint32) * 255 + 32767) // 65535
        return to_linear(np.repeat(grey.astype(np.uint8)[..., None], 3, axis=2))
    return to_linear(np.asarray(image.convert("RGB")))


class _Part:
    """One geometry of a file: plain arrays of its triangles and colours."""

    def __init__(
        self,
        path: Path,
        geometry: Any,
        transform: NDArray[np.float64],
        normals: NDArray[np.float64] | None,
        image: NDArray[np.float32] | None,
        assets: Assets,
    ) -> None:
        # Not by trimesh's own transform, which is a BLAS product: its bits differ between machines.
        self.vertices = _placed(transform, np.asarray(geometry.vertices, np.float64))
        self.normals: NDArray[np.float64] | None = None
        if normals is not None:
            turned = np.hstack([cofactors(transform), np.zeros((3, 1))])
            self.normals = _placed(turned, np.asarray(normals, np.float64))
        self.faces = np.asarray(geometry.faces, np.int64)
        self.factor = np.ones(3, np.float32)
        self.image = image
        self.uv: NDArray[np.float64] | None = None
        self.vertex_colors: NDArray[np.float32] | None = None
        self.note = ""
        self._path, self._assets = path, assets
        visual = geometry.visual
        if visual.kind == "texture":
            self._take_texture(visual)
        elif visual.kind == "vertex":
            self.vertex_colors = self._linear_colors(visual.vertex_colors)
        elif visual.kind == "face":
            self._take_face_colors(np.asarray(visual.face_colors)[:, :3])
        if self.uv is None:
            self.image = None
        self.colored = self.image is not None or self.vertex_colors is not None or bool((self.factor != 1).any())

    def _take_texture(self, visual: Any) -> None:
        if visual.uv is not None and len(visual.uv) == len(self.vertices):
            self.uv = np.zeros((len(visual.uv), 2))  # OBJ may leave v out, which is then 0
            self.uv[:, : visual.uv.shape[1]] = visual.uv[:, :2]
        material = visual.material
        found = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
        if found == empty_material().image:  # the grey one that trimesh makes for a file that names none
            found = None
        if self.image is None and found is not None:
            self._take_image(found)
        if self.image is not None and self.uv is not None and not np.isfinite(self.uv).all():
            raise InputError(f"{self._path}: a texture coordinate is not finite")
        self._take_factor(material, found)
        colors = visual.vertex_attributes.get("color")  # where glTF has a material and colours at the vertices
        if colors is not None and len(colors) == len(self.vertices):
            self.vertex_colors = self._linear_colors(colors)

    def _take_image(self, found: Any) -> None:
        if self.uv is None:
            self.note = "an image is left out, as its faces have no texture coordinates"
            return
        self._assets.check_texture(found)
        try:
            self.image = _texture(found)
        except Exception as error:  # Pillow decodes late: a broken image is noticed only here
            reason = reason_of(self._path, error)
            raise InputError(f"{self._path}: its texture cannot be read as an image ({reason})") from error

    def _take_factor(self, material: Any, found: Any) -> None:
        factor = getattr(material, "baseColorFactor", None)
        if factor is not None:  # glTF's factor is linear, but trimesh keeps it as 8-bit numbers
            self.factor = np.asarray(factor, np.float32)[:3] / np.float32(255)
        # trimesh makes up a grey for a material without Kd; what the file said is in kwargs.
        elif found is None and "kd" in getattr(material, "kwargs", {}):
            self.factor = to_linear(np.asarray(material.diffuse, np.uint8)[:3])

    def _linear_colors(self, colors: Any) -> NDArray[np.float32]:
        """Linear RGB of vertex colours: glTF's are linear, those of other formats are sRGB codes."""
        codes: NDArray[np.uint8] = to_rgba(np.array(colors))[:, :3]
        if self._path.suffix.lower() in _GLTF:
            return codes.astype(np.float32) / np.float32(255)
        return to_linear(codes)

    def _take_face_colors(self, colors: NDArray[np.uint8]) -> None:
        """Give each face its own three vertices in its colour."""
        if not ((self.faces >= 0) & (self.faces < len(self.vertices))).all():
            return  # Mesh refuses it
        self.vertices = self.vertices[self.faces].reshape(-1, 3)
        self.normals = None if self.normals is None else self.normals[self.faces].reshape(-1, 3)
        self.faces = np.arange(len(self.vertices)).reshape(-1, 3)
        self.vertex_colors = to_linear(np.repeat(colors, 3, axis=0))


def _placed(transform: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points under a transform; under the identity with the bits that they have."""
    return points if np.array_equal(transform[:3], np.eye(3, 4)) else transform_points(transform, points)


def _join_paint(parts: list[_Part]) -> Paint | None:
    """The paint of all parts, one material each; None if no part has colour."""
    if not any(part.colored for part in parts):
        return None
    uv = [np.zeros((len(p.vertices), 2)) if p.uv is None else p.uv for p in parts]
    colors = [np.ones((len(p.vertices), 3), np.float32) if p.vertex_colors is None else p.vertex_colors for p in parts]
    return Paint(
        factors=np.stack([part.factor for part in parts]),
        face_material=np.repeat(np.arange(len(parts), dtype=np.int32), [len(part.faces) for part in parts]),
        textures=tuple(part.image for part in parts),
        uv=None if all(part.uv is None for part in parts) else np.concatenate(uv),
        vertex_colors=None if all(part.vertex_colors is None for part in parts) else np.concatenate(colors),
    )
