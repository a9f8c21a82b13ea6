"""Vertices of a glTF in its rest pose: morph targets by their default weights, then skins."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import cofactors
from lfssao.scene.gltf.accessors import read_numbers, read_whole
from lfssao.scene.gltf.file import File
from lfssao.scene.gltf.item import Item
from lfssao.scene.gltf.nodes import Nodes, product
from lfssao.scene.part import Part

_ROUNDED = 1e-3  # sums of 8-bit weights are off by about as much


def morph_weights(node: Item, mesh: Item) -> list[float]:
    """Return the weights of a mesh's targets at a node: the node's, else the mesh's, else none."""
    found = node.numbers("weights", None, None)
    return list(mesh.numbers("weights", None, []) if found is None else found)


def morph(file: File, primitive: Item, key: str, values: Any, weights: list[float]) -> Any:
    """Return values of an attribute, (V, k), plus weight times displacement of each target, in their order."""
    targets = primitive.items("targets")
    if weights and len(weights) != len(targets):
        raise primitive.fault(f"has {len(targets)} targets, but there are {len(weights)} weights", "targets")
    for target, weight in zip(targets, weights, strict=False):
        if weight == 0.0:
            continue
        moved = read_numbers(file, target, key, ("VEC2", "VEC3", "VEC4"))
        if moved is None:
            continue
        if len(moved) != len(values) or moved.shape[1] > values.shape[1]:
            raise target.fault(f"has shape {moved.shape}, expected {values.shape}", key)
        width = moved.shape[1]  # displacements of colours may leave alpha out
        values = np.hstack([values[:, :width] + weight * moved, values[:, width:]])
    return values


def joint_transforms(file: File, nodes: Nodes, skin: Item) -> NDArray[np.float64]:
    """Return (J, 3, 4): the transform of each joint's node after its inverse bind matrix."""
    joints = skin.array("joints")
    count = len(file.objects("nodes"))
    if not joints or not all(type(number) is int and 0 <= number < count for number in joints):
        raise skin.must("joints", f"numbers of nodes, of which there are {count}")
    inverse = read_numbers(file, skin, "inverseBindMatrices", ("MAT4",))
    bound: Any = [((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))] * len(joints)
    if inverse is not None:
        if len(inverse) < len(joints):
            raise skin.fault(f"has {len(inverse)} matrices for {len(joints)} joints", "inverseBindMatrices")
        if (abs(inverse[:, 3::4] - (0.0, 0.0, 0.0, 1.0)) > _ROUNDED).any():
            raise skin.fault("must be affine, with 0, 0, 0, 1 as the last row of each", "inverseBindMatrices")
        bound = inverse.reshape(-1, 4, 4).transpose(0, 2, 1)[:, :3].tolist()
    found = []
    for number, matrix in zip(joints, bound, strict=False):
        world = nodes.world(number)
        found.append(product(world, matrix) if world else matrix)
    return np.array(found)


def skin_part(file: File, attributes: Item, part: Part, joints: NDArray[np.float64], skin: Item) -> None:
    """Move a part's vertices, and turn its normals, by the mean of its joints' transforms with the vertices' weights.

    The mean is the sum of weight x matrix from the first joint to the last, divided by the sum of the weights.
    """
    total = np.zeros((len(part.vertices), 3, 4))
    sums = np.zeros(len(part.vertices))
    number = 0
    while f"JOINTS_{number}" in attributes.values or f"WEIGHTS_{number}" in attributes.values or not number:
        named = read_whole(file, attributes, f"JOINTS_{number}", "VEC4")
        weights = read_numbers(file, attributes, f"WEIGHTS_{number}", ("VEC4",), fractions=True)
        for key, values in (("JOINTS", named), ("WEIGHTS", weights)):
            if values is None or len(values) != len(part.vertices):
                found = "is missing" if values is None else f"has {len(values)} elements"
                raise attributes.fault(
                    f"{found}, the skin needs one for each of {len(part.vertices)} vertices", f"{key}_{number}"
                )
        assert named is not None
        if (weights < 0).any():
            raise attributes.fault("has a negative weight", f"WEIGHTS_{number}")
        if ((named >= len(joints)) & (weights > 0)).any():
            raise attributes.fault(
                f"names joint {named[weights > 0].max()} of {skin.place}, which has {len(joints)}", f"JOINTS_{number}"
            )
        named = np.minimum(named, len(joints) - 1)
        for k in range(4):
            total += weights[:, k, None, None] * joints[named[:, k]]
            sums += weights[:, k]
        number += 1
    used = sums[part.faces]
    if not (used > 0).all():
        raise attributes.fault("is 0 at all joints of a vertex that a face uses", "WEIGHTS_0")
    if (abs(used - 1.0) > _ROUNDED).any():
        file.assets.note("weights of its skins do not sum to 1 at every vertex: they are divided by their sum")
    m = total / np.where(sums > 0, sums, 1.0)[:, None, None]
    part.vertices = _turned(m, part.vertices) + m[:, :, 3]
    if part.normals is not None:
        part.normals = _turned(cofactors(m), part.normals)


def _turned(m: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each vector, (V, 3), under a linear map of its own: (m0 x + m1 y) + m2 z."""
    x, y, z = (vectors[:, None, k] for k in range(3))
    return np.asarray((m[:, :, 0] * x + m[:, :, 1] * y) + m[:, :, 2] * z)
