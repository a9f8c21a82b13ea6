"""STL: spellings of text, colours of binary facets, and what is refused."""

import struct

import numpy as np
import pytest
from mesh_files import CORNERS, colors, linear, loaded, triangles

from lfssao.errors import InputError

FACES = CORNERS[[[0, 1, 2], [0, 2, 3]]]
FACET = "facet normal 0 0 1\n outer loop\n{}\n endloop\nendfacet\n"
FACETS = "".join(FACET.format("\n".join("  vertex {:g} {:g} {:g}".format(*c) for c in face)) for face in FACES)
TEXT = f"solid a facetious solid vertex\n{FACETS}endsolid a\n"


def binary(header=b"", attributes=(0, 0), count=2):
    """The two triangles of the square."""
    facets = zip(FACES.reshape(2, 9).tolist(), attributes, strict=True)
    body = b"".join(struct.pack("<12fH", 0, 0, 1, *face, attribute) for face, attribute in facets)
    return header.ljust(80) + struct.pack("<I", count) + body


@pytest.mark.parametrize("content", [
    TEXT, TEXT.upper(), TEXT.replace("\n", "\r"), TEXT.replace("\n", "\r\n"), "\ufeff" + TEXT, TEXT.encode("utf-16"),
    TEXT.encode("utf-16-be").join([b"\xfe\xff", b""]), TEXT.encode("utf-16-le"), TEXT.encode("utf-32"),
    TEXT.replace("solid a", "solid facet 7"), TEXT.replace("endsolid a\n", ""), "\n  " + TEXT, FACETS,
    TEXT.replace("solid a", "Solid ß"), TEXT.replace("-1", "-1.0E+00").replace(" 1 ", " +.1e1 "),
    TEXT.replace(" 1 1 0\n", " 1, 1, 0\n"), TEXT.replace("endloop", "end loop").replace("endfacet", "end facet"),
    TEXT.replace("normal 0 0 1", ""), TEXT.replace("0 0 1\n", "nan -nan(ind) 1\n"), " ".join(f"solid {FACETS}".split()),
    TEXT.replace("outer ", "outer"), TEXT.replace("endfacet\n", "endfacet\nendsolid\nsolid b\n", 1), binary(),
    binary(b"solid a"), binary(b"SOLID facet normal"), TEXT.replace("solid a", "solid stra\xdfe").encode("latin-1"),
])  # fmt: skip
def test_spellings(tmp_path, content):
    mesh = loaded(tmp_path, "a.stl", content)
    assert np.array_equal(triangles(mesh), FACES)
    assert (mesh.notes, mesh.paint) == ((), None)


def five(red, green, blue):
    """The linear value of a colour of 5 bits each."""
    return linear([red, green, blue], 31)


@pytest.mark.parametrize(("content", "wanted", "note"), [
    (binary(b"", (0x8000 | 31 << 10, 0x8000 | 31)), [five(31, 0, 0), five(0, 0, 31)], None),
    (binary(b"solid", (0x8000 | 7 << 10 | 9 << 5 | 20, 0)), [five(7, 9, 20), [1, 1, 1]], None),
    (binary(b"COLOR=\xff\x80\x00\xff", (0x8000, 0x8000)), [linear([255, 128, 0])] * 2, None),
    (binary(b"xCOLOR=\x0a\x80\x00\xff,MATERIAL=", (20 << 10 | 9 << 5 | 7, 0xFFFF)),
     [five(7, 9, 20), linear([10, 128, 0])], None),
    (binary(b"COLOR=\xff\x80\x00\xff"), [linear([255, 128, 0])] * 2, "no colours of their own"),
    (binary(b"COLOR=\xff\x80\x00\x7f", (0x8000, 0x8000)), [linear([255, 128, 0])] * 2, "in part transparent"),
])  # fmt: skip
def test_colours_of_facets(tmp_path, content, wanted, note):
    mesh = loaded(tmp_path, "a.stl", content)
    assert colors(mesh) == pytest.approx(np.repeat(np.array(wanted)[:, None], 3, axis=1), abs=1e-6)
    assert [note in each for each in mesh.notes] == ([True] if note else [])


@pytest.mark.parametrize(("content", "note"), [
    (binary(attributes=(5, 0)), "attributes of its facets"), (binary() + b"tail", "4 bytes after its end"),
    (binary(b"solid a") + b"tail", "4 bytes after its end"),
])  # fmt: skip
def test_notes(tmp_path, content, note):
    mesh = loaded(tmp_path, "a.stl", content)
    assert np.array_equal(triangles(mesh), FACES)
    assert (mesh.paint, len(mesh.notes), note in mesh.notes[0]) == (None, 1, True)


@pytest.mark.parametrize(("content", "words"), [
    (binary(count=3), "it declares 3 faces, which take 234 bytes, but has 184"),
    (binary()[:-1], "it declares 2 faces, which take 184 bytes, but has 183"),
    (TEXT[:-30], "line 9: it has no facet with a normal and a loop of three vertices"),
    (TEXT.replace("  vertex 1 1 0\n", "", 1), "line 2: it has no facet"),
    (TEXT.replace("  vertex 1 1 0\n", "  vertex 1 1 0\n  vertex 0 2 0\n"), "line 2: it has no facet"),
    (TEXT.replace("-1 1 0", "-1 1,5 0"), "facet 2: '1,5' is no number"),
    (TEXT.replace("-1 1 0", "-1 1_0 0"), "facet 2: '1_0' is no number"),
    ("hello", "it is no STL file"),
])  # fmt: skip
def test_broken_files_are_refused(tmp_path, content, words):
    with pytest.raises(InputError, match=words):
        loaded(tmp_path, "a.stl", content)
