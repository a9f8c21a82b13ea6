"""Trees over a mesh's triangles: the float64 one, and Embree's, faster, but with other bits on other machines."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import MissingPackageError
from lfssao.gbuffer.kernels import bvh
from lfssao.scene.mesh import Mesh, used_bounds

# How far Embree looks at most, about the largest float32: a ray that meets nothing keeps this length.
_NO_END = 1e37


class TriangleTree:
    """The float64 tree over triangles in any space (``lfssao.gbuffer.kernels.bvh``): vertices (V, 3), faces (F, 3)."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> None:
        low, high = used_bounds(vertices, faces)
        codes = np.empty(len(faces), np.uint64)
        bvh.morton_codes(vertices, faces, low, high - low, codes)
        order = np.argsort(codes, kind="stable")
        self.vertices = vertices
        self.faces = faces[order]
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


def embree_installed() -> bool:
    """Whether embreex can be imported."""
    try:
        import embreex.rtcore_scene  # noqa: F401, late: optional
    except ImportError:
        return False
    return True


def require_embree() -> None:
    """Raise MissingPackageError if embreex is not installed."""
    if not embree_installed():
        raise MissingPackageError(
            "Embree needs the package embreex, which is not installed here (it has no wheel for Linux on aarch64); "
            "everything that does not ask for Embree works without it"
        )


def build_scene(vertices: NDArray[np.float32], faces: NDArray[np.int32]) -> Any:
    """Embree's scene of (V, 3) vertices and (F, 3) faces, its BVH built."""
    from embreex.mesh_construction import TriangleMesh  # late: optional, see require_embree
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, vertices, faces)
    # The first run builds the BVH; it must be over before several threads share the scene.
    scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
    return scene


class CentredScene:
    """Embree's scene of a mesh whose box lies between -1 and 1, where float32 is finest, wherever it is in the world.

    ``middle`` is the world's place of the scene's 0, (3,) float64, and ``unit`` the world units in its 1, a power of
    two: distances change by no rounding. MissingPackageError if embreex is not installed.
    """

    def __init__(self, mesh: Mesh) -> None:
        require_embree()
        low, high = mesh.bounds
        self.middle = 0.5 * low + 0.5 * high
        self.unit = 2.0 ** math.frexp(float((high - low).max()) / 2)[1]
        with np.errstate(over="ignore"):  # of vertices that no face names
            vertices = ((mesh.vertices - self.middle) / self.unit).astype(np.float32)
        self._scene = build_scene(vertices, mesh.faces)

    def distances(
        self, origins: NDArray[np.float32], directions: NDArray[np.float32], far: float, any_hit: bool
    ) -> NDArray[np.float32]:
        """How far each ray goes to the first triangle, (n,), infinity for none within ``far``; any hit is 0 if asked.

        Rays are (n, 3) in the scene's space and unit, directions of length 1.
        """
        if far == 0:  # a triangle at the origin would be hit
            return np.full(len(origins), np.inf, np.float32)
        reach = min(far, _NO_END)
        if any_hit:
            met = self._scene.run(origins, directions, reach, query="OCCLUDED") >= 0
            return np.where(met, np.float32(0), np.float32(np.inf))
        found: NDArray[np.float32] = self._scene.run(origins, directions, reach, query="DISTANCE")
        found[found >= np.float32(reach)] = np.inf
        return found
