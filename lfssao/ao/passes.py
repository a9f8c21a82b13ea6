"""The passes behind the G-buffer, each on arrays from any source (LF section 7, passes 3 to 6).

Every function checks its arguments, computes in their dtype, float32 or float64, and returns new arrays.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.kernels import blur as blur_kernels
from lfssao.ao.kernels import merge as merge_kernels
from lfssao.ao.kernels import shade as shade_kernels
from lfssao.ao.kernels import ssao
from lfssao.core.affine import Matrix
from lfssao.core.pictures import row_png, visibility_codes
from lfssao.errors import InputError
from lfssao.optics.kernels.projection import MATRIX, Projection
from lfssao.optics.view import WorldToImage

Texture = NDArray[np.floating[Any]]

# A kernel of 6 million taps, the most that memory shall hold.
MAX_SIGMA = 1e6

# Kernels count samples in 32 bits.
MOST_COUNTED = 2**31 - 1

# Numbers of the longest mapping, kind DISPLAY.
DISPLAY_NUMBERS = 44


@dataclass(frozen=True, eq=False)
class Occlusion:
    """The result of Algorithm 1 or 2.

    Attributes
    ----------
    texture : (H, W), dtype of the depth texture
        Occluded fraction of the samples, 0 to 1; 0 where there is no surface.
    outside : int
        Number of samples outside the texture or the mapping's domain (they count as not occluded).
    """

    texture: Texture
    outside: int

    def _repr_png_(self) -> bytes:
        return row_png([visibility_codes(self.texture)])


def algorithm1(
    depth: Texture,
    screen_to_world: Matrix,
    world_to_screen: Matrix,
    samples: Texture,
    radius: float,
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

    Raises
    ------
    InputError
        If a shape, a dtype or the radius is wrong.
    """
    check_texture("depth", depth, 2)
    for name, matrix in (("screen_to_world", screen_to_world), ("world_to_screen", world_to_screen)):
        if np.shape(matrix) != (4, 4):
            raise InputError(f"{name} has shape {np.shape(matrix)}, expected (4, 4)")
    offsets = _offsets(samples, radius, depth.dtype)
    depth = np.ascontiguousarray(depth)
    back, forth = (np.ascontiguousarray(np.ravel(m), depth.dtype) for m in (screen_to_world, world_to_screen))
    occlusion, outside = np.empty_like(depth), np.empty(depth.shape[0], np.int64)
    ssao.algorithm1(depth, offsets, back, Projection(MATRIX, forth), occlusion, outside)
    return Occlusion(occlusion, int(outside.sum()))


def algorithm2(
    depth: Texture,
    positions: Texture,
    world_to_image: WorldToImage,
    samples: Texture,
    radius: float,
) -> Occlusion:
    """LF Algorithm 2: occlusion of one module's texture from its depth and positions textures.

    Parameters
    ----------
    depth : (H, W) float32 or float64
        Image z, +infinity where there is no surface.
    positions : (H, W, 3), same dtype
        World coordinates of the visible surface.
    world_to_image : WorldToImage
        The module's mapping (``View.world_to_image``).
    samples : (n, 3)
        Offsets in the unit ball (``make_samples``).
    radius : float
        R, world units.

    Raises
    ------
    InputError
        If a shape, a dtype or the radius is wrong.
    """
    return algorithm2_of_radii(depth, positions, world_to_image, samples, (radius,))[0]


def algorithm2_of_radii(
    depth: Texture,
    positions: Texture,
    world_to_image: WorldToImage,
    samples: Texture,
    radii: Sequence[float],
) -> list[Occlusion]:
    """``algorithm2`` of each of several radii, with the same bits, in less time.

    Parameters
    ----------
    depth, positions, world_to_image, samples
        As for ``algorithm2``.
    radii : sequence of float
        R of each, world units, at least one.

    Raises
    ------
    InputError
        As for ``algorithm2``, or if there is no radius.
    """
    if not radii:
        raise InputError("radii: at least one is needed")
    check_texture("depth", depth, 2)
    check_texture("positions", positions, 3)
    check_fit("positions", positions, depth, 3)
    depth, positions = np.ascontiguousarray(depth), np.ascontiguousarray(positions)
    offsets = np.stack([_offsets(samples, radius, depth.dtype) for radius in radii])
    occlusion = np.empty((len(radii), *depth.shape), depth.dtype)
    outside = np.empty((len(radii), depth.shape[0]), np.int64)
    ssao.algorithm2(depth, positions, offsets, world_to_image.as_type(depth.dtype), occlusion, outside)
    return [Occlusion(texture, int(rows.sum())) for texture, rows in zip(occlusion, outside, strict=True)]


