"""Parts of a glTF that trimesh leaves out silently, or reads at any cost in memory and time: refused by name."""

import base64
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from lfssao.errors import InputError
from lfssao.scene.assets import Assets

# Extensions of glTF that may be required: no part of the mesh or its diffuse colour is elsewhere, or trimesh reads it.
_EXTENSIONS = re.compile("KHR_materials_.*|KHR_lights_punctual|KHR_mesh_quantization|EXT_texture_webp")
_COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_TRIANGLE_FAN = 6
_DEEPEST = 256  # nodes of glTF; trimesh takes time by the square of the depth


def check_gltf(path: Path, data: bytes, assets: Assets) -> None:
    """Refuse a glTF of which trimesh would leave out a part, or which it would take too much memory or time to read.

    Other faults are left to trimesh; images within the file that cannot be read are remembered.
    """
    length = int.from_bytes(data[12:16], "little")
    binary = path.suffix.lower() == ".glb"
    header = json.loads(data[20 : 20 + length] if binary else data)
    if strange := [name for name in header.get("extensionsRequired", []) if not _EXTENSIONS.fullmatch(name)]:
        raise InputError(f"{path}: it requires the glTF extension {strange[0]:.40}, which is not read")
    _check_depth(path, header.get("nodes", []))
    accessors, views = header.get("accessors", []), header.get("bufferViews", [])
    for number, name in _accessors_used(path, header):
        accessor = accessors[number]
        if "sparse" in accessor or "bufferView" not in accessor:
            kind = "sparse" if "sparse" in accessor else "without a bufferView"
            raise InputError(f"{path}: its accessor {number}, {name}, is {kind}, which is not read")
        if accessor.get("normalized") and name in ("POSITION", "TEXCOORD_0"):
            raise InputError(f"{path}: its accessor {number}, {name}, has normalized integers, which are not read")
    buffers = [
        data[28 + length :] if binary and "uri" not in each else _content(each["uri"], assets)
        for each in header.get("buffers", [])
    ]
    needed = sum(abs(view["byteLength"]) for view in views)
    needed += sum(abs(a["count"]) * _COMPONENTS[a["type"]] * _COMPONENT_BYTES[a["componentType"]] for a in accessors)
    assets.check("its accessors", needed)
    for number in _images_used(header):
        image = header["images"][number]
        if "bufferView" in image:
            view = views[image["bufferView"]]
            start = view.get("byteOffset", 0)
            assets.try_image(str(number), buffers[view["buffer"]][start : start + view["byteLength"]])
        elif "base64," in image["uri"]:
            assets.try_image(str(number), _content(image["uri"], assets))


def _content(uri: str, assets: Assets) -> bytes:
    """Content of a file that is named, or that stands in its own name."""
    start = uri.find("base64,")
    return assets.get(uri) if start < 0 else base64.b64decode(uri[start + 7 :])


def _check_depth(path: Path, nodes: list[dict[str, Any]]) -> None:
    """Refuse nodes that are nested too deep, or in a circle."""
    level = set(range(len(nodes)))
    for _ in range(_DEEPEST):
        level = {child for number in level for child in nodes[number].get("children", [])}
    if level:
        raise InputError(f"{path}: its nodes are nested more than {_DEEPEST} deep, or in a circle")


def _accessors_used(path: Path, header: dict[str, Any]) -> Iterator[tuple[int, str]]:
    """Accessors, each with its attribute, of what is read of a glTF."""
    for mesh in header.get("meshes", []):
        for primitive in mesh["primitives"]:
            if primitive.get("mode") == _TRIANGLE_FAN:
                raise InputError(f"{path}: it holds a triangle fan, which is not read")
            named = {**primitive["attributes"], "indices": primitive.get("indices")}
            for name in ("POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0", "indices"):
                if named.get(name) is not None:
                    yield named[name], name


def _images_used(header: dict[str, Any]) -> Iterator[int]:
    """Images that are base colours in a glTF."""
    for material in header.get("materials", []):
        if found := material.get("pbrMetallicRoughness", {}).get("baseColorTexture"):
            texture = header["textures"][found["index"]]
            source = texture.get("extensions", {}).get("EXT_texture_webp", texture).get("source")
            if source is not None:
                yield source
