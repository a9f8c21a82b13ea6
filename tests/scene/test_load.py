"""Mesh files: what colours they give, and that broken ones are refused in a sentence."""

import io
import json
import logging
import re
import struct
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from jobs import python
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


def linear(codes):
    """sRGB codes decoded once, by IEC 61966-2-1."""
    value = np.asarray(codes, np.float64) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def write(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def square(folder, material=None, faces=f"usemtl m\n{SQUARE_FACES}"):
    """The square as an OBJ, with a material file of this content."""
    if material is None:
        return write(folder / "a.obj", SQUARE_UV + SQUARE_FACES)
    write(folder / "a.mtl", material)
    return write(folder / "a.obj", f"mtllib a.mtl\n{SQUARE_UV}{faces}")


def square_mesh(**visual):
    """The square as trimesh has it."""
    corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    faces = [[0, 1, 2], [0, 2, 3]]
    return trimesh.Trimesh(corners, faces, process=False, **visual)


def triangle_mesh():
    return trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False)


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


def assert_halves(mesh, below, above):
    """Colours of the square's two triangles, below its diagonal and above it."""
    rgb = seen_from_front(mesh, 4, 4)
    assert rgb[3, 2] == pytest.approx(np.array(below), abs=1e-6)
    assert rgb[0, 1] == pytest.approx(np.array(above), abs=1e-6)


# --- colours


@pytest.mark.parametrize(("material", "given"), [
    ("newmtl m\nKd 0.5 0.5 0.5\nmap_Kd t e x.png\n", False),
    (None, True),
    ("newmtl m\nmap_Kd nope.png\n", True),  # the texture that is given takes the place of a missing one
    ("newmtl m\nmap_Kd other.png\n", True),  # and of another one
])  # fmt: skip
def test_texture_stands_upright_and_is_decoded_once(tmp_path, material, given):
    texture = picture(tmp_path, name="t e x.png")
    _ = picture(tmp_path, 255 - CODES, "other.png")
    mesh = load_scene(square(tmp_path, material), texture if given else None)
    # Two texels a side: each ray passes through the middle of one, where the texture has exactly its value.
    assert seen_from_front(mesh, 2, 2) == pytest.approx(linear(CODES), abs=1e-6)
    assert mesh.notes == ()


@pytest.mark.parametrize("faces", ["usemtl m\n" + SQUARE_FACES, "usemtl m\nf 1/1 2/2 3/3\nusemtl n\nf 1/1 3/3 4/4\n"])
def test_the_second_texture_coordinate_is_0_where_an_obj_leaves_it_out(tmp_path, faces):
    picture(tmp_path, name="x.png")
    path = square(tmp_path, "newmtl m\nmap_Kd x.png\nnewmtl n\nmap_Kd x.png\n", faces)
    found = []
    for coordinate in (r"\1", r"\1 0"):
        path.write_text(re.sub(r"^(vt \d) ?\d?$", coordinate, path.read_text(), flags=re.MULTILINE))
        found.append(load_scene(path))
    assert {tuple(row) for row in found[0].paint.uv} == {(0, 0), (1, 0)}
    assert np.array_equal(*(seen_from_front(mesh, 2, 2) for mesh in found))


@pytest.mark.parametrize("material", [None, "newmtl m\nNs 10\n"])
def test_coordinates_without_an_image_and_a_material_without_a_colour_are_white(tmp_path, material):
    """trimesh makes up a grey of 40 per cent."""
    assert load_scene(square(tmp_path, material)).paint is None


def test_glb_texture_stands_upright(tmp_path):
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=Image.fromarray(CODES), baseColorFactor=[255, 51, 102, 255]
    )
    square_mesh(visual=trimesh.visual.TextureVisuals(uv=uv, material=material)).export(tmp_path / "a.glb")
    # glTF multiplies, and its factors are linear.
    wanted = linear(CODES) * [1.0, 0.2, 0.4]
    assert seen_from_front(load_scene(tmp_path / "a.glb"), 2, 2) == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize(("mode", "code"), [("L", 77), ("I;16", 77 * 257)])
def test_grey_images_keep_their_range(tmp_path, mode, code):
    grey = picture(tmp_path, np.full((2, 2), code, np.uint16 if mode == "I;16" else np.uint8))
    texture = load_scene(square(tmp_path), grey).paint.textures[0]
    assert texture == pytest.approx(np.full((2, 2, 3), linear(77)), abs=1e-6)


