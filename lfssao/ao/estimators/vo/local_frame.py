"""A view and random reflections for the kernels over the local frame, in the arithmetic's dtype."""

from typing import Any

import numpy as np

from lfssao.ao.estimators.vo.kernels.local_frame import TILE, SeenSurface
from lfssao.ao.kernels.float_view import FloatView
from lfssao.ao.kernels.spans import CHUNK
from lfssao.ao.textures import Texture
from lfssao.core.elementary import sincospi
from lfssao.core.philox import random_signed
from lfssao.samples.kernels.ball import algorithm3

# Streams of the counter-based generator: numbers of one stream never meet those of another.
_TURN, _MIRROR_1, _MIRROR_2 = 64, 65, 66


def seen_surface(view: FloatView) -> SeenSurface:
    """Return a view that has surfaces and directions as the kernels take it."""
    return SeenSurface(
        depth=view.surfaces,
        positions=view.positions,
        directions=view.directions,
        normals=view.normals,
        kind=view.kind,
        rows=view.rows,
        lens=view.lens,
        right=view.axes[:3],
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
