"""Mesh files: what colours they give, and that broken ones are refused in a sentence."""

import io
import json
import logging
import struct
import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from lfssao.errors import InputError
from lfssao.gbuffer.caster import RayCaster
from lfssao.scene.load import load_scene

MESHES = Path(__file__).resolve().parents[3] / "shared" / "meshes"

ENDINGS = ("obj", "ply", "stl", "off", "glb")

# A square seen from +Z, corners at -1 and 1, with texture coordinates 0 at the left and the bottom.
SQUARE = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"
SQUARE_UV = SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
SQUARE_FACES = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"

# Rows from top to bottom; red and blue differ in every corner.
CODES = np.array([[[200, 10, 20], [60, 120, 180]], [[30, 230, 90], [255, 128, 1]]], np.uint8)


def as_bytes(content):
    return content if isinstance(content, bytes) else content.encode()


def linear(codes):
    """sRGB codes decoded once, by IEC 61966-2-1."""
    value = np.asarray(codes, np.float64) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def write(folder, **files):
    for name, content in files.items():
        path = folder / name.replace("__", ".")
        path.write_bytes(content if isinstance(content, bytes) else content.encode())


def square(folder, material=None, faces=f"usemtl m\n{SQUARE_FACES}"):
    """The square as an OBJ, with a material file of this content."""
    if material is None:
        write(folder, a__obj=SQUARE_UV + SQUARE_FACES)
    else:
        write(folder, a__mtl=material, a__obj=f"mtllib a.mtl\n{SQUARE_UV}{faces}")
    return folder / "a.obj"


def picture(folder, codes=CODES, name="t.png"):
    Image.fromarray(codes).save(folder / name)
    return folder / name


def refused(path, words=None, texture=None):
    with pytest.raises(InputError, match=words) as caught:
        load_scene(path, texture)
    message = str(caught.value)
    assert "\n" not in message
    return message


def seen_from_front(mesh, width, height):
    """Colours of an orthographic view of the square [-1, 1]^2 from +Z, one ray through the middle of each texel."""
    from lfssao.optics.camera import Camera

    view = Camera("orthographic", (0, 0, 5), (0, 0, 0), (0, 1, 0), 2.0, 1.0, 9.0).view(width, height)
    return RayCaster(mesh, view.cast_from_world).gbuffer(view).color


# --- colours


def test_texture_stands_upright_and_is_decoded_once(tmp_path):
    picture(tmp_path)
    mesh = load_scene(square(tmp_path, "newmtl m\nKd 0.5 0.5 0.5\nmap_Kd t.png\n"))
    # Two texels a side: each ray passes through the middle of one, where the texture has exactly its value.
    assert seen_from_front(mesh, 2, 2) == pytest.approx(linear(CODES), abs=1e-6)
    assert mesh.notes == ()


@pytest.mark.parametrize("material", [None, "newmtl m\nmap_Kd nope.png\n"])
def test_given_texture_takes_the_place_of_none_and_of_a_missing_one(tmp_path, material):
    mesh = load_scene(square(tmp_path, material), picture(tmp_path, name="t e x.png"))
    assert seen_from_front(mesh, 2, 2) == pytest.approx(linear(CODES), abs=1e-6)


def test_texture_coordinates_without_an_image_are_no_colour(tmp_path):
    assert load_scene(square(tmp_path)).paint is None


def test_glb_texture_stands_upright(tmp_path):
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=Image.fromarray(CODES), baseColorFactor=[255, 51, 102, 255]
    )
    square = trimesh.Trimesh(
        [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],
        [[0, 1, 2], [0, 2, 3]],
        visual=trimesh.visual.TextureVisuals(uv=uv, material=material),
        process=False,
    )
    square.export(tmp_path / "a.glb")
    # glTF multiplies, and its factors are linear.
    wanted = linear(CODES) * [1.0, 0.2, 0.4]
    assert seen_from_front(load_scene(tmp_path / "a.glb"), 2, 2) == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize(("mode", "code"), [("L", 77), ("I;16", 77 * 257)])
