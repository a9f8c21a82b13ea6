"""A bounding volume hierarchy (BVH) over the triangles: a tree of boxes, float64.

The triangles are put in Morton order (Morton 1966) and four neighbours make a leaf. The tree is complete and has no
pointers: node k has children 2k + 1 and 2k + 2, and the last ``leaves`` nodes are the leaves.
"""

from typing import Any, NamedTuple

import numpy as np

from lfssao.core.jit import formula, kernel

LEAF = 4


class Tree(NamedTuple):
    """The tree as kernels take it."""

    corners: Any  # (F, 9) float64: corners of the triangles in Morton order
    order: Any  # (F,) int64: their numbers
    place_of: Any  # (F,) int64: the place of each number in that order
    boxes: Any  # (2 leaves - 1, 6) float64: lower and upper corner of each node's box


# None of these kernels is parallel: threads would save milliseconds, once a mesh, and cost seconds of compiling.


@formula
def _spread_bits(n):
    """The 21 bits of n, each followed by two zero bits."""
    n = np.uint64(n)
    n = (n | (n << np.uint64(32))) & np.uint64(0x1F00000000FFFF)
    n = (n | (n << np.uint64(16))) & np.uint64(0x1F0000FF0000FF)
    n = (n | (n << np.uint64(8))) & np.uint64(0x100F00F00F00F00F)
    n = (n | (n << np.uint64(4))) & np.uint64(0x10C30C30C30C30C3)
    n = (n | (n << np.uint64(2))) & np.uint64(0x1249249249249249)
    return n


@kernel
def morton_codes(vertices, faces, low, size, codes):
    """Write the Morton code, (F,) uint64, of each triangle's middle in the box at ``low`` of edge lengths ``size``."""
    for f in range(faces.shape[0]):
        code = np.uint64(0)
        for axis in range(3):
            a, b, c = vertices[faces[f, 0], axis], vertices[faces[f, 1], axis], vertices[faces[f, 2], axis]
            middle = 0.5 * (min(a, b, c) + max(a, b, c))
            place = (middle - low[axis]) / size[axis] if size[axis] > 0.0 else 0.0
            cell = np.uint64(min(max(place, 0.0), 1.0) * 2097151.0)
            code |= _spread_bits(cell) << np.uint64(axis)
        codes[f] = code


@kernel
def leaf_count(triangles):
    """Number of leaves of a tree over that many triangles, a power of two."""
    leaves = 1
    while leaves * LEAF < triangles:
        leaves *= 2
    return leaves


@kernel
def build_boxes(corners, margin, boxes):
    """Write the boxes of all nodes, (2 leaves - 1, 6) float64; empty, (inf, -inf), where a node holds nothing.

    margin: distance by which every box is larger than its triangles, so that rounding cannot make a ray miss it.
    """
    leaves = (boxes.shape[0] + 1) // 2
    for leaf in range(leaves):
        node = leaves - 1 + leaf
        for axis in range(3):
            boxes[node, axis], boxes[node, 3 + axis] = np.inf, -np.inf
        for place in range(LEAF * leaf, min(LEAF * leaf + LEAF, corners.shape[0])):
            for k in range(9):
                axis = k % 3
                boxes[node, axis] = min(boxes[node, axis], corners[place, k] - margin)
                boxes[node, 3 + axis] = max(boxes[node, 3 + axis], corners[place, k] + margin)
    for node in range(leaves - 2, -1, -1):
        for axis in range(3):
            boxes[node, axis] = min(boxes[2 * node + 1, axis], boxes[2 * node + 2, axis])
            boxes[node, 3 + axis] = max(boxes[2 * node + 1, 3 + axis], boxes[2 * node + 2, 3 + axis])
