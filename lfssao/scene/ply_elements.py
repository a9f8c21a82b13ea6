"""Elements of PLY files: header and rows, text or binary."""

import re
import struct
from array import array
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.scene.assets import Assets
from lfssao.scene.mesh import FloatArray
from lfssao.scene.polygons import IntArray
from lfssao.scene.text import as_text, is_unicode, numbers

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_HEADER = re.compile(
    rb"\s*ply[ \t]*(\r\n|\n|\r)(.*?)[\r\n][ \t]*end_header[ \t]*(?:\1|\r\n|\n|\r|\Z)", re.DOTALL | re.IGNORECASE
)
_Property = tuple[str, str, str | None]  # its name, the type of a number, that of the count of a list


@dataclass
class Element:
    """An element of the header, and its values: numbers by name, and the items of lists with their number in each row.

    types: the declared type of each number or item, as NumPy names it.
    """

    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)
    columns: dict[str, NDArray[Any]] = field(default_factory=dict)
    lists: dict[str, tuple[NDArray[Any], IntArray]] = field(default_factory=dict)

    @property
    def types(self) -> dict[str, str]:
        """The declared type of each property, as NumPy names it."""
        return {name: kind for name, kind, _ in self.properties}

    def several(self, *choices: tuple[str, ...]) -> FloatArray | None:
        """Return columns (count, n) float64 of the first choice whose names are all there."""
        for names in choices:
            if all(name in self.columns for name in names):
                return np.stack([self.columns[name].astype(np.float64) for name in names], axis=1)
        return None


def read_elements(path: Path, data: bytes, assets: Assets) -> tuple[dict[str, Element], list[str]]:
    """Return all elements of a PLY by name, and the images that its comments name; InputError if it is broken."""
    if is_unicode(data):
        data = as_text(data).encode()
    found = _HEADER.match(data)
    if not found:
        raise InputError(f"{path}: it is no PLY file, which begins with the line 'ply' and has a line 'end_header'")
    header = as_text(found[2])
    images = re.findall(r"^\s*comment\s+TextureFile\s+(.*\S)", header, re.MULTILINE | re.IGNORECASE)
    form, elements = _header(path, header)
    body = data[found.end() :]
    if form == "ascii":
        _read_text(path, elements, as_text(body).encode(), header.count("\n") + 4, assets)
    elif left := len(body) - _read_rows(path, elements, body, _ORDERS[form]):
        assets.note(f"{left} bytes after its end are left out")
    return {element.name: element for element in elements}, images


def _header(path: Path, header: str) -> tuple[str, list[Element]]:
    """Return the format and the elements that a header declares."""
    form = ""
    elements = list[Element]()
    for number, line in enumerate(header.split("\n"), 2):
        match line.split():
            case [] | ["obj_info" | "comment", *_]:
                pass
            case ["format", name, *_] if name in _ORDERS:
                form = name
            case ["element", name, count] if count.isdigit() and len(count) < 19:
                elements.append(Element(name, int(count)))
            case ["property", "list", count, kind, name] if {count, kind} <= set(_TYPES) and elements:
                elements[-1].properties.append((name, _TYPES[kind], _TYPES[count]))
            case ["property", kind, name] if kind in _TYPES and elements:
                elements[-1].properties.append((name, _TYPES[kind], None))
            case _:
                raise InputError(f"{path}: line {number}: no header of PLY has '{line.strip():.60}'")
    if not form or len({element.name for element in elements}) < len(elements):
        raise InputError(f"{path}: its header has no format, or an element twice")
    return form, elements


def _read_text(path: Path, elements: list[Element], body: bytes, line: int, assets: Assets) -> None:
    """Fill all elements from text, read as if it were binary and all of it double; floats are rounded to float32."""
    try:
        values = numbers(body, line)
    except ValueError as error:
        declared = _declared_text(elements, body)
        if declared == body:
            raise
        try:
            _read_text(path, elements, declared, line, assets)
        except InputError:  # rows are longer than a line, so that the word stands in one of them
            raise error from None
        assets.note("text after its end is left out")
        return
    taken = _read_rows(path, elements, values.data.cast("B"), "") // values.itemsize
    for element in elements:
        for name, kind, count in element.properties:
            if kind == "f4" and not count:
                element.columns[name] = element.columns[name].astype(np.float32)
    if taken < len(values):
        if len(_declared_text(elements, body).split()) != taken:
            raise InputError(f"{path}: it holds {len(values) - taken} numbers more than its header declares")
        assets.note(f"{len(values) - taken} numbers after its end are left out")