def test_grey_images_keep_their_range(tmp_path, mode, code):
    grey = picture(tmp_path, np.full((2, 2), code, np.uint16 if mode == "I;16" else np.uint8))
    texture = load_scene(square(tmp_path), grey).paint.textures[0]
    assert texture == pytest.approx(np.full((2, 2, 3), linear(77)), abs=1e-6)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            "property uchar red\nproperty uchar green\nproperty uchar blue\n"
            "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
            "0 0 0 255 51 0\n1 0 0 0 255 153\n0 1 0 102 0 255\n3 0 1 2\n",
        ),
        ("a.obj", "v 0 0 0 1 0.2 0\nv 1 0 0 0 1 0.6\nv 0 1 0 0.4 0 1\nf 1 2 3\n"),
    ],
)
def test_vertex_colours_of_text_formats_are_srgb(tmp_path, name, content):
    (tmp_path / name).write_text(content)
    colors = load_scene(tmp_path / name).paint.vertex_colors
    assert colors == pytest.approx(linear([[255, 51, 0], [0, 255, 153], [102, 0, 255]]), abs=1e-6)


def test_vertex_colours_of_gltf_are_linear(tmp_path):
    triangle = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False)
    triangle.visual.vertex_colors = [[255, 51, 0, 255], [0, 255, 153, 255], [102, 0, 255, 255]]
    triangle.export(tmp_path / "a.glb")
    colors = load_scene(tmp_path / "a.glb").paint.vertex_colors
    assert colors == pytest.approx(np.array([[1, 0.2, 0], [0, 1, 0.6], [0.4, 0, 1]]), abs=1e-6)


def test_face_colours(tmp_path):
    square = trimesh.Trimesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]], process=False)
    square.visual.face_colors = [[200, 10, 20, 255], [30, 230, 90, 255]]
    square.export(tmp_path / "a.ply")
    rgb = seen_from_front(load_scene(tmp_path / "a.ply"), 4, 4)
    assert rgb[3, 2] == pytest.approx(linear([200, 10, 20]), abs=1e-6)  # below the diagonal
    assert rgb[0, 1] == pytest.approx(linear([30, 230, 90]), abs=1e-6)


def test_two_materials_in_one_obj(tmp_path):
    picture(tmp_path, CODES[:1, :1])
    material = "newmtl red\nKd 1 0.2 0\nnewmtl picture\nKd 0 0 0\nmap_Kd t.png\n"
    path = square(tmp_path, material, "usemtl red\nf 1/1 2/2 3/3\nusemtl picture\nf 1/1 3/3 4/4\n")
    rgb = seen_from_front(load_scene(path), 4, 4)
    assert rgb[3, 2] == pytest.approx(linear([255, 51, 0]), abs=1e-6)
    # An OBJ's image takes the place of its Kd: exporters write Kd 0 beside it.
    assert rgb[0, 1] == pytest.approx(linear(CODES[0, 0]), abs=1e-6)


def test_material_without_a_colour_is_white(tmp_path):
    # trimesh makes up a grey of 40 per cent.
    assert load_scene(square(tmp_path, "newmtl m\nNs 10\n")).paint is None


def test_degenerate_faces_are_counted_and_keep_materials_in_step(tmp_path):
    faces = "usemtl red\nf 1 1 2\nf 1 2 3\nusemtl green\nf 1 3 4\nf 2 2 2\n"
    mesh = load_scene(square(tmp_path, "newmtl red\nKd 1 0 0\nnewmtl green\nKd 0 1 0\n", faces))
    assert (len(mesh.faces), mesh.degenerate) == (2, 2)
    rgb = seen_from_front(mesh, 4, 4)
    assert rgb[3, 2].tolist() == [1, 0, 0]
    assert rgb[0, 1].tolist() == [0, 1, 0]


# --- geometry


