"""OBJ and its materials: spellings, forms of faces, colours, options of images, and what is refused or noted."""

import numpy as np
import pytest
from mesh_files import CORNERS, area, colors, linear, loaded, rows, textured, triangles
from PIL import Image

from lfssao.errors import InputError
from lfssao.scene.mesh import samplers_of

RNG = np.random.default_rng(29)
V = "".join(f"v {row}\n" for row in rows(CORNERS).splitlines())
VT = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
UV = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
PLAIN = V + "f 1 2 3 4\n"
MAPPED = f"mtllib m.mtl\n{V}{VT}usemtl a\nf 1/1 2/2 3/3 4/4\n"
TWO_HALVES = [[0, 1, 2], [2, 3, 0]]


@pytest.fixture
def folder(tmp_path):
    """A folder with two images."""
    for name in ("t.png", "t u.png"):
        Image.new("RGB", (1, 1), (255, 0, 0)).save(tmp_path / name)
    return tmp_path


@pytest.mark.parametrize("content", [
    PLAIN, PLAIN.replace("\n", "\r"), PLAIN.replace("\n", "\r\n"), "\ufeff" + PLAIN, PLAIN.encode("utf-16"),
    PLAIN + "\x1a", PLAIN.encode("utf-16-le"), PLAIN.encode("utf-16-be"), PLAIN.encode("utf-32"),
    b"\xfe\xff" + PLAIN.encode("utf-16-be"), PLAIN.replace(" ", "\t").replace("v", " \tv"), PLAIN.strip(),
    PLAIN.replace("\n", " # top\n"), PLAIN.replace("\n", "# top\n"), PLAIN.replace("2 3", "\\\n2 \\\n\\\n 3"),
    V + "# C:\\\nf 1 2 3 4", V + "f -4 -3 -2 -1\n", V + "f 1/ 2// 3/ 4\n", "g a\no b\ns off\n" + V + "f 1 2 -2 4\n",
    PLAIN.replace("v 1 1 0", "v 1.0E+00 +1. 0e5"), PLAIN.replace("f ", "fo "), (PLAIN + "# ß").encode("latin-1"),
    "v 9 9 9\nf -1 -1 -1\n" + V + "f -4 -3 -2 -1\nv 8 8 8\n", V.replace("0\n", "0 1\n") + "f 1 2 3 4\n",
    "".join(f"v {row}\n" for row in rows(CORNERS * 4, [[4]] * 4).splitlines()) + "f 1 2 3 4\n",
])  # fmt: skip
def test_spellings(tmp_path, content):
    mesh = loaded(tmp_path, "a.obj", content)
    assert np.array_equal(triangles(mesh), CORNERS[TWO_HALVES])
    assert (mesh.notes, mesh.paint) == ((), None)


def test_faces_of_every_form_that_are_drawn(folder):
    """Three materials, each with an image or a colour; corners with any of coordinates and normals, from either end."""
    materials = "newmtl m0\nmap_Kd t.png\nnewmtl m1\nKd 0.25 0.5 1\nnewmtl m2\nmap_Kd t u.png\n"
    for _ in range(30):
        count = RNG.integers(3, 9, 3)
        v, vt, vn = (RNG.normal(size=(n, k)) for n, k in zip(count, (3, 2, 3), strict=True))
        lines = [f"{key} {row}" for key, table in (("v", v), ("vt", vt), ("vn", vn)) for row in
                 (" ".join(map(repr, each)) for each in table.tolist())]  # fmt: skip
        wanted = {}
        for _ in range(12):
            material = int(RNG.integers(3))
            mapped = RNG.random() < 0.6
            normal = RNG.random() < 0.5
            corners = np.stack([RNG.choice(n, 3, replace=False) for n in count], axis=1).tolist()
            shown = [[k - n if RNG.random() < 0.3 else k + 1 for k, n in zip(c, count, strict=True)] for c in corners]
            words = [f"{a}/{b if mapped else ''}/{c if normal else ''}".rstrip("/") for a, b, c in shown]
            lines += [f"usemtl m{material}", f"f {' '.join(words)}"]
            wanted.setdefault(material, {True: [], False: []})[mapped].append([c[:2] for c in corners])
        mesh = loaded(folder, "a.obj", "\n".join(["mtllib m.mtl", *lines]), m=materials)
        # The last material is the first part; of one with an image, faces with coordinates go before others.
        order = [
            (name, kind, face)
            for name in reversed(wanted)
            for kind in (True, False)
            for face in wanted[name][kind]
            if name != 1
        ]
        assert len(mesh.faces) == 12
        painted = mesh.paint.factors[mesh.paint.face_material]
        plain = (painted != 1).any(axis=1)
        assert plain.sum() == sum(map(len, wanted.get(1, {}).values()))
        assert np.array_equal(triangles(mesh)[~plain], v[[[c[0] for c in face] for _, _, face in order]])
        found, has = textured(mesh) if mesh.paint.uv is not None else (None, np.zeros(12, bool))
        assert has[~plain].tolist() == [kind for _, kind, _ in order]
        if has.any():
            assert np.array_equal(found[has], vt[[[c[1] for c in face] for _, kind, face in order if kind]])


