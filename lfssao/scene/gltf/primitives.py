"""Primitives of a glTF's meshes as parts."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lfssao.scene.gltf.accessors import read_numbers, read_whole
from lfssao.scene.gltf.cutout import cut_out
from lfssao.scene.gltf.deform import joint_transforms, morph, morph_weights, skin_part
from lfssao.scene.gltf.file import File
from lfssao.scene.gltf.item import Item
from lfssao.scene.gltf.materials import Look, look_of
from lfssao.scene.gltf.nodes import Nodes, instances, product
from lfssao.scene.part import Part

_TRIANGLES = 4
_STRIP = 5
_FAN = 6
_ROUNDED = 1e-6  # by how much colours may be beyond 0 and 1 without a word
_DRACO = "KHR_draco_mesh_compression"


def parts_of(file: File, nodes: Nodes, number: int) -> Iterator[Part]:
    """Yield the triangles of a node's mesh, one part a primitive and copy, where they stand in the scene."""
    node = file.objects("nodes")[number]
    mesh = file.named(node, "mesh", "meshes")
    skin = file.named(node, "skin", "skins")
    if mesh is None:
        return
    copies = instances(file, node)
    world = nodes.world(number)
    if skin is not None and copies != [None]:
        raise node.fault("has a skin and EXT_mesh_gpu_instancing, which are not read together")
    joints = None if skin is None else joint_transforms(file, nodes, skin)
    places = [product(world, copy) if world and copy else world or copy for copy in copies]
    weights = morph_weights(node, mesh)
    for primitive in mesh.items("primitives"):
        if primitive.whole("mode", _TRIANGLES, 0, _FAN) < _TRIANGLES:
            file.assets.note("its points and lines are left out")
            continue
        part = _part(file, primitive, weights)
        # Each vertex in float64, with copies as parts are put in place and joined.
        size = 200 * (len(part.vertices) + len(part.faces))
        file.claim("its meshes", size)
        file.claim("copies of its meshes", size * (len(places) - 1), meant=True)
        if skin is not None and joints is not None:  # the transform of the node itself means nothing then
            skin_part(file, _attributes(primitive), part, joints, skin)
            yield part
            continue
        for place in places:
            copy = replace(part)
            if place is not None:
                copy.place(np.array(place))
            yield copy


def _attributes(primitive: Item) -> Item:
    found = primitive.item("attributes")
    if found is None:
        raise primitive.must("attributes", "a JSON object")
    return found


def _part(file: File, primitive: Item, weights: list[float]) -> Part:
    attributes = _attributes(primitive)
    look = look_of(file, primitive)
    _check_draco(file, primitive, attributes)
    vertices = read_numbers(file, attributes, "POSITION", ("VEC3",))
    if vertices is None:
        raise attributes.must("POSITION", "the number of an accessor")
    part = Part(morph(file, primitive, "POSITION", vertices, weights), _faces(file, primitive, len(vertices)))
    part.factor = look.factor
    part.image = look.image
    part.sampler = look.sampler
    part.normals = _of_vertices(file, primitive, "NORMAL", ("VEC3",), len(vertices), weights)
    part.uv = _coordinates(file, primitive, look, len(vertices), weights)
    read = _of_vertices(file, primitive, "COLOR_0", ("VEC3", "VEC4"), len(vertices), weights)
    alpha = None
    if read is not None:
        if abs(read - 0.5).max() > 0.5 + _ROUNDED:
            reach = f"from {read.min():g} to {read.max():g}"
            file.assets.note(f"colours of its vertices reach {reach}: they are clamped to 0 to 1")
        colors = np.clip(read, 0.0, 1.0).astype(np.float32)
        part.vertex_colors = colors[:, :3]
        alpha = colors[:, 3] if colors.shape[1] == 4 else None
    cut_out(file, part, look, alpha)
    return part


def _of_vertices(
    file: File, primitive: Item, key: str, kinds: tuple[str, ...], count: int, weights: list[float]
) -> NDArray[np.float64] | None:
    """Return an attribute of all vertices in the rest pose; None where there is none."""
    attributes = _attributes(primitive)
    found = read_numbers(file, attributes, key, kinds, fractions=key.startswith("COLOR"))
    if found is None:
        return None
    if len(found) != count:
        raise attributes.fault(f"has {len(found)} elements, but POSITION has {count}", key)
    moved: NDArray[np.float64] = morph(file, primitive, key, found, weights)
    return moved


def _coordinates(
    file: File, primitive: Item, look: Look, count: int, weights: list[float]
) -> NDArray[np.float64] | None:
    """Texture coordinates, v upwards, that the base colour is read at; None where nothing is read."""
    if look.image is None and file.assets.given is None:
        return None
    key = f"TEXCOORD_{look.uv_set}"
    found = _of_vertices(file, primitive, key, ("VEC2",), count, weights)
    if found is None:
        if file.assets.given is None:
            raise primitive.fault(f"has no {key}, at which {look.place} reads its texture")
        return None
    a, b, c, d, e, f = look.uv_map
    u, v = found.T
    return np.column_stack([(a * u + b * v) + c, 1.0 - ((d * u + e * v) + f)])


def _faces(file: File, primitive: Item, count: int) -> NDArray[np.int64]:
    """Return triangles of a primitive, (F, 3) vertex numbers."""
    mode = primitive.whole("mode", _TRIANGLES)
    found = read_whole(file, primitive, "indices", "SCALAR")
    corners = np.arange(count) if found is None else found[:, 0]
    if corners.max() >= count:
        raise primitive.fault(f"names vertex {corners.max()}, but there are {count} vertices", "indices")
    if len(corners) < 3 or (mode == _TRIANGLES and len(corners) % 3):
        what = {_STRIP: "a triangle strip", _FAN: "a triangle fan"}.get(mode, "triangles")
        raise primitive.fault(f"it has {len(corners)} corners, which are no {what}")
    if mode == _TRIANGLES:
        return corners.reshape(-1, 3)
    first = np.arange(len(corners) - 2)
    odd = first % 2
    if mode == _STRIP:
        return np.column_stack([corners[first], corners[first + 1 + odd], corners[first + 2 - odd]])
    return np.column_stack([corners[1:-1], corners[2:], np.repeat(corners[0], len(first))])


def _check_draco(file: File, primitive: Item, attributes: Item) -> None:
    """Refuse a primitive that is there in compressed form alone."""
    if primitive.extension(_DRACO) is None:
        return
    named = [(attributes, key) for key in attributes.values] + [(primitive, "indices")]
    accessors = [file.named(owner, key, "accessors") for owner, key in named]
    if any(each is not None and "bufferView" not in each.values for each in accessors):
        raise primitive.fault(f"is compressed by {_DRACO}, which is not read")