@pytest.mark.parametrize("ending", ["obj", "ply", "glb"])
def test_normals_are_the_files_own_and_turned_with_the_scene(tmp_path, ending):
    """trimesh makes normals up for a mesh without; (1, 0, 1) stretched twice along x is (1, 0, 2) by its cofactors."""
    wanted = np.array([1, 0, 1]) / np.sqrt(2)
    bare, own = (trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False) for _ in range(2))
    own.vertex_normals = np.tile(wanted, (3, 1))
    assert own.vertex_normals[0] == pytest.approx(wanted)
    scene = trimesh.Scene()
    scene.add_geometry(own, transform=np.diag([2.0, 1, 1, 1]))
    made = scene if ending == "glb" else own
    (tmp_path / f"own.{ending}").write_bytes(as_bytes(made.export(file_type=ending)))
    (tmp_path / f"bare.{ending}").write_bytes(as_bytes(bare.export(file_type=ending)))
    normals = load_scene(tmp_path / f"own.{ending}").normals
    assert normals == pytest.approx(np.tile([1, 0, 2] / np.sqrt(2) if ending == "glb" else wanted, (3, 1)), abs=1e-6)
    assert load_scene(tmp_path / f"bare.{ending}").normals is None


@pytest.mark.parametrize("ending", [*ENDINGS, "OBJ", "GLB"])
def test_all_formats_give_the_same_box(tmp_path, ending):
    box = trimesh.creation.box(extents=(1, 2, 3))
    box.export(tmp_path / f"a.{ending}", file_type=ending.lower())
    mesh = load_scene(tmp_path / f"a.{ending}")
    assert mesh.bounds.tolist() == [[-0.5, -1.0, -1.5], [0.5, 1.0, 1.5]]
    assert (len(mesh.faces), mesh.degenerate, mesh.paint) == (12, 0, None)


def test_transforms_of_a_scene_are_applied(tmp_path):
    scene = trimesh.Scene()
    box = trimesh.creation.box(extents=(1, 1, 1))
    for x in (0.0, 10.0):
        scene.add_geometry(box, transform=trimesh.transformations.translation_matrix((x, 0, 0)))
    scene.export(tmp_path / "a.glb")
    mesh = load_scene(tmp_path / "a.glb")
    assert len(mesh.faces) == 24
    assert mesh.bounds.tolist() == [[-0.5] * 3, [10.5, 0.5, 0.5]]


def test_names_and_comments_in_latin_1(tmp_path):
    write(tmp_path, a__obj=("# Ringstraße\n" + TRIANGLE).encode("latin-1"))
    assert len(load_scene(tmp_path / "a.obj").faces) == 1


def test_loading_is_silent(tmp_path, capfd):
    write(tmp_path, a__stl="solid a\nfacet normal 0 0 1\nouter loop\nvertex inf 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
          "endloop\nendfacet\nendsolid a\n", b__obj=f"mtllib no.mtl\n{TRIANGLE}")  # fmt: skip
    logging.getLogger("trimesh").debug("a handler would print this")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        refused(tmp_path / "a.stl", "vertex 0 is not finite")
        load_scene(tmp_path / "b.obj")
    assert caught == []
    assert capfd.readouterr() == ("", "")


def test_missing_material_file_is_said(tmp_path):
    write(tmp_path, a__obj=f"mtllib no.mtl\n{TRIANGLE}")
    assert load_scene(tmp_path / "a.obj").notes == (
        "it names 'no.mtl', which is not there: its materials are left out",
    )


# --- broken files


def box_as(ending, encoding=None):
    keywords = {} if encoding is None else {"encoding": encoding}
    return as_bytes(trimesh.creation.box().export(file_type=ending, **keywords))


@pytest.mark.parametrize("ending", ENDINGS)
def test_every_file_that_is_none_is_refused(tmp_path, ending):
    random = np.random.default_rng(5)
    whole = box_as(ending)
    broken = {
        "empty": b"",
        "text": b"hello world\n",
        "zeros": bytes(5000),
        "garbage": random.bytes(5000),
        "start": whole[:20] + random.bytes(2000),
    }
    for name, content in broken.items():
        path = tmp_path / f"{name}.{ending}"
        path.write_bytes(content)
        assert refused(path).startswith(f"{path}: ")
    assert refused(tmp_path / f"empty.{ending}").endswith("the file is empty")