@pytest.mark.parametrize(("outline", "size"), [
    ([[0, 0], [1, -1], [1, 1], [-1, 1], [-1, -1]], 3), ([[3, 0], [3, 1], [1, 1], [1, 3], [0, 3], [0, 0]], 5),
])  # fmt: skip
def test_concave_polygons(tmp_path, outline, size):
    text = "".join(f"v {x} 2 {y}\n" for x, y in outline)
    for start in range(len(outline)):
        order = [(start + k) % len(outline) + 1 for k in range(len(outline))]
        assert area(loaded(tmp_path, "a.obj", text + f"f {' '.join(map(str, order))}\n")) == pytest.approx(size)


def colored(color):
    """The square with more numbers at its vertices."""
    return "".join(f"v {row} {color}\n" for row in rows(CORNERS).splitlines()) + "f 1 2 3 4\n"


@pytest.mark.parametrize(("text", "wanted", "note"), [
    (colored("1 0.5 0"), linear([1, 0.5, 0], 1), None),
    (colored("1 0.5 0 1"), linear([1, 0.5, 0], 1), None),
    (colored("1 0.5 0 0.5") + V.replace("0\n", "0 .1 .1 .1 1\n"), linear([1, 0.5, 0], 1), "in part transparent"),
    (colored("255 128 0"), linear([255, 128, 0]), "its colours reach 255: they are read as 0 to 255"),
    (colored("1 0 2"), linear([1, 0, 2]), "its colours reach 2: they"),
    (colored("1.5 0.5 -1"), linear([1, 0.5, 0], 1), "clamped to 0 to 1"),
])  # fmt: skip
def test_colours_of_vertices(tmp_path, text, wanted, note):
    mesh = loaded(tmp_path, "a.obj", text)
    assert colors(mesh) == pytest.approx(np.broadcast_to(wanted, (2, 3, 3)), abs=1e-7)
    assert [note in each for each in mesh.notes] == ([True] if note else [])


@pytest.mark.parametrize("first", [True, False])
def test_vertices_without_colours_are_white_and_materials_multiply(folder, first):
    halves = [V, V.replace("0\n", "0 1 0.5 0\n")]
    text = "".join(reversed(halves) if first else halves) + "f 1 2 3\nf 5 6 7\nusemtl a\nf 1 2 7\n"
    mesh = loaded(folder, "a.obj", "mtllib m.mtl\n" + text, m="newmtl a\nKd 0.5 0.5 1\n")
    orange = linear([1, 0.5, 0], 1)
    white = np.ones(3)
    pair = [orange, white] if first else [white, orange]
    both = np.array([pair[0], pair[0], pair[1]]) * linear([0.5, 0.5, 1], 1)
    assert colors(mesh) == pytest.approx(np.stack([both, *([each] * 3 for each in pair)]), abs=1e-7)
    assert mesh.notes == ()
    mesh = loaded(folder, "a.obj", MAPPED.replace("1 1 0\n", "1 1 0 1 1 0\n"), m="newmtl a\nmap_Kd t.png\n")
    assert mesh.notes == ("colours of its vertices multiply its image",)
    assert np.unique(mesh.paint.vertex_colors, axis=0).tolist() == [[1, 1, 0], [1, 1, 1]]