def _declared_text(elements: list[Element], body: bytes) -> bytes:
    """Return the first lines of a text that are not blank: as many as elements have rows."""
    lines = re.finditer(rb"[^\n]*\S[^\n]*\n?", body)
    rows = sum(element.count for element in elements if element.properties)
    return b"".join(line[0] for line in islice(lines, rows))


def _read_rows(path: Path, elements: list[Element], buffer: Any, order: str) -> int:
    """Fill all elements from bytes, of doubles where the order of bytes is empty; return the position behind them."""
    position = 0
    for element in elements:
        kinds = [
            (order + kind if order else "f8", count and (order + count if order else "f8"))
            for _, kind, count in element.properties
        ]
        try:
            first = _walk(kinds, buffer, position, min(1, element.count))
            lengths = [int(each[0]) if element.count else 0 for each in first[1]]
            position = _read_alike(element, kinds, lengths, buffer, position) or _read_unlike(
                element, kinds, buffer, position
            )
        except (struct.error, ValueError, OverflowError):
            declared = f"its header declares {element.count} of '{element.name}'"
            raise InputError(f"{path}: it ends too early, or a list has no length: {declared}") from None
    return position


def _read_alike(
    element: Element, kinds: list[tuple[str, str | None]], lengths: list[int], buffer: Any, position: int
) -> int:
    """Fill an element if the lists of all rows are as long as those of the first; the position behind it, or 0."""
    fields: list[Any] = []
    for number, ((kind, count), length) in enumerate(zip(kinds, lengths, strict=True)):
        fields += [(f"length {number}", count), (str(number), kind, (length,))] if count else [(str(number), kind)]
    layout = np.dtype(fields)
    if element.count * layout.itemsize > len(buffer) - position:
        if any(count for _, count in kinds):
            return 0
        raise ValueError("too few bytes")
    rows = np.frombuffer(buffer, layout, element.count if layout.itemsize else 0, position)
    for number, ((_, count), length) in enumerate(zip(kinds, lengths, strict=True)):
        if count and (rows[f"length {number}"] != length).any():
            return 0
    for number, (name, _, count) in enumerate(element.properties):
        if count:
            items = rows[str(number)].reshape(-1)
            element.lists[name] = items, np.full(element.count, lengths[number], np.int64)
        else:
            element.columns[name] = rows[str(number)]
    return position + element.count * layout.itemsize


def _read_unlike(element: Element, kinds: list[tuple[str, str | None]], buffer: Any, position: int) -> int:
    """Fill an element row by row; the position behind it."""
    starts, lengths, end = _walk(kinds, buffer, position, element.count)
    data = np.frombuffer(buffer, np.uint8)
    for (name, _, _), (kind, count), start, length in zip(element.properties, kinds, starts, lengths, strict=True):
        size = np.dtype(kind).itemsize
        within = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
        places = np.repeat(start, length) + size * within
        items = data[places[:, None] + np.arange(size)].view(kind)[:, 0]
        if count:
            element.lists[name] = items, length
        else:
            element.columns[name] = items
    return end


def _walk(
    kinds: list[tuple[str, str | None]], buffer: Any, position: int, rows: int
) -> tuple[list[IntArray], list[IntArray], int]:
    """The position of each property's first number in every row, how many it has there, and the position behind all."""
    starts = [array("q") for _ in kinds]
    lengths = [array("q") for _ in kinds]
    steps = []
    for (kind, count), start, length in zip(kinds, starts, lengths, strict=True):
        read = None
        before = 0
        if count:
            form = np.dtype(count)
            before = np.dtype(count).itemsize
            read = struct.Struct(form.str[0].replace("|", "=") + form.char).unpack_from
        steps.append((np.dtype(kind).itemsize, read, before, start.append, length.append))
    for _ in range(rows):
        for size, read, before, add_start, add_length in steps:
            number = 1
            if read:
                (given,) = read(buffer, position)
                number = int(given)
                if not 0 <= number <= len(buffer) or number != given:
                    raise ValueError("a list has no length")
                position += before
            add_start(position)
            add_length(number)
            position += number * size
    if position > len(buffer):
        raise ValueError("too few bytes")
    return [np.array(each, np.int64) for each in starts], [np.array(each, np.int64) for each in lengths], position
