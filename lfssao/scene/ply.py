"""Meshes from PLY files."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.scene.assets import Assets
from lfssao.scene.images import texture
from lfssao.scene.part import MULTIPLIED, NO_COORDINATES, TOO_FEW_CORNERS, TRANSPARENT, TWO_COLORS, Part, distinct
from lfssao.scene.ply_elements import Element, read_elements
from lfssao.scene.polygons import IntArray, Polygons, triangulate
from lfssao.scene.text import color_values, whole

_INDICES = ("vertex_indices", "vertex_index", "vertex_indexes")
_COLORS = ("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue")
_OPACITIES = "alpha", "a", "diffuse_alpha"
_COORDINATES = ("texture_u", "texture_v"), ("u", "v"), ("s", "t"), ("texture_s", "texture_t")
_FULL = {"u2": 65535.0, "f4": None, "f8": None}  # the value of a colour that means 1, where it is not 255
_LIKE_COLORS = re.compile(r"(^|_)(red|green|blue|gr[ae]y|colou?r|rgba?|f_dc)(_|\d|$)", re.IGNORECASE)


def read_ply(path: Path, data: bytes, assets: Assets) -> list[Part]:
    """Return the triangles of a PLY, one part an image that its comments name (TextureFile).

    Text or binary of both byte orders; words of text are separated by any white space. Faces are polygons or strips of
    triangles. Colours of vertices or faces are sRGB: 1 is 65535 of ushort, 1 of float and 255 of others; floats that
    reach 2 to 255 are read as 0 to 255. Texture coordinates, v upwards, are those of vertices or of faces' corners.
    Other elements are left out. InputError if the file is broken, ends too early, names a vertex that does not exist or
    has a colour of several types.
    """
    elements, images = read_elements(path, data, assets)
    vertex, face = (elements.get(name, Element(name, 0)) for name in ("vertex", "face"))
    vertices = vertex.several(("x", "y", "z"))
    if vertices is None:
        raise InputError(f"{path}: it has no element 'vertex' with x, y and z")
    polygons = _polygons(path, face)
    declared = len(polygons.counts)
    if "tristrips" in elements:
        polygons = polygons.followed_by(_strips(path, elements["tristrips"]))
    assets.check("its meshes", 200 * (len(vertices) + len(polygons.corners)))
    triangles, owner = triangulate(lambda number: f"{path}: face {number}", vertices, polygons)
    if (polygons.counts < 3).any():
        assets.note(TOO_FEW_CORNERS)
    part = Part(vertices, polygons.corners[triangles])
    part.normals = vertex.several(("nx", "ny", "nz"))
    part.uv = vertex.several(*_COORDINATES)
    part.vertex_colors = _colors(path, vertex, assets)
    if "w" in vertex.columns and (vertex.columns["w"] != 1).any():
        assets.note("w of its vertices is left out")
    if "texcoord" in face.lists:
        _take_corner_coordinates(part, face.lists["texcoord"][0], polygons, triangles, assets)
    colors = _colors(path, face, assets)
    if colors is not None and part.vertex_colors is not None:
        assets.note(TWO_COLORS)
    elif colors is not None:
        strips = np.ones((len(polygons.counts) - declared, 3), np.float32)
        part.color_faces(np.concatenate([colors, strips])[owner])
    if part.vertex_colors is None:
        _note_unread_colors(elements, assets)
    chosen = np.zeros(len(polygons.counts), np.int64)
    if "texnumber" in face.columns:
        chosen[:declared] = whole(face.columns["texnumber"])
    return _with_images(path, part, chosen[owner], images, assets)


def _polygons(path: Path, face: Element) -> Polygons:
    """Return the corners of faces."""
    for name in _INDICES:
        if name in face.lists:
            return Polygons(whole(face.lists[name][0]), face.lists[name][1])
    if face.count:
        raise InputError(f"{path}: its faces have no list '{_INDICES[0]}'")
    return Polygons(np.zeros(0, np.int64), np.zeros(0, np.int64))


def _strips(path: Path, element: Element) -> IntArray:
    """Return triangles, (T, 3), of strips that end with their list or at -1; every second triangle is reversed."""
    name = next((name for name in _INDICES if name in element.lists), None)
    if name is None:
        raise InputError(f"{path}: its strips of triangles have no list '{_INDICES[0]}'")
    items, lengths = element.lists[name]
    corners = whole(items)
    # A -1 behind each list ends the strip, too.
    corners = np.insert(corners, np.cumsum(lengths), -1)
    ends = np.flatnonzero(corners == -1)
    place = np.arange(len(corners)) - np.repeat(np.append(0, ends[:-1] + 1), np.diff(ends, prepend=-1))
    triangles = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    odd = place[:-2] % 2 == 1
    triangles[odd] = triangles[odd][:, [1, 0, 2]]
    return np.asarray(triangles[(triangles != -1).all(axis=1)])


def _colors(path: Path, element: Element, assets: Assets) -> NDArray[np.float32] | None:
    """Linear RGB of vertices or faces, (count, 3) float32."""
    values = element.several(*_COLORS)
    if values is None:
        return None
    names = next(names for names in _COLORS if set(names) <= set(element.columns))
    most, *others = {_FULL.get(element.types[name], 255.0) for name in names}
    if others:
        raise InputError(f"{path}: element '{element.name}': {', '.join(names)} are not of one type")
    for opacity in _OPACITIES:
        if opacity in element.columns and (element.columns[opacity] < (most or 1.0)).any():
            assets.note(TRANSPARENT)
    try:
        colors, note = color_values(values, most)
    except ValueError as error:
        raise InputError(f"{path}: element '{element.name}': {error}") from None
    assets.note(note)
    return colors


def _note_unread_colors(elements: dict[str, Element], assets: Assets) -> None:
    """Note properties that are perhaps colours, where no colour is read."""
    for element in elements.values():
        for name in element.types:
            if element.name != "edge" and _LIKE_COLORS.search(name):
                assets.note(f"'{name:.40}' of its element '{element.name:.40}', which may be a colour, is left out")


def _take_corner_coordinates(
    part: Part, items: NDArray[np.generic], polygons: Polygons, triangles: IntArray, assets: Assets
) -> None:
    """Give a part the texture coordinates of the corners of its faces, and each pair of a vertex a copy of it."""
    if len(items) != 2 * len(polygons.corners):
        assets.note("texture coordinates are left out: they are not two numbers for each corner of the faces")
        return
    corners = triangles.reshape(-1)
    uv = items.astype(np.float64).reshape(-1, 2)[corners]
    named = polygons.corners[corners]
    places, numbers = distinct(np.column_stack([named, uv]))
    for name in ("vertices", "normals", "vertex_colors"):
        values = getattr(part, name)
        setattr(part, name, None if values is None else values[named[places]])
    part.uv = uv[places]
    part.faces = numbers.reshape(-1, 3)


def _with_images(path: Path, part: Part, chosen: IntArray, images: list[str], assets: Assets) -> list[Part]:
    """Return a part for each image that faces choose by its number."""
    if not images or assets.given is not None:
        return [part]
    if part.uv is None:
        assets.note(NO_COORDINATES)
        return [part]
    if part.vertex_colors is not None and (part.vertex_colors != 1).any():
        assets.note(MULTIPLIED)
    if ((chosen < 0) | (chosen >= len(images))).any():
        raise InputError(f"{path}: its faces name textures up to {chosen.max()}, but there are {len(images)}")
    return [
        replace(part, faces=part.faces[chosen == number], image=assets.image(images[number], None, texture))
        for number in np.unique(chosen)
    ]
