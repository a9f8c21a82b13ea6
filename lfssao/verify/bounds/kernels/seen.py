"""A view of balls: the texels that a place may be looked up in, and the depths of their surfaces.

The image point of a place is a box [u - e_u, u + e_u] x [v - e_v, v + e_v]. A renderer reads one of the texels that the
box touches, or none. A sample's term lies between the least and the largest that these give.
"""

from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.kernels import look_up
from lfssao.core.balls import SAFETY, UNKNOWN, Ball
from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import where_none
from lfssao.core.places import point_spot, row_of_spot
from lfssao.core.vectors import Vector
from lfssao.optics.kernels.projection import MATRIX
from lfssao.verify.bounds.kernels.images import certain, certain_vector, linear_room, project, widen

# A box of more texels than this is open without looking at them: it takes a mapping next to its singularity.
_MOST_TEXELS = 4096

IMAGE, CAST = 0, 1  # depths that places are compared with
NOTHING = np.empty((0, 0, 3), np.float32)


class Seen(NamedTuple):
    """A view and its textures, which are empty where they are not read; numbers are float32 ones, held as float64."""

    depth: Any  # (H, W) float32: image z
    positions: Any  # (H, W, 3) float32, world coordinates; empty where Algorithm 1 makes them from depth
    turns: Any  # (2, H, W) float32: cosine and sine by which each texel's samples are turned
    back: Any  # (16,): ``screen_to_world``
    kind: int  # the mapping's, apart from its numbers, as parallel kernels take no tuples of tuples
    numbers: Any  # (16,) or (44,)
    radius: float  # world units
    normals: Any = NOTHING  # (H, W, 3) float32
    directions: Any = NOTHING  # (H, W, 3) float32: viewing directions
    axis: Any = np.zeros(4)  # the last row of ``cast_from_world``
    low: Any = np.empty((0, 0))  # (H, W) float64: least and largest depth of each surface, by ``write_depths``
    high: Any = np.empty((0, 0))
    room: float = 0.0  # relative error of depth, where renderers may make image z of another


class Box(NamedTuple):
    """The texels that an image point may lie in: ``texels`` of them, ``span`` a row, from column i0 and row j0 on.

    A term of at most 1 is at least ``least`` and at most ``most`` before these texels are looked at: 0 and 0 where the
    point may lie in none, 1 and 0 else, 0 and 1 where there are too many. ``sure``: in one texel, or in none, for sure.
    """

    least: float
    most: float
    sure: bool
    texels: int
    span: int
    i0: int
    j0: int


@formula
def turn_of(seen, j, i):
    """Cosine and sine of a texel."""
    if seen.turns.shape[1] == 0:
        return 1.0, 0.0
    return np.float64(seen.turns[0, j, i]), np.float64(seen.turns[1, j, i])


@formula
def depth_of(seen, j, i):
    """A texel's depth, and how far it is off; the depth may be -infinity."""
    depth = np.float64(seen.depth[j, i])
    return depth, seen.room * abs(depth) if seen.room > 0.0 else 0.0


@formula
def texel_point(seen, j, i, by):
    """World coordinates of a texel's surface, a vector of balls: given, or made as in Algorithm 1, line 3."""
    if seen.back.shape[0] == 0:
        return certain_vector(seen.positions[j, i], by)
    depth, off = depth_of(seen, j, i)
    half = certain(0.5, by)
    place = point_spot(Vector(certain(i + 0.5, by), certain(j + 0.5, by), Ball(depth, off, half)))
    w = row_of_spot(seen.back, 3, place)
    a, b, c = row_of_spot(seen.back, 0, place), row_of_spot(seen.back, 1, place), row_of_spot(seen.back, 2, place)
    return Vector(a / w, b / w, c / w)


@formula
def box_of(seen, image):
    """The texels that an image point may lie in."""
    height, width = seen.depth.shape
    u_low, u_high = image.u.value - image.u.error, image.u.value + image.u.error
    v_low, v_high = image.v.value - image.v.error, image.v.value + image.v.error
    if not image.may or u_high < 0.0 or u_low >= width or v_high < 0.0 or v_low >= height:
        return Box(0.0, 0.0, True, 0, 1, 0, 0)
    is_near = abs(image.u.value) + image.u.error < 1e15 and abs(image.v.value) + image.v.error < 1e15
    if not (is_near and abs(image.z.value) + image.z.error < UNKNOWN):
        return Box(0.0, 1.0, False, 0, 1, 0, 0)
    must = image.must and u_low >= 0.0 and u_high < width and v_low >= 0.0 and v_high < height
    i0, i1 = np.int64(max(u_low, 0.0)), np.int64(min(u_high, width - 1.0))
    j0, j1 = np.int64(max(v_low, 0.0)), np.int64(min(v_high, height - 1.0))
    count = (i1 - i0 + 1) * (j1 - j0 + 1)
    if count > _MOST_TEXELS:
        return Box(0.0, 1.0, False, 0, 1, 0, 0)
    return Box(1.0 if must else 0.0, 0.0, must and count == 1, count, i1 - i0 + 1, i0, j0)


