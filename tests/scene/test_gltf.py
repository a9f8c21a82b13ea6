"""glTF that trimesh would read wrongly, in part, or at any cost."""

import base64
import io
import json

import numpy as np
import pytest
from PIL import Image

from lfssao.core import memory
from lfssao.errors import InputError
from lfssao.scene.load import load_scene

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
POSITION = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
SPARSE = {"count": 1, "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 0}}


def uri(data):
    return "data:application/octet-stream;base64," + base64.b64encode(data).decode()


def write(folder, primitive=(), data=CORNERS, **header):
    """A triangle as glTF with other parts of its header."""
    made = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, **dict(primitive)}]}],
        "buffers": [{"byteLength": len(data), "uri": uri(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "accessors": [POSITION],
        **header,
    }
    (folder / "a.gltf").write_text(json.dumps(made))
    return folder / "a.gltf"


def textured(image):
    """A primitive and the parts of a header that give it an image as its base colour."""
    used = {"attributes": {"POSITION": 0, "TEXCOORD_0": 0}, "material": 0}
    materials = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    return {"primitive": used, "materials": materials, "textures": [{"source": 0}], "images": [image]}


def chain(depth):
    """Nodes of which each is the child of the one before."""
    return [{"children": [number + 1]} for number in range(depth - 1)] + [{"mesh": 0}]


@pytest.mark.parametrize(("parts", "words"), [
    ({"extensionsRequired": ["KHR_lights_punctual", "KHR_texture_transform"]}, "extension KHR_texture_transform,"),
    ({"accessors": [{**POSITION, "sparse": SPARSE}]}, "accessor 0, POSITION, is sparse"),
    ({"accessors": [{**POSITION, "bufferView": None}]}, "cannot be read"),
    ({"primitive": {"indices": 1}, "accessors": [POSITION, {"componentType": 5125, "count": 3, "type": "SCALAR"}]},
     "accessor 1, indices, is without a bufferView"),
    ({"accessors": [{**POSITION, "componentType": 5122, "normalized": True}]}, "POSITION, has normalized integers"),
    ({"primitive": {"mode": 6}}, "a triangle fan"),
    ({"nodes": chain(257)}, "nested more than 256 deep"),
    ({"nodes": [{"children": [1]}, {"children": [0], "mesh": 0}]}, "or in a circle"),
    (textured({"uri": uri(b"no image")}), "names the image '0', which cannot be read"),
    (textured({"bufferView": 0, "mimeType": "image/png"}), "names the image '0', which cannot be read"),
    ({"accessors": [POSITION, {"componentType": 5126, "count": 10**8, "type": "MAT4"}]}, r"need 6\.4 GB of memory"),
    ({"data": bytes(10**4), "bufferViews": [{"buffer": 0, "byteLength": 10**4}] * 500}, "accessors need"),
    ({"nodes": [{"mesh": 0}] * 2000, "scenes": [{"nodes": list(range(2000))}]}, "meshes need"),
])  # fmt: skip
def test_what_is_not_read_is_refused_by_name(tmp_path, parts, words, monkeypatch):
    monkeypatch.setattr(memory, "_HARMLESS", 10**6)
    monkeypatch.setattr(memory, "_MOST_EXPANSION", 1)
    with pytest.raises(InputError, match=words):
        load_scene(write(tmp_path, **parts))


@pytest.mark.parametrize("parts", [
    {"extensionsRequired": ["KHR_materials_unlit"]},
    {"accessors": [POSITION, {**POSITION, "sparse": SPARSE}]},  # of no attribute that is read
    {"nodes": chain(256)},
])  # fmt: skip
def test_what_changes_nothing_is_read(tmp_path, parts):
    assert load_scene(write(tmp_path, **parts)).vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_a_given_texture_takes_the_place_of_a_broken_image(tmp_path):
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "t.png")
    for image in ({"uri": uri(b"no image")}, {"uri": "t%2Epng"}):
        path = write(tmp_path, **textured(image))
        (texture,) = load_scene(path, tmp_path / "t.png" if "base64" in image["uri"] else None).paint.textures
        assert texture[0, 0].tolist() == [1, 0, 0]


def test_embedded_images_count_together(tmp_path, monkeypatch):
    """Each of 28 bytes a pixel; of the two that one file holds each alone would do."""
    picture = io.BytesIO()
    Image.new("1", (200, 200)).save(picture, "PNG")
    monkeypatch.setattr(memory, "_HARMLESS", 2_000_000)
    monkeypatch.setattr(memory, "_MOST_EXPANSION", 1)
    parts = textured({"uri": uri(picture.getvalue())})
    primitive = parts.pop("primitive")
    load_scene(write(tmp_path, meshes=[{"primitives": [primitive]}], **parts))
    with pytest.raises(InputError, match="its textures need"):
        load_scene(write(tmp_path, meshes=[{"primitives": [primitive] * 2}], **parts))
