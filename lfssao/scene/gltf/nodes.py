"""Nodes of a glTF's scene: which are shown, and their transforms to the scene."""

from math import sqrt
from typing import Any

from lfssao.scene.gltf.accessors import read_numbers
from lfssao.scene.gltf.file import File
from lfssao.scene.gltf.item import Item

_ROUNDED = 1e-6  # by how much a program's float32 may miss the last row of an affine matrix

Rows = tuple[tuple[float, float, float, float], ...]

_UNIT = 0.01  # by how much the length of a quaternion may differ from 1: old exporters round to few digits


class Nodes:
    """The tree of nodes: who is whose parent, and where each stands; InputError if it is none."""

    def __init__(self, file: File) -> None:
        self._file = file
        self._nodes = file.objects("nodes")
        self._parents = _parents(file)
        self._worlds: dict[int, Rows | None] = {}

    def shown(self) -> list[int]:
        """Return numbers of the nodes that the scene shows, parents first."""
        roots = [number for number, parent in enumerate(self._parents) if parent < 0]
        waiting = list(roots)
        reached = 0
        while waiting:
            reached += 1
            waiting += self._nodes[waiting.pop()].values.get("children", [])
        if reached < len(self._nodes):
            raise self._file.root.fault("some are children of their own children, in a circle", "nodes")
        found = []
        waiting = self._scene(roots)[::-1]
        while waiting:
            number = waiting.pop()
            visibility = self._nodes[number].extension("KHR_node_visibility")
            if visibility is None or visibility.flag("visible", True):
                found.append(number)
                waiting += self._nodes[number].values.get("children", [])[::-1]
        return found

    def _scene(self, roots: list[int]) -> list[int]:
        """Return roots of the scene; all roots where the file has no scenes."""
        file = self._file
        scenes = self._file.objects("scenes")
        if not scenes:
            file.assets.note("it has no scenes: all its nodes are read")
            return roots
        scene = file.named(file.root, "scene", "scenes") or scenes[0]
        if len(scenes) > 1:
            file.assets.note(f"it has {len(scenes)} scenes: {scene.place} alone is read")
        found = _numbers(scene, "nodes", len(self._nodes))
        for number in found:
            if self._parents[number] >= 0:
                raise scene.fault(f"names node {number}, which is a child of node {self._parents[number]}", "nodes")
        return found

    def world(self, number: int) -> Rows | None:
        """Return the transform from a node to the scene, 3 rows of 4; None for the identity."""
        way = []
        known = self._worlds
        while number >= 0 and number not in known:
            way.append(number)
            number = self._parents[number]
        found = known[number] if number >= 0 else None
        for each in reversed(way):
            local = _local(self._nodes[each])
            found = product(found, local) if found and local else found or local
            known[each] = found
        return found


def instances(file: File, node: Item) -> list[Rows | None]:
    """Return transforms of the copies of a node's mesh, to the node: one for EXT_mesh_gpu_instancing's every row."""
    extension = node.extension("EXT_mesh_gpu_instancing")
    attributes = None if extension is None else extension.item("attributes")
    if extension is None:
        return [None]
    if attributes is None:
        raise extension.must("attributes", "a JSON object")
    kinds = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}
    for key in [each for each in attributes.values if each not in kinds]:
        file.assets.note(f"{key:.40} of copies of its meshes (EXT_mesh_gpu_instancing) is left out")
    read = {key: read_numbers(file, attributes, key, (kind,)) for key, kind in kinds.items()}
    lengths = {len(values) for values in read.values() if values is not None}
    if len(lengths) != 1:
        raise attributes.fault("TRANSLATION, ROTATION and SCALE must have one count")
    plain = {"TRANSLATION": (0.0, 0.0, 0.0), "ROTATION": (0.0, 0.0, 0.0, 1.0), "SCALE": (1.0, 1.0, 1.0)}
    rows: Any = [[plain[key]] * max(lengths) if read[key] is None else read[key].tolist() for key in plain]
    return [_placed(attributes, "ROTATION", *row) for row in zip(*rows, strict=True)]


def product(a: Rows, b: Rows) -> Rows:
    """Transform a after b; each entry adds its products from the first to the last.

    Entries are Python's: deep trees have as many products as nodes, and an array is slower to make than this.
    """
    (b00, b01, b02, b03), (b10, b11, b12, b13), (b20, b21, b22, b23) = b
    return tuple(
        (
            (x * b00 + y * b10) + z * b20,
            (x * b01 + y * b11) + z * b21,
            (x * b02 + y * b12) + z * b22,
            ((x * b03 + y * b13) + z * b23) + w,
        )
        for x, y, z, w in a
    )


def _parents(file: File) -> list[int]:
    """Return the parent of each node, -1 where it has none."""
    nodes = file.objects("nodes")
    parents = [-1] * len(nodes)
    for number, node in enumerate(nodes):
        for child in _numbers(node, "children", len(nodes)):
            if parents[child] >= 0:
                raise node.fault(f"names node {child}, which is a child of node {parents[child]}, too", "children")
            parents[child] = number
    return parents


def _numbers(item: Item, key: str, count: int) -> list[int]:
    """Return numbers of nodes, each once."""
    found = item.array(key)
    if not all(type(number) is int and 0 <= number < count for number in found):
        raise item.must(key, f"numbers of nodes, of which there are {count}")
    if len(set(found)) < len(found):
        raise item.must(key, "numbers of nodes, each once")
    return found


def _local(node: Item) -> Rows | None:
    """Return the transform of a node to its parent; None where it has none."""
    own = {"translation", "rotation", "scale"} & set(node.values)
    if "matrix" in node.values:
        if own:
            raise node.fault(f"it has a matrix and a {min(own)}, of which glTF allows one")
        m = node.numbers("matrix", 16)
        if any(abs(x - right) > _ROUNDED for x, right in zip(m[3::4], (0.0, 0.0, 0.0, 1.0), strict=True)):
            raise node.must("matrix", "affine, with 0, 0, 0, 1 as its last row")
        return tuple((m[row], m[row + 4], m[row + 8], m[row + 12]) for row in range(3))
    if not own:
        return None
    return _placed(
        node,
        "rotation",
        node.numbers("translation", 3, (0.0, 0.0, 0.0)),
        node.numbers("rotation", 4, (0.0, 0.0, 0.0, 1.0)),
        node.numbers("scale", 3, (1.0, 1.0, 1.0)),
    )


def _placed(item: Item, key: str, translation: Any, rotation: Any, scale: Any) -> Rows:
    """Translation after rotation after scale; the quaternion (x, y, z, w) is divided by its length."""
    x, y, z, w = rotation
    square = ((x * x + y * y) + z * z) + w * w
    if not abs(sqrt(square) - 1.0) <= _UNIT:
        raise item.fault(f"has a quaternion of length {sqrt(square):.6g}, it must be 1", key)
    twice = 2.0 / square
    turned = (
        (1.0 - twice * (y * y + z * z), twice * (x * y - z * w), twice * (x * z + y * w)),
        (twice * (x * y + z * w), 1.0 - twice * (x * x + z * z), twice * (y * z - x * w)),
        (twice * (x * z - y * w), twice * (y * z + x * w), 1.0 - twice * (x * x + y * y)),
    )
    sx, sy, sz = scale
    return tuple((a * sx, b * sy, c * sz, t) for (a, b, c), t in zip(turned, translation, strict=True))
