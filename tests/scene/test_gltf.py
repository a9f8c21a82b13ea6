"""glTF: what the core specification can say of surfaces and base colours, and what is refused."""

import json
import re
import zlib
from itertools import product

import numpy as np
import pytest
from gltf_files import CODES, FACES, QUAD, TURN, TURNED, UV, Gltf, glb, linear, load, moved, png, refused, uri

from lfssao import InputError, RayCaster
from lfssao.core import memory
from lfssao.optics.camera import Camera
from lfssao.scene.load import load_scene


def seen(mesh, size=24):
    """Colours of the square [-1, 1]^2 from +Z, one ray through the middle of each texel."""
    view = Camera("orthographic", (0, 0, 5), (0, 0, 0), (0, 1, 0), 2.0, 1.0, 9.0).view(size, size)
    return RayCaster(mesh, view.cast_from_world).gbuffer(view).color


def corners(mesh):
    """Coordinates of the corners of all faces, (F, 3, 3)."""
    return mesh.vertices[mesh.faces]


# --- colours


@pytest.mark.parametrize(("dtype", "width"), [*product(("f4", "u1", "u2"), (3, 4))])
def test_vertex_colours_are_linear_and_keep_their_numbers(tmp_path, dtype, width):
    most = {"f4": 1, "u1": 255, "u2": 65535}[dtype]
    numbers = np.array([[0.001, 0.5, 0.0019, 1]] * 4) if dtype == "f4" else np.arange(16).reshape(4, 4) * (most // 16)
    mesh = load(Gltf(COLOR_0=(numbers[:, :width], dtype, dtype != "f4")), tmp_path)
    assert mesh.paint.vertex_colors.tolist() == (numbers[:, :3] / most).astype(np.float32).tolist()


def test_factors_are_linear_and_keep_their_numbers(tmp_path):
    made = Gltf()
    made.material()["pbrMetallicRoughness"]["baseColorFactor"] = [0.001, 0.0019, 0.5, 1]
    mesh = load(made, tmp_path)
    assert mesh.paint.factors.tolist() == np.array([[0.001, 0.0019, 0.5]], np.float32).tolist()
    assert np.unique(seen(mesh, 8).reshape(-1, 3), axis=0).tolist() == mesh.paint.factors.tolist()


def test_vertex_colours_end_at_0_and_1(tmp_path):
    mesh = load(Gltf(COLOR_0=([[-1, 0.5, 7]] * 4,)), tmp_path)
    assert mesh.paint.vertex_colors.tolist() == [[0, 0.5, 1]] * 4
    assert mesh.notes == ("colours of its vertices reach from -1 to 7: they are clamped to 0 to 1",)
    mesh = load(Gltf(COLOR_0=([[0, 0.5, 1 + 2.0**-23]] * 4,)), tmp_path)
    assert (mesh.paint.vertex_colors.max(), mesh.notes) == (1, ())


def gl_texel(number, size, wrap):
    """The texel at a number along an axis, as OpenGL 4.6 has it in table 8.20."""
    if wrap == 33071:
        return np.clip(number, 0, size - 1)
    if wrap == 10497:
        return number % size
    place = number % (2 * size) - size
    return (size - 1) - np.where(place >= 0, place, -(1 + place))


def gl_color(image, u, v, wraps, nearest):
    """Colour of an image at (u, v), v downwards: OpenGL 4.6, section 8.14."""
    high, wide, _ = image.shape
    x = u * wide
    y = v * high
    if nearest:
        rows = np.floor(y).astype(int)
        columns = np.floor(x).astype(int)
        return image[gl_texel(rows, high, wraps[1]), gl_texel(columns, wide, wraps[0])]
    total = 0
    left = np.floor(x - 0.5).astype(int)
    top = np.floor(y - 0.5).astype(int)
    for i, j in product((0, 1), (0, 1)):
        share = (1 - abs(x - 0.5 - (left + i))) * (1 - abs(y - 0.5 - (top + j)))
        total = total + share[..., None] * image[gl_texel(top + j, high, wraps[1]), gl_texel(left + i, wide, wraps[0])]
    return total


WRAPS = [33071, 33648, 10497]


@pytest.mark.parametrize(
    ("s", "t", "nearest"), [*((s, t, False) for s, t in product(WRAPS, WRAPS)), (33648, 33071, True)]
)
def test_samplers(tmp_path, s, t, nearest):
    """Texture coordinates from -1.3 to 2.7 across the quad, downwards from -1.2 to 1.8."""
    image = np.random.default_rng(s + t).integers(0, 256, (2, 3, 3))
    made = Gltf(TEXCOORD_0=([[-1.3, 1.8], [2.7, 1.8], [2.7, -1.2], [-1.3, -1.2]],))
    made.material(png(image), {"wrapS": s, "wrapT": t, **({"magFilter": 9728} if nearest else {})})
    u, v = np.meshgrid(-1.3 + 4 * (np.arange(24) + 0.5) / 24, -1.2 + 3 * (np.arange(24) + 0.5) / 24)
    assert seen(load(made, tmp_path)) == pytest.approx(gl_color(linear(image), u, v, (s, t), nearest), abs=1e-5)


@pytest.mark.parametrize("dtype", ["f4", "u1", "u2"])
def test_the_set_of_texture_coordinates_is_the_one_named(tmp_path, dtype):
    most = {"f4": 1, "u1": 255, "u2": 65535}[dtype]
    made = Gltf(TEXCOORD_0=([[0, 0]] * 4,), TEXCOORD_1=(np.array(UV) * most, dtype, dtype != "f4"))
    made.material(png(), info={"texCoord": 1})
    assert seen(load(made, tmp_path), 2) == pytest.approx(linear(CODES), abs=1e-6)
    made.first["attributes"].pop("TEXCOORD_1")
    refused(made.save(tmp_path / "a.glb"), r"primitives\[0\]: has no TEXCOORD_1, at which materials\[0\] reads")


def test_an_image_of_several_materials_is_decoded_and_held_once(tmp_path, monkeypatch):
    """Each of 28 bytes a pixel; one alone would do, and two would not."""
    noise = np.random.default_rng(1).integers(0, 256, (200, 200, 3))
    made = Gltf(TEXCOORD_0=(UV,))
    texture = made.material(png(noise))
    made.header["materials"] += [texture]
    made.header["meshes"][0]["primitives"] += [{**made.first, "material": 1}]
    path = made.save(tmp_path / "a.glb")
    monkeypatch.setattr(memory, "_HARMLESS", 2_000_000)
    monkeypatch.setattr(memory, "_MOST_EXPANSION", 1)
    paint = load_scene(path).paint
    assert paint.textures[0] is paint.textures[1]
    made.header["images"] *= 2
    made.header["textures"] += [{"source": 1}]
    made.header["materials"][1] = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}
    refused(made.save(tmp_path / "a.glb"), "its textures need")


