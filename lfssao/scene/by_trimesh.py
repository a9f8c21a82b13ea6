"""Meshes that trimesh reads."""

import io
import logging
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from trimesh.exchange.load import mesh_loaders
from trimesh.visual.color import to_rgba
from trimesh.visual.material import empty_material

from lfssao.errors import InputError
from lfssao.files.srgb import to_linear
from lfssao.scene.assets import Assets, reason_of
from lfssao.scene.images import texture
from lfssao.scene.part import NO_COORDINATES, Part

# Its warnings are for whoever listens to them, and none of Python's handlers of last resort.
logging.getLogger("trimesh").addHandler(logging.NullHandler())

_ARCHIVES = ("3mf", "3dxml", "zae")  # trimesh would expand them to any size, if lxml is there


def read_by_trimesh(path: Path, data: bytes, assets: Assets) -> list[Part]:
    """Return the parts of a file of any format that trimesh reads; InputError for one that it does not."""
    kind = path.suffix.lower()[1:]
    if kind not in mesh_loaders or kind in _ARCHIVES:
        raise InputError(f"{path}: it cannot be read as a mesh (files ending in '{path.suffix}' have no reader)")
    # process=False: trimesh would merge vertices and renumber faces.
    given = mesh_loaders[kind](file_obj=io.BytesIO(data), file_type=kind, resolver=assets, process=False)
    given = {"process": False, **given}
    return _parts_of(path, trimesh.load_scene(given), given, assets)


def take_scene(scene: Any, assets: Assets) -> list[Part]:
    """Return the parts of a mesh or a scene; none of what holds no triangles."""
    if isinstance(scene, trimesh.Trimesh):
        scene = trimesh.Scene(scene)
    return _parts_of(Path("trimesh"), scene, {}, assets) if isinstance(scene, trimesh.Scene) else []


def _parts_of(path: Path, scene: Any, given: Any, assets: Assets) -> list[Part]:
    """Return the parts of a scene, and the normals that were given with them."""
    placed = [scene.graph[node] for node in scene.graph.nodes_geometry]
    meshes = [(scene.geometry[name], transform, name) for transform, name in placed]
    meshes = [each for each in meshes if isinstance(each[0], trimesh.Trimesh) and len(each[0].faces)]
    if meshes:
        assets.check_images()
    # Each vertex in float64, with copies as parts are put in place and joined.
    assets.check("its meshes", 200 * sum(len(mesh.vertices) + len(mesh.faces) for mesh, _, _ in meshes))
    parts = []
    for mesh, transform, name in meshes:
        # Not mesh.vertex_normals, which trimesh computes where the file has none.
        normals = given.get("geometry", {name: given})[name].get("vertex_normals")
        parts.append(_part(path, mesh, normals if np.shape(normals) == mesh.vertices.shape else None, assets))
        parts[-1].place(transform)
    return parts


def _part(path: Path, mesh: Any, normals: Any, assets: Assets) -> Part:
    """One geometry of trimesh as plain arrays."""
    part = Part(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64))
    part.normals = None if normals is None else np.asarray(normals, np.float64)
    visual = mesh.visual
    if visual.kind == "texture":
        _take_texture(path, part, visual, assets)
    elif visual.kind == "vertex":
        part.vertex_colors = to_linear(to_rgba(visual.vertex_colors)[:, :3])
    elif visual.kind == "face" and ((part.faces >= 0) & (part.faces < len(part.vertices))).all():
        part.color_faces(to_linear(np.asarray(visual.face_colors)[:, :3]))
    return part


def _take_texture(path: Path, part: Part, visual: Any, assets: Assets) -> None:
    if visual.uv is not None and len(visual.uv) == len(part.vertices):
        part.uv = np.asarray(visual.uv, np.float64)[:, :2]
    material = visual.material
    found = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    if found == empty_material().image:  # the grey one that trimesh makes for a file that names none
        found = None
    if assets.given is None and found is not None:
        _take_image(path, part, found, assets)
    factor = getattr(material, "baseColorFactor", None)
    if factor is not None:  # trimesh keeps linear factors as 8-bit numbers
        part.factor = np.asarray(factor, np.float32)[:3] / np.float32(255)


def _take_image(path: Path, part: Part, found: Any, assets: Assets) -> None:
    if part.uv is None:
        assets.note(NO_COORDINATES)
        return
    assets.check_texture(found)
    try:
        part.image = texture(found)
    except Exception as error:  # Pillow decodes late: a broken image is noticed only here
        reason = reason_of(path, error)
        raise InputError(f"{path}: its texture cannot be read as an image ({reason})") from error
