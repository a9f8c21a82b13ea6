"""The float64 tree over a mesh's triangles, which is built once and serves all rays of its space."""

import numpy as np
from numpy.typing import NDArray

from lfssao.gbuffer.kernels import bvh
from lfssao.scene.mesh import used_bounds


class TriangleTree:
    """The float64 tree over triangles in any space (``lfssao.gbuffer.kernels.bvh``): vertices (V, 3), faces (F, 3)."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> None:
        low, high = used_bounds(vertices, faces)
        codes = np.empty(len(faces), np.uint64)
        bvh.morton_codes(vertices, faces, low, high - low, codes)
        order = np.argsort(codes, kind="stable")
        self.vertices, self.faces = vertices, faces[order]
        place_of = np.empty_like(order)
        place_of[order] = np.arange(len(faces))
        corners = np.ascontiguousarray(vertices[self.faces].reshape(-1, 9))
        boxes = np.empty((2 * bvh.leaf_count(len(faces)) - 1, 6))
        # Rounding moves a ray, seen from a corner, by a few units in the last place of the largest coordinate.
        margin = 1e-12 * float(np.maximum(np.abs(low), np.abs(high)).max())
        bvh.build_boxes(corners, margin, boxes)
        # Embree sees corners and rays in float32.
        margin = 1e-6 * float(np.maximum(np.abs(low), np.abs(high)).max())
        self.bounds = np.stack([low - margin, high + margin])
        self.arrays = bvh.Tree(corners, order, place_of, boxes)
