"""Input of all estimators, the textures of one view and its mapping, and checks of single textures."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.arguments import MOST_TEXELS, check_unmasked
from lfssao.errors import InputError, check_type, shown
from lfssao.gbuffer.caster import GBuffer
from lfssao.optics.kernels.rays import write_directions
from lfssao.optics.view import View, WorldToImage
from lfssao.samples.rotation import check_rotation, texel_turns
from lfssao.summary import Table, size_of

Texture = NDArray[np.floating[Any]]
Neighbour = tuple[WorldToImage, Texture]  # mapping and depth texture of another module


@dataclass(frozen=True, eq=False, repr=False)
class Buffers(Table):
    """The textures of one view, guard band included, and the view itself.

    Attributes
    ----------
    view : View
        A module of a display (``view.screen_to_world`` is None) or a camera.
    depth : (H, W) float32 or float64
        What the view says (``View.depth_kind``), +infinity where there is no surface.
    positions : (H, W, 3), same dtype
        World coordinates, +infinity where there is no surface.
    normals : (H, W, 3), same dtype, or None
        Unit normals in world space, towards the viewer, 0 where there is no surface; None where none were made.
    turns : (2, H, W) or (3, H, W), same dtype, or None
        Cosine and sine by which each texel's samples are turned about world z (``lfssao.samples.texel_turns``), or x, y
        and z of its noise vector (``lfssao.samples.noise_turns``); None where all texels share them.
    neighbours : tuple of (WorldToImage, (H_k, W_k) texture of the same dtype)
        Mapping and depth texture, image z, of each other module that estimator lf-neighbours asks; empty by default.

    Raises
    ------
    InputError
        If sizes or dtypes do not fit each other or the view, a number is NaN, or an array is masked.

    Examples
    --------
    >>> textures = lfssao.render("corner", lfssao.find_display("virtual").with_resolution(64, 48))[0]
    >>> lfssao.Buffers.of(textures.gbuffer, textures.view).depth.shape
    (48, 64)
    """

    view: View
    depth: Texture
    positions: Texture
    normals: Texture | None = None
    turns: Texture | None = None
    neighbours: Sequence[Neighbour] = field(default=(), kw_only=True)

    def _facts(self) -> dict[str, object]:
        names = [name for name in ("depth", "positions", "normals", "turns") if getattr(self, name) is not None]
        there = {"view": self.view.name, "texels": size_of(self.depth), "textures": " ".join(names)}
        return {**there, "neighbours": len(self.neighbours)}

    def __post_init__(self) -> None:
        check_type("view", self.view, View)
        check_texture("depth", self.depth, 2)
        if self.depth.shape != (self.view.height, self.view.width):
            raise InputError(f"depth has shape {self.depth.shape}, the view's is {(self.view.height, self.view.width)}")
        for name, texture in (("positions", self.positions), ("normals", self.normals)):
            if texture is not None:
                check_fit(name, texture, self.depth, 3)
        check_turns(self.turns, self.depth, 2 if self.turns is None or np.shape(self.turns)[:1] != (3,) else 3)
        check_neighbours(self.neighbours, self.depth)

    @classmethod
    def of(cls, gbuffer: GBuffer, view: View, neighbours: Sequence[Neighbour] = ()) -> "Buffers":
        """The textures that the ray caster made for a view; InputError if positions are not among them."""
        check_type("gbuffer", gbuffer, GBuffer)
        if gbuffer.positions is None:
            raise InputError("there are no positions, which estimators read")
        return cls(view, gbuffer.depth, gbuffer.positions, gbuffer.normals, neighbours=neighbours)

    def turned(self, rotation: str, seed: int = 0) -> "Buffers":
        """The same with the turns of a rotation (``lfssao.samples.texel_turns``, whose InputErrors it raises)."""
        check_rotation(rotation, seed)
        return replace(self, turns=texel_turns(rotation, *self.depth.shape, seed, self.depth.dtype))

    @cached_property
    def directions(self) -> Texture:
        """Unit directions in which the texels look, (H, W, 3) in depth's dtype, world space, away from the viewer."""
        out = np.empty(self.positions.shape, self.depth.dtype)
        write_directions(self.view.rays, np.ravel(self.view.world_from_cast), out)
        return out


def plain(texture: Any) -> Any:
    """The array that an object stands for, such as an ``Occlusion``; all else as it is."""
    return np.asarray(texture) if hasattr(texture, "__array__") and not isinstance(texture, np.ndarray) else texture


def check_texture(name: str, texture: Texture, dimensions: int) -> None:
    """Refuse all but arrays of float32 or float64 with that many dimensions, none of them empty, without NaN."""
    if not isinstance(texture, np.ndarray) or texture.dtype not in (np.float32, np.float64):
        kind = getattr(texture, "dtype", type(texture).__name__)
        raise InputError(f"{name} is of {kind}, expected an array of float32 or float64")
    if texture.ndim != dimensions or 0 in texture.shape:
        raise InputError(f"{name} has shape {texture.shape}, expected {dimensions} dimensions and no empty one")
    if dimensions == 2 and texture.size > MOST_TEXELS:
        raise InputError(f"{name} has {texture.size} texels, a texture has at most {MOST_TEXELS}")
    check_unmasked(name, texture)
    if np.isnan(texture.min()):  # the fastest pass in which a NaN stays
        place = np.argwhere(np.isnan(texture))[0].tolist()
        raise InputError(f"{name} is NaN at {place}, and no texture may hold a NaN")


def check_fit(name: str, texture: Texture, other: Texture, *channels: int) -> None:
    """Refuse all but a texture (``check_texture``) of another one's size, (H, W), and dtype, with these channels."""
    _check_shape(name, texture, (*other.shape, *channels), other.dtype)


def check_turns(turns: Texture | None, depth: Texture, numbers: int = 2) -> None:
    """Refuse turns whose shape is not (numbers, H, W) of the depth texture's, or whose dtype is another."""
    if turns is not None:
        _check_shape("turns", turns, (numbers, *depth.shape), depth.dtype)


def check_neighbours(neighbours: Sequence[Neighbour], depth: Texture) -> None:
    """Refuse neighbours that are not a mapping and a depth texture of the dtype of a module's own."""
    for number, neighbour in enumerate(neighbours):
        if not isinstance(neighbour, tuple | list) or len(neighbour) != 2:
            raise InputError(f"neighbour {number} is {shown(neighbour)}, it must be a mapping and a depth texture")
        check_type(f"mapping of neighbour {number}", neighbour[0], WorldToImage)
        check_texture(f"depth of neighbour {number}", neighbour[1], 2)
        if neighbour[1].dtype != depth.dtype:
            raise InputError(f"depth of neighbour {number} is of {neighbour[1].dtype}, expected {depth.dtype}")


def _check_shape(name: str, texture: Texture, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
    check_texture(name, texture, len(shape))
    if texture.shape != shape or texture.dtype != dtype:
        raise InputError(f"{name}: {texture.shape} of {texture.dtype}, expected {shape} of {dtype}")
