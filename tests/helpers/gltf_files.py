"""glTF files made by tests: a header whose parts may be replaced, and accessors packed one behind the other."""

import base64
import io
import json

import numpy as np
import pytest
from PIL import Image

from lfssao import InputError
from lfssao.scene.load import load_scene

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
QUAD = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
FACES = [[0, 1, 2], [0, 2, 3]]
UV = [[0, 1], [1, 1], [1, 0], [0, 0]]  # v downwards: the image stands upright
CODES = np.array([[[200, 10, 20], [60, 120, 180]], [[30, 230, 90], [255, 128, 1]]], np.uint8)
TURN = [0, 0, 0.6, 0.8]  # about z: x to (0.28, 0.96), y to (-0.96, 0.28)
TURNED = np.array([[0.28, -0.96, 0], [0.96, 0.28, 0], [0, 0, 1]])


def uri(data, kind="application/octet-stream"):
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


class Gltf:
    """A scene of one node with one mesh of one primitive, a quad from -1 to 1, seen from +Z."""

    def __init__(self, positions=QUAD, indices=FACES, **attributes):
        self.data = b""
        self.header = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{}],
            "accessors": [],
            "bufferViews": [],
        }
        self.header["meshes"][0]["primitives"] = [self.primitive(positions, indices, **attributes)]
        self.first = self.header["meshes"][0]["primitives"][0]
        self.node = self.header["nodes"][0]

    def primitive(self, positions=QUAD, indices=FACES, **attributes):
        made = {"attributes": {"POSITION": self.accessor(positions)}}
        made["attributes"] |= {name: self.accessor(*values) for name, values in attributes.items()}
        if indices is not None:
            made["indices"] = self.accessor(np.ravel(indices)[:, None], "u2")
        return made

    def view(self, data):
        """The number of a bufferView with these bytes."""
        self.data += bytes(-len(self.data) % 4)
        self.header["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)})
        self.data += data
        return len(self.header["bufferViews"]) - 1

    def accessor(self, values, dtype="f4", normalized=False, **more):
        """The number of an accessor with these values, one element a row."""
        values = np.asarray(values, "<" + dtype)
        made = {"componentType": COMPONENTS[dtype], "count": len(values), "type": KINDS[values.shape[1]], **more}
        if normalized:
            made["normalized"] = True
        if "bufferView" not in made:
            made["bufferView"] = self.view(values.tobytes())
        self.header["accessors"].append(made)
        return len(self.header["accessors"]) - 1

    def material(self, image=None, sampler=None, info=(), **material):
        """Give the primitive a material; an image is the bytes of a PNG."""
        made = {"pbrMetallicRoughness": {}, **material}
        if image is not None:
            made["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0, **dict(info)}
            self.header["images"] = [{"bufferView": self.view(image), "mimeType": "image/png"}]
            self.header["textures"] = [{"source": 0}]
        if sampler is not None:
            self.header["samplers"] = [sampler]
            self.header["textures"][0]["sampler"] = 0
        self.header["materials"] = [made]
        self.first["material"] = 0
        return made

    def save(self, path):
        """Write a .gltf with its buffer within it, or a .glb."""
        header = {"buffers": [{"byteLength": len(self.data)}], **self.header}
        if path.suffix == ".gltf":
            header["buffers"] = self.header.get("buffers", [{"byteLength": len(self.data), "uri": uri(self.data)}])
            path.write_text(json.dumps(header))
        else:
            path.write_bytes(glb(header, self.data))
        return path


def glb(header, data, version=2):
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    body = len(text).to_bytes(4, "little") + b"JSON" + text + len(data).to_bytes(4, "little") + b"BIN\0" + data
    return b"glTF" + version.to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body


def linear(codes):
    """sRGB codes decoded once, by IEC 61966-2-1."""
    value = np.asarray(codes, np.float64) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def png(codes=CODES, kind="PNG"):
    content = io.BytesIO()
    Image.fromarray(np.asarray(codes, np.uint8)).save(content, kind, lossless=True)
    return content.getvalue()


def load(made, path):
    return load_scene(made.save(path / "a.glb"))


def refused(path, words):
    with pytest.raises(InputError, match=words) as caught:
        load_scene(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def moved(points, x, y, z):
    return np.array(points) + np.array([x, y, z])