@pytest.mark.parametrize(("ending", "options"), [("ply", {"encoding": "ascii"}), ("ply", {}), ("obj", {}), ("glb", {})])
def test_vertex_colours_are_srgb_and_of_gltf_linear(tmp_path, ending, options):
    codes = np.array([[255, 51, 0], [0, 255, 153], [102, 0, 255]], np.uint8)
    made = triangle_mesh()
    made.visual.vertex_colors = codes
    content = made.export(file_type=ending, **options)
    colors = load_scene(write(tmp_path / f"a.{ending}", content)).paint.vertex_colors
    assert colors == pytest.approx(codes / 255 if ending == "glb" else linear(codes), abs=1e-6)


def test_face_colours(tmp_path):
    square_mesh(face_colors=[[200, 10, 20, 255], [30, 230, 90, 255]]).export(tmp_path / "a.ply")
    assert_halves(load_scene(tmp_path / "a.ply"), linear([200, 10, 20]), linear([30, 230, 90]))


def test_two_materials_in_one_obj(tmp_path):
    """An OBJ's image takes the place of its Kd: exporters write Kd 0 beside it."""
    picture(tmp_path, CODES[:1, :1])
    material = "newmtl red\nKd 1 0.2 0\nnewmtl picture\nKd 0 0 0\nmap_Kd t.png\n"
    path = square(tmp_path, material, "usemtl red\nf 1/1 2/2 3/3\nusemtl picture\nf 1/1 3/3 4/4\n")
    assert_halves(load_scene(path), linear([255, 51, 0]), linear(CODES[0, 0]))


def test_degenerate_faces_are_counted_and_keep_materials_in_step(tmp_path):
    faces = "usemtl red\nf 1 1 2\nf 1 2 3\nusemtl green\nf 1 3 4\nf 2 2 2\n"
    mesh = load_scene(square(tmp_path, "newmtl red\nKd 1 0 0\nnewmtl green\nKd 0 1 0\n", faces))
    assert (len(mesh.faces), mesh.degenerate) == (2, 2)
    assert_halves(mesh, [1, 0, 0], [0, 1, 0])


# --- geometry


@pytest.mark.parametrize("ending", ["obj", "ply", "glb"])
def test_normals_are_the_files_own_and_turned_with_the_scene(tmp_path, ending):
    """trimesh makes normals up for a mesh without; (1, 0, 1) stretched twice along x is (1, 0, 2) by its cofactors."""
    wanted = np.array([1, 0, 1]) / np.sqrt(2)
    bare = triangle_mesh()
    own = triangle_mesh()
    own.vertex_normals = np.tile(wanted, (3, 1))
    assert own.vertex_normals[0] == pytest.approx(wanted)
    scene = trimesh.Scene()
    scene.add_geometry(own, transform=np.diag([2.0, 1, 1, 1]))
    made = scene if ending == "glb" else own
    normals = load_scene(write(tmp_path / f"own.{ending}", made.export(file_type=ending))).normals
    assert normals == pytest.approx(np.tile([1, 0, 2] / np.sqrt(2) if ending == "glb" else wanted, (3, 1)), abs=1e-6)
    assert load_scene(write(tmp_path / f"bare.{ending}", bare.export(file_type=ending))).normals is None


@pytest.mark.parametrize("bad", ["0 0 0", "nan 0 0", "inf 0 1", "-nan -nan -nan"])
def test_normals_that_are_none_are_those_of_the_faces(tmp_path, bad):
    """Two walls of a right angle share an edge, at one end of which there is no normal."""
    vertices = "v 0 0 0\nv 0 0 2\nv 2 0 0\nv 0 2 0\n"
    text = f"{vertices}vn {bad}\nvn 0 0 5\nf 1//1 2//2 3//2\nf 1//1 4//2 2//2\n"
    mesh = load_scene(write(tmp_path / "a.obj", text))
    (first,) = np.flatnonzero((mesh.vertices == 0).all(axis=1))
    assert mesh.normals[first] == pytest.approx(np.array([1, 1, 0]) / np.sqrt(2))
    assert (np.delete(mesh.normals, first, axis=0) == [0, 0, 5]).all()
    assert mesh.notes == ("normals of 1 of its vertices are 0 or not finite: those of their faces take their place",)


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