def test_images_are_in_files_in_uris_and_in_buffers(tmp_path):
    (tmp_path / "t x.png").write_bytes(png())
    made = Gltf(TEXCOORD_0=(UV,))
    made.material(png())
    for image in (made.header["images"][0], {"uri": "t%20x.png"}, {"uri": uri(png(), "image/png")}):
        made.header["images"] = [image]
        assert load(made, tmp_path).paint.textures[0] == pytest.approx(linear(CODES), abs=1e-6)
    for image, name in (({"uri": uri(b"no image")}, r"images\[0\]"), ({"uri": "no.png"}, r"no\.png")):
        made.header["images"] = [image]
        path = made.save(tmp_path / "a.glb")
        refused(path, f"it names the image '{name}', which (cannot be read|is not there)")
        (texture,) = load_scene(path, tmp_path / "t x.png").paint.textures  # one that is given takes its place
        assert texture == pytest.approx(linear(CODES), abs=1e-6)


# --- transparency


def alpha_image(alpha):
    return np.dstack([np.full((*np.shape(alpha), 3), 255), np.array(alpha)])


CUT = "is transparent at a part of its triangles"


@pytest.mark.parametrize(("mode", "factor", "alpha", "image", "faces"), [
    ({"alphaMode": "OPAQUE"}, 0.1, 0.1, [[0, 0]], 2),
    ({"alphaMode": "MASK"}, 0.5, 1, None, 2),  # at the cutoff: there
    ({"alphaMode": "MASK"}, 0.49, 1, None, 0),
    ({"alphaMode": "MASK", "alphaCutoff": 0.2}, 0.49, 1, None, 2),
    ({"alphaMode": "MASK"}, 1, [1, 1, 1, 0.4], None, CUT),
    ({"alphaMode": "MASK"}, 1, [1, 0.4, 0.4, 0.4], None, CUT),
    ({"alphaMode": "MASK"}, 1, [0.1, 0.4, 0.4, 0.4], None, 0),
    ({"alphaMode": "MASK"}, 1, 1, [[255, 128]], 2),
    ({"alphaMode": "MASK"}, 1, 1, [[255, 127]], CUT),
    ({"alphaMode": "MASK", "alphaCutoff": 128 / 255}, 1, 1, [[128, 128]], 2),
    ({"alphaMode": "MASK"}, 0.9, 1, [[255, 128]], CUT),
    ({"alphaMode": "MASK"}, 1, 0.9, [[255, 128]], CUT),
    ({"alphaMode": "MASK"}, 0.9, 0.5, [[255, 255]], 0),
    ({"alphaMode": "BLEND"}, 0.5, 1, None, "translucent"),
    ({"alphaMode": "BLEND"}, 1, 1, None, 2),
    ({"alphaMode": "BLEND"}, 0, 1, None, 0),
    ({"alphaMode": "BLEND"}, 1, 1, [[255, 1]], "translucent"),
    ({"alphaMode": "BLEND"}, 1, 1, [[255, 0]], CUT),
])  # fmt: skip
def test_what_is_cut_out_is_no_surface(tmp_path, mode, factor, alpha, image, faces):
    colors = np.column_stack([np.ones((4, 3)), np.broadcast_to(alpha, 4)])
    made = Gltf(TEXCOORD_0=(UV,), COLOR_0=(colors,))
    material = made.material(None if image is None else png(alpha_image(image)), **mode)
    material["pbrMetallicRoughness"]["baseColorFactor"] = [1, 1, 1, factor]
    path = made.save(tmp_path / "a.glb")
    if faces == 0:
        refused(path, "the file holds no triangles")
    elif faces == CUT:
        refused(path, rf"materials\[0\] {CUT}")
    else:
        mesh = load_scene(path)
        assert len(mesh.faces) == 2
        assert ["translucent" in note for note in mesh.notes] == [True] * (faces == "translucent")


