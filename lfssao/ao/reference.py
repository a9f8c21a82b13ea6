"""LF's Algorithms 1 to 4, merge, blur and shading as the paper prints them: the text to read first.

One texel and one sample at a time, in plain NumPy scalars of the depth texture's dtype. Comments number the lines of
the paper's listings. The kernels that run (``lfssao.ao.kernels``, ``lfssao.samples.kernels.ball``) give these bits.

Two readings of the paper are fixed here. A texture is read at the nearest texel. A sample that falls outside the
texture, or where the mapping is not defined, is not occluded.
"""

from collections.abc import Sequence
from math import ceil, floor, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import Matrix, sum_in_order
from lfssao.core.elementary import cbrt, exp, sincospi
from lfssao.optics.kernels.projection import MATRIX, project
from lfssao.optics.view import WorldToImage

Texture = NDArray[np.floating[Any]]
Point = tuple[float, float, float]


@np.errstate(all="ignore")
def algorithm1(
    depth: Texture,
    screen_to_world: Matrix,
    world_to_screen: Matrix,
    samples: Texture,
    radius: float,
    turns: Texture | None = None,
) -> Texture:
    """LF Algorithm 1: occlusion (H, W) of an ordinary view; arguments as of ``lfssao.algorithm1``."""
    number = depth.dtype.type
    ao = np.zeros_like(depth)
    inverse = np.asarray(screen_to_world, depth.dtype).ravel()
    mapping = WorldToImage(MATRIX, np.ravel(world_to_screen))
    for j, i in np.ndindex(depth.shape):
        if depth[j, i] < np.inf:
            x, y = number(i) + number(0.5), number(j) + number(0.5)  # 1: pntScrn.xy
            z = depth[j, i]  # 2: pntScrn.z
            *pnt, w = (affine(inverse, row, (x, y, z)) for row in range(4))
            pnt_wrld = [p / w for p in pnt]  # 3
            turn = None if turns is None else turns[:, j, i]
            ao[j, i] = occluded_fraction(depth, pnt_wrld, mapping, samples, radius, turn)  # 4 to 10
    return ao


@np.errstate(all="ignore")
def algorithm2(
    depth: Texture,
    positions: Texture,
    world_to_image: WorldToImage,
    samples: Texture,
    radius: float,
    turns: Texture | None = None,
) -> Texture:
    """LF Algorithm 2: occlusion (H, W) of one module; arguments as of ``lfssao.algorithm2``."""
    ao = np.zeros_like(depth)
    for j, i in np.ndindex(depth.shape):  # 1: pntImg.xy
        if depth[j, i] < np.inf:
            pnt_wrld = positions[j, i]  # 2
            turn = None if turns is None else turns[:, j, i]
            ao[j, i] = occluded_fraction(depth, pnt_wrld, world_to_image, samples, radius, turn)  # 3 to 9
    return ao


def occluded_fraction(
    depth: Texture, pnt_wrld: Any, mapping: WorldToImage, samples: Texture, radius: float, turn: Any = None
) -> Any:
    """Lines 3 to 9 of Algorithm 2 (4 to 10 of Algorithm 1): the fraction of samples behind the visible surface.

    World to image is an affine map and a projection. The affine map is applied to the point and to the sample's offset,
    and the two are added, so that a point is mapped once for all its samples. ``turn`` is the cosine and sine of an
    angle by which the texel's samples are turned about world z, or None: it is added to phi in line 3 of Algorithm 3.
    """
    number = depth.dtype.type
    projection = mapping.as_type(depth.dtype)
    kind, m = projection
    height, width = depth.shape
    rows = range(4 if kind == MATRIX else 3)
    pnt = [affine(m, row, pnt_wrld) for row in rows]
    ao = 0
    for offset in (radius * np.asarray(samples, np.float64)).astype(depth.dtype):  # 3, 4
        smp = [pnt[row] + turned(m, row, offset, turn) for row in rows]  # 5: smpWrld = pntWrld + offset
        u, v, z, defined = project(projection, *smp, *[number(0)] * (4 - len(smp)))  # 6: smpImg
        if defined and 0 <= u < width and 0 <= v < height:
            sur_depth = depth[floor(v), floor(u)]  # 7
            if sur_depth < z:  # 8
                ao += 1  # 9
    return number(ao) / number(len(samples))


def affine(m: Any, row: int, p: Any) -> Any:
    """One row of M (x, y, z, 1), M the rows of four of a mapping's numbers."""
    return linear(m, row, p) + m[4 * row + 3]