@pytest.mark.parametrize(
    ("ending", "encoding"), [("ply", None), ("ply", "ascii"), ("stl", None), ("off", None), ("glb", None)]
)
def test_every_truncation_is_refused(tmp_path, ending, encoding):
    whole = box_as(ending, encoding)
    path = tmp_path / f"a.{ending}"
    # Text may lose its last line feed, or digits of its last number, and nobody can know.
    last = len(whole) - (3 if encoding or ending == "off" else 1)
    for length in {*range(0, last, 13), last}:
        path.write_bytes(whole[:length])
        refused(path)


def test_truncated_text_formats_without_counts_never_crash(tmp_path):
    for ending in ("obj", "stl_ascii"):
        whole = box_as(ending)
        path = tmp_path / f"a.{ending[:3]}"
        found = set()
        for length in range(0, len(whole), 11):
            path.write_bytes(whole[:length])
            try:
                found.add(len(load_scene(path).faces) <= 12)
            except InputError as error:
                found.add("\n" not in str(error))
        assert found == {True}


def ply(vertices="0 0 0\n1 0 0\n0 1 0\n", face="3 0 1 2", count=3):
    return (
        f"ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face 1\nproperty list uchar int vertex_indices\nend_header\n{vertices}{face}\n"
    )


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.obj", TRIANGLE.replace("v 1", "v nan"), r"vertex 1 is not finite: \[nan, 0\.0, 0\.0\]"),
        ("a.obj", TRIANGLE.replace("v 1", "v -inf"), "vertex 1 is not finite"),
        ("a.obj", TRIANGLE.replace("v 1", "v 1e400"), "vertex 1 is not finite"),
        ("a.obj", TRIANGLE.replace("v 1", "v 1e200"), r"vertex 1 is beyond 1e\+30"),
        ("a.obj", TRIANGLE.replace("f 1", "f 4"), "a face names a vertex that does not exist"),
        ("a.obj", TRIANGLE.replace("f 1", "f -4"), "a face names a vertex that does not exist"),
        ("a.obj", TRIANGLE.replace("f 1", "f 0"), "line 4: a face names vertex 0, but OBJ counts from 1"),
        ("a.obj", TRIANGLE + "f 1 2 0", "line 5: a face names vertex 0"),
        ("a.obj", TRIANGLE + "f -3 -2 -1\nv 9 9 9\n", "line 5: a face counts vertices backwards"),
        ("a.obj", TRIANGLE + "f 1 2 x\n", "cannot be read as a mesh"),
        ("a.obj", SQUARE, "no triangles"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 2\n", "no face with an area"),
        ("a.obj", "v 0 0 0\nv 1e-40 0 0\nv 0 1e-40 0\nf 1 2 3\n", "at least 1e-30"),
        ("a.ply", ply("nan 0 0\n1 0 0\n0 1 0\n"), "vertex 0 is not finite"),
        ("a.ply", ply(face="3 0 1 3"), "face 0 names vertex 3, but there are 3 vertices"),
        ("a.ply", ply(face="3 0 1 -1"), "face 0 names vertex -1"),
        ("a.ply", ply(count=10**12), "declares 1000000000001 lines, there are 4"),
        ("a.ply", ply().replace("ascii", "binary_little_endian").replace("vertex 3", "vertex 99999999999"), "PLY"),
        ("a.off", "OFF\n3 1 0\ninf 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "vertex 0 is not finite"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "outside the range"),
        ("a.off", "OFF\n3 999999999 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "declares 3 vertices and 999999999 faces"),
        ("a.stl", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50), "4294967295 faces, which take .* but has 134"),
        ("a.stl", bytes(84), "no triangles"),
        ("a.txt", "hello", "cannot be read as a mesh .* '.txt' have no reader"),
        ("a", "hello", "cannot be read as a mesh"),
    ],
)
def test_broken_meshes_are_refused(tmp_path, name, content, words):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert refused(path, words).startswith(f"{path}: ")


def patched_glb(patch):
    whole = box_as("glb")
    length = struct.unpack("<I", whole[12:16])[0]
    header, binary = json.loads(whole[20 : 20 + length]), bytearray(whole[20 + length :])
    patch(header, binary)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + bytes(binary)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def far_index(header, binary):
    accessor = header["accessors"][header["meshes"][0]["primitives"][0]["indices"]]
    start = 8 + header["bufferViews"][accessor["bufferView"]].get("byteOffset", 0)
    binary[start : start + 4] = struct.pack("<I", 30000)