@pytest.mark.parametrize(("wrap", "left", "wide", "words"), [
    (10497, 3.1, 0.3, None),
    (33648, 3.1, 0.3, CUT),  # a mirrored one is taken whole
    (33071, -2.9, 0.3, None),
    (33071, 0.1, 0.3, None),
    (10497, 0.5, 0.21, None),
    (10497, 0.5, 0.23, CUT),  # between the last texel that is there and the first that is not
    (10497, 0.85, 0.05, "the file holds no triangles"),
])  # fmt: skip
@pytest.mark.parametrize("axis", [0, 1])
def test_texels_that_a_mesh_does_not_show_cut_nothing_out(tmp_path, axis, wrap, left, wide, words):
    """The right, or lower, quarter of the image is transparent; the quad shows a part of it, or of another tile."""
    alpha = np.full((4, 16), 255)
    alpha[:, 12:] = 0
    corners_uv = np.array([[left, 0.6], [left + wide, 0.6], [left + wide, 0.4], [left, 0.4]])
    made = Gltf(TEXCOORD_0=(corners_uv[:, ::-1] if axis else corners_uv,))
    sampler = {("wrapS", "wrapT")[axis]: wrap}
    made.material(png(alpha_image(alpha.T if axis else alpha)), sampler, alphaMode="MASK")
    path = made.save(tmp_path / "a.glb")
    if words:
        refused(path, words)
    else:
        assert len(load_scene(path).faces) == 2


def test_opacity_of_16_bits_is_refused_where_it_counts(tmp_path):
    """Pillow has 8 bits of it, and cannot write such an image."""

    def chunk(kind, data):
        return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")

    size = (1).to_bytes(4, "big") * 2 + bytes([16, 6, 0, 0, 0])
    image = (
        chunk(b"IHDR", size)
        + chunk(b"IDAT", zlib.compress(b"\0" + b"\xff\xff" * 3 + b"\x7f\xff"))
        + chunk(b"IEND", b"")
    )
    made = Gltf(TEXCOORD_0=(UV,))
    material = made.material(b"\x89PNG\r\n\x1a\n" + image)
    assert load(made, tmp_path).paint.textures[0].tolist() == [[[1, 1, 1]]]
    material["alphaMode"] = "MASK"
    refused(made.save(tmp_path / "a.glb"), r"images\[0\]', which cannot be read \(of its opacity of 16 bits only 8")


# --- accessors


