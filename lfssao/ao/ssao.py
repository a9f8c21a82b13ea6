"""Algorithms 1 and 2 on arrays from any source, in their dtype, float32 or float64 (LF section 7, pass 3)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lfssao.ao.kernels import ssao
from lfssao.ao.textures import Texture, check_fit, check_texture, check_turns
from lfssao.core.affine import Matrix
from lfssao.core.arguments import as_number, as_numbers
from lfssao.errors import InputError, check_type, shown
from lfssao.files.pictures import row_png, visibility_codes
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import WorldToImage, finite_numbers
from lfssao.summary import Arrayed, Summary, size_of

# Kernels count samples in 32 bits.
MOST_COUNTED = 2**31 - 1


@dataclass(frozen=True, eq=False, repr=False)
class Occlusion(Arrayed, Summary):
    """The result of Algorithm 1 or 2; NumPy takes it for its texture.

    Attributes
    ----------
    texture : (H, W), dtype of the depth texture
        Occluded fraction of the samples, 0 to 1; 0 where there is no surface.
    outside : int
        Number of samples outside the texture or the mapping's domain (they count as not occluded).

    Examples
    --------
    >>> depth, M = np.ones((2, 2), np.float32), np.eye(4)
    >>> lfssao.algorithm1(depth, M, M, np.array([[0.0, 0.0, 0.5]]), radius=1.0).texture.tolist()
    [[1.0, 1.0], [1.0, 1.0]]
    """

    texture: Texture
    outside: int

    def _array(self) -> Texture:
        return self.texture

    def _facts(self) -> dict[str, object]:
        return {"texels": size_of(self.texture), "mean": f"{self.texture.mean():.3g}", "outside": self.outside}

    def _repr_png_(self) -> bytes:
        return row_png([visibility_codes(self.texture)])


def run_kernel(kernel: Callable[..., None], depth: Texture, *arguments: Any) -> Occlusion:
    """Return occlusion, (H, W) as depth, and samples outside, which a kernel writes into its last two arguments."""
    occlusion = np.empty_like(depth, order="C")
    outside = np.empty(depth.shape[0], np.int64)
    kernel(*arguments, occlusion, outside)
    return Occlusion(occlusion, int(outside.sum()))


def algorithm1(
    depth: Texture,
    screen_to_world: Matrix,
    world_to_screen: Matrix,
    samples: Texture,
    radius: float,
    turns: Texture | None = None,
) -> Occlusion:
    """LF Algorithm 1: occlusion of an ordinary view from its depth texture and two matrices.

    Parameters
    ----------
    depth : (H, W) float32 or float64
        Screen space z, +infinity where there is no surface.
    screen_to_world, world_to_screen : (4, 4)
        The matrices; screen x right and y down in texels, z growing away from the viewer.
    samples : (n, 3)
        Offsets in the unit ball (``make_samples``).
    radius : float
        R, world units.
    turns : (2, H, W), same dtype, optional
        Cosine and sine by which each texel's samples are turned about world z (``texel_turns``); else none are.

    Raises
    ------
    InputError
        If a shape, a dtype or the radius is wrong, a number of a texture is NaN, or an array is masked.

    Examples
    --------
    >>> depth, M = np.full((2, 2), 0.5, np.float32), np.eye(4)
    >>> samples = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, -0.5]])
    >>> lfssao.algorithm1(depth, M, M, samples, radius=0.1).texture.tolist()
    [[0.5, 0.5], [0.5, 0.5]]
    """
    check_texture("depth", depth, 2)
    check_turns(turns, depth)
    back = finite_numbers("screen_to_world", screen_to_world, 4, 4)
    mapping = WorldToImage(MATRIX, finite_numbers("world_to_screen", world_to_screen, 4, 4).ravel())
    return algorithm2_of_radii(depth, unprojected(depth, back), mapping, samples, (radius,), turns)[0]


def unprojected(depth: Texture, screen_to_world: Matrix) -> Texture:
    """World positions, (H, W, 3), of a depth texture's points, for Algorithm 1; anything where there is no surface."""
    positions = np.empty((*depth.shape, 3), depth.dtype)
    ssao.unproject(np.ascontiguousarray(depth), np.ascontiguousarray(np.ravel(screen_to_world), depth.dtype), positions)
    return positions


def algorithm2(
    depth: Texture,
    positions: Texture,
    world_to_image: WorldToImage,
    samples: Texture,
    radius: float,
    turns: Texture | None = None,
) -> Occlusion:
    """LF Algorithm 2: occlusion of one module's texture from its depth and positions textures.

    Depth is image z, +infinity where there is no surface, and positions are the surface's world coordinates, (H, W, 3)
    of depth's dtype; the mapping is the module's (``View.world_to_image``). Samples, radius, turns and errors are those
    of ``algorithm1``.

    >>> textures = lfssao.render("corner", lfssao.find_display("virtual").with_resolution(64, 48))[0]
    >>> g, samples = textures.gbuffer, lfssao.make_samples("latin", 8)
    >>> lfssao.algorithm2(g.depth, g.positions, textures.view.world_to_image, samples, radius=0.1).texture.shape
    (48, 64)
    """
    check_type("world_to_image", world_to_image, WorldToImage)
    check_texture("depth", depth, 2)
    check_fit("positions", positions, depth, 3)
    check_turns(turns, depth)
    return algorithm2_of_radii(depth, positions, world_to_image, samples, (radius,), turns)[0]


def algorithm2_of_radii(
    depth: Texture,
    positions: Texture,
    world_to_image: WorldToImage,
    samples: Texture,
    radii: Sequence[float],
    turns: Texture | None = None,
) -> list[Occlusion]:
    """``algorithm2`` of each of several radii, at least one, with the same bits, in less time.

    The textures and the mapping have been checked.
    """
    depth = np.ascontiguousarray(depth)
    positions = np.ascontiguousarray(positions)
    turns = turns if turns is None else np.ascontiguousarray(turns)
    offsets = np.stack([scaled_offsets(samples, radius, depth.dtype) for radius in radii])
    occlusion = np.empty((len(radii), *depth.shape), depth.dtype)
    outside = np.empty((len(radii), depth.shape[0]), np.int64)
    ssao.algorithm2(depth, positions, offsets, world_to_image.as_type(depth.dtype), turns, occlusion, outside)
    return [Occlusion(texture, int(rows.sum())) for texture, rows in zip(occlusion, outside, strict=True)]


def check_radius(radius: float) -> None:
    """Refuse a radius that is not a finite number of at least 0."""
    if not 0 <= as_number(radius) < np.inf:
        raise InputError(f"radius is {shown(radius)}, it must be a finite number of at least 0")


def scaled_offsets(samples: Texture, radius: float, dtype: np.dtype[Any]) -> Texture:
    """Offsets in world units: radius times samples in float64, rounded once to the dtype."""
    check_radius(radius)
    table = as_numbers("samples", samples).astype(np.float64, copy=False)
    if table.ndim != 2 or table.shape[1] != 3 or len(table) == 0:
        raise InputError(f"samples have shape {table.shape}, expected (n, 3) with n at least 1")
    if len(table) > MOST_COUNTED:
        raise InputError(f"there are {len(table)} samples, more than {MOST_COUNTED} cannot be counted")
    if not np.isfinite(table).all():
        raise InputError("samples: a coordinate is not finite")
    return np.ascontiguousarray(radius * table, dtype)
