"""A piece of a mesh file with one material, and how pieces become one mesh."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import cofactors, transform_points
from lfssao.errors import InputError
from lfssao.scene.mesh import REPEATED, FloatArray, Paint, Sampler

# Notes of several readers.
TOO_FEW_CORNERS = "faces of fewer than three corners are left out"
TRANSPARENT = "its colours are in part transparent: they are taken for opaque"
TWO_COLORS = "colours of its faces are left out, as its vertices have colours"
NO_COORDINATES = "an image is left out of faces that have no texture coordinates"
MULTIPLIED = "colours of its vertices multiply its image"


def _white() -> NDArray[np.float32]:
    return np.ones(3, np.float32)


@dataclass(eq=False)
class Part:
    """Triangles of a mesh file with one material; colours are linear RGB.

    vertices: (V, 3) float64. faces: (F, 3) int64. normals: (V, 3) float64. uv: (V, 2) float64, v upwards.
    vertex_colors: (V, 3) float32. factor: (3,) float32. image: (h, w, 3) float32, row 0 at v = 1. sampler: how the
    image is read (``Paint.samplers``).
    """

    vertices: FloatArray
    faces: NDArray[np.int64]
    normals: FloatArray | None = None
    uv: FloatArray | None = None
    vertex_colors: NDArray[np.float32] | None = None
    factor: NDArray[np.float32] = field(default_factory=_white)
    image: NDArray[np.float32] | None = None
    sampler: Sampler = REPEATED

    @property
    def colored(self) -> bool:
        """Whether any colour but white is given."""
        return self.image is not None or self.vertex_colors is not None or bool((self.factor != 1).any())

    def check(self, name: str) -> None:
        """Refuse (InputError) arrays that do not fit the vertices."""
        count = len(self.vertices)
        outside = (self.faces < 0) | (self.faces >= count)
        if outside.any():
            face, corner = np.argwhere(outside)[0]
            named = self.faces[face, corner]
            raise InputError(f"{name}: face {face} names vertex {named}, but there are {count} vertices")
        for what, values, width in (
            ("normals", self.normals, 3),
            ("texture coordinates", self.uv, 2),
            ("colours", self.vertex_colors, 3),
        ):
            if values is not None and values.shape != (count, width):
                raise InputError(f"{name}: its {what} have shape {values.shape}, expected {(count, width)}")
        if self.image is not None and self.uv is not None and not np.isfinite(self.uv).all():
            raise InputError(f"{name}: a texture coordinate is not finite")

    def place(self, transform: FloatArray) -> None:
        """Move vertices, and turn normals, by a (4, 4) transform; under the identity they keep their bits."""
        if np.array_equal(transform[:3], np.eye(3, 4)):
            return
        # Not by a library's own transform, which is a BLAS product: its bits differ between machines.
        self.vertices = transform_points(transform, self.vertices)
        if self.normals is not None:
            self.normals = transform_points(np.hstack([cofactors(transform), np.zeros((3, 1))]), self.normals)

    def color_faces(self, colors: NDArray[np.float32]) -> None:
        """Give each face three vertices of its own in its colour, linear RGB, (F, 3) float32."""
        if colors.shape != (len(self.faces), 3):
            raise InputError(f"there are {len(colors)} colours of faces for {len(self.faces)} triangles")
        corners = self.faces.reshape(-1)
        for name in ("vertices", "normals", "uv"):
            values = getattr(self, name)
            setattr(self, name, None if values is None else values[corners])
        self.faces = np.arange(len(corners)).reshape(-1, 3)
        self.vertex_colors = np.repeat(colors, 3, axis=0)

    def mend_normals(self) -> int:
        """Give vertices of faces whose normals are 0 or not finite unit ones of their faces; return how many."""
        if self.normals is None:
            return 0
        used = np.zeros(len(self.vertices), np.bool_)
        used[self.faces] = True
        bad = used & ~(np.isfinite(self.normals).all(axis=1) & self.normals.any(axis=1))
        if bad.any():
            faces = self.faces[bad[self.faces].any(axis=1)]
            a, b, c = (self.vertices[faces[:, k]] for k in range(3))
            sums = np.zeros_like(self.vertices)
            with np.errstate(all="ignore"):  # vertices are checked afterwards
                across = np.cross(b - a, c - a)
                for k in range(3):
                    np.add.at(sums, faces[:, k], across)
                x, y, z = sums[bad].T
                length = np.sqrt((x * x + y * y) + z * z)
                self.normals = np.where(bad[:, None], 0.0, self.normals)
                self.normals[bad] = sums[bad] / np.where(length > 0, length, 1.0)[:, None]
        return int(bad.sum())

    def flatten(self) -> None:
        """Give each face three vertices of its own with its normal, (b - a) x (c - a)."""
        corners = self.faces.reshape(-1)
        for name in ("vertices", "uv", "vertex_colors"):
            values = getattr(self, name)
            setattr(self, name, None if values is None else values[corners])
        self.faces = np.arange(len(corners)).reshape(-1, 3)
        a, b, c = (self.vertices[k::3] for k in range(3))
        with np.errstate(over="ignore", invalid="ignore"):  # vertices are checked afterwards
            self.normals = np.repeat(np.cross(b - a, c - a), 3, axis=0)


def distinct(rows: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The places of the distinct rows of (N, k) in their order by value, and the number of each row among them."""
    order = np.lexsort(rows.T[::-1])
    new = np.ones(len(rows), np.bool_)
    new[1:] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    numbers = np.empty(len(rows), np.int64)
    numbers[order] = np.cumsum(new) - 1
    return order[new], numbers


def join(parts: list[Part]) -> dict[str, Any]:
    """Return the arrays of a mesh of all parts, as ``Mesh`` takes them; some normals make parts without them flat."""
    if any(part.normals is not None for part in parts):
        for part in parts:
            if part.normals is None:
                part.flatten()
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    normals = [part.normals for part in parts if part.normals is not None]
    return {
        "vertices": np.concatenate([part.vertices for part in parts]),
        "faces": np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)]),
        "paint": _join_paint(parts),
        "normals": np.concatenate(normals) if len(normals) == len(parts) else None,
    }


def _join_paint(parts: list[Part]) -> Paint | None:
    """Return the paint of all parts, one material each; None if no part has colour."""
    if not any(part.colored for part in parts):
        return None
    uv = [np.zeros((len(p.vertices), 2)) if p.uv is None else p.uv for p in parts]
    colors = [np.ones((len(p.vertices), 3), np.float32) if p.vertex_colors is None else p.vertex_colors for p in parts]
    return Paint(
        factors=np.stack([part.factor for part in parts]),
        face_material=np.repeat(np.arange(len(parts), dtype=np.int32), [len(part.faces) for part in parts]),
        textures=tuple(part.image for part in parts),
        uv=None if all(part.uv is None for part in parts) else np.concatenate(uv),
        vertex_colors=None if all(part.vertex_colors is None for part in parts) else np.concatenate(colors),
        samplers=None if all(part.sampler == REPEATED for part in parts) else tuple(part.sampler for part in parts),
    )