@pytest.mark.parametrize(("dtype", "most"), [("i1", 127), ("u1", 255), ("i2", 32767), ("u2", 65535)])
def test_integers_stand_for_fractions_where_they_are_normalised(tmp_path, dtype, most):
    codes = np.array([[0, 0, 0], [most, 0, 0], [most // 3, most, 0], [-most - 1 if dtype[0] == "i" else 0, most, 5]])
    made = Gltf(TEXCOORD_0=(codes[:, :2], dtype, True))
    made.first["attributes"]["POSITION"] = made.accessor(codes, dtype, True)
    made.material(png())
    mesh = load(made, tmp_path)
    wanted = np.maximum(codes / most, -1)
    assert mesh.vertices.tolist() == wanted.tolist()
    assert mesh.paint.uv.tolist() == np.column_stack([wanted[:, 0], 1 - wanted[:, 1]]).tolist()
    made.first["attributes"]["POSITION"] = made.accessor(codes, dtype)
    assert load(made, tmp_path).vertices.tolist() == codes.tolist()


@pytest.mark.parametrize("dtype", ["u1", "u2", "u4", None])
def test_indices(tmp_path, dtype):
    made = Gltf(indices=None, positions=QUAD if dtype else np.array(QUAD)[np.ravel(FACES)])
    if dtype:
        made.first["indices"] = made.accessor(np.ravel(FACES)[:, None], dtype)
    assert corners(load(made, tmp_path)).tolist() == np.array(QUAD, float)[FACES].tolist()


def test_strides_offsets_and_sparse_accessors(tmp_path):
    made = Gltf()
    row = np.zeros(4, [("pad", "<f4"), ("at", "<f4", 3), ("end", "<u4")])
    row["at"] = QUAD
    view = made.view(b"abcd" + row.tobytes())
    made.header["bufferViews"][view]["byteStride"] = 20
    made.first["attributes"]["POSITION"] = made.accessor(QUAD, bufferView=view, byteOffset=8)
    assert corners(load(made, tmp_path)).tolist() == np.array(QUAD, float)[FACES].tolist()
    places = made.view(b"xx\1\0\2\0")
    values = made.view(np.array([[9, 8, 7], [5, -1, 3], [4, 2, 1]], "<f4").tobytes())
    indices = {"bufferView": places, "byteOffset": 2, "componentType": 5123}
    sparse = {"count": 2, "indices": indices, "values": {"bufferView": values, "byteOffset": 12}}
    for start, base in ((view, np.array(QUAD, float)), (None, np.zeros((4, 3)))):
        number = made.accessor(QUAD, bufferView=start, byteOffset=8, sparse=sparse)
        if start is None:
            made.header["accessors"][number].pop("bufferView")
        made.first["attributes"]["POSITION"] = number
        base[1:3] = [[5, -1, 3], [4, 2, 1]]
        mesh = load(made, tmp_path)
        assert corners(mesh).tolist() == [base[face].tolist() for face in FACES][: len(mesh.faces)]
        assert len(mesh.faces) + mesh.degenerate == 2


@pytest.mark.parametrize(("mode", "faces"), [
    (4, [[0, 1, 2]]),
    (5, [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]]),
    (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0], [4, 5, 0]]),
])  # fmt: skip
def test_triangles_strips_and_fans(tmp_path, mode, faces):
    points = np.random.default_rng(3).random((6, 3)).astype(np.float32)
    made = Gltf(points[:3] if mode == 4 else points, None)
    made.first["mode"] = mode
    assert corners(load(made, tmp_path)).tolist() == points[np.array(faces)].astype(float).tolist()
    made.header["meshes"][0]["primitives"] += [{**made.first, "mode": n} for n in range(4)]
    mesh = load(made, tmp_path)
    assert (len(mesh.faces), mesh.notes) == (len(faces), ("its points and lines are left out",))


# --- nodes, skins and morph targets


def test_nodes_by_matrices_and_by_translation_rotation_scale(tmp_path):
    """The parent turns about z after it stretches x; the child is moved first, by a matrix that stands by columns."""
    made = Gltf(NORMAL=([[1, 0, 1]] * 4,))
    matrix = np.eye(4)
    matrix[:3, 3] = 1, 2, 3
    made.header["nodes"] = [
        {"children": [1], "rotation": TURN, "scale": [2, 1, -1], "translation": [0, 0, 5]},
        {"mesh": 0, "matrix": matrix.T.ravel().tolist()},
    ]
    mesh = load(made, tmp_path)
    wanted = (moved(QUAD, 1, 2, 3) * [2, 1, -1]) @ TURNED.T + [0, 0, 5]
    assert mesh.vertices == pytest.approx(wanted, abs=1e-12)
    # The normal's x is halved as x is stretched, its z turned over with z; lengths mean nothing, nor do all signs.
    unit = np.array([0.5, 0, -1]) @ TURNED.T
    assert np.abs(np.cross(mesh.normals, unit)).max() < 1e-12


