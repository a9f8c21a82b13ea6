"""Depth, positions and colour textures by Embree ray casting: LF's Z prepass and G-buffer in one (LF section 7)."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError, MissingPackageError
from lfssao.kernels import hits, paint, rays
from lfssao.matrix import Matrix
from lfssao.scene.mesh import Mesh, Paint
from lfssao.view import View

# Rays that one thread hands to Embree at a time: long enough to hide the call, short enough to share the work.
_CHUNK = 65_536


@dataclass(frozen=True, eq=False)
class GBuffer:
    """What a view sees, one value a texel.

    Attributes
    ----------
    depth : (H, W) float32
        Image z (``View.depth_kind``), +infinity where there is no surface.
    positions : (H, W, 3) float32
        World coordinates, +infinity where there is no surface.
    color : (H, W, 3) float32 or None
        Diffuse colour, linear RGB, 0 where there is no surface; None where the mesh has none.
    triangle : (H, W) int32
        Number of the visible triangle, -1 where there is none.
    """

    depth: NDArray[np.float32]
    positions: NDArray[np.float32]
    color: NDArray[np.float32] | None
    triangle: NDArray[np.int32]


class RayCaster:
    """A mesh ready to be ray cast from any view that shares its cast space; Embree's BVH is built once.

    Parameters
    ----------
    mesh : Mesh
        What to look at.
    cast_from_world : (3, 4) float64
        Affine map world -> cast space (``View.cast_from_world``).
    threads : int
        How many threads trace.

    Raises
    ------
    MissingPackageError
        If embreex is not installed.
    InputError
        If the mesh leaves the range of float32 in cast space.
    """

    def __init__(self, mesh: Mesh, cast_from_world: Matrix, threads: int = 1) -> None:
        self.mesh = mesh
        self.threads = threads
        self._vertices = np.empty_like(mesh.vertices)
        rays.transform_points(np.ravel(cast_from_world), mesh.vertices, self._vertices)
        self._box = self._bounding_box()
        self._scene = _embree_scene(mesh.name, self._vertices, mesh.faces)
        self._paint = None if mesh.paint is None else _PaintTables(mesh.paint)

    def _bounding_box(self) -> NDArray[np.float64]:
        """Box of the used vertices, grown by what float32 may move them."""
        used = self._vertices[np.unique(self.mesh.faces)]
        low, high = used.min(axis=0), used.max(axis=0)
        margin = 1e-6 * np.maximum(np.maximum(np.abs(low), np.abs(high)), (high - low).max())
        return np.stack([low - margin, high + margin])

    def gbuffer(self, view: View, color: bool = True) -> GBuffer:
        """Cast one ray through the centre of each texel of a view.

        Parameters
        ----------
        view : View
            Where from; its cast space must be the caster's.
        color : bool
            Whether to make the colour texture (if the mesh has colour).

        Returns
        -------
        GBuffer
        """
        texels, origins, directions, lengths = self._make_rays(view)
        hit = self._trace(origins, directions, lengths)
        size = view.height * view.width
        depth, positions = np.empty(size, np.float32), np.empty((size, 3), np.float32)
        triangle, weights = np.full(size, -1, np.int32), np.zeros((size, 2), np.float32)
        rays.fill(depth, np.inf)
        rays.fill(positions.reshape(-1), np.inf)
        hits.resolve_hits(
            view.ray_kind, view.lens, np.ravel(view.world_from_cast), self._vertices, self.mesh.faces, view.width,
            texels, hit, depth, positions, triangle, weights,
        )  # fmt: skip
        rgb = None
        if color and self._paint is not None:
            rgb = self._paint.color(triangle, weights, self.mesh.faces)
        shape = view.height, view.width
        return GBuffer(
            depth=depth.reshape(shape),
            positions=positions.reshape(*shape, 3),
            color=None if rgb is None else rgb.reshape(*shape, 3),
            triangle=triangle.reshape(shape),
        )

    def _make_rays(self, view: View) -> tuple[NDArray[Any], ...]:
        """Texel number, origin, direction and length of each ray that meets the mesh's box."""
        counts = np.empty(view.height, np.int64)
        rays.count_rays(view.ray_kind, view.lens, self._box, view.width, counts)
        starts = np.cumsum(counts) - counts
        n = int(counts.sum())
        texels, lengths = np.empty(n, np.int32), np.empty(n, np.float32)
        origins, directions = np.empty((n, 3), np.float32), np.empty((n, 3), np.float32)
        rays.make_rays(view.ray_kind, view.lens, self._box, view.width, starts, texels, origins, directions, lengths)
        return texels, origins, directions, lengths

    def _trace(
        self, origins: NDArray[np.float32], directions: NDArray[np.float32], lengths: NDArray[np.float32]
    ) -> NDArray[np.int32]:
        """Number of the first triangle along each ray, -1 where there is none."""
        hit = np.empty(len(origins), np.int32)

        def trace(start: int, stop: int) -> None:
            part = slice(start, stop)
            # Embree writes into the lengths it is given: they are not used again.
            hit[part] = self._scene.run(origins[part], directions[part], lengths[part], query="INTERSECT")

        _run_chunks(trace, len(origins), self.threads)
        return hit


