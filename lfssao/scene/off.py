"""Meshes from OFF files."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.scene.assets import Assets
from lfssao.scene.mesh import FloatArray
from lfssao.scene.part import TOO_FEW_CORNERS, TRANSPARENT, TWO_COLORS, Part
from lfssao.scene.polygons import IntArray, Polygons, triangulate
from lfssao.scene.text import as_text, color_values, numbers, whole

_KEYWORD = re.compile(r"\s*(ST)?(C)?(N)?(4)?(n)?(?:OFF|off)(?![^\s\d])")
_COLOR = (3, 4)  # numbers of a colour, the fourth is opacity


def read_off(path: Path, data: bytes, assets: Assets) -> list[Part]:
    """Return the triangles of a text OFF, COFF, NOFF, STOFF or 4OFF, as one part.

    The keyword may be left out. Numbers are separated by any white space, but only a file with a line a vertex and a
    line a face may have colours of faces, or codes of vertices without its keyword. Colours are sRGB, 0 to 1, or 0 to
    255 if one is at least 2. The fourth number of a 4OFF's position divides the others. InputError if it is another
    kind of OFF, is broken, ends too early or names a vertex that does not exist.
    """
    text = re.sub("#[^\n]*", "", as_text(data))
    found = _KEYWORD.match(text)
    body = text[found.end() :] if found else text
    coordinates, color, normal, four, any_dimension = found.groups() if found else (None,) * 5
    if any_dimension or body.lstrip()[:6].upper() == "BINARY":
        kind = "an nOFF, whose vertices have any number of dimensions" if any_dimension else "a binary OFF"
        raise InputError(f"{path}: it is {kind}, which is not read")
    if not found and not re.match(r"\s*\d", text):
        other = re.match(r"\s*([STCN4n]+OFF)\b", text)
        if other:
            raise InputError(f"{path}: its keyword is '{other[1]:.20}', but OFF's has ST, C, N, 4 and n in this order")
        raise InputError(f"{path}: it is no OFF file, which begins with the word 'OFF'")
    values = numbers(body.encode(), text.count("\n", 0, len(text) - len(body)) + 1)
    sizes = np.array([len(words) for line in body.split("\n") if (words := line.split())], np.int64)
    if len(values) < 2:
        raise InputError(f"{path}: it ends too early: it does not say how many vertices and faces it has")
    counts = whole(values[:2])
    if counts.min() < 0 or counts.sum() > len(values):
        raise InputError(f"{path}: it ends too early: it declares {counts[0]} vertices and {counts[1]} faces")
    position = 4 if four else 3
    before = 3 if normal else 0
    behind = 2 if coordinates else 0
    plain = position + before + behind
    rows = None
    for head in (2, 3) if sizes[0] == 2 else (3,):  # the number of edges may be left out at the end of its line
        rest = np.diff(np.maximum(np.cumsum(sizes), head), prepend=head)
        rows = rows or _by_lines(values[head:], rest[rest > 0], counts, [plain, plain + 3, plain + 4])
    for width in [plain + 4, plain + 3] if color else [plain]:
        rows = rows or _by_words(values[3:], counts, width)
    if rows is None:
        declared = f"it declares {counts[0]} vertices and {counts[1]} faces"
        raise InputError(f"{path}: it ends too early, or holds more: {declared}, which its numbers do not fit")
    values, width, begins, ends = rows
    if len(ends) and ends[-1] < len(values):
        assets.note(f"{len(values) - ends[-1]} numbers after its end are left out")
    table = values[: counts[0] * width].reshape(-1, width)
    part = Part(_positions(path, table[:, :position]), np.zeros((0, 3), np.int64))
    part.normals = table[:, position : position + before] if before else None
    part.uv = table[:, width - 2 :] if behind else None
    given = table[:, position + before :][:, : width - plain]
    # Without the keyword's C they may be normals.
    if width > plain and (color or (given.max() >= 2 and given.min() >= 0)):
        part.vertex_colors = _linear(path, given, assets)
    elif width > plain:
        assets.note(f"{width - plain} numbers at each vertex are left out, as its keyword does not have them")
    _take_faces(path, part, values, begins, ends, assets)
    return [part]


# All numbers behind the header, how many each vertex has, and the places at which the rows of faces begin and end.
_Rows = tuple[FloatArray, int, IntArray, IntArray]


def _by_lines(values: FloatArray, sizes: IntArray, counts: IntArray, widths: list[int]) -> _Rows | None:
    """The rows of a file with a line a vertex and a line a face, from the numbers of each line; None if it has not."""
    vertices = int(counts[0])
    all_rows = int(counts.sum())
    if len(sizes) < all_rows or not vertices or sizes[0] not in widths or (sizes[:vertices] != sizes[0]).any():
        return None
    ends = np.cumsum(sizes)[vertices:all_rows]
    begins = ends - sizes[vertices:all_rows]
    behind = ends - begins - 1 - values[begins]
    return (values, int(sizes[0]), begins, ends) if np.isin(behind, (0, 1, *_COLOR)).all() else None


def _by_words(values: FloatArray, counts: IntArray, width: int) -> _Rows | None:
    """Return the rows of a file without colours of faces, wherever its lines end; None if the numbers do not fit."""
    place = int(counts[0]) * width
    begins = []
    for _ in range(int(counts[1])):
        if place >= len(values) or not 0 <= values[place] <= len(values):
            return None
        begins.append(place)
        place += 1 + int(values[place])
    starts = np.array([*begins, place], np.int64)
    return (values, width, starts[:-1], starts[1:]) if place == len(values) else None


def _positions(path: Path, numbers: FloatArray) -> FloatArray:
    """Return positions, (V, 3); a fourth number divides the others."""
    if numbers.shape[1] == 3:
        return numbers
    if (numbers[:, 3] == 0).any():
        raise InputError(f"{path}: vertex {int((numbers[:, 3] == 0).argmax())} has w = 0")
    return numbers[:, :3] / numbers[:, 3:]


def _linear(path: Path, colors: FloatArray, assets: Assets) -> NDArray[np.float32]:
    """Linear RGB of colours of three or four numbers."""
    most = 255.0 if colors.max(initial=0) >= 2 else 1.0
    if colors.shape[1] == 4 and (colors[:, 3] < most).any():
        assets.note(TRANSPARENT)
    try:
        linear, note = color_values(colors[:, :3], most)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    assets.note(note)
    return linear


def _take_faces(path: Path, part: Part, values: FloatArray, begins: IntArray, ends: IntArray, assets: Assets) -> None:
    """Give a part the triangles of all faces, and their colours."""
    lengths = whole(values[begins])
    within = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    polygons = Polygons(whole(values[np.repeat(begins + 1, lengths) + within]), lengths)
    assets.check("its meshes", 200 * (len(part.vertices) + len(polygons.corners)))
    triangles, owner = triangulate(lambda number: f"{path}: face {number}", part.vertices, polygons)
    part.faces = polygons.corners[triangles]
    if (lengths < 3).any():
        assets.note(TOO_FEW_CORNERS)
    behind = ends - begins - 1 - lengths
    if (behind == 1).any():
        assets.note("colours of faces that are numbers of a colour map are left out")
    colored = np.flatnonzero(behind >= 3)
    if not len(colored):
        return
    if part.vertex_colors is not None:
        assets.note(TWO_COLORS)
        return
    given = np.ones((len(colored), 4))
    for number in range(4):
        has = behind[colored] > number
        given[has, number] = values[ends[colored[has]] - behind[colored[has]] + number]
    colors = np.ones((len(lengths), 3), np.float32)
    colors[colored] = _linear(path, given[:, : int(behind.max())], assets)
    part.color_faces(colors[owner])