@formula
def texel_of(box, k):
    """Row and column of texel k of a box."""
    return box.j0 + k // box.span, box.i0 + k % box.span


@formula
def looked_up_box(look, seen, image):
    """The texels that an image point may lie in, beyond the border too where a look says what they stand for.

    Rules but CLAMP are known no further than ``look_up`` follows them. The cells of a linear look begin at the centres
    of texels; one may lie beyond the border, where the look says nothing of it, if its image point does not.
    """
    own, opened = box_of(seen, image), look.border == look_up.VALUE and look.outside == look_up.NOTHING
    if opened and (look.linear is None or own.texels == 0):
        return own
    half, (height, width) = where_none(look.linear, 0.0, 0.5), seen.depth.shape
    u_low, u_high = np.floor(image.u.value - image.u.error - half), np.floor(image.u.value + image.u.error - half)
    v_low, v_high = np.floor(image.v.value - image.v.error - half), np.floor(image.v.value + image.v.error - half)
    if not image.may:
        return Box(0.0, 0.0, True, 0, 1, 0, 0)
    if look.border in (look_up.CLAMP, look_up.VALUE):  # one texel beyond stands for all
        u_low, u_high = max(min(u_low, np.float64(width)), -2.0), max(min(u_high, np.float64(width)), -2.0)
        v_low, v_high = max(min(v_low, np.float64(height)), -2.0), max(min(v_high, np.float64(height)), -2.0)
    count = (u_high - u_low + 1.0) * (v_high - v_low + 1.0)
    near = max(abs(u_low), abs(u_high)) < look_up.FARTHEST and max(abs(v_low), abs(v_high)) < look_up.FARTHEST
    if not (near and count <= _MOST_TEXELS and abs(image.z.value) + image.z.error < UNKNOWN):
        return Box(0.0, 1.0, False, 0, 1, 0, 0)
    least = own.least if opened else 1.0 if image.must else 0.0
    span = np.int64(u_high - u_low) + 1
    return Box(least, 0.0, least == 1.0 and count == 1.0, np.int64(count), span, np.int64(u_low), np.int64(v_low))


@formula
def looked_up_texel(look, box, k, size):
    """The number of texel k of a box, or of that which stands for it; size: height and width."""
    row, column = texel_of(box, k)
    return look_up.texel_in(look, column, row, size)


@formula
def look(seen, place, by):
    """The image point of a place, the cast z that surfaces there are compared with, and the texels it may lie in."""
    image = widen(project(seen.kind, seen.numbers, place), by)
    depth = image.z
    if seen.kind == MATRIX:
        depth = row_of_spot(seen.axis, 0, place)
        depth = Ball(depth.value, depth.error * SAFETY, depth)
    return image, depth, box_of(seen, image)


@kernel(rows="seen.depth")
def write_depths(begin, stop, seen, kind, by, low, high):
    """Write the least and largest depth that a texel's surface may be compared with, (H, W) float64.

    That is the depth texture (IMAGE), or the cast z of the texel's position (CAST), which differs from the depth of a
    camera alone; infinity where there is no surface.
    """
    for j in range(begin, stop):
        for i in range(seen.depth.shape[1]):
            depth, off = depth_of(seen, j, i)
            low[j, i], high[j, i] = depth - off, depth + off
            if not depth < np.inf:
                low[j, i], high[j, i] = np.inf, np.inf
            elif kind == CAST and seen.kind == MATRIX:
                _, z, _ = look(seen, point_spot(texel_point(seen, j, i, by)), by)
                low[j, i], high[j, i] = z.value - z.error, z.value + z.error
            windows = kind != CAST and seen.kind == MATRIX and depth < np.inf and high[j, i] < np.inf
            if windows and not linear_room(seen.numbers, 8, 12, certain(high[j, i], by), by) < np.inf:
                low[j, i], high[j, i] = -np.inf, np.inf  # its distance may be any number
            if abs(depth) < 2.0**-126:  # may be flushed to zero
                low[j, i], high[j, i] = min(low[j, i], 0.0), max(high[j, i], 0.0)