@pytest.mark.parametrize(("material", "wanted", "note"), [
    ("Kd 0.5", linear([0.5] * 3, 1), None),
    ("Kd 0.25 0.5 1 # blue", linear([0.25, 0.5, 1], 1), None),
    ("\tKd\t0.001 0 1\r\nNs 10", linear([0.001, 0, 1], 1), None),
    ("Kd 255 128 0", linear([255, 128, 0]), "are read as 0 to 255"),
    ("Kd 1.2 0.5 0", linear([1, 0.5, 0], 1), "clamped to 0 to 1"),
    ("Kd spectral a.rfl 1", [1, 1, 1], "Kd spectral is left out"),
    ("Kd xyz 0.2 0.3 0.4", [1, 1, 1], "Kd xyz is left out"),
    ("Kd 1 0 0\nd 0.5", [1, 0, 0], "d 0.5 is left out"),
    ("Kd 1 0 0\nd 1.0\nTr 0\nd -halo 1", [1, 0, 0], None),
    ("Kd 1 0 0\nTr 0.25", [1, 0, 0], "Tr 0.25 is left out"),
    ("Kd 1 0 0\nTr 1.0", [1, 0, 0], None),  # some write it for opaque
    ("Kd 1 0 0\nmap_d t.png", [1, 0, 0], "map_d is left out"),
])  # fmt: skip
def test_materials(folder, material, wanted, note):
    for begin, blank in (("", " "), ("\ufeff", "\t")):
        text = f"{begin}newmtl{blank}a\n{material}\nnewmtl b\nKd spectral x\nmap_Kd no.png\n"
        mesh = loaded(folder, "a.obj", f"mtllib{blank}m.mtl\n{V}usemtl{blank}a\nf 1 2 3 4\n", m=text)
        found = np.ones(3) if mesh.paint is None else colors(mesh)
        assert found == pytest.approx(np.broadcast_to(wanted, np.shape(found)), abs=1e-7)
        assert [note in each for each in mesh.notes] == ([True] if note else [])


@pytest.mark.parametrize(("head", "names"), [
    ("mtllib m.mtl n.mtl", "ab"), ("mtllib m.mtl\nmtllib n.mtl", "ab"), ("mtllib m.mtl x y.mtl  n.mtl # three", "ab"),
    ("mtllib x y.mtl", ("a b", "Mat #2")), ("mtllib ./x y.mtl # mine", ("a b # mine", "Mat")),
    ("mtllib n.mtl\tm.mtl", "ab"), ("mtllib C:\\away\\m.mtl n.mtl", "ab"),
])  # fmt: skip
def test_several_material_files_and_names_with_blanks(tmp_path, head, names):
    files = {"m": "newmtl a\nKd 1 0 0\n", "n": "newmtl a\nKd 1 1 1\nnewmtl b\nKd 0 1 0\n".encode("utf-16"),
             "x y": "newmtl a b\nKd 1 0 0\nnewmtl Mat #1\nKd 1 1 1\n"
                    "newmtl Mat #2\nKd 0 1 0\nnewmtl Mat\nKd 0 1 0\n"}  # fmt: skip
    text = f"usemtl {names[0]}\n{V}f 1 2 3\nusemtl {names[1]}\nf 3 4 1\n"
    for content in (f"{head}\n{text}", f"{text}{head}\n"):
        if head.startswith("mtllib n"):
            files["n"] = "newmtl b\nKd 0 1 0\n"
        mesh = loaded(tmp_path, "a.obj", content, **files)
        assert colors(mesh)[:, 0].tolist() == [[0, 1, 0], [1, 0, 0]]
        assert mesh.notes == ()


@pytest.mark.parametrize("library", ["sub/m.mtl", "sub\\m.mtl"])
def test_images_are_beside_the_material_file_that_names_them(folder, library):
    (folder / "sub").mkdir()
    Image.new("RGB", (1, 1), (0, 255, 0)).save(folder / "sub" / "t.png")
    (folder / "sub" / "m.mtl").write_text("newmtl a\nmap_Kd t.png\nnewmtl b\nmap_Kd t u.png\n")
    content = MAPPED.replace("m.mtl", library)
    for name, wanted in (("a", [0, 1, 0]), ("b", [1, 0, 0])):
        mesh = loaded(folder, "a.obj", content.replace("usemtl a", f"usemtl {name}"))
        assert mesh.paint.textures[0].tolist() == [[wanted]]


