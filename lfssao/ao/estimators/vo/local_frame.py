"""A view and random reflections for the kernels over the local frame, in the arithmetic's dtype."""

from typing import Any

import numpy as np

from lfssao.ao.estimators.vo.kernels.local_frame import TILE, SeenSurface
from lfssao.ao.formulas import cast_depth
from lfssao.ao.kernels.spans import CHUNK
from lfssao.ao.textures import Buffers, Texture
from lfssao.core.elementary import sincospi
from lfssao.core.philox import random_signed
from lfssao.optics.kernels.projection import MATRIX
from lfssao.samples.kernels.ball import algorithm3

# Streams of the counter-based generator: numbers of one stream never meet those of another.
_TURN, _MIRROR_1, _MIRROR_2 = 64, 65, 66


def seen_surface(buffers: Buffers) -> SeenSurface:
    """Return a view's textures and mapping as the kernels take them."""
    view, dtype, mapping = buffers.view, buffers.depth.dtype, buffers.view.world_to_image
    positions, m = np.ascontiguousarray(buffers.positions), mapping.numbers
    divisor = m[12:16] if mapping.kind == MATRIX else np.zeros(4)
    return SeenSurface(
        depth=cast_depth(buffers).ravel(),
        positions=positions.ravel(),
        directions=buffers.directions.ravel(),
        normals=(positions if buffers.normals is None else np.ascontiguousarray(buffers.normals)).ravel(),
        kind=mapping.kind,
        rows=np.concatenate([m[:8], divisor, view.cast_from_world[2]]).astype(dtype),
        lens=np.ascontiguousarray(m[12:], dtype),
        right=np.ascontiguousarray(view.world_from_cast[:, 0], dtype),
    )


def disk_mirrors(randomize: bool, seed: int, dtype: np.dtype[Any]) -> Texture:
    """Reflections of the disk, (2, TILE, CHUNK): cosine and sine of random angles for a tile; 1 and 0 for none."""
    key = np.uint64(seed)
    turns = [sincospi(random_signed(key, _TURN, k)) if randomize else (0.0, 1.0) for k in range(TILE**2)]
    return _in_tiles([(cosine, sine) for sine, cosine in turns], dtype)


def ball_mirrors(randomize: bool, seed: int, dtype: np.dtype[Any]) -> Texture:
    """Directions of the ball's reflections, (3, TILE, CHUNK): uniform on the sphere for a tile; 0 for none."""
    if not randomize:
        return _in_tiles([(0.0, 0.0, 0.0)] * TILE**2, dtype)
    key = np.uint64(seed)
    places = [(random_signed(key, _MIRROR_1, k), random_signed(key, _MIRROR_2, k)) for k in range(TILE**2)]
    return _in_tiles([algorithm3(xi1, xi2) for xi1, xi2 in places], dtype)


def _in_tiles(vectors: list[tuple[float, ...]], dtype: np.dtype[Any]) -> Texture:
    """Vectors of a tile, row by row, repeated along rows of CHUNK texels: (d, TILE, CHUNK)."""
    tile = np.array(vectors).T.reshape(-1, TILE, TILE)
    return np.ascontiguousarray(np.tile(tile, (1, 1, CHUNK // TILE)), dtype)
