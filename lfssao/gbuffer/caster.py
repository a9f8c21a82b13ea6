"""Depth, positions and colour textures by ray casting: LF's Z prepass and G-buffer in one (LF section 7)."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from lfssao.core.affine import Matrix, transform_points
from lfssao.core.threads import check_threads, in_chunks
from lfssao.errors import InputError, check_type, shown
from lfssao.files import pictures
from lfssao.gbuffer import rasterize
from lfssao.gbuffer.kernels import first_hit, surface
from lfssao.gbuffer.trees import TriangleTree, build_scene, embree_installed, require_embree
from lfssao.optics.kernels.rays import make_rays
from lfssao.optics.view import View, WorldToImage, finite_numbers, seen_rows
from lfssao.scene.builtin import find_scene
from lfssao.scene.mesh import Mesh, Paint, samplers_of
from lfssao.summary import Summary, size_of

_MOST_KEPT_TEXELS = 2**24  # of depth textures

# Rays that one thread hands to Embree at a time: long enough to hide the call, short enough to share the work.
_CHUNK = 65_536

COLOR_FILTERS = ("bilinear", "nearest")
NORMALS = ("geometric", "smooth")
CASTERS = ("exact", "embree")
WRAP_CODES = {"repeat": surface.REPEAT, "mirror": surface.MIRROR, "clamp": surface.CLAMP}


@dataclass(frozen=True, eq=False, repr=False)
class GBuffer(Summary):
    """The visible surface of a view, one value a texel.

    Attributes
    ----------
    depth : (H, W) float32
        Image z (``View.depth_kind``), +infinity where there is no surface.
    positions : (H, W, 3) float32 or None
        World coordinates, +infinity where there is no surface; None where not asked for.
    color : (H, W, 3) float32 or None
        Diffuse colour, linear RGB, 0 where there is no surface; None where the mesh has none.
    triangle : (H, W) int32
        Number of the visible triangle, -1 where there is none.
    normals : (H, W, 3) float32 or None
        Unit normals in world space, turned towards the viewer, 0 where there is no surface; None where not asked for.

    Examples
    --------
    >>> textures = lfssao.render("corner", lfssao.find_display("virtual").with_resolution(64, 48))[0]
    >>> textures.gbuffer.positions.shape, textures.gbuffer.positions.dtype
    ((48, 64, 3), dtype('float32'))
    """

    depth: NDArray[np.float32]
    positions: NDArray[np.float32] | None
    color: NDArray[np.float32] | None
    triangle: NDArray[np.int32]
    normals: NDArray[np.float32] | None = None

    def _facts(self) -> dict[str, object]:
        names = [name for name in ("depth", "positions", "color", "normals") if getattr(self, name) is not None]
        surface = f"at {np.mean(self.triangle >= 0):.1%} of the texels"
        return {"texels": size_of(self.depth), "textures": " ".join(names), "surface": surface}

    def _repr_png_(self) -> bytes:
        return pictures.row_png(self.pictures())

    def pictures(self) -> list[NDArray[np.uint8]]:
        """Depth, and normals and colour where there are any, as 8-bit codes (H, W, 3)."""
        codes = [pictures.depth_codes(self.depth)]
        if self.normals is not None:
            codes.append(pictures.normal_codes(self.normals))
        if self.color is not None:
            codes.append(pictures.light_codes(self.color))
        return codes


class RayCaster:
    """A mesh ready to be ray cast from any view that shares its cast space.

    An exact float64 test of a ray and a triangle picks each ray's first hit. Candidates come from conservative
    rasterisation (``lfssao.gbuffer.rasterize``) if rays are separable and triangles cover few texels, else from a tree
    of boxes (``gbuffer.kernels.first_hit``). The textures do not depend on which of the two ran, on Embree, the
    processor or the number of threads. Embree's own tree is built when a view first asks for it.

    Parameters
    ----------
    mesh : Mesh, or an embedded scene's name, or a file's
        The scene.
    cast_from_world : (3, 4) float64
        Affine map world -> cast space (``View.cast_from_world``).
    threads : int
        How many threads trace.

    Raises
    ------
    InputError
        If the mesh leaves the range of float32 in cast space, or the map or the threads are none.

    Examples
    --------
    >>> mesh, display = lfssao.find_scene("corner"), lfssao.find_display("virtual").with_resolution(64, 48)
    >>> (view,) = lfssao.module_views(mesh, display)
    >>> lfssao.render_view(lfssao.RayCaster(mesh, view.cast_from_world), view, lfssao.Settings((0.1,))).ao[0].shape
    (48, 64)
    """

    def __init__(self, mesh: Mesh | str | Path, cast_from_world: Matrix, threads: int = 1) -> None:
        self.mesh = mesh = find_scene(mesh)
        self.bounds = mesh.bounds
        self.threads = check_threads(threads)
        cast_from_world = finite_numbers("cast_from_world", cast_from_world, 3, 4)
        vertices = transform_points(cast_from_world, mesh.vertices)
        with np.errstate(over="ignore"):  # float32 textures and Embree cannot hold what overflows: it is refused
            if not np.isfinite(vertices.astype(np.float32)).all():
                raise InputError(f"{mesh.name}: coordinates leave the range of float32 in the space rays are cast in")
        self._cast_from_world = cast_from_world
        self._tree = TriangleTree(vertices, mesh.faces)
        self._material = None if mesh.paint is None else _material(mesh.paint)

    def of_view(self, view: View) -> "RayCaster":
        """Return the caster of a view's cast space: this one, or a new one of the same mesh."""
        if np.array_equal(view.cast_from_world, self._cast_from_world):
            return self
        return RayCaster(self.mesh, view.cast_from_world, self.threads)

    def gbuffer(
        self,
        view: View,
        color: str | None = "bilinear",
        normals: str | None = None,
        rows: range | None = None,
        caster: str = "exact",
        positions: bool = True,
    ) -> GBuffer:
        """Cast one ray through the centre of each texel of a view.

        Parameters
        ----------
        view : View
            The view; its cast space must be the caster's.
        color : str or None
            How the mesh's textures are read, 'bilinear' or 'nearest'; None: no colour texture.
        normals : str or None
            'geometric' (of the triangle), or 'smooth' (interpolated from the vertices where the mesh came with normals
            there, else geometric); None: no normals texture.
        rows : range, optional
            Rows that alone are cast: no other sees anything (``lfssao.optics.view.seen_rows``). All by default.
        caster : str
            'exact', or 'embree' for the triangles that Embree finds, whose bits depend on the processor.
        positions : bool
            Whether the positions texture is made.

        Raises
        ------
        InputError
            If ``color``, ``normals`` or ``caster`` is none of these, or rows are not a part of the view's.
        MissingPackageError
            If Embree is asked for and embreex is not installed.
        """
        check_type("view", view, View)
        options = ("color", color, COLOR_FILTERS), ("normals", normals, NORMALS), ("caster", caster, CASTERS)
        for name, value, choices in options:
            if value is not None and not (isinstance(value, str) and value in choices):
                raise InputError(f"{name} is '{value!s:.40}': choose one of {', '.join(choices)}")
        rows = range(view.height) if rows is None else rows
        if not isinstance(rows, range) or not 0 <= rows.start <= rows.stop <= view.height or rows.step != 1:
            raise InputError(f"rows is {shown(rows)}, it must be a part of range({view.height})")
        part = slice(rows.start, rows.stop)
        colored = color is not None and self._material is not None
        depth = _texture(view, rows, np.inf)
        triangle = _texture(view, rows, -1, dtype=np.int32)
        places = _texture(view, rows, np.inf, 3) if positions else None
        rgb = _texture(view, rows, 0, 3) if colored else None
        directions = None if normals is None else _texture(view, rows, 0, 3)
        if rows:
            seen = triangle[part]
            mesh = self.mesh
            z = np.empty((len(rows), view.width))
            at = np.empty((0, 0, 3), np.float32) if places is None else places[part]
            rays = view.rays
            world = np.ravel(view.world_from_cast)
            smooth = normals == "smooth" and mesh.normals is not None
            weights = np.empty((*seen.shape, 2) if caster == "embree" or colored or smooth else (0, 0, 2))
            if caster == "embree":
                seen[:] = self._seen_by_embree(view, rows, 1)
            else:
                self._first_hits(view, rows, seen, z)
            if weights.size:
                surface.points_on_triangles(rays, self._tree.arrays, seen, z, weights, rows.start)
            surface.write_surface(rays, world, seen, z, depth[part], at, rows.start)
            if rgb is not None:
                surface.write_albedo(seen, weights, mesh.faces, self._material, color == "nearest", rgb[part])
            if directions is not None:
                at_vertices = np.zeros((0, 3)) if mesh.normals is None else mesh.normals
                known = surface.Surface(mesh.vertices, mesh.faces, at_vertices)
                used = weights if smooth else weights[:0]
                surface.write_normals(rays, world, seen, used, known, directions[part], rows.start)
        return GBuffer(depth=depth, positions=places, color=rgb, triangle=triangle, normals=directions)

    def first_depths(self, lines: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the first hits of n lines in cast space: t of origin + t direction, infinity for none.

        ``lines``, (n, 8) float64, are the points at t = 0 and 1, the second with the larger z, and the least
        and greatest t; t is (n,) float64.
        """
        origin = lines[:, :3]
        direction = lines[:, 3:6] - lines[:, :3]
        near, far = lines[:, 6:].T
        z = origin[:, 2]
        slope = direction[:, 2]
        across = direction[:, :2] / slope[:, None]
        ends = np.stack([z + near * slope, z + far * slope], axis=1)
        given = np.ascontiguousarray(np.hstack([origin[:, :2] - across * z[:, None], across, ends]))
        found = np.empty(len(given))
        first_hit.first_depths(given, self._tree.arrays, found)
        return np.asarray((found - z) / slope)

    def _first_hits(self, view: View, rows: range, triangle: NDArray[np.int32], z: NDArray[np.float64]) -> None:
        """Find triangle and z of each texel by the faster way; both give the same bits."""
        candidates = rasterize.candidate_pairs(view, self._tree, rows)
        if candidates is not None and candidates.pairs <= rasterize.MOST_PAIRS * triangle.size:
            rasterize.first_hits(candidates, self._tree, triangle, z)
        else:
            size = (view.width, len(rows))
            tree = self._tree.arrays
            likely = self._seen_by_embree(view, rows, first_hit.TILE, embree_installed())  # first in each tile
            first_hit.first_hits(view.rays, *size, tree, likely, triangle, z, rows.start)

    def _seen_by_embree(self, view: View, rows: range, step: int, known: bool = True) -> NDArray[np.int32]:
        """Embree's triangle in the middle of each cell of step x step texels, -1 for none and where not ``known``."""
        shape = -(-len(rows) // step), -(-view.width // step)
        if not known:
            return np.full(shape, -1, np.int32)
        require_embree()
        n = shape[0] * shape[1]
        cells = np.empty(n, np.int32)
        lengths = np.empty(n, np.float32)
        origins, directions = np.empty((2, n, 3), np.float32)
        made = cells, origins, directions, lengths
        n = make_rays(view.rays, self._tree.bounds, view.width, len(rows), step, *made, rows.start)
        seen = np.full(shape, -1, np.int32)
        seen.reshape(-1)[cells[:n]] = self._trace(origins[:n], directions[:n], lengths[:n])
        return seen

    @cached_property
    def _scene(self) -> Any:
        """Embree's scene of the mesh, its BVH built."""
        return build_scene(self._tree.vertices.astype(np.float32), self.mesh.faces)

    def _trace(
        self, origins: NDArray[np.float32], directions: NDArray[np.float32], lengths: NDArray[np.float32]
    ) -> NDArray[np.int32]:
        """Number of the first triangle along each ray, -1 where there is none."""
        hit = np.empty(len(origins), np.int32)
        scene = self._scene

        def trace(start: int, stop: int) -> None:
            part = slice(start, stop)
            # Embree writes into the lengths it is given: they are not used again.
            hit[part] = scene.run(origins[part], directions[part], lengths[part], query="INTERSECT")

        in_chunks(trace, len(origins), _CHUNK, self.threads)
        return hit


def _texture(view: View, rows: range, nothing: float, *channels: int, dtype: DTypeLike = np.float32) -> NDArray[Any]:
    """Return a texture of a view with ``nothing`` above and below some rows, anything in them."""
    texture = np.empty((view.height, view.width, *channels), dtype)
    texture[: rows.start], texture[rows.stop :] = nothing, nothing
    return texture


def _material(source: Paint) -> surface.Material:
    """Return a mesh's paint as the arrays that the kernel takes; an image of several materials is there once."""
    images = {id(t): t for t in source.textures if t is not None}
    ends = np.cumsum([0, *(t.shape[0] * t.shape[1] for t in images.values())])
    first = dict(zip(images, ends, strict=False))
    table = np.zeros((len(source.textures), 6), np.int64)
    for row, texture, (u, v, nearest) in zip(table, source.textures, samplers_of(source), strict=True):
        if texture is not None:
            size = texture.shape[1], texture.shape[0]
            row[:] = first[id(texture)], *size, WRAP_CODES[u], WRAP_CODES[v], nearest
    texels = np.concatenate([np.zeros((0, 3), np.float32), *(t.reshape(-1, 3) for t in images.values())])
    colors = np.zeros((0, 3)) if source.vertex_colors is None else source.vertex_colors
    uv = np.zeros((0, 2)) if source.uv is None else source.uv
    return surface.Material(
        factors=np.ascontiguousarray(source.factors, np.float32),
        of_face=np.ascontiguousarray(source.face_material, np.int32),
        vertex_colors=np.ascontiguousarray(colors, np.float32),
        uv=np.ascontiguousarray(uv, np.float64),
        textures=table,
        texels=np.ascontiguousarray(texels, np.float32),
    )


def textures_kept(neighbours: Sequence[Sequence[View]]) -> int:
    """Return the number of depth textures to keep for views with these neighbours, rendered in turn.

    All small textures are kept, as those of lenses are. Large ones are kept for twice a view's neighbours, and one:
    modules in a row need no more.
    """
    texels = {view.name: view.width * view.height for views in neighbours for view in views}
    return len(texels) if sum(texels.values()) <= _MOST_KEPT_TEXELS else 2 * max(map(len, neighbours)) + 1


class DepthCache:
    """Depth textures of a caster's scene, the last ``size``."""

    def __init__(self, caster: RayCaster, size: int) -> None:
        def depth(view: View, how: str) -> NDArray[np.float32]:
            rows = seen_rows(view, caster.bounds)
            return caster.of_view(view).gbuffer(view, None, rows=rows, caster=how, positions=False).depth

        self._depth = lru_cache(size)(depth)

    def neighbours(
        self, views: tuple[View, ...], caster: str = "exact"
    ) -> list[tuple[WorldToImage, NDArray[np.float32]]]:
        """Mapping and depth texture of each view; ``caster`` as of ``RayCaster.gbuffer``."""
        return [(view.world_to_image, self._depth(view, caster)) for view in views]