def algorithm2_with_neighbours(
    depth: Texture,
    positions: Texture,
    world_to_image: WorldToImage,
    neighbours: Sequence[tuple[WorldToImage, Texture]],
    samples: Texture,
    radius: float,
) -> Occlusion:
    """Algorithm 2 on the textures of several modules: a sample is occluded if it is behind the surface in each.

    Not in LF. A neighbour may see in the open a sample that the module's own texture hides; with no neighbours the
    result is that of ``algorithm2``, bit for bit. More neighbours never add occlusion to a sample that falls into the
    module's own texture.

    Parameters
    ----------
    depth, positions, world_to_image
        The module's own, as for ``algorithm2``.
    neighbours : sequence of (WorldToImage, (H_k, W_k) texture)
        Mapping and depth texture, of depth's dtype, of each other module.
    samples, radius
        As for ``algorithm2``.

    Raises
    ------
    InputError
        As for ``algorithm2``, or if a neighbour's depth is no texture of that dtype, or all have 2^31 texels.
    """
    from lfssao.ao.estimators.kernels.neighbours import Views, hidden_fraction  # late: compiled for this alone

    check_texture("depth", depth, 2)
    check_texture("positions", positions, 3)
    check_fit("positions", positions, depth, 3)
    views = [(world_to_image, depth), *neighbours]
    for number, (_, other) in enumerate(views):
        check_texture(f"depth of neighbour {number}", other, 2)
        if other.dtype != depth.dtype:
            raise InputError(f"depth of neighbour {number} is of {other.dtype}, expected {depth.dtype}")
    numbers = np.zeros((len(views), DISPLAY_NUMBERS), depth.dtype)
    for row, (mapping, _) in zip(numbers, views, strict=True):
        row[: len(mapping.numbers)] = mapping.as_type(depth.dtype).numbers
    sizes = np.array([(other.shape[1], other.shape[0]) for _, other in views], np.int64)
    texels = sizes[:, 0] * sizes[:, 1]
    ends = np.cumsum(texels)
    if ends[-1] >= 2**31:  # the kernel's numbers of texels are of 32 bits
        raise InputError(f"depth textures of {len(views)} modules have {ends[-1]} texels, 2^31 or more in all")
    depths = np.concatenate([other.ravel() for _, other in views])
    kinds = np.array([mapping.kind for mapping, _ in views], np.int64)
    given = np.ascontiguousarray(depth), np.ascontiguousarray(positions), _offsets(samples, radius, depth.dtype)
    occlusion, outside = np.empty_like(depth, order="C"), np.empty(len(depth), np.int64)
    hidden_fraction(*given, Views(kinds, numbers, sizes, ends - texels, depths), occlusion, outside)
    return Occlusion(occlusion, int(outside.sum()))


def merge(layers: list[Texture] | Texture) -> Texture:
    """Multi-resolution merge: the maximum over textures of several radii (LF section 6).

    Parameters
    ----------
    layers : (K, H, W), or a list of K textures (H, W)
        Occlusion, one texture a radius, K >= 1.

    Raises
    ------
    InputError
        If there is no texture, or their sizes or dtypes differ.
    """
    if len(layers) == 0 or any(np.shape(a) != np.shape(layers[0]) for a in layers):
        raise InputError("merge needs at least one texture, all of one size")
    for number, layer in enumerate(layers):
        check_texture(f"layer {number}", layer, 2)
        if layer.dtype != layers[0].dtype:
            raise InputError(f"layer {number} is of {layer.dtype}, layer 0 of {layers[0].dtype}")
    merged = np.array(layers[0])
    for layer in layers[1:]:
        merge_kernels.merge_maximum(np.ascontiguousarray(layer), merged)
    return merged


def gaussian_kernel(sigma: float) -> NDArray[np.float64]:
    """Weights of the Gaussian blur, float64, 2 ceil(3 sigma) + 1 of them; sigma in texels, 0 gives the one weight 1.

    Raises
    ------
    InputError
        If sigma is negative, above MAX_SIGMA or not a number.
    """
    if not 0 <= sigma <= MAX_SIGMA:
        raise InputError(f"blur is {sigma}, it must be a sigma between 0 and {MAX_SIGMA:g} texels")
    radius = ceil(3 * sigma)
    weights = np.ones(2 * radius + 1)
    if radius > 0:
        blur_kernels.gaussian_weights(float(sigma), radius, weights)
    return weights


