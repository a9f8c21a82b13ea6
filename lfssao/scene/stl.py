"""Meshes from STL files."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.scene.assets import Assets
from lfssao.scene.mesh import FloatArray
from lfssao.scene.part import TRANSPARENT, Part
from lfssao.scene.text import as_text, color_values, is_unicode, numbers

_HEADER = 84  # bytes: 80 of any content, and the number of facets
_FACET = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
_LARGEST = 31.0  # of 5 bits
_MARK = 0x8000  # the bit above the colour
_OPAQUE = 255
_NAME = re.compile(r"\b(end[ \t]*)?solid\b((?!\bfacet\s+(normal|outer))[^\n])*")
_FORM = ["facet", "normal", *"...", "outer", "loop", *["vertex", *"..."] * 3, "endloop", "endfacet"]
_WORDS = [place for place, word in enumerate(_FORM) if word != "."]
_COORDINATES = [place for place, word in enumerate(_FORM) if word == "."][3:]


def read_stl(path: Path, data: bytes, assets: Assets) -> list[Part]:
    """Return the triangles of an STL, text or binary, as one part; each has vertices of its own.

    Text may be in any letters' case and hold several solids. The attribute bytes of binary facets are sRGB colours of 5
    bits as VisCAM or, with ``COLOR=`` in the header, as Magics writes them; facets without a colour are white, or have
    the header's. InputError if the file is broken or ends too early.
    """
    size = len(data)
    count = int.from_bytes(data[80:_HEADER], "little")
    needed = _HEADER + _FACET.itemsize * count
    if size != needed and (is_unicode(data) or b"\0" not in data[:512]):
        return [_part(path, _vertices_of_text(path, as_text(data)), assets)]
    if size < max(needed, _HEADER):
        raise InputError(f"{path}: it declares {count} faces, which take {needed} bytes, but has {size}")
    if size > needed:
        assets.note(f"{size - needed} bytes after its end are left out")
    facets = np.frombuffer(data, _FACET, count, _HEADER)
    part = _part(path, facets["vertices"].reshape(-1, 3).astype(np.float64), assets)
    colors = _colors(data[:80], facets["attribute"], assets)
    if colors is not None:
        part.color_faces(colors)
    return [part]


def _part(path: Path, vertices: FloatArray, assets: Assets) -> Part:
    assets.check("its meshes", 200 * len(vertices))
    return Part(vertices, np.arange(len(vertices)).reshape(-1, 3))


def _vertices_of_text(path: Path, text: str) -> FloatArray:
    """Return vertices, (3 F, 3), of the facets of a text."""
    if not re.match(r"\s*(solid|facet)\b", text, re.IGNORECASE):
        raise InputError(f"{path}: it is no STL file: neither does text begin with 'solid', nor is it binary")
    text = re.sub(r",(?=\s)", " ", _NAME.sub("", text.lower()))
    facets, wrong = _facets(text)
    if wrong is not None:  # perhaps another spelling
        text = re.sub(r"\bend[ \t]+(?=loop|facet)", "end", text.replace("outerloop", "outer loop"))
        text = re.sub(r"\bfacet\s+(?=outer)", "facet normal 0 0 0 ", text)
        facets, wrong = _facets(text)
    if wrong is not None:
        starts = [0, *(found.start() for found in re.finditer(r"\bfacet\b", text))]
        line = text.count("\n", 0, starts[min(wrong + 1, len(starts) - 1)]) + 1
        raise InputError(f"{path}: line {line}: it has no facet with a normal and a loop of three vertices")
    coordinates = "\n".join(" ".join(row) for row in facets[:, _COORDINATES])
    return numbers(coordinates.encode(), 1, "facet").reshape(-1, 3)


def _facets(text: str) -> tuple[NDArray[np.object_], int | None]:
    """Return the words of whole facets, and the number of the first that is none."""
    words = text.split()
    facets = np.array(words[: len(words) // len(_FORM) * len(_FORM)], object).reshape(-1, len(_FORM))
    right = (facets[:, _WORDS] == np.array(_FORM, object)[_WORDS]).all(axis=1)
    if not right.all():
        return facets, int(right.argmin())
    return facets, len(facets) if len(words) % len(_FORM) else None


def _colors(header: bytes, attributes: NDArray[np.uint16], assets: Assets) -> NDArray[np.float32] | None:
    """Linear RGB of facets, (F, 3) float32."""
    marked = (attributes & _MARK) != 0
    bits = np.stack([attributes >> shift & 31 for shift in (0, 5, 10)], axis=1).astype(np.float64)
    if found := re.search(rb"COLOR=(.{4})", header, re.DOTALL):  # Magics: the mark means the header's colour
        *codes, opacity = found[1]
        if opacity < _OPAQUE:
            assets.note(TRANSPARENT)
        if not attributes.any():
            assets.note("its facets have no colours of their own: they have its header's")
        whole = color_values(np.array([codes], np.float64), 255.0)[0]
        own = ~marked & attributes.any()
    elif marked.any():  # VisCAM: the mark means a colour, blue first
        whole = np.ones((1, 3), np.float32)
        own = marked
        bits = bits[:, ::-1]
    else:
        if attributes.any():
            assets.note("the attributes of its facets, which are no colours, are left out")
        return None
    return np.where(own[:, None], color_values(bits, _LARGEST)[0], whole)