def test_loading_is_silent_and_says_which_material_file_is_missing(tmp_path, capfd):
    broken = write(tmp_path / "a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex inf 0 0\nvertex 1 0 0\n"
                   "vertex 0 1 0\nendloop\nendfacet\nendsolid a\n")  # fmt: skip
    whole = write(tmp_path / "b.obj", f"mtllib no.mtl\n{TRIANGLE}")
    logging.getLogger("trimesh").debug("a handler would print this")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        refused(broken, "vertex 0 is not finite")
        notes = load_scene(whole).notes
    assert notes == ("it names 'no.mtl', which is not there: its materials are left out",)
    assert caught == []
    assert capfd.readouterr() == ("", "")


# --- broken files


def box_as(ending, **options):
    whole = trimesh.creation.box().export(file_type=ending, **options)
    return whole if isinstance(whole, bytes) else whole.encode()


@pytest.mark.parametrize("ending", ENDINGS)
def test_every_file_that_is_none_is_refused(tmp_path, ending):
    random = np.random.default_rng(5)
    whole = box_as(ending)
    broken = {"empty": b"", "text": b"hello world\n", "zeros": bytes(5000), "garbage": random.bytes(5000),
              "start": whole[:20] + random.bytes(2000)}  # fmt: skip
    for name, content in broken.items():
        path = write(tmp_path / f"{name}.{ending}", content)
        assert refused(path).startswith(f"{path}: ")
    assert refused(tmp_path / f"empty.{ending}").endswith("the file is empty")


@pytest.mark.parametrize(
    ("ending", "options"), [("ply", {}), ("ply", {"encoding": "ascii"}), ("stl", {}), ("off", {}), ("glb", {})]
)
def test_every_truncation_is_refused(tmp_path, ending, options):
    whole = box_as(ending, **options)
    # Text may lose its last line feed, or digits of its last number, and nobody can know.
    last = len(whole) - (3 if options or ending == "off" else 1)
    for length in {*range(0, last, 13), last}:
        refused(write(tmp_path / f"a.{ending}", whole[:length]))


def test_truncated_text_formats_without_counts_never_crash(tmp_path):
    for ending in ("obj", "stl_ascii"):
        whole = box_as(ending)
        found = set()
        for length in range(0, len(whole), 11):
            path = write(tmp_path / f"a.{ending[:3]}", whole[:length])
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


def patched_glb(patch):
    whole = box_as("glb")
    length = struct.unpack("<I", whole[12:16])[0]
    header = json.loads(whole[20 : 20 + length])
    binary = bytearray(whole[20 + length :])
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


@pytest.mark.parametrize(("name", "content", "words"), [
    ("a.obj", TRIANGLE.replace("v 1", "v nan"), r"vertex 1 is not finite: \[nan, 0\.0, 0\.0\]"),
    ("a.obj", TRIANGLE.replace("v 1", "v 1e400"), "vertex 1 is not finite"),
    ("a.obj", TRIANGLE.replace("v 1", "v 1e200"), r"vertex 1 is beyond 1e\+30"),
    ("a.obj", TRIANGLE.replace("f 1", "f 4"), "a face names a vertex that does not exist"),
    ("a.obj", TRIANGLE.replace("f 1", "f -4"), "a face names a vertex that does not exist"),
    ("a.obj", TRIANGLE.replace("f 1", "f 0"), "line 4: a face names vertex 0, but OBJ counts from 1"),
    ("a.obj", TRIANGLE + "f 1 2 x\n", "line 5: 'f 1 2 x' has a word that is no number"),
    ("a.obj", SQUARE, "no triangles"),
    ("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 2\n", "no face with an area"),
    ("a.obj", "v 0 0 0\nv 1e-40 0 0\nv 0 1e-40 0\nf 1 2 3\n", "at least 1e-30"),
    ("a.ply", ply("nan 0 0\n1 0 0\n0 1 0\n"), "vertex 0 is not finite"),
    ("a.ply", ply(face="3 0 1 3"), "face 0 names vertex 3, but there are 3 vertices"),
    ("a.ply", ply(face="3 0 1 -1"), "face 0 names vertex -1"),
    ("a.ply", ply(count=10**12), "declares 1000000000000 of 'vertex'"),
    ("a.ply", ply().replace("ascii", "binary_little_endian").replace("vertex 3", "vertex 99999999999"), "of 'vertex'"),
    ("a.off", "OFF\n3 1 0\ninf 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "vertex 0 is not finite"),
    ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "face 0 names vertex 7, but there are 3 vertices"),
    ("a.off", "OFF\n3 999999999 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "declares 3 vertices and 999999999 faces"),
    ("a.stl", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50), "4294967295 faces, which take .* but has 134"),
    ("a.stl", bytes(84), "no triangles"),
    ("a.glb", patched_glb(far_index), "names vertex 30000"),
    ("a.glb", patched_glb(huge_count), "need 24000.0 GB"),
    ("a.glb", patched_glb(bad_transform), "is not finite"),
    ("a.txt", "hello", "cannot be read as a mesh .* '.txt' have no reader"),
    ("a", "hello", "cannot be read as a mesh"),
])  # fmt: skip
def test_broken_meshes_are_refused(tmp_path, name, content, words):
    path = write(tmp_path / name, content)
    assert refused(path, words).startswith(f"{path}: ")