def linear(m: Any, row: int, p: Any) -> Any:
    """One row of M (x, y, z, 0)."""
    return (m[4 * row] * p[0] + m[4 * row + 1] * p[1]) + m[4 * row + 2] * p[2]


def turned(m: Any, row: int, p: Any, turn: Any) -> Any:
    """One row of M (x c - y s, x s + y c, z, 0), c and s the cosine and sine of ``turn``."""
    if turn is None:
        return linear(m, row, p)
    (c, s), (x, y, z), k = turn, p, 4 * row
    return (c * (m[k] * x + m[k + 1] * y) + s * (m[k + 1] * x - m[k] * y)) + m[k + 2] * z


def algorithm3(xi1: float, xi2: float) -> Point:
    """LF Algorithm 3: a point of the unit sphere from xi_1 and xi_2 in [-1, 1]."""
    z = xi1  # 2
    sine, cosine = sincospi(xi2)  # 3: phi = pi xi_2
    r = sqrt(max(1.0 - z * z, 0.0))  # 4
    return r * cosine, r * sine, z  # 5, 6


def algorithm4(point: Point, t: float, r_min: float, r_max: float) -> Point:
    """LF Algorithm 4: a point of the sphere moved into the shell r_min <= r <= r_max; t is uniform on [0, 1].

    The cubes are those of radii over r_max, so that no radius overflows.
    """
    if r_max == 0.0:
        return 0.0, 0.0, 0.0
    x, y, z = point  # 1, 2
    inner = r_min / r_max
    cube = inner * inner * inner
    r = cbrt(cube + t * (1.0 - cube)) * r_max  # 3, 4
    r = min(max(r, r_min), r_max)
    return r * x, r * y, r * z  # 5


def merge(layers: Sequence[Texture]) -> Texture:
    """Section 6: the maximum over the textures of several radii."""
    merged = layers[0].copy()
    for layer in layers[1:]:
        for texel in np.ndindex(merged.shape):
            merged[texel] = max(merged[texel], layer[texel])
    return merged


def blur(ao: Texture, sigma: float) -> Texture:
    """Passes 4 and 5: a horizontal and then a vertical Gaussian blur; the border's texels continue beyond it.

    Weights are rounded to fixed point, and the centre takes the rest: their sum is 1, and covered regions stay 1.
    """
    quantum = np.finfo(ao.dtype).epsneg  # 2^-24 in float32, 2^-53 in float64
    weights = np.rint(gaussian_weights(sigma) / quantum) * quantum
    centre = len(weights) // 2
    weights[centre] = 1 - 2 * sum(weights[:centre])
    weights = weights.astype(ao.dtype)
    return convolve_rows(convolve_rows(ao, weights).T, weights).T


def gaussian_weights(sigma: float, radius: int | None = None) -> NDArray[np.float64]:
    """Weights of taps up to ``radius``, by default 3 sigma, to each side, over their sum.

    The quotient k / sigma is squared, not its parts, so that no sigma overflows.
    """
    radius = ceil(3 * sigma) if radius is None else radius
    if radius == 0:
        return np.ones(1)
    weights = [exp(-0.5 * ((k / sigma) * (k / sigma))) for k in range(-radius, radius + 1)]
    return np.array(weights) / sum_in_order(weights)


def convolve_rows(source: Texture, weights: Texture) -> Texture:
    """Each texel as the weighted sum of its row's texels around it, added from left to right."""
    width = source.shape[1]
    radius = len(weights) // 2
    target = np.zeros_like(source)
    for j, i in np.ndindex(source.shape):
        for k, weight in enumerate(weights):
            column = min(max(i + k - radius, 0), width - 1)
            target[j, i] += weight * source[j, column]
    return target


def shade(rgb: Texture, ao: Texture) -> Texture:
    """Section 4 and the last pass: each channel multiplied by 1 - ao."""
    return rgb * (ao.dtype.type(1) - ao)[..., None]


def lit(rgb: Texture, ao: Texture, normals: Texture, unit: Point, ambient: float, on_all: bool) -> Texture:
    """The last pass with a ``Light``, of a unit vector towards it; ``on_all``: whether AO is on all."""
    x, y, z, share, one = np.array([*unit, ambient, 1]).astype(ao.dtype)
    cosine = (normals[..., 0] * x + normals[..., 1] * y) + normals[..., 2] * z
    direct = (one - share) * np.where(cosine < 0, 0 * one, cosine)
    factor = (share + direct) * (one - ao) if on_all else share * (one - ao) + direct
    shaded: Texture = rgb * factor[..., None]
    return shaded
