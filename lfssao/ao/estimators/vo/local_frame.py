"""The frame of a texel's viewing direction, and random reflections of it (VO sections 4.1, 4.4 and 4.5).

Estimators that integrate over a ball along the line of sight share this. P is a texel's point, w the unit direction in
which the texel looks (away from the viewer), R the radius. A place in the ball is

    P + R (x e + y f + t w),   e, f, w orthonormal, x, y, t in the unit ball's coordinates

e is the view's rightward direction made orthogonal to w, f = w x e (down, where the world is not mirrored). Both are
then reflected in the disk's plane about a direction that differs from texel to texel (VO section 4.5):

    e' = c e + s f,  f' = s e - c f,  (c, s) = (cos, sin) of twice the angle of that direction from e

Places that turn by an angle of cosine C and sine S before that have c C + s S in place of c and s C - c S of s.

Depth is z of cast space (``optics.kernels.rays``), affine in world space: physical z of a display, eye z of a camera.
The surface that texel Q shows is met by the line P + R (x e + y f) + t R w at

    t = (z_Q - z_S) / (R w_z),   S = P + R (x e + y f), Q the texel that S lands in, w_z the z component of w

which takes one look-up. It is exact in parallel projection and for surfaces at constant z; elsewhere it takes the ray
of Q to be parallel to that of P. It is VO's d_r, depth 'mapped into the unit sphere's coordinate system'.
"""

from typing import Any

import numpy as np

from lfssao.ao.kernels.spans import CHUNK
from lfssao.ao.textures import Texture
from lfssao.core.elementary import sincospi
from lfssao.core.jit import formula
from lfssao.core.numbers import larger, rounded, select, smaller
from lfssao.core.philox import random_signed
from lfssao.core.quotients import divided, over
from lfssao.core.vectors import cross, dot
from lfssao.samples.kernels.ball import algorithm3

TILE = 4  # texels; the random reflections repeat in squares of 4 x 4 (Mittring 2007); divides CHUNK

# A normal this near to edge-on, or turned away from the viewer, counts as this near: the plane's slope stays finite.
EDGE_ON = 2.0**-20

# Streams of the counter-based generator: numbers of one stream never meet those of another.
_TURN, _MIRROR_1, _MIRROR_2 = 64, 65, 66


@formula
def disk_frame(view: Any, texel: Any, radius: Any, mirrors: Any) -> Any:
    """Return the images of P, R e' and R f', R w_z and what is one over it, and the slopes of the tangent plane.

    mirrors: (2, TILE, ..), cosines and sines. The plane is n . (x e' + y f' + t w) = 0, t = x slope_e + y slope_f.
    """
    w, right = view.direction(texel), view.rightward()
    a = right - dot(right, w) * w
    a = (1 / np.sqrt(dot(a, a))) * a
    b, (cosine, sine) = cross(w, a), view.turn(texel)
    row, column = view.row(texel) % TILE, view.column(texel) % TILE
    # Renderers may turn lines before they make vectors of them: the terms of e and f are rounded 4 times more.
    c, s = rounded(mirrors[0, row, column], 4, cosine), rounded(mirrors[1, row, column], 4, cosine)
    c, s = c * cosine + s * sine, s * cosine - c * sine
    e, f, n = c * a + s * b, s * a - c * b, view.normal(texel)
    deep = radius * view.depth_along(w)
    towards = larger(EDGE_ON, -dot(n, w))
    slopes = over(dot(n, e), towards), over(dot(n, f), towards)
    images = view.at(view.position(texel)), radius * view.along(e), radius * view.along(f)
    return images, deep, 1 / deep, slopes


@formula
def line_end(slopes: Any, x: Any, y: Any, half: Any, tangent: Any) -> Any:
    """Return the end of the line at (x, y) of the disk: half, or the tangent plane where that is nearer."""
    slope_e, slope_f = slopes
    return select(tangent, smaller(half, divided(x * slope_e + y * slope_f)), half)


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
