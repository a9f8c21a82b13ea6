"""LF's algorithms with samples of whole tiles decided by bounds of the depths, where that is found to save time."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.kernels.mapping import DISPLAY, MATRIX
from lfssao.kernels.threads import ROWS_A_BLOCK

Texture = NDArray[np.floating[Any]]

# By measurement, in one thread: the bounds of a view's depths take what one or two samples of all its texels take, and
# asking in one tile of _EVERY^2 some thousandths. In a tile a decided sample costs an eighth of its look-ups, any other
# a quarter more than in long rows; with few samples the tile itself costs more than they do.
# Of kind DISPLAY there are slopes to be found first, 5 to 10 ms for the tiles that are asked: 3 % of as many look-ups.
LEAST_SAMPLES = 128
LEAST_OF_ALL = 96
LEAST_LOOKED_UP = 50_000_000
_LEAST_DECIDED = 1 / 3
_EVERY = 8


def worth_asking(kind: int, seen: int, texels: int, samples: int, radii: int) -> bool:
    """Whether there is so much to look up that asking what can be decided is next to nothing, 3 % at most.

    Parameters
    ----------
    kind : int
        Of the mapping world -> image.
    seen, texels : int
        How many texels see a surface, and how many there are.
    samples, radii : int
        Samples of each that does, of one radius, and how many radii are sampled.
    """
    if samples < LEAST_SAMPLES:
        return False
    return seen * samples >= LEAST_LOOKED_UP if kind == DISPLAY else seen * samples * radii >= LEAST_OF_ALL * texels


def occlusion_in_tiles(
    depth: Texture,
    surface: Texture,
    offsets: Texture,
    kind: int,
    numbers: Texture,
    bounds: Texture,
) -> tuple[Texture, int] | None:
    """Algorithm 1 or 2 in tiles, bit for bit; None where too few samples would be decided.

    Parameters
    ----------
    depth : (H, W) float32 or float64
        Image z, +infinity where there is no surface.
    surface : (H, W, 3) or (16,), same dtype
        World coordinates of the visible surface; for a camera rows of the matrix screen -> world.
    offsets : (n, 3), same dtype
        The samples relative to the point, world units.
    kind, numbers : int, (16,) or (44,), same dtype
        The mapping world -> image; of kind MATRIX a camera's.
    bounds : (2, R, C), same dtype
        ``depth_bounds``.

    Returns
    -------
    occlusion : (H, W), same dtype
        Occluded samples / n.
    outside : int
        Samples outside the texture or the mapping's domain.

    Raises
    ------
    InputError
        If the bounds are not of such a texture.
    """
    from lfssao.kernels import tiled_ssao  # late: compiled for many samples only
    from lfssao.kernels.tile_images import BLOCK

    if bounds.shape != (2, *_blocks_of(depth)) or bounds.dtype != depth.dtype:
        raise InputError(
            f"bounds are {bounds.shape} of {bounds.dtype}, expected {(2, *_blocks_of(depth))} of {depth.dtype}"
        )
    tiles = -(-depth.shape[0] // ROWS_A_BLOCK)
    looked_up, given = np.empty((2, -(-tiles // _EVERY)), np.int64)
    positions = np.empty((0, 0, 3), depth.dtype) if kind == MATRIX else surface
    back = surface if kind == MATRIX else np.empty(0, depth.dtype)
    asked = depth, positions, offsets, kind, back, numbers, bounds
    tiled_ssao.count_decided(*asked, _slopes(*asked[:4], numbers, _EVERY), _EVERY, looked_up, given)
    if looked_up.sum() >= (1 - _LEAST_DECIDED) * given.sum():  # or no tile that was asked sees a surface
        return None
    slopes = _slopes(*asked[:4], numbers, BLOCK)
    occlusion, outside = np.empty_like(depth), np.empty(tiles, np.int64)
    tiled_ssao.occlusion_in_tiles(*asked, slopes, occlusion, outside)
    return occlusion, int(outside.sum())


def depth_bounds(depth: Texture) -> Texture:
    """Least and largest depth of the blocks of ``lfssao.kernels.tile_bounds``, (2, rows, columns).

    Parameters
    ----------
    depth : (H, W) float32 or float64
        Image z, +infinity where there is no surface.
    """
    from lfssao.kernels.tile_bounds import BLOCK, bound_depths  # late: as above

    rows, columns = _blocks_of(depth)
    cells = np.full((2, rows + BLOCK - 1, columns + BLOCK - 1), np.inf, depth.dtype)
    cells[1] = -np.inf
    blocks = np.empty((2, rows, columns), depth.dtype)
    bound_depths(depth, cells, blocks)
    return blocks


def _slopes(depth: Texture, positions: Texture, offsets: Texture, kind: int, numbers: Texture, every: int) -> Texture:
    """``tile_slopes`` of the tiles that ``tile_boxes`` takes; only kind DISPLAY has any."""
    from lfssao.kernels.tiled_ssao import TILE, tile_boxes  # late: as above
    from lfssao.tile_slopes import tile_slopes

    if kind != DISPLAY:
        return np.empty((0, 0, 0), depth.dtype)
    height, width = depth.shape
    boxes = np.empty((-(-height // ROWS_A_BLOCK), -(-width // TILE), 6), depth.dtype)
    tile_boxes(depth, positions, numbers, every, boxes)
    return tile_slopes(numbers, offsets, boxes)


def _blocks_of(depth: Texture) -> tuple[int, int]:
    from lfssao.kernels.tile_bounds import CELL  # late: as above

    height, width = depth.shape
    return -(-height // CELL), -(-width // CELL)