def test_scenes(tmp_path):
    made = Gltf()
    made.header["nodes"] = [{"mesh": 0, "translation": [n, 0, 0], "children": [2] if n == 1 else []} for n in range(3)]
    for scene, scenes, left in ((1, [[0], [1]], [0, 2]), (None, [[0], [1]], [-1]), (None, None, [-1, 0, 2])):
        made.header |= {"scenes": [{"nodes": nodes} for nodes in scenes or []], "scene": scene or 0}
        if scene is None:
            made.header.pop("scene")
        mesh = load(made, tmp_path)
        assert sorted({x for x in mesh.vertices[::4, 0].tolist()}) == left
        (note,) = mesh.notes
        assert note.startswith("it has 2 scenes" if scenes else "it has no scenes")


def test_meshes_that_no_scene_shows(tmp_path):
    made = Gltf()
    words = "it has meshes, but none of triangles at a node that its scene shows"
    made.header["scenes"] = [{}]
    refused(made.save(tmp_path / "a.glb"), words)
    for key in ("nodes", "scenes", "scene"):
        made.header.pop(key)
    refused(made.save(tmp_path / "a.glb"), words)


def test_deep_nodes_are_quick_and_keep_their_bits(tmp_path):
    made = Gltf()
    made.header["nodes"] = [{"children": [n + 1], "translation": [0.5, 0, 0]} for n in range(20_000)] + [{"mesh": 0}]
    assert load(made, tmp_path).bounds.tolist() == [[9999, -1, 0], [10001, 1, 0]]


@pytest.mark.parametrize(("children", "words"), [
    ([[1], [0], []], "nodes some are children of their own children, in a circle"),
    ([[0], [], []], "in a circle"),
    ([[2], [2], []], r"nodes\[1\]\.children names node 2, which is a child of node 0, too"),
    ([[1, 1], [], []], r"nodes\[0\]\.children is \[1, 1\], it must be numbers of nodes, each once"),
    ([[3], [], []], r"nodes\[0\]\.children is \[3\], it must be numbers of nodes, of which there are 3"),
    ([[], [0], []], r"scenes\[0\]\.nodes names node 0, which is a child of node 1"),
])  # fmt: skip
def test_nodes_that_are_no_tree(tmp_path, children, words):
    made = Gltf()
    made.header["nodes"] = [{"children": each, "mesh": 0} for each in children]
    refused(made.save(tmp_path / "a.glb"), words)


def skinned(joints=((0, 1, 0, 0),) * 4, weights=((0.25, 0.75, 0, 0),) * 4, dtype="f4", **more):
    """A quad of two joints: node 1 is moved by (10, 0, 0), node 2, its child, turned; the mesh's node is far away."""
    made = Gltf(NORMAL=([[1, 0, 1]] * 4,), JOINTS_0=(joints, "u1"), WEIGHTS_0=(weights, dtype, dtype != "f4"), **more)
    made.header["nodes"] = [
        {"mesh": 0, "skin": 0, "translation": [99, 99, 99]},
        {"translation": [10, 0, 0], "children": [2]},
        {"rotation": TURN},
    ]
    made.header["scenes"][0]["nodes"] = [0, 1]
    inverse = np.tile(np.eye(4), (2, 1, 1))
    inverse[1, :3, 3] = 0, 4, 3
    made.header["skins"] = [
        {"joints": [1, 2], "inverseBindMatrices": made.accessor(inverse.transpose(0, 2, 1).reshape(2, 16))}
    ]
    return made


@pytest.mark.parametrize("dtype", ["f4", "u1", "u2"])
def test_skins_stand_by_their_joints_alone(tmp_path, dtype):
    most = {"f4": 1, "u1": 255, "u2": 65535}[dtype]
    shares = np.array([[51, 204, 0, 0]] * 3 + [[255, 0, 0, 0]]) / 255
    mesh = load(skinned(weights=np.round(shares * most, 6 if dtype == "f4" else 0), dtype=dtype), tmp_path)
    first = moved(QUAD, 10, 0, 0)
    second = moved(QUAD, 0, 4, 3) @ TURNED.T + [10, 0, 0]
    wanted = shares[:, :1] * first + shares[:, 1:2] * second
    assert mesh.vertices == pytest.approx(wanted, abs=1e-6)
    made = skinned()
    made.header["skins"][0].pop("inverseBindMatrices")
    assert load(made, tmp_path).vertices == pytest.approx(
        0.25 * first + 0.75 * (np.array(QUAD) @ TURNED.T + [10, 0, 0]), abs=1e-6
    )
    mixed = 0.2 * np.eye(3) + 0.8 * TURNED
    assert np.abs(np.cross(mesh.normals[0], np.linalg.inv(mixed).T @ [1, 0, 1])).max() < 1e-6
    assert mesh.notes == ()


