"""PLY in text and both orders of bytes: polygons, strips, lists, colours, images."""

import struct
from itertools import product

import numpy as np
import pytest
from mesh_files import CORNERS, area, colors, linear, loaded, textured, triangles
from PIL import Image

from lfssao.errors import InputError

RNG = np.random.default_rng(17)
CODES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
XYZ = [("float", "x"), ("float", "y"), ("float", "z")]
INDICES = [("uchar", "int", "vertex_indices")]
QUAD = [[[0, 1, 2, 3]]]


def ply(form, *elements, comments=""):
    """A PLY of elements, each its name, its properties, and its rows of numbers and lists."""
    header = f"ply\nformat {form} 1.0\n{comments}"
    body = b""
    for name, properties, values in elements:
        header += f"element {name} {len(values)}\n"
        header += "".join(f"property {'list ' * (len(each) == 3)}{' '.join(each)}\n" for each in properties)
        for row in values:
            for kinds, value in zip(properties, row, strict=True):
                items = value if len(kinds) == 3 else [value]
                if form == "ascii":
                    body += " ".join(repr(item) for item in [len(items), *items][len(kinds) != 3 :]).encode() + b" "
                    continue
                if len(kinds) == 3:
                    body += struct.pack(FORMATS[form] + CODES[kinds[0]], len(items))
                body += struct.pack(f"{FORMATS[form]}{len(items)}{CODES[kinds[-2]]}", *items)
            body += b"\n" if form == "ascii" else b""
    return header.encode() + b"end_header\n" + body


def square(form="ascii", faces=QUAD, face_properties=INDICES, vertex_properties=(), values=(), **more):
    """The square with more numbers at its vertices."""
    table = [[*corner, *(values if np.ndim(values) < 2 else values[k])] for k, corner in enumerate(CORNERS.tolist())]
    return ply(form, ("vertex", [*XYZ, *vertex_properties], table), ("face", face_properties, faces), **more)


def named(kind, names):
    return [(kind, name) for name in names]


@pytest.mark.parametrize("form", FORMATS)
def test_files_that_are_drawn(tmp_path, form):
    """Triangles and quads, colours of vertices or faces, lists of any type, before and behind others, and elements."""
    for colored, kind, count, index in product(
        ("vertex", "face"), ("uchar", "ushort", "double"), *2 * [list(CODES)[:6]]
    ):
        if RNG.random() > 0.1:
            continue
        most = {"uchar": 255, "ushort": 65535, "double": 1}[kind]
        vertices = RNG.normal(size=(12, 3)).astype(np.float32).astype(float)
        faces = [RNG.choice(12, 3, replace=False).tolist() for _ in range(6)]
        # The fourth corner of a parallelogram.
        for face in faces[:: int(RNG.integers(1, 3))]:
            vertices = np.append(vertices, [vertices[face[0]] - vertices[face[1]] + vertices[face[2]]], axis=0)
            face.append(len(vertices) - 1)
        shades = RNG.random((len(vertices), 3)) if most == 1 else RNG.integers(0, most + 1, (len(vertices), 3))
        three = named(kind, ("red", "green", "blue"))
        own = three if colored == "vertex" else []
        table = [[*v, 0.5, *s[: len(own)]] for v, s in zip(vertices.tolist(), shades.tolist(), strict=True)]
        lists = [([1.5] * int(RNG.integers(0, 3)), face) for face in faces]
        other = [] if colored == "vertex" else three
        mesh = loaded(tmp_path, "a.ply", ply(
            form,
            ("camera", [("float", "view"), ("uchar", "short", "sizes")], [[1.0, [1, 2]], [2.0, []]]),
            ("vertex", [("double", "x"), ("double", "y"), ("double", "z"), ("float", "quality"), *own], table),
            ("face", [("uchar", "float", "more"), (count, index, "vertex_index"), *other, ("uchar", "flag")],
             [[*two, *s[: len(other)], 7] for two, s in zip(lists, shades.tolist(), strict=False)]),
            ("edge", [("int", "vertex1")], [[1], [2]]),
        ))  # fmt: skip
        wanted = [(k, c) for k, f in enumerate(faces) for c in (f[:3], [f[2], *f[3:], f[0]])[: len(f) - 2]]
        named_vertices = np.array([corners for _, corners in wanted])
        assert np.array_equal(triangles(mesh), vertices[named_vertices])
        of_corners = shades[named_vertices] if colored == "vertex" else shades[[[k] * 3 for k, _ in wanted]]
        assert colors(mesh) == pytest.approx(linear(of_corners, most), abs=1e-6)
        assert mesh.notes == ()


