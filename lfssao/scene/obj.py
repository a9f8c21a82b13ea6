"""Meshes from OBJ files."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.scene.assets import Assets
from lfssao.scene.images import texture
from lfssao.scene.mesh import CLAMPED, REPEATED, FloatArray
from lfssao.scene.mtl import Material, read_materials
from lfssao.scene.obj_lines import Lines
from lfssao.scene.part import MULTIPLIED, NO_COORDINATES, TOO_FEW_CORNERS, TRANSPARENT, Part, distinct
from lfssao.scene.polygons import IntArray, Polygons, triangulate
from lfssao.scene.text import as_text, color_values

_CONTINUED = re.compile(r"^(?!\s*#)(?:.*\\\n)+.*", re.MULTILINE)  # comments are not


def read_obj(path: Path, data: bytes, assets: Assets) -> list[Part]:
    """Return the triangles of an OBJ, one part a material, that of the file's last one first.

    A fourth number of a vertex divides the others; three or four more than three are its sRGB colour, 0 to 1, or 0 to
    255 if one is at least 2, and vertices without are white. Kd is sRGB; an image takes its place (map_Kd, with
    texture coordinates times -s plus -o), and colours of vertices multiply. Faces without texture coordinates have no
    image. Negative numbers count from the lines read before. InputError, with the line, for what is broken or is a
    surface of another kind, or names a vertex that does not exist.
    """
    text = as_text(data)
    if "\\\n" in text:
        text = _CONTINUED.sub(lambda found: found[0].replace("\\\n", " ") + "\n" * found[0].count("\\\n"), text)
    if "#MRGB " in text:
        assets.note("colours of its vertices in comments (#MRGB, as of ZBrush) are left out")
    lines = Lines(assets)
    try:
        lines.read(text)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    positions = np.array(lines.positions, np.float64).reshape(-1, 3)
    corners = np.array(lines.corners, np.int64)
    counts = np.array(lines.counts, np.int64)
    triples = _triples(path, lines, corners, counts, assets)
    assets.check("its meshes", 200 * (len(positions) + len(corners)))
    polygons = Polygons(triples[corners, 0], counts)
    places, owner = triangulate(lambda face: f"{path}: line {lines.lines[face]}: a face", positions, polygons)
    if (counts < 3).any():
        assets.note(TOO_FEW_CORNERS)
    triangles = corners[places]
    used = np.array(lines.materials, np.int64)[owner]
    materials = _Materials(path, lines.libraries, assets)
    parts = []
    colors = _colors(path, lines, assets)
    for name, number in reversed(lines.names.items()):
        own = triangles[used == number]
        if not len(own):
            continue
        material = materials.find(name)
        mapped = (triples[own, 1] >= 0).all(axis=1)
        textured = material.image is not None or assets.given is not None
        for uv, chosen in ((True, mapped), (False, ~mapped)) if textured else ((bool(mapped.all()), mapped | True),):
            if chosen.any():
                part = _part(lines, positions, triples, own[chosen], uv, colors)
                materials.paint(part, material)
                parts.append(part)
    return parts


def _triples(path: Path, lines: Lines, corners: IntArray, counts: IntArray, assets: Assets) -> IntArray:
    """Return the vertex, texture coordinate and normal of each corner, (C, 3), counted from 0; -1 where it has none."""
    triples = np.array(lines.table.triples, np.int64).reshape(-1, 3) - 1
    known = len(lines.positions) // 3, len(lines.coordinates) // 2, len(lines.normals) // 3
    wrong = triples[:, 0] >= known[0]
    if wrong.any():
        face = int(np.searchsorted(np.cumsum(counts), int(wrong[corners].argmax()), side="right"))
        number = int(triples[corners, 0][wrong[corners]][0]) + 1
        missing = f"a face names a vertex that does not exist: {number} of {known[0]}"
        raise InputError(f"{path}: line {lines.lines[face]}: {missing}")
    for column, what in ((1, "texture coordinates"), (2, "normals")):
        wrong = triples[:, column] >= known[column]
        if wrong.any():
            assets.note(f"faces name {what} that do not exist: they have none")
            triples[wrong, column] = -1
    return triples


def _colors(path: Path, lines: Lines, assets: Assets) -> NDArray[np.float32] | None:
    """Linear RGB of all vertices, (V, 3) float32, white where a vertex has none; None if none has."""
    if not lines.colored:
        return None
    given = np.array(lines.colors, np.float64).reshape(-1, 4)
    opacity = given[:, 3]
    if (opacity < 1).any():
        if (given[~np.isnan(opacity), 0] == 1).all():
            raise InputError(f"{path}: its vertices have seven numbers: w before r, g and b, or opacity behind them")
        assets.note(TRANSPARENT)
    try:
        linear, note = color_values(given[:, :3])
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    assets.note(note)
    colors = np.ones((len(lines.positions) // 3, 3), np.float32)
    colors[np.array(lines.colored)] = linear
    return colors


def _part(
    lines: Lines,
    positions: FloatArray,
    triples: IntArray,
    triangles: IntArray,
    mapped: bool,
    colors: NDArray[np.float32] | None,
) -> Part:
    """Return triangles of corners, (T, 3), as a part, whose vertices are the different corners."""
    used = np.zeros(len(triples), np.bool_)
    used[triangles] = True
    corners = triples[used]
    normals = bool((corners[:, 2] >= 0).all())
    corners[:, 1:][:, [not mapped, not normals]] = -1
    places, numbers = distinct(corners)
    renamed = np.zeros(len(triples), np.int64)
    renamed[used] = numbers
    vertex, uv, normal = corners[places].T
    part = Part(positions[vertex], renamed[triangles])
    part.uv = np.array(lines.coordinates, np.float64).reshape(-1, 2)[uv] if mapped else None
    part.normals = np.array(lines.normals, np.float64).reshape(-1, 3)[normal] if normals else None
    part.vertex_colors = None if colors is None else colors[vertex]
    return part


class _Materials:
    """Materials of all files that an OBJ names, and what they give to parts."""

    def __init__(self, path: Path, libraries: list[str], assets: Assets) -> None:
        self._path = path
        self._assets = assets
        self._named = bool(libraries)
        self._images: dict[str, NDArray[np.float32]] = {}
        self._found: dict[str, Material] = {}
        for rest in libraries:
            # A line names several files, or one with blanks in its name.
            alone = rest if assets.has(rest) else rest.partition("#")[0].strip()
            names = [alone] if assets.has(alone) else re.findall(r"\S.*?\.mtl(?=\s|$)", alone, re.IGNORECASE) or [alone]
            for name in names:
                self._read(name)

    def _read(self, name: str) -> None:
        try:
            data = self._assets.get(name)
        except Exception:  # noted, with the reason
            return
        try:
            found = read_materials(as_text(data))
        except ValueError as error:
            raise InputError(f"{self._path}: its '{name}': {error}") from None
        folder = name.replace("\\", "/").rpartition("/")[0]
        for material in found.values():  # names of images begin in the folder of the file that names them
            if folder and material.image is not None and self._assets.has(f"{folder}/{material.image}"):
                material.image = f"{folder}/{material.image}"
        self._found = {**found, **self._found}

    def find(self, name: str | None) -> Material:
        """Return the material of a name that faces use; a white one if no file has it."""
        if name is None:
            return Material()
        material = self._found.get(name) or self._found.get(name.partition("#")[0].strip())
        if material is None:
            if self._found or not self._named:
                self._assets.note(f"no file has its material '{name:.60}': it is white")
            return Material()
        for note in material.notes:
            self._assets.note(f"material '{name:.60}': {note}")
        return material

    def paint(self, part: Part, material: Material) -> None:
        """Give a part the colour of its material."""
        assets = self._assets
        if material.image is not None and assets.given is None:
            if part.uv is None:
                assets.note(NO_COORDINATES)
                return
            part.uv = part.uv * material.scale + material.offset
            part.sampler = CLAMPED if material.clamp else REPEATED
            name = material.image if assets.has(material.image) else material.image.partition("#")[0].strip()
            if name not in self._images:
                self._images[name] = assets.image(name, None, texture)
            part.image = self._images[name]
            if part.vertex_colors is not None and (part.vertex_colors != 1).any():
                assets.note(MULTIPLIED)
        elif material.image is None and material.color is not None:
            try:
                linear, note = color_values(material.color[None])
            except ValueError as error:
                raise InputError(f"{self._path}: Kd: {error}") from None
            assets.note(note)
            part.factor = linear[0]
