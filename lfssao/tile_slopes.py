"""How far the images of a tile's points lie apart, of modules of any display: what decides samples for whole tiles.

The points of a tile, behind the mapping's affine half, lie in a box; with a sample's offset added, and rounded, they
lie in a box again. Between two of its points, P and C, an image coordinate changes by L . D at most, D being how far
they are apart and L bounds of the derivatives over the box, where the mapping is smooth (the mean value theorem); as
computed, by e(P) + e(C) more, the bounds of rounding. A surface that a tile sees is deep along the rays, along which
images hardly change: D is measured along x, y and a ray (r_x, r_y, 1) of the tile's, so that

    P - C = (D_x, D_y, 0) + D_z (r_x, r_y, 1),   D_z = P_z - C_z,   D_x = (P_x - r_x P_z) - (C_x - r_x C_z),   D_y alike

whatever the ray is. L and e vary little from tile to tile, and are those of the box around the points of a block of
tiles, grown by the ball of samples: derivatives by ``lfssao.display_slopes``, rounding by ``lfssao.display_rounding``,
which doubts where a comparison of the kernel's may have another answer for some point, or a number may overflow. So
where nothing is doubted every point of the box has an image, and the mapping is smooth.

The kernel rounds what it makes of D, and points with a sample added are rounded: that is added to e. ``Range`` rounds
outwards; all else is sums and products of positive numbers, whose rounding, that of the kernel too, SAFETY outweighs.
"""

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from lfssao.display_rounding import SINGLE, rounded_image
from lfssao.display_slopes import distorted_slopes, ray_ways, screen_slopes, texel_slopes
from lfssao.display_window import projected, screen_points
from lfssao.matrix import multiply
from lfssao.ranges import SAFETY, Numbers, Range

Texture = NDArray[np.floating[Any]]

# Modules with larger numbers are not reckoned with, metres and curvatures: float32 may overflow where rounding scales.
_LARGE = 2.0**20

# By how much the box around all samples is larger than computed: in shares of its largest numbers, and metres.
_ROUNDING, _FLUSHED = 2.0**-20, 2.0**-100


def tile_slopes(numbers: Texture, offsets: Texture, boxes: Texture) -> Texture:
    """Bounds of derivatives and of rounding for blocks of tiles.

    Parameters
    ----------
    numbers : (44,) float32 or float64
        The mapping, of kind DISPLAY (``lfssao.kernels.mapping``).
    offsets : (n, 3), same dtype
        The samples relative to the point, world units.
    boxes : (rows, columns, 6), same dtype
        ``lfssao.kernels.tiled_ssao.tile_boxes``.

    Returns
    -------
    (ceil(rows / BLOCK), ceil(columns / BLOCK), SLOPES), same dtype
        As ``lfssao.kernels.tile_images`` takes them: what u changes by, in texels, per metre along x, y and the ray,
        and by rounding; the same of v; r_x and r_y. NaN where they are not known.
    """
    from lfssao.kernels.tile_images import BLOCK, SLOPES  # late: compiled for many samples only

    rows, columns = (np.arange(0, n, BLOCK) for n in boxes.shape[:2])
    low, high = (
        end.reduceat(end.reduceat(boxes[..., k::2].astype(np.float64), rows, axis=0), columns, axis=1).reshape(-1, 3).T
        for k, end in enumerate((np.minimum, np.maximum))
    )
    lens, made = numbers[12:].astype(np.float64), np.full((low.shape[1], SLOPES), np.nan, numbers.dtype)
    with np.errstate(all="ignore"):  # NaN is asked for
        least, most = _ball(numbers[:12].astype(np.float64).reshape(3, 4)[:, :3], offsets.astype(np.float64))
        size = np.maximum(np.abs(low + least), np.abs(high + most)).max(axis=0)
        there = np.isfinite(size)  # not where there are no points
        if _ordinary(lens) and there.any():
            margin = _ROUNDING * size[there] + _FLUSHED
            x, y, z = map(Range, (low + least)[:, there] - margin, (high + most)[:, there] + margin)
            made[there] = _slopes(lens, x, y, z, numbers.dtype).T
    return made.reshape(len(rows), len(columns), SLOPES)


def _ball(rows: Numbers, offsets: Numbers) -> tuple[Numbers, Numbers]:
    """Least and largest x, y and z, (3, 1), of samples behind the mapping's linear part, rounded or not, and of 0."""
    moved, error = multiply(offsets, rows.T), _ROUNDING * multiply(np.abs(offsets), np.abs(rows).T)
    return (moved - error).min(axis=0, initial=0.0)[:, None], (moved + error).max(axis=0, initial=0.0)[:, None]


def _ordinary(lens: Numbers) -> bool:
    """Whether the module's numbers are those of a display: the lens behind the screen, the observers before it."""
    if not (np.isfinite(lens[:23]).all() and np.abs(lens[:8]).max() < _LARGE):
        return False
    conical_and_curved = lens[7] != 0.0 and (lens[5] != 0.0 or lens[6] != 0.0)
    return bool(lens[4] < 0.0 < lens[2] and lens[19] > 0.0 and not conical_and_curved)


def _slopes(lens: Numbers, x: Range, y: Range, z: Range, dtype: DTypeLike) -> Numbers:
    """The numbers of ``tile_slopes``, (SLOPES, n) float64, of the points between these, metres."""
    doubt = np.zeros(len(z.low), np.bool_)
    s_x, s_y = screen_points(lens, x, y, z)
    u, v = projected(lens[8:17], s_x, s_y)
    ways = [way.astype(dtype).astype(np.float64) for way in ray_ways(lens, s_x, s_y)]
    plain = screen_slopes(lens, s_x, s_y, z, (Range(ways[0], ways[0]), Range(ways[1], ways[1])))
    slopes = distorted_slopes(lens, u, v, texel_slopes(lens, s_x, s_y, u, v, plain))
    # Six roundings of a point's coordinates and of how far it is along the ray.
    aside = [n.size + np.abs(way) * z.size for n, way in zip((x, y), ways, strict=True)]
    off = [8.0 * SINGLE * size for size in (*aside, z.size)]
    sigma = x.plus(-float(lens[0])).over(z.times(-1.0).plus(float(lens[2])))
    made: list[Numbers] = []
    for place, row in zip(rounded_image(lens, sigma, x, y, z, doubt), slopes, strict=True):
        a, b, c = (slope.size for slope in row)
        made += [a, b, c, 2.0 * place.error + ((a * off[0] + b * off[1]) + c * off[2])]
    return np.stack([*(np.where(doubt, np.nan, n) * SAFETY**2 for n in made), *ways])