def _run_chunks(work: Callable[[int, int], None], n: int, threads: int) -> None:
    """Call work(start, stop) over 0 .. n - 1 in chunks, on several threads if asked."""
    edges = [*range(0, n, _CHUNK), n]
    if threads == 1:
        for start, stop in pairwise(edges):
            work(start, stop)
        return
    with ThreadPoolExecutor(threads) as pool:
        for done in [pool.submit(work, start, stop) for start, stop in pairwise(edges)]:
            done.result()


def _embree_scene(name: str, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> Any:
    """Embree's scene of the mesh, its BVH built."""
    try:
        from embreex.mesh_construction import TriangleMesh  # late: optional, see MissingPackageError
        from embreex.rtcore_scene import EmbreeScene
    except ImportError as error:
        raise MissingPackageError(
            "ray casting needs the package embreex, which is not installed here (it has no wheel for Linux on "
            "aarch64); everything else works on textures made elsewhere"
        ) from error
    single = vertices.astype(np.float32)
    if not np.isfinite(single).all():
        raise InputError(f"{name}: coordinates leave the range of float32 in the space rays are cast in")
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, single, faces)
    # The first run builds the BVH; it must be over before several threads share the scene.
    scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
    return scene


class _PaintTables:
    """A mesh's paint as the arrays that the kernel takes."""

    def __init__(self, source: Paint) -> None:
        sizes = [(0, 0) if t is None else (t.shape[1], t.shape[0]) for t in source.textures]
        first = np.cumsum([0, *(w * h for w, h in sizes)])[:-1]
        self._table = np.array([(f, w, h) for f, (w, h) in zip(first, sizes, strict=True)], np.int64)
        images = [t.reshape(-1, 3) for t in source.textures if t is not None]
        self._texels = np.concatenate(images) if images else np.zeros((0, 3), np.float32)
        self._vertex_colors = np.zeros((0, 3), np.float32) if source.vertex_colors is None else source.vertex_colors
        self._uv = np.zeros((0, 2)) if source.uv is None else source.uv
        self._source = source

    def color(
        self, triangle: NDArray[np.int32], weights: NDArray[np.float32], faces: NDArray[np.int32]
    ) -> NDArray[np.float32]:
        """Diffuse colour of each texel, (n, 3) float32 linear RGB."""
        rgb = np.empty((len(triangle), 3), np.float32)
        paint.paint_hits(
            triangle, weights, faces, self._source.factors, self._source.face_material, self._vertex_colors,
            self._uv, self._table, self._texels, rgb,
        )  # fmt: skip
        return rgb