@pytest.mark.parametrize("ending", ["zip", "3mf", "3dxml", "zae"])
def test_archives_have_no_reader(tmp_path, ending):
    with zipfile.ZipFile(tmp_path / f"a.{ending}", "w") as file:
        file.writestr("3D/a.model", TRIANGLE)
    refused(tmp_path / f"a.{ending}", r"it cannot be read as a mesh .*have no reader")


def test_files_that_are_missing_or_may_not_be_read_folders_and_links(tmp_path, monkeypatch):
    refused(tmp_path / "no.obj", r"no\.obj: there is no such file")
    refused(tmp_path, "it is a folder, not a file")
    (tmp_path / "zero.obj").symlink_to("/dev/zero")
    refused(tmp_path / "zero.obj", "not a regular file")

    def deny(path):
        raise PermissionError(13, "Permission denied", str(path))

    path = write(tmp_path / "a.obj", TRIANGLE)
    monkeypatch.setattr(Path, "read_bytes", deny)
    refused(path, r"a\.obj: it cannot be read as a mesh \(Permission denied\)")


def test_textures_that_cannot_be_had(tmp_path):
    noise = io.BytesIO()
    Image.fromarray(np.random.default_rng(1).integers(0, 255, (64, 64, 3), dtype=np.uint8)).save(noise, "png")
    write(tmp_path / "garbage.png", "garbage")
    write(tmp_path / "half.png", noise.getvalue()[:5000])
    whole = write(tmp_path / "whole.png", noise.getvalue())
    plain = write(tmp_path / "plain.obj", TRIANGLE)
    for name, named, given in (
        ("no such.png", "is not there", "there is no such file"),
        ("garbage.png", "cannot be read", "it cannot be read as an image"),
        ("half.png", "cannot be read", "it cannot be read as an image"),
    ):
        path = square(tmp_path, f"newmtl m\nmap_Kd {name}\n")
        refused(path, rf"a\.obj: it names the image '{name}', which {named}")
        refused(path, f"{name}: {given}", tmp_path / name)
    refused(path, "it is a folder", tmp_path)
    refused(plain, r"plain\.obj: .*no texture coordinates", whole)
    broken = write(tmp_path / "a.obj", SQUARE_UV.replace("vt 1 1", "vt nan 1") + SQUARE_FACES)
    refused(broken, "texture coordinate is not finite", whole)


# --- real files


@pytest.mark.parametrize(("name", "faces", "texture"), [
    ("armadillo.ply", 172_972, None),
    ("bunny.obj", 69_451, None),
    ("lucy.obj", 99_970, None),
    ("spot/spot_triangulated.obj", 5_856, "spot/spot_texture.png"),
    ("fuze/fuze.obj", None, None),
])  # fmt: skip
def test_real_meshes(name, faces, texture):
    if not (MESHES / name).exists():
        pytest.skip(f"{name} is not there")
    mesh = load_scene(MESHES / name, texture and MESHES / texture)
    assert faces is None or len(mesh.faces) + mesh.degenerate == faces
    textured = mesh.paint is not None and mesh.paint.textures[0] is not None
    assert textured == (texture is not None or name == "fuze/fuze.obj")
    assert mesh.notes == ()


def test_warnings_of_trimesh_do_not_reach_the_terminal():
    """In a process of its own: pytest listens to all loggers, and Python prints what nobody listens to."""
    code = "import lfssao.scene.load, trimesh; trimesh.util.log.warning('that cannot be helped')"
    done = python("-c", code)
    assert (done.stdout, done.stderr) == ("", "")
