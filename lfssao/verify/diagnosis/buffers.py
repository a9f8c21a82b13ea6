"""Changed textures and views of the estimators' buffers."""

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.textures import Buffers, Texture
from lfssao.core.affine import transform_points
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX
from lfssao.optics.view import View, WorldToImage
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.bounds.depth import displaced


def changed_turns(buffers: Buffers, change: Callable[[Any], Any]) -> Any:
    """The turns after a change; None without turns."""
    return None if buffers.turns is None else change(buffers.turns)


def with_far_texels(buffers: Buffers, other: Texture) -> Texture:
    """Depth of another view; texels without a surface are far away if the own depth shows one."""
    view = buffers.view
    farthest = np.finfo(other.dtype).max if view.screen_to_world is None or view.linear else 1.0
    return np.where(np.isinf(other) & np.isfinite(buffers.depth), other.dtype.type(farthest), other)


def view_axes(view: View) -> FloatArray:
    """Unit vectors to the right, up and towards the viewer, (3, 3), in world space."""
    axes = view.world_from_cast[:, :3].T * [[1], [1], [-1]]
    return np.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True))


def unturned(buffers: Buffers) -> Any:
    """Turns by an angle of 0: None, or noise with its third component alone."""
    turns = buffers.turns
    if turns is None or len(turns) == 2:
        return None
    return np.stack([np.ones_like(turns[2]), np.zeros_like(turns[2]), turns[2]])


def remake_buffers(buffers: Buffers, makers: tuple[tuple[str, Callable[[Buffers], Any]], ...]) -> Buffers:
    """The buffers with textures by functions of the buffers, each with the texture's name."""
    textures = {name: make(buffers) for name, make in makers}
    single: dict[str, Any] = {
        n: None if t is None else np.ascontiguousarray(t, buffers.depth.dtype) for n, t in textures.items()
    }
    return replace(buffers, **single)


def with_view(buffers: Buffers, view: View) -> Buffers:
    """The same textures of another view of their size, not checked again: that would take longer than a trial."""
    other = copy(buffers)
    other.__dict__.pop("directions", None)
    other.__dict__.update(view=view)
    return other


def padded_buffers(buffers: Buffers, guard: int, border: str) -> Buffers:
    """Textures with texels beyond the border, by a rule of ``INSIDE``."""
    mode = {"clamp": "edge", "mirror": "symmetric", "wrap": "wrap"}.get(border, "reflect")

    def padded(texture: Texture | None, first: int = 0) -> Any:
        if texture is None:
            return None
        widths = [(guard * (k in (first, first + 1)),) * 2 for k in range(texture.ndim)]
        return np.ascontiguousarray(np.pad(texture, widths, mode=mode))  # type: ignore[call-overload]

    textures = padded(buffers.depth), padded(buffers.positions), padded(buffers.normals), padded(buffers.turns, 1)
    return Buffers(_widened_view(buffers.view, guard), *textures, neighbours=buffers.neighbours)


def _widened_view(view: View, guard: int) -> View:
    """The view with ``guard`` more texels on each side."""
    return replace(shifted_view(view, guard), width=view.width + 2 * guard, height=view.height + 2 * guard)


def physical_positions(buffers: Buffers) -> FloatArray:
    """Positions in cast space, a display's physical space; infinite without a surface."""
    with np.errstate(all="ignore"):
        points = buffers.positions.reshape(-1, 3).astype(np.float64)
        physical = transform_points(buffers.view.cast_from_world, points)
    return np.where(np.isnan(physical), np.inf, physical).reshape(buffers.positions.shape)


def shifted_view(view: View, texels: float) -> View:
    """The view with its image shifted by ``texels`` to the right and down."""
    shifted = displaced(view, -texels, -texels)
    numbers = view.world_to_image.numbers.copy()
    inverse = view.screen_to_world
    if view.rays.kind == CROSSED_SLITS:
        numbers[14:16] += texels
    elif view.rays.kind == MATRIX:
        numbers[0:8] += texels * np.tile(numbers[12:16], 2)
        assert inverse is not None
        inverse = np.column_stack([inverse[:, :3], inverse[:, 3] - texels * (inverse[:, 0] + inverse[:, 1])])
    else:
        numbers[12:] = shifted.lens
        for row in (0, 3):
            numbers[20 + row : 23 + row] += texels * numbers[26:29]
    return replace(shifted, world_to_image=WorldToImage(view.rays.kind, numbers), screen_to_world=inverse)


def face_normals(buffers: Buffers) -> NDArray[Any]:
    """Unit normals from differences of neighbouring positions, towards the viewer; 0 without a surface."""
    with np.errstate(all="ignore"):
        down, across = (np.gradient(buffers.positions.astype(np.float64), axis=axis) for axis in (0, 1))
        normal = np.cross(down, across)
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        normal *= -np.sign(np.einsum("ijk,ijk->ij", normal, buffers.directions))[..., None]
    return np.where(np.isfinite(normal), normal, 0).astype(buffers.depth.dtype)