def test_skins_of_eight_joints_and_of_weights_that_do_not_sum_to_1(tmp_path):
    second = ([[1, 1, 1, 1]] * 4, "u2")
    made = skinned(((0, 0, 0, 0),) * 4, ((0.1, 0.1, 0.1, 0.1),) * 4, JOINTS_1=second, WEIGHTS_1=([[0.1] * 4] * 4,))
    mesh = load(made, tmp_path)
    half = (np.array(QUAD) + moved(QUAD, 0, 4, 3) @ TURNED.T) / 2 + [10, 0, 0]
    assert mesh.vertices == pytest.approx(half, abs=1e-6)
    assert mesh.notes == ("weights of its skins do not sum to 1 at every vertex: they are divided by their sum",)


@pytest.mark.parametrize(("made", "words"), [
    (skinned(weights=((0, 0, 0, 0),) * 4), "WEIGHTS_0 is 0 at all joints of a vertex that a face uses"),
    (skinned(weights=((2, -1, 0, 0),) * 4), "WEIGHTS_0 has a negative weight"),
    (skinned(joints=((0, 2, 0, 0),) * 4), r"JOINTS_0 names joint 2 of skins\[0\], which has 2"),
    (skinned(JOINTS_1=([[0] * 4] * 4, "u1")), "WEIGHTS_1 is missing, the skin needs one for each of 4 vertices"),
])  # fmt: skip
def test_skins_that_are_broken(tmp_path, made, words):
    refused(made.save(tmp_path / "a.glb"), words)


@pytest.mark.parametrize(("of_mesh", "of_node", "weights"), [
    ([1.0, 0.5], None, (1, 0.5)),
    ([1.0, 0.5], [0.0, 2.0], (0, 2)), (None, [0.25, 0.0], (0.25, 0)), (None, None, (0, 0)),
])  # fmt: skip
def test_morph_targets_stand_by_their_default_weights(tmp_path, of_mesh, of_node, weights):
    rng = np.random.default_rng(5)
    base = {"NORMAL": rng.random((4, 3)), "TEXCOORD_0": np.array(UV, float), "COLOR_0": rng.random((4, 4)) / 2}
    made = Gltf(**{key: (values,) for key, values in base.items()})
    made.material(png())
    base["POSITION"] = np.array(QUAD, float)
    moves = [{key: rng.random((4, min(3, values.shape[1]))) for key, values in base.items()} for _ in range(2)]
    made.first["targets"] = [{key: made.accessor(values) for key, values in move.items()} for move in moves]
    for item, given in ((made.header["meshes"][0], of_mesh), (made.node, of_node)):
        item.update({} if given is None else {"weights": given})
    mesh = load(made, tmp_path)
    wanted = {
        key: values[:, :3] + sum(w * move[key] for w, move in zip(weights, moves, strict=True))
        for key, values in base.items()
    }
    assert mesh.vertices == pytest.approx(wanted["POSITION"], abs=1e-6)
    assert mesh.normals == pytest.approx(wanted["NORMAL"], abs=1e-6)
    assert mesh.paint.uv == pytest.approx(wanted["TEXCOORD_0"] * [1, -1] + [0, 1], abs=1e-6)
    assert mesh.paint.vertex_colors == pytest.approx(np.clip(wanted["COLOR_0"], 0, 1), abs=1e-6)


def test_parts_without_normals_are_flat_beside_others(tmp_path):
    made = Gltf(NORMAL=([[0, 1, 0]] * 4,))
    made.header["meshes"][0]["primitives"] += [made.primitive(np.array(QUAD) * 2)]
    mesh = load(made, tmp_path)
    assert mesh.normals[mesh.faces[:2]].tolist() == [[[0, 1, 0]] * 3] * 2
    assert (mesh.normals[mesh.faces[2:]] / 16).tolist() == [[[0, 0, 1]] * 3] * 2
    assert corners(mesh)[2:].tolist() == (2.0 * np.array(QUAD))[FACES].tolist()


