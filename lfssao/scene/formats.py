"""Faults of mesh files that trimesh would not notice, refused in one sentence."""

import re
from pathlib import Path

from lfssao.errors import InputError
from lfssao.scene.assets import as_utf8


def readable(ending: str, data: bytes) -> bytes:
    """Content in the form that trimesh reads; text is UTF-8, or else taken for Latin-1."""
    if ending == ".obj":  # trimesh asks for one space after each first word, which begins its line
        text = as_utf8(data.removeprefix(b"\xef\xbb\xbf")).replace(b"\t", b" ").replace(b"\r\n", b"\n")
        return re.sub(rb"(?<!\\)\n +", b"\n", text.lstrip(b" "))
    if ending == ".off" and b"OFF" not in data:  # the word is optional
        return b"OFF\n" + data
    return data


def _check_stl(path: Path, data: bytes) -> int:
    """Refuse a binary file whose size does not fit the triangles that it declares; text declares none."""
    count, size = int.from_bytes(data[80:84], "little"), len(data)
    if size < 84 or data.lstrip()[:5].lower() == b"solid":
        return 0
    if size != 84 + 50 * count:
        raise InputError(f"{path}: it declares {count} faces, which take {84 + 50 * count} bytes, but has {size}")
    return count


def _check_obj(path: Path, data: bytes) -> int:
    """Refuse vertex numbers that trimesh would take for others; an OBJ declares no number of faces."""
    if found := re.search(rb"^f[ \t][^\n]*?(?<=[ \t])[+-]?0+(?=[/\s]|\Z)", data, re.MULTILINE):
        raise InputError(f"{path}: line {_line(data, found)}: a face names vertex 0, but OBJ counts from 1")
    backwards = re.search(rb"^f[ \t][^\n]*?[ \t]-[0-9]", data, re.MULTILINE)
    if backwards and re.compile(rb"^v[ \t]", re.MULTILINE).search(data, backwards.end()):
        raise InputError(
            f"{path}: line {_line(data, backwards)}: a face counts vertices backwards (negative numbers) while more "
            "vertices follow, which cannot be read"
        )
    return 0


def _line(data: bytes, found: re.Match[bytes]) -> int:
    return data.count(b"\n", 0, found.start()) + 1


def _check_ply(path: Path, data: bytes) -> int:
    """Number of faces that a text PLY declares; one with fewer lines is refused, as trimesh would read it."""
    header, end, body = data.partition(b"end_header")
    if not end or not re.search(rb"^format[ \t]+ascii", header, re.MULTILINE):
        return 0  # trimesh compares the sizes of binary files, and says what else is wrong
    elements = re.findall(rb"^element[ \t]+(\S+)[ \t]+([0-9]{1,18})", header, re.MULTILINE)
    declared = sum(int(count) for _, count in elements)
    lines = sum(1 for line in body.splitlines() if line.strip())
    if lines < declared:
        raise InputError(f"{path}: it ends too early: the header declares {declared} lines, there are {lines}")
    return sum(int(count) for name, count in elements if name == b"face")


def _check_off(path: Path, data: bytes) -> int:
    """Number of faces that an OFF declares; one with fewer lines is refused."""
    lines = [line for line in re.sub(rb"#[^\n]*", b"", data).splitlines() if line.strip()]
    words = b" ".join(lines[:2]).split()
    if len(words) < 3 or not all(word.isdigit() and len(word) < 18 for word in words[1:3]):
        return 0  # trimesh says what is wrong with it
    vertices, faces = int(words[1]), int(words[2])
    if len(lines) - 1 < vertices + faces:
        raise InputError(f"{path}: it ends too early: it declares {vertices} vertices and {faces} faces on a line each")
    return faces


CHECKS = {".obj": _check_obj, ".ply": _check_ply, ".off": _check_off, ".stl": _check_stl}