@pytest.mark.parametrize(("line", "scale", "offset", "note"), [
    ("map_Kd t u.png", 1, 0, None),
    ("map_kd -s .5 .5 1 -o .5 0 0 t.png", 0.5, [0.5, 0], None),
    ("map_Kd -o 0.25 t.png # mine", 1, [0.25, 0], None),
    ("map_Kd -s 2 -3 -blendu on -blendv off -bm 1 -boost 2 -texres 64 t u.png", [2, -3], 0, None),
    ("map_Kd -mm 0 1 -cc off -t 0 0 0 t.png", 1, 0, None),
    ("map_Kd -clamp off t.png", 1, 0, None), ("map_Kd -clamp on t.png", 1, 0, None),
    ("map_Kd -s .5 -clamp on t.png", [0.5, 1], 0, None),
    ("map_Kd -mm 0.1 0.9 t.png", 1, 0, "option -mm 0.1 0.9 is left out"),
    ("map_Kd -cc on t.png", 1, 0, "option -cc on is left out"),
    ("map_Kd -imfchan r t.png", 1, 0, "option -imfchan r is left out"),
    ("map_Kd -t 1 1 1 t.png", 1, 0, "option -t 1 1 1 is left out"),
])  # fmt: skip
def test_options_of_images(folder, line, scale, offset, note):
    mesh = loaded(folder, "a.obj", MAPPED, m=f"newmtl a\nKd 0 0 0\n{line}\n")
    found, has = textured(mesh)
    assert has.all()
    assert np.array_equal(found, (UV * scale + offset)[TWO_HALVES])
    clamped = ("clamp", "clamp", False) if "clamp on" in line else ("repeat", "repeat", False)
    assert set(samplers_of(mesh.paint)) == {clamped}
    assert [note in each for each in mesh.notes] == ([True] if note else [])


@pytest.mark.parametrize(("text", "note"), [
    (PLAIN + "l 1 2\np 1\n", "lines, points and curves"),
    (PLAIN + "cstype bezier\ncurv 0 1 1 2 3\nend\n", "lines, points and curves"),
    (PLAIN + "9 9 9\nwhat 1\n", "line 6 is left out: OBJ has no '9'"),
    (PLAIN + "f 1 2\n", "fewer than three corners"),
    (V + "#MRGB ffff0000ffff0000ffff0000ffff0000\nf 1 2 3 4\n", "colours of its vertices in comments"),
    (V + "f 1/1 2/2 3/3 4/4\n", "texture coordinates that do not exist"),
    (V + "f 1//9 2//9 3//9 4//9\n", "normals that do not exist"),
    (V + "usemtl a\nf 1 2 3 4\n", "no file has its material 'a'"),
    (V + "mtllib m.mtl\nusemtl b\nf 1 2 3 4\n", "no file has its material 'b'"),
    (MAPPED.replace("1/1", "1"), "an image is left out of faces that have no texture coordinates"),
])  # fmt: skip
def test_notes(folder, text, note):
    mesh = loaded(folder, "a.obj", text, m="newmtl a\nmap_Kd t.png\n")
    assert (area(mesh), len(mesh.notes), note in mesh.notes[0]) == (4, 1, True)


@pytest.mark.parametrize(("text", "words"), [
    (PLAIN + "v 1 2\n", "line 6: a vertex has 2 numbers"), (PLAIN + "v 1 2 3 4 5\n", "line 6: a vertex has 5 numbers"),
    (PLAIN + "v 1 2 3 0\n", "line 6: a vertex has w = 0"), (PLAIN + "v 1 2_0 3\n", "line 6: .* has an underscore"),
    (PLAIN + "v 1 2 z\n", "line 6: 'v 1 2 z' has a word that is no number"),
    (PLAIN + "vn 1 2\n", "line 6: 'vn 1 2' has"), (PLAIN + "vt\n", "line 6: 'vt' has"),
    (PLAIN + "f 1 2 3_0\n", "line 6: no corner: 3_0"),
    (PLAIN + "f 1 \\\n2 9\n", "line 6: a face names a vertex that does not exist: 9 of 4"),
    (PLAIN + "f 1 \\\n2 \\\n3\nv 1 2\n", "line 9: a vertex has 2 numbers"),
    (PLAIN + "f 1 2 -5\n", "line 6: a face names a vertex that does not exist: -5"),
    (PLAIN + "f 1/1/1/1 2 3\n", "line 6: no corner"), (PLAIN + "call b.obj\n", "line 6: 'call' makes"),
    (V + "f 1 3 2 4\n", "line 5: a face is a polygon of 4 corners that crosses itself"),
    (PLAIN + "surf 0 1 0 1 1 2 3 4\n", "line 6: 'surf' makes surfaces"),
    (colored("1 0.5 0 0").replace("f", "v 0 0 0 1 1 1 1\nf"), "seven numbers"), (colored("nan 0 0"), "not finite"),
    (MAPPED.replace("usemtl a", "usemtl b"), "'m.mtl': line 4: 'Kd a' is no line of a material file"),
])  # fmt: skip
def test_broken_files_are_refused(folder, text, words):
    materials = "newmtl a\nmap_Kd t.png\n" + "newmtl b\nKd a\n" * ("usemtl b" in text)
    with pytest.raises(InputError, match=words):
        loaded(folder, "a.obj", text, m=materials)