# --- broken files


def changed(*path, value=None):
    """A quad with all parts of a header that a change may break, with one changed; None takes it out."""
    made = Gltf(TEXCOORD_0=(UV,))
    made.material(png(), {"wrapS": 33071})
    at = made.header
    for key in path[:-1]:
        at = at[key]
    if value is None:
        del at[path[-1]]
    else:
        at[path[-1]] = value
    return made


def test_bytes_behind_a_glb_are_noted(tmp_path):
    made = changed("nodes", 0, "translation", value=[1, 0, 0])
    path = made.save(tmp_path / "a.glb")
    path.write_bytes(path.read_bytes() + b"12345")
    mesh = load_scene(path)
    assert (len(mesh.faces), mesh.notes) == (2, ("5 bytes after its end are left out",))


def test_the_last_row_of_a_matrix_may_be_rounded(tmp_path):
    matrix = [1.0, 0, 0, 1e-7, 0, 1, 0, 0, 0, 0, 1, 0, 4, 5, 6, 0.9999999]
    made = changed("nodes", 0, "matrix", value=matrix)
    plain = changed("nodes", 0, "name", value="plain")
    assert np.allclose(load(made, tmp_path).vertices - load(plain, tmp_path).vertices, [4, 5, 6])


@pytest.mark.parametrize(("path", "value", "words"), [
    (("asset",), None, "it is no glTF 2.0: asset.version is missing"),
    (("asset", "version"), "1.0", r"it is glTF 1\.0 \(asset\.version\), only 2\.0 is read"),
    (("asset", "version"), 2, "asset.version is 2, it must be text"),
    (("asset", "version"), "two", "asset.version is 'two', it must be a version such as 2.0"),
    (("asset", "minVersion"), "2.1", r"it is glTF 2\.1 \(asset\.minVersion\), only 2\.0 is read"),
    (("scene",), 3, "scene is 3, but there are 1 scenes"),
    (("nodes",), "x", "nodes is 'x', it must be a JSON array"),
    (("nodes", 0), 7, r"nodes\[0\] is 7, it must be a JSON object"),
    (("nodes", 0, "mesh"), -1, r"nodes\[0\]\.mesh is -1, it must be a whole number of at least 0"),
    (("nodes", 0, "rotation"), [0, 0, 0, 2], r"nodes\[0\]\.rotation has a quaternion of length 2, it must be 1"),
    (("nodes", 0, "scale"), [1, 2], r"nodes\[0\]\.scale is \[1, 2\], it must be 3 numbers"),
    (("nodes", 0, "matrix"), [1.0] * 16, r"nodes\[0\]\.matrix is .* affine"),
    (("nodes", 0), {"mesh": 0, "scale": [1, 1, 1], "matrix": [0] * 16}, r"nodes\[0\]: it has a matrix and a scale"),
    (("meshes", 0, "primitives", 0, "attributes"), None, r"primitives\[0\]\.attributes is missing"),
    (("meshes", 0, "primitives", 0, "attributes", "POSITION"), None, r"attributes\.POSITION is missing"),
    (("meshes", 0, "primitives", 0, "mode"), 7, r"primitives\[0\]\.mode is 7, it must be a whole number from 0 to 6"),
    (("accessors", 0, "count"), 5, r"accessors\[0\]: ends at byte 60 of bufferViews\[0\], which has 48"),
    (("accessors", 0, "count"), 3, r"attributes\.TEXCOORD_0 has 4 elements, but POSITION has 3|names vertex 3"),
    (("accessors", 0, "count"), -4, r"accessors\[0\]\.count is -4"),
    (("accessors", 0, "byteOffset"), 4, r"accessors\[0\]: ends at byte 52"),
    (("accessors", 0, "componentType"), 5124, r"accessors\[0\]\.componentType is 5124, it must be one of 5120"),
    (("accessors", 0, "type"), "VEC2", r"accessors\[0\]\.type is VEC2, but POSITION must be VEC3"),
    (("accessors", 0, "type"), None, r"accessors\[0\]\.type is missing"),
    (("accessors", 2, "componentType"), 5122, r"accessors\[2\]: indices must be unsigned integers"),
    (("bufferViews", 0, "buffer"), 1, r"bufferViews\[0\]\.buffer is 1, but there are 1 buffers"),
    (("bufferViews", 0, "byteLength"), 10**6, r"bufferViews\[0\]: ends at byte 1000000 of buffers\[0\], which has"),
    (("bufferViews", 0, "byteStride"), 4, r"bufferViews\[0\]\.byteStride is 4, it must be .* at least 12"),
    (("buffers",), [{"byteLength": 9999, "uri": uri(b"abc")}], r"buffers\[0\]\.byteLength is 9999, but its data have"),
    (("buffers",), [{"byteLength": 9, "uri": "no.bin"}], r"buffers\[0\]\.uri names 'no\.bin', which is not there"),
    (("buffers",), [{"byteLength": 9, "uri": "data:;base64,???"}], r"buffers\[0\]\.uri is data that cannot be decoded"),
    (("buffers",), [{"byteLength": 9}], r"buffers\[0\]: it has no data"),
    (("textures", 0, "source"), None, r"textures\[0\]\.source names no image"),
    (("samplers", 0, "wrapS"), 1, r"samplers\[0\]\.wrapS is 1, it must be one of 10497, 33648, 33071"),
    (("materials", 0, "alphaMode"), "CUT", r"materials\[0\]\.alphaMode is 'CUT', it must be OPAQUE, MASK or BLEND"),
    (("materials", 0, "pbrMetallicRoughness", "baseColorFactor"), [2, 0, 0, 1], "it must be four numbers from 0 to 1"),
])  # fmt: skip
def test_what_is_wrong_is_named_by_its_key(tmp_path, path, value, words):
    message = refused(changed(*path, value=value).save(tmp_path / "a.gltf"), words)
    assert "cannot be read as a mesh" not in message


