"""Lines of OBJ files."""

from array import array
from collections.abc import Iterable

import numpy as np

from lfssao.scene.assets import Assets

_SURFACES = {"surf", "bzp", "bsp", "call", "csh"}  # there is more of the mesh than faces
_LINES = {"l", "p", "curv", "curv2"}
_IGNORED = {
    *("g", "o", "s", "mg", "vp", "cstype", "deg", "bmat", "step", "parm", "trim", "hole", "scrv", "sp", "end", "con"),
    *("bevel", "c_interp", "d_interp", "lod", "shadow_obj", "trace_obj", "ctech", "stech", "res", "cdc"),
}


class _Corners(dict[str, int]):
    """Corners of faces by their words, v/vt/vn, each with a number; its triples count from 1, and 0 is none."""

    def __init__(self) -> None:
        self.triples = array("q")

    def __missing__(self, word: str) -> int:
        parts = [int(word)] if word.isdigit() else [int(part) if part else 0 for part in word.split("/")]
        if parts[0] == 0 or "_" in word or len(parts) > 3 or min(parts) < 0:
            raise ValueError("a face names vertex 0, but OBJ counts from 1" if parts[0] == 0 else f"no corner: {word}")
        self[word] = number = len(self)
        self.triples.extend([*parts, 0, 0][:3])
        return number


class Lines:
    """Everything that the lines of an OBJ hold, in their order."""

    def __init__(self, assets: Assets) -> None:
        self.positions = array("d")
        self.coordinates = array("d")
        self.normals = array("d")
        self.colored = array("q")  # numbers of vertices
        self.colors = array("d")  # three or four numbers of each of these
        self.corners = array("q")
        self.counts = array("q")
        self.lines = array("q")
        self.table = _Corners()
        self.materials = array("q")  # of each face, its number in names
        self.names: dict[str | None, int] = {None: 0}
        self._material = 0
        self.libraries: list[str] = []
        self._assets = assets
        self._unknown = False

    def read(self, text: str) -> None:
        """Take all lines; ValueError, with the line, if one cannot be read."""
        number = 0
        line = ""
        try:
            for number, line in enumerate(text.split("\n"), 1):
                words = (line.partition("#")[0] if "#" in line else line).split()
                if not words:
                    continue
                key = words[0]
                if key == "v":
                    if len(words) == 4 and "_" not in line:
                        self.positions.extend(map(float, words[1:]))
                    else:
                        self._take_vertex(_floats(words[1:]))
                elif key in ("f", "fo"):
                    self._take_face(map(self._absolute, words[1:]) if "-" in line else words[1:], number)
                elif key == "vn":
                    x, y, z = _floats(words[1:])
                    self.normals.extend((x, y, z))
                elif key == "vt":
                    u, v = [*_floats(words[1:4]), 0.0][:2]  # v may be left out, which is then 0
                    self.coordinates.extend((u, v))
                else:
                    self._take_other(key, line.strip()[len(key) :].strip(), number)
        except ValueError as error:
            reason = str(error)
            if reason.startswith(("could not convert", "invalid literal", "not enough", "too many")):
                reason = f"'{line.strip():.60}' has a word that is no number, or not as many as it must"
            raise ValueError(f"line {number}: {reason}") from None

    def _take_vertex(self, values: list[float]) -> None:
        """A vertex of other than three numbers."""
        match values:
            case [x, y, z]:
                self.positions.extend(values)
            case [x, y, z, w]:
                if w == 0:
                    raise ValueError("a vertex has w = 0")
                self.positions.extend((x / w, y / w, z / w))
            case [x, y, z, *color] if len(color) in (3, 4):
                self.colored.append(len(self.positions) // 3)
                self.positions.extend((x, y, z))
                self.colors.extend([*color, np.nan][:4])
            case _:
                raise ValueError(f"a vertex has {len(values)} numbers")

    def _take_face(self, words: Iterable[str], line: int) -> None:
        corners = [self.table[word] for word in words]
        self.corners.extend(corners)
        self.counts.append(len(corners))
        self.lines.append(line)
        self.materials.append(self._material)

    def _absolute(self, word: str) -> str:
        """Return a corner whose negative numbers count backwards from the lines read last."""
        read = len(self.positions) // 3, len(self.coordinates) // 2, len(self.normals) // 3
        parts = word.split("/")
        for place, (part, count) in enumerate(zip(parts, read, strict=False)):
            if part.startswith("-"):
                if int(part) < -count:
                    raise ValueError(f"a face names a vertex that does not exist: {word}")
                parts[place] = str(count + 1 + int(part))
        return "/".join(parts)

    def _take_other(self, key: str, rest: str, line: int) -> None:
        if key == "usemtl":
            self._material = self.names.setdefault(rest, len(self.names))
        elif key == "mtllib":
            self.libraries.append(rest)
        elif key in _SURFACES:
            raise ValueError(f"'{key}' makes surfaces that are no polygons, which are not read")
        elif key in _LINES:
            self._assets.note("its lines, points and curves are left out")
        elif key not in _IGNORED and not self._unknown:
            self._unknown = True
            self._assets.note(f"line {line} is left out: OBJ has no '{key:.20}'")


def _floats(words: list[str]) -> list[float]:
    if any("_" in word for word in words):  # Python reads 1_0 as 10
        raise ValueError("a number has an underscore")
    return [float(word) for word in words]