@pytest.mark.parametrize("form", FORMATS)
def test_strips_of_triangles(tmp_path, form):
    """Two strips in one list, a third in another: every other triangle is turned."""
    strips = [[[0, 1, 3, 2, -1, 0, 1, 2]], [[3, 0, 2]]]
    properties = [("int", "int", "vertex_indices")]
    content = ply(form, ("vertex", XYZ, CORNERS.tolist()), ("tristrips", properties, strips))
    mesh = loaded(tmp_path, "a.ply", content)
    assert mesh.faces.tolist() == [[0, 1, 3], [3, 1, 2], [0, 1, 2], [3, 0, 2]]


def test_concave_polygons(tmp_path):
    corners = [[0, 0, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [-1, -1, 0]]
    vertices = [[float(value) for value in corner] for corner in corners]
    for form in FORMATS:
        content = ply(form, ("vertex", XYZ, vertices), ("face", INDICES, [[[1, 2, 3, 4, 0]]]))
        assert area(loaded(tmp_path, "a.ply", content)) == 3


TEXT = square().decode()


@pytest.mark.parametrize("content", [
    TEXT.replace("\n", "\r"), TEXT.replace("\n", "\r\n"), "\ufeff" + TEXT, TEXT.encode("utf-16"),
    TEXT.encode("utf-32"), TEXT.encode("utf-16-be"),
    TEXT.replace("0.0 \n", "0.0 \n\n \t\n"), TEXT.replace(" \n", " "),
    TEXT[: TEXT.index("-1")] + TEXT[TEXT.index("-1") :].replace(" ", "\n"),
    TEXT.replace("element v", "obj_info by hand\ncomment c\n\nelement v"), TEXT.replace(" 0 1 2 3", "\t0\n1 2\n3"),
    *(square("binary_little_endian").replace(b"\n", end) for end in (b"\n", b"\r", b"\r\n")),
])  # fmt: skip
def test_spellings(tmp_path, content):
    mesh = loaded(tmp_path, "a.ply", content)
    assert (mesh.faces.tolist(), mesh.notes) == ([[0, 1, 2], [2, 3, 0]], ())


@pytest.mark.parametrize(("kind", "names", "values", "wanted", "note"), [
    ("uchar", ("diffuse_red", "diffuse_green", "diffuse_blue"), [255, 128, 0], linear([255, 128, 0]), None),
    ("float", ("r", "g", "b"), [1.0, 0.5, 0.0], linear([1, 0.5, 0], 1), None),
    ("float", ("red", "green", "blue"), [255.0, 128.0, 0.0], linear([255, 128, 0]), "reach 255: they are read as 0 to"),
    ("double", ("red", "green", "blue"), [1.5, 0.5, -1.0], linear([1, 0.5, 0], 1), "clamped to 0 to 1"),
    ("int", ("red", "green", "blue"), [255, 128, 0], linear([255, 128, 0]), None),
    ("ushort", ("red", "green", "blue"), [65535, 32768, 0], linear([65535, 32768, 0], 65535), None),
    ("uchar", ("red", "green", "blue", "alpha"), [9, 9, 9, 254], linear([9, 9, 9]), "in part transparent"),
])  # fmt: skip
def test_colours_of_vertices(tmp_path, kind, names, values, wanted, note):
    for form in FORMATS:
        mesh = loaded(tmp_path, "a.ply", square(form, vertex_properties=named(kind, names), values=values))
        assert colors(mesh) == pytest.approx(np.broadcast_to(wanted, (2, 3, 3)), abs=1e-7)
        assert [note in each for each in mesh.notes] == ([True] if note else [])


@pytest.mark.parametrize(("names", "note"), [
    ("red", "'red' of its element 'vertex', which may be a colour, is left out"),
    (("Red", "Green", "Blue"), "'Green' of its element 'vertex'"),
    (("ambient_red", "ambient_green", "ambient_blue"), "'ambient_blue' of its element 'vertex'"),
    (("f_dc_0", "confidence", "intensity"), "'f_dc_0' of its element 'vertex'"),
    ("w", "w of its vertices is left out"),
])  # fmt: skip
def test_what_is_left_out_of_vertices_is_noted(tmp_path, names, note):
    names = (names,) if isinstance(names, str) else names
    content = square(vertex_properties=named("float", names), values=[0.5] * len(names))
    mesh = loaded(tmp_path, "a.ply", content)
    assert mesh.paint is None
    assert any(each.startswith(note) for each in mesh.notes)
    assert not any("intensity" in each for each in mesh.notes)


def test_colours_of_materials_are_noted_where_no_others_are(tmp_path):
    three = named("uchar", ("red", "green", "blue"))
    for own, values, count in (([], [], 3), (three, [255, 0, 0], 0)):
        table = [[*corner, *values] for corner in CORNERS.tolist()]
        elements = ("vertex", [*XYZ, *own], table), ("face", INDICES, QUAD), ("material", three, [[9, 9, 9]])
        mesh = loaded(tmp_path, "a.ply", ply("ascii", *elements, ("edge", [("int", "red")], [[1]])))
        assert len(mesh.notes) == count
        assert (mesh.paint is None) == (count > 0)


def test_text_has_the_declared_precision(tmp_path):
    vertices = [[0.1, 0.2, 0.3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    for kind, round_to in (("float", np.float32), ("double", np.float64)):
        content = ply("ascii", ("vertex", named(kind, "xyz"), vertices), ("face", INDICES, [[[0, 1, 2]]]))
        mesh = loaded(tmp_path, "a.ply", content)
        assert mesh.vertices[0].tolist() == [float(round_to(value)) for value in vertices[0]]


def test_vertices_colours_go_before_those_of_faces(tmp_path):
    three = named("uchar", ("red", "green", "blue"))
    content = square("ascii", [[[0, 1, 2, 3], 0, 255, 0]], [*INDICES, *three], three, [255, 0, 0])
    mesh = loaded(tmp_path, "a.ply", content)
    assert (colors(mesh) == [1, 0, 0]).all()
    assert "colours of its faces are left out" in mesh.notes[0]


def test_texture_coordinates_of_vertices_and_of_corners_and_several_images(tmp_path):
    for name, color in (("a b.png", (255, 0, 0)), ("b.png", (0, 0, 255))):
        Image.new("RGB", (1, 1), color).save(tmp_path / name)
    one = "comment TextureFile a b.png\n"
    two = "comment TextureFile b.png\n"
    uv = [[0.0, 0.25], [1.0, 0.25], [1.0, 0.75], [0.0, 0.75]]
    for names in ("st", "uv", ("texture_u", "texture_v")):
        content = square(vertex_properties=named("float", names), values=uv, comments=one)
        found, has = textured(loaded(tmp_path, "a.ply", content))
        assert found.tolist() == [[uv[k] for k in face] for face in ([0, 1, 2], [2, 3, 0])]
        assert has.all()
    flat = [value for pair in uv for value in pair]
    per_face = [*INDICES, ("uchar", "float", "texcoord"), ("int", "texnumber")]
    faces = [[[0, 1, 2, 3], flat, 1], [[0, 1, 2], flat[2:], 0], [[1, 2, 3], flat[:6], 1]]
    for form in FORMATS:
        mesh = loaded(tmp_path, "a.ply", square(form, faces, per_face, comments=one + two))
        found, has = textured(mesh)
        shown = [mesh.paint.textures[k][0, 0].tolist() for k in mesh.paint.face_material]
        assert shown == [[1, 0, 0], *[[0, 0, 1]] * 3]
        assert found.tolist() == [uv[1:], uv[:3], [uv[2], uv[3], uv[0]], uv[:3]]
        assert mesh.faces.tolist()[1][::2] == mesh.faces.tolist()[2][::-2]  # corners with equal coordinates are one
    mesh = loaded(tmp_path, "a.ply", square(comments=one))
    assert "no texture coordinates" in mesh.notes[0]
    colored = named("float", ("s", "t", "red", "green", "blue"))
    for red, notes in ((0.5, ("colours of its vertices multiply its image",)), (1.0, ())):
        content = square(vertex_properties=colored, values=[0.5, 0.5, red, 1.0, 1.0], comments=one)
        assert loaded(tmp_path, "a.ply", content).notes == notes


def test_bytes_after_the_end_are_noted(tmp_path):
    for content, note in (
        (square("binary_big_endian") + b"junk", "4 bytes after its end"),
        (square() + b"8 8\n8", "3 numbers after its end"),
        (square() + b"\nthe end\n", "text after its end"),
    ):
        mesh = loaded(tmp_path, "a.ply", content)
        assert (area(mesh), note in mesh.notes[0]) == (4, True)


@pytest.mark.parametrize(("content", "words"), [
    (TEXT.replace("vertex_indices", "corners"), "have no list 'vertex_indices'"),
    (TEXT.replace("float z", "float w"), "no element 'vertex' with x, y and z"),
    (TEXT.replace("float z", "real z"), "line 6: no header of PLY has 'property real z'"),
    (TEXT.replace("format", "comment"), "has no format"),
    (TEXT.replace("end_header", "end"), "it is no PLY file"),
    (TEXT.replace("0.0 \n", "0.0 7.0 \n"), "'face'"),  # each line holds more than is declared
    (TEXT.replace("element face", "element vertex"), "an element twice"),
    (TEXT.replace("4 0 1 2 3", "4 0 1 2 2.5"), "not whole"),
    (TEXT.replace("4 0 1 2 3", "4.5 0 1 2 3"), "a list has no length"),
    (TEXT.replace("4 0 1 2 3", "-1 0 1 2 3"), "a list has no length"),
    (TEXT.replace("4 0 1 2 3", "4 0 1 2 x"), r"line 14: 'x' is no number"),
    (TEXT.replace("4 0 1 2 3", "4\n0\n1\n2\nx"), r"line 18: 'x' is no number"),
    (TEXT.replace("4 0 1 2 3", "4 0 1-2 3"), r"line 14: '1-2' is no number"),
    (TEXT.replace("4 0 1 2 3", "4 0 1_0 2 3"), r"line 14: '1_0' is no number"),
    (TEXT.replace("4 0 1 2 3", "4 0 2 1 3"), "face 0 is a polygon of 4 corners that crosses itself"),
    (TEXT.replace("4 0 1 2 3", "4 0 1 2 4"), "face 0 names vertex 4, but there are 4 vertices"),
    (square("binary_little_endian")[:-1], "ends too early"),
    (square(vertex_properties=[("ushort", "red"), ("uchar", "green"), ("uchar", "blue")], values=[65535, 255, 0]),
     "element 'vertex': red, green, blue are not of one type"),
    (square("binary_little_endian").replace(b"face 1", b"face 1000000000000000"), "declares 1000000000000000"),
    (ply("ascii", ("vertex", XYZ, CORNERS.tolist()), ("tristrips", [("int", "x")], [[1]])), "strips of triangles have"),
])  # fmt: skip
def test_broken_files_are_refused(tmp_path, content, words):
    with pytest.raises(InputError, match=words):
        loaded(tmp_path, "a.ply", content)


def test_faces_of_fewer_than_three_corners_are_noted(tmp_path):
    mesh = loaded(tmp_path, "a.ply", square(faces=[[[0, 1]], [[0, 1, 2]], [[]]]))
    assert (len(mesh.faces), mesh.notes) == (1, ("faces of fewer than three corners are left out",))