def test_any_value_may_be_wrong(tmp_path):
    """No other error than one that names the file, whatever is changed."""
    rng = np.random.default_rng(0)
    wrong = [-1, 0.5, 1e300, 10**30, True, "x", [], [[]], {}, float("nan"), [1e300] * 3]
    whole = json.loads(changed("asset", "version", value="2.0").save(tmp_path / "a.gltf").read_text())

    def places(value, path=()):
        for key in value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
            yield (*path, key)
            yield from places(value[key], (*path, key))

    every = list(places(whole))
    messages = []
    for _ in range(300):
        header = json.loads(json.dumps(whole))
        *path, last = every[rng.integers(len(every))]
        at = header
        for key in path:
            at = at[key]
        at[last] = wrong[rng.integers(len(wrong))]
        (tmp_path / "b.gltf").write_text(json.dumps(header))
        try:
            load_scene(tmp_path / "b.gltf")
        except InputError as error:
            messages.append(str(error))
    assert len(messages) > 150
    assert all(re.match(rf"{tmp_path}/b\.gltf: (?!it cannot be read as a mesh)", each) for each in messages)


@pytest.mark.parametrize(("content", "words"), [
    (glb({}, b"", 1), r"it is a GLB of version 1, that of glTF 1\.0; only 2\.0 is read"),
    (Gltf, "it ends too early: its header declares"),
    (b"glTF\2\0\0\0\x14\0\0\0\0\0\0\0BIN\0", "its first chunk is of type 0x004e4942, it must be JSON"),
    (b"glTF\2\0\0\0\x14\0\0\0\x09\0\0\0JSON", "a chunk at byte 12 declares 9 bytes, of which 0 are there"),
    (b"glTF\2\0\0\0\x0c\0\0\0", "it is a GLB without a JSON chunk"),
    (b"{", "its JSON cannot be read"),
    (b"[" * 100_000, "its JSON cannot be read"),
    (b"[]", r"its content is \[\], it must be a JSON object"),
])  # fmt: skip
def test_broken_containers(tmp_path, content, words):
    path = tmp_path / "a.glb"
    path.write_bytes(content if isinstance(content, bytes) else Gltf().save(path).read_bytes()[:-5])
    refused(path, words)


@pytest.mark.parametrize(("parts", "words"), [
    ({"accessors": [{"componentType": 5126, "count": 10**12, "type": "VEC3"}]}, r"its accessors need 24000\.0 GB"),
    ({"nodes": [{"mesh": 0}] * 2000, "scenes": [{"nodes": list(range(2000))}]}, "its meshes need"),
])  # fmt: skip
def test_small_files_that_take_much_memory(tmp_path, parts, words, monkeypatch):
    monkeypatch.setattr(memory, "_HARMLESS", 10**6)
    monkeypatch.setattr(memory, "_MOST_EXPANSION", 1)
    made = Gltf()
    made.header |= parts
    refused(made.save(tmp_path / "a.glb"), words)
