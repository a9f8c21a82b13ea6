"""A triangle mesh with its diffuse colour, checked once when it is made."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import Matrix, cofactors, transform_points
from lfssao.core.arguments import as_numbers, check_whole
from lfssao.errors import InputError, check_type, shown
from lfssao.summary import Table, listed

FloatArray = NDArray[np.float64]
Sampler = tuple[str, str, bool]

WRAPS = ("repeat", "mirror", "clamp")
REPEATED: Sampler = ("repeat", "repeat", False)
CLAMPED: Sampler = ("clamp", "clamp", False)

# Positions are float32 in the textures, 1e-38 to 3.4e38; products and quotients on the way to them need room.
LARGEST = 1e30
SMALLEST = 1e-30

# Texture coordinates are cut to whole numbers of 64 bits; here float64 still tells 2^22 texels apart.
LARGEST_UV = 2.0**31


@dataclass(frozen=True, eq=False)
class Paint:
    """Diffuse colour of a mesh, linear RGB: material factor x vertex colour x texture, as in glTF.

    Attributes
    ----------
    factors : (M, 3) float32
        One factor a material, 0 to 1.
    face_material : (F,) int32
        The material of each face.
    textures : tuple of M arrays or None
        (h, w, 3) float32 linear, row 0 at v = 1; None where a material has none.
    uv : (V, 2) float64 or None
        Texture coordinates, v upwards; needed where a material has a texture.
    vertex_colors : (V, 3) float32 or None
        Linear RGB, 0 to 1.
    samplers : tuple of M tuples (str, str, bool) or None
        How a texture goes on outside of [0, 1) along u and v: "repeat", "mirror" (every other tile is turned) or
        "clamp" (the outermost texels go on); and whether it is read at the nearest texel even if a view's textures
        are read between four. None: all are repeated, and read as the view says.

    Examples
    --------
    >>> lfssao.find_scene("corner").paint.factors.shape[1]
    3
    """

    factors: NDArray[np.float32]
    face_material: NDArray[np.int32]
    textures: tuple[NDArray[np.float32] | None, ...]
    uv: FloatArray | None = None
    vertex_colors: NDArray[np.float32] | None = None
    samplers: tuple[Sampler, ...] | None = None

    @classmethod
    def from_vertex_colors(cls, colors: NDArray[np.float32], face_count: int) -> "Paint":
        """Return paint of one material with linear RGB at the vertices, (V, 3) float32; InputError if they are none."""
        check_whole("face_count", face_count, 1)
        return cls(
            factors=np.ones((1, 3), np.float32),
            face_material=np.zeros(face_count, np.int32),
            textures=(None,),
            vertex_colors=np.ascontiguousarray(as_numbers("colors", colors), np.float32),
        )


def samplers_of(paint: Paint) -> tuple[Sampler, ...]:
    """Return how the texture of each material is read, also where the paint does not say."""
    return (REPEATED,) * len(paint.textures) if paint.samplers is None else paint.samplers


@dataclass(frozen=True, eq=False, repr=False)
class Mesh(Table):
    """Triangles in world space.

    InputError if vertices are not (V, 3), not finite, beyond ``LARGEST`` or none; if a face names a vertex that does
    not exist; if no face with an area is left; if the whole mesh is smaller than ``SMALLEST``; if normals or paint do
    not fit; if an array is masked.

    Attributes
    ----------
    vertices : (V, 3) float64
        World coordinates, scene units, finite.
    faces : (F, 3) int32
        Vertex numbers; face f of this array is triangle f everywhere.
    paint : Paint or None
        Diffuse colour; None if the mesh has none.
    normals : (V, 3) float64 or None
        Normals at the vertices, of any length, if the mesh came with them.
    name : str
        Its name in messages and in the manifest.
    degenerate : int
        Number of faces without area, left out when the mesh was made.
    notes : tuple of str
        Sentences about other things that were left out when it was loaded.

    Examples
    --------
    >>> lfssao.Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])).bounds.tolist()
    [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
    """

    vertices: FloatArray
    faces: NDArray[np.int32]
    paint: Paint | None = None
    normals: FloatArray | None = None
    name: str = "mesh"
    degenerate: int = 0
    notes: tuple[str, ...] = ()

    def _facts(self) -> dict[str, object]:
        present = {"colour": self.paint is not None, "normals": self.normals is not None}
        counts = {"name": self.name, "vertices": f"{len(self.vertices):,}", "faces": f"{len(self.faces):,}"}
        words = {name: "yes" if has else "no" for name, has in present.items()}
        return {**counts, **words, "size": listed((self.bounds[1] - self.bounds[0]).tolist())}

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(as_numbers(f"{self.name}: vertices", self.vertices), np.float64)
        faces = as_numbers(f"{self.name}: faces", self.faces)
        _check(self.name, vertices, faces)
        if self.normals is not None:
            normals = as_numbers(f"{self.name}: normals", self.normals).astype(np.float64, copy=False)
            if normals.shape != vertices.shape:
                raise InputError(f"{self.name}: normals have shape {normals.shape}, expected {vertices.shape}")
            object.__setattr__(self, "normals", normals)
        if self.paint is not None:
            _check_paint(self.name, self.paint, len(vertices), faces)
        keep = _has_area(vertices, faces)
        if not keep.any():
            raise InputError(f"{self.name}: the mesh has no face with an area")
        low, high = used_bounds(vertices, faces[keep])
        size = float((high - low).max())
        if size < SMALLEST:
            raise InputError(f"{self.name}: the mesh is {size:g} scene units large, it must be at least {SMALLEST:g}")
        dropped = len(faces) - int(keep.sum())
        if dropped and self.paint is not None:
            object.__setattr__(self, "paint", replace(self.paint, face_material=self.paint.face_material[keep]))
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", np.ascontiguousarray(faces[keep], np.int32))
        object.__setattr__(self, "degenerate", self.degenerate + dropped)

    @cached_property  # a job asks 15 times: a tenth of a second of the default one's 6
    def bounds(self) -> FloatArray:
        """Smallest and largest world coordinates of the vertices that faces use, (2, 3) float64."""
        return used_bounds(self.vertices, self.faces)


def used_bounds(vertices: FloatArray, faces: NDArray[np.integer[Any]]) -> FloatArray:
    """Smallest and largest coordinates, (2, 3) float64, of the vertices (V, 3) that faces (F, 3) name."""
    used = np.zeros(len(vertices), np.bool_)
    used[faces] = True
    named = vertices if used.all() else vertices[used]
    return np.stack([named.min(axis=0), named.max(axis=0)])


def _check(name: str, vertices: FloatArray, faces: NDArray[np.int32]) -> None:
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise InputError(f"{name}: vertices have shape {vertices.shape}, expected (V, 3)")
    if faces.shape[:1] == (0,):
        raise InputError(f"{name}: the mesh has no faces")
    if faces.ndim != 2 or faces.shape[1] != 3 or not np.issubdtype(faces.dtype, np.integer):
        raise InputError(f"{name}: faces have shape {faces.shape} of {faces.dtype}, expected (F, 3) integers")
    outside = (faces < 0) | (faces >= len(vertices))
    if outside.any():
        face, corner = np.argwhere(outside)[0]
        raise InputError(
            f"{name}: face {face} names vertex {faces[face, corner]}, but there are {len(vertices)} vertices"
        )
    for good, fault in ((np.isfinite(vertices), "not finite"), (np.abs(vertices) <= LARGEST, f"beyond {LARGEST:g}")):
        if not good.all():
            number = int(np.argmin(good.all(axis=1)))
            raise InputError(f"{name}: vertex {number} is {fault}: {vertices[number].tolist()}")


def _check_paint(name: str, paint: Paint, vertices: int, faces: NDArray[np.integer[Any]]) -> None:
    """Refuse paint whose arrays do not fit the mesh or each other: kernels read them unchecked."""
    check_type(f"{name}: paint", paint, Paint)
    check_type(f"{name}: textures", paint.textures, tuple | list)
    materials = len(paint.textures)
    shapes = {
        "factors": (materials, 3),
        "face_material": (len(faces),),
        "uv": (vertices, 2),
        "vertex_colors": (vertices, 3),
    }
    for field, shape in shapes.items():
        value = getattr(paint, field)
        if value is None and field in ("uv", "vertex_colors"):
            continue
        check_type(f"{name}: {field}", value, np.ndarray)
        numbers = as_numbers(f"{name}: {field}", value)
        if numbers.shape != shape:
            raise InputError(f"{name}: {field} has shape {numbers.shape}, expected {shape}")
        if field != "uv" and not np.isfinite(numbers).all():
            raise InputError(f"{name}: {field} has a number that is not finite")
    named = paint.face_material
    if not np.issubdtype(named.dtype, np.integer) or named.min() < 0 or named.max() >= materials:
        raise InputError(f"{name}: face_material is {shown(named)}, it must be whole numbers below {materials}")
    for number, texture in enumerate(paint.textures):
        if texture is None:
            continue
        check_type(f"{name}: texture {number}", texture, np.ndarray)
        shape = as_numbers(f"{name}: texture {number}", texture).shape
        if len(shape) != 3 or shape[2] != 3 or 0 in shape or paint.uv is None:
            raise InputError(f"{name}: texture {number} has shape {shape}, expected (h, w, 3), and uv with it")
        if not (np.isfinite(texture.min()) and np.isfinite(texture.max())):
            raise InputError(f"{name}: texture {number} has a number that is not finite")
    _check_samplers(name, paint)
    painted = faces[np.array([texture is not None for texture in paint.textures])[named]]
    if paint.uv is not None and not (np.abs(paint.uv[painted].astype(np.float64)) <= LARGEST_UV).all():
        raise InputError(f"{name}: a texture coordinate is not finite, or beyond {LARGEST_UV:g}")


def _check_samplers(name: str, paint: Paint) -> None:
    samplers = samplers_of(paint)
    if not isinstance(samplers, tuple | list) or len(samplers) != len(paint.textures):
        raise InputError(
            f"{name}: samplers is {shown(samplers)}, expected one for each of {len(paint.textures)} textures"
        )
    for number, sampler in enumerate(samplers):
        if not (
            isinstance(sampler, tuple | list)
            and len(sampler) == 3
            and all(isinstance(wrap, str) and wrap in WRAPS for wrap in sampler[:2])
            and isinstance(sampler[2], bool)
        ):
            raise InputError(
                f"{name}: sampler {number} is {shown(sampler)}, expected two of {', '.join(WRAPS)} and a bool"
            )


def _has_area(vertices: FloatArray, faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Whether each face spans an area: its edges' cross product, in float64, is not zero."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    # Edges are scaled to about 1 so that tiny meshes do not lose their areas to underflow.
    edge1 = b - a
    edge2 = c - a
    size = np.maximum(np.abs(edge1).max(axis=1), np.abs(edge2).max(axis=1))
    size = np.where(size > 0, size, 1.0)[:, None]
    return np.asarray(np.cross(edge1 / size, edge2 / size).any(axis=1))


def moved(mesh: Mesh, transform: Matrix) -> Mesh:
    """A mesh moved by an affine map world -> world, (3, 4), itself by the identity; InputError as of ``Mesh``."""
    if np.array_equal(transform, np.eye(3, 4)):
        return mesh
    vertices = transform_points(transform, mesh.vertices)
    turn = np.hstack([cofactors(transform), np.zeros((3, 1))])
    normals = None if mesh.normals is None else transform_points(turn, mesh.normals)
    return Mesh(vertices, mesh.faces, mesh.paint, normals, mesh.name, mesh.degenerate, mesh.notes)