def blur(occlusion: Texture, sigma: float) -> Texture:
    """Gaussian blur in two passes, horizontal then vertical (LF section 7, passes 4 and 5).

    Parameters
    ----------
    occlusion : (H, W) float32 or float64
        The texture. Texels beyond the border have the border's value.
    sigma : float
        Standard deviation, texels; the kernel reaches ceil(3 sigma) texels to each side. 0 returns a copy.

    Raises
    ------
    InputError
        If the texture is not one, or sigma is negative or not finite.
    """
    check_texture("occlusion", occlusion, 2)
    weights = gaussian_kernel(sigma).astype(occlusion.dtype)
    if len(weights) == 1:
        return occlusion.copy()
    half, blurred = np.empty(occlusion.shape, occlusion.dtype), np.empty(occlusion.shape, occlusion.dtype)
    blur_kernels.blur_horizontal(np.ascontiguousarray(occlusion), weights, half)
    blur_kernels.blur_vertical(half, weights, blurred)
    return blurred


def shade(rgb: Texture, occlusion: Texture) -> Texture:
    """Post pass: rgb (1 - occlusion) (LF sections 4 and 7).

    Parameters
    ----------
    rgb : (H, W, 3) float32 or float64
        Linear colour.
    occlusion : (H, W), same dtype
        0 to 1.

    Raises
    ------
    InputError
        If sizes or dtypes do not fit.
    """
    check_texture("rgb", rgb, 3)
    check_texture("occlusion", occlusion, 2)
    check_fit("rgb", rgb, occlusion, 3)
    return _shaded(shade_kernels.apply_occlusion, rgb, occlusion)


def shade_white(depth: Texture, occlusion: Texture) -> Texture:
    """The post pass of a scene without colour: ``shade`` of an image that is 1 on the surface and 0 elsewhere.

    Parameters
    ----------
    depth : (H, W) float32 or float64
        Image z, +infinity where there is no surface.
    occlusion : (H, W), same dtype
        0 to 1.

    Raises
    ------
    InputError
        If sizes or dtypes do not fit.
    """
    check_texture("depth", depth, 2)
    check_texture("occlusion", occlusion, 2)
    check_fit("depth", depth, occlusion)
    return _shaded(shade_kernels.apply_to_white, depth, occlusion)


def _shaded(kernel: Callable[..., None], image: Texture, occlusion: Texture) -> Texture:
    shaded = np.empty((*occlusion.shape, 3), occlusion.dtype)
    kernel(np.ascontiguousarray(image), np.ascontiguousarray(occlusion), shaded)
    return shaded


def check_radius(radius: float) -> None:
    """Refuse a radius that is not a finite number of at least 0."""
    if not 0 <= radius < np.inf:
        raise InputError(f"radius is {radius}, it must be a finite number of at least 0")


def check_fit(name: str, texture: Texture, other: Texture, *channels: int) -> None:
    """Refuse a texture whose size or dtype is not that of another one, (H, W), or with other channels."""
    shape = *other.shape, *channels
    if texture.shape != shape or texture.dtype != other.dtype:
        raise InputError(f"{name}: {texture.shape} of {texture.dtype}, expected {shape} of {other.dtype}")


def _offsets(samples: Texture, radius: float, dtype: np.dtype[Any]) -> Texture:
    """Offsets in world units: radius times samples in float64, rounded once to the dtype."""
    check_radius(radius)
    table = np.asarray(samples, np.float64)
    if table.ndim != 2 or table.shape[1] != 3 or len(table) == 0:
        raise InputError(f"samples have shape {table.shape}, expected (n, 3) with n at least 1")
    if len(table) > MOST_COUNTED:
        raise InputError(f"there are {len(table)} samples, more than {MOST_COUNTED} cannot be counted")
    if not np.isfinite(table).all():
        raise InputError("samples: a coordinate is not finite")
    return np.ascontiguousarray(radius * table, dtype)


def check_texture(name: str, texture: Texture, dimensions: int) -> None:
    """Refuse all but arrays of float32 or float64 with that many dimensions, none of them empty."""
    if not isinstance(texture, np.ndarray) or texture.dtype not in (np.float32, np.float64):
        kind = getattr(texture, "dtype", type(texture).__name__)
        raise InputError(f"{name} is of {kind}, expected an array of float32 or float64")
    if texture.ndim != dimensions or 0 in texture.shape:
        raise InputError(f"{name} has shape {texture.shape}, expected {dimensions} dimensions and no empty one")