def huge_count(header, binary):
    for accessor in header["accessors"]:
        accessor["count"] = 10**12


def bad_transform(header, binary):
    header["nodes"][-1]["matrix"] = [float("inf")] * 16


@pytest.mark.parametrize(
    ("patch", "words"),
    [(far_index, "names vertex 30000"), (huge_count, "cannot be read"), (bad_transform, "is not finite")],
)
def test_broken_glb_is_refused(tmp_path, patch, words):
    (tmp_path / "a.glb").write_bytes(patched_glb(patch))
    refused(tmp_path / "a.glb", words)


def test_missing_files_folders_and_links(tmp_path):
    refused(tmp_path / "no.obj", r"no\.obj: there is no such file")
    refused(tmp_path, "it is a folder, not a file")
    (tmp_path / "zero.obj").symlink_to("/dev/zero")
    refused(tmp_path / "zero.obj", "not a regular file")


def test_file_that_may_not_be_read(tmp_path, monkeypatch):
    write(tmp_path, a__obj=TRIANGLE)

    def deny(path):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "read_bytes", deny)
    refused(tmp_path / "a.obj", r"a\.obj: it cannot be read as a mesh \(Permission denied\)")


def test_textures_that_cannot_be_had(tmp_path):
    write(
        tmp_path,
        a__mtl="newmtl m\nmap_Kd no such.png\n",
        b__mtl="newmtl m\nmap_Kd garbage.png\n",
        c__mtl="newmtl m\nmap_Kd half.png\n",
        garbage__png="garbage",
        **{f"{k}__obj": f"mtllib {k}.mtl\n{SQUARE_UV}usemtl m\n{SQUARE_FACES}" for k in "abc"},
        plain__obj=TRIANGLE,
    )
    noise = Image.fromarray(np.random.default_rng(1).integers(0, 255, (64, 64, 3), dtype=np.uint8))
    buffer = io.BytesIO()
    noise.save(buffer, "png")
    (tmp_path / "half.png").write_bytes(buffer.getvalue()[:5000])
    noise.save(tmp_path / "whole.png")

    refused(tmp_path / "a.obj", r"a\.obj: it names the image 'no such\.png', which is not there")
    refused(tmp_path / "b.obj", r"b\.obj: it names the image 'garbage\.png', which cannot be read")
    refused(tmp_path / "c.obj", r"c\.obj: it names the image 'half\.png', which cannot be read")
    refused(tmp_path / "a.obj", r"no\.png: there is no such file", tmp_path / "no.png")
    refused(tmp_path / "a.obj", r"garbage\.png: it cannot be read as an image", tmp_path / "garbage.png")
    refused(tmp_path / "a.obj", r"half\.png: it cannot be read as an image", tmp_path / "half.png")
    refused(tmp_path / "a.obj", "it is a folder", tmp_path)
    refused(tmp_path / "plain.obj", r"plain\.obj: .*no texture coordinates", tmp_path / "whole.png")


def test_texture_with_coordinates_that_are_not_finite(tmp_path):
    write(tmp_path, a__obj=SQUARE_UV.replace("vt 1 1", "vt nan 1") + SQUARE_FACES)
    refused(tmp_path / "a.obj", "texture coordinate is not finite", picture(tmp_path))


# --- real files


@pytest.mark.parametrize(
    ("name", "faces", "texture"),
    [
        ("armadillo.ply", 172_972, None),
        ("bunny.obj", 69_451, None),
        ("lucy.obj", 99_970, None),
        ("spot/spot_triangulated.obj", 5_856, "spot/spot_texture.png"),
        ("fuze/fuze.obj", None, None),
    ],
)
def test_real_meshes(name, faces, texture):
    if not (MESHES / name).exists():
        pytest.skip(f"{name} is not there")
    mesh = load_scene(MESHES / name, texture and MESHES / texture)
    assert faces is None or len(mesh.faces) + mesh.degenerate == faces
    textured = mesh.paint is not None and mesh.paint.textures[0] is not None
    assert textured == (texture is not None or name == "fuze/fuze.obj")
    assert mesh.notes == ()
