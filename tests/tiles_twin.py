"""Which samples are decided for a whole tile, by interval arithmetic, one at a time; nothing here comes from lfssao."""

import math

import display_twin
import numpy as np
import twins

CELL, MOST, LEAST = 4, 6, 3  # texels; cells a side that are looked at, at most and at least
TILE = 8


def cells_bounds(depth, row, rows, column, columns):
    """Least and largest depth of a rectangle of cells, as far as the texture goes; NaN as infinity."""
    part = depth[row * CELL : (row + rows) * CELL, column * CELL : (column + columns) * CELL]
    part = np.where(np.isnan(part), np.inf, part)
    return part.min(), part.max()


def blocks(depth):
    """Bounds of three by three cells from each cell on."""
    rows, columns = -(-depth.shape[0] // CELL), -(-depth.shape[1] // CELL)
    made = [[cells_bounds(depth, j, LEAST, i, LEAST) for i in range(columns)] for j in range(rows)]
    return np.moveaxis(np.array(made, depth.dtype), -1, 0)


def interval(low, high, near, far):
    """Bounds of a quotient of positive divisors."""
    every = [x / d for x in (low, high) for d in (near, far)]
    return min(every), max(every)


def span(low, high):
    """First cell, and how many of them; at least as many as a block has."""
    first, last = math.floor(low) // CELL, math.floor(high) // CELL
    return first, max(last - first + 1, LEAST), last - first + 1


def image_of_slits(low, high, m):
    """Bounds of u, v and z of a box of points and a sample, a flat linear display's; None where none are known."""
    z_m, z_o, u_0, v_0 = m[12:16]
    near, far = z_m - high[2], z_m - low[2]
    below, above = low[2] - z_o, high[2] - z_o
    if not (near > 0 and below > 0):
        return None
    u, v = interval(low[0], high[0], near, far), interval(-high[1], -low[1], below, above)
    return *(u_0 + x for x in u), *(v_0 + x for x in v), low[2], high[2]


def image_of_matrix(low, high, points):
    """The same of a camera's."""
    mixed = np.isnan(points).any(axis=1) & ~np.isnan(points).all(axis=1)
    if mixed.any() or not low[3] > 0:
        return None
    return sum((interval(low[k], high[k], low[3], high[3]) for k in range(3)), ())


def image_of_display(low, high, m, sample, middle):
    """The same of any display's module."""
    u, v, answer = display_twin.physical_to_image(m[12:], *(x + y for x, y in zip(middle[:3], sample, strict=True)))
    of_u, of_v = middle[3:]
    return None if answer else (u - of_u, u + of_u, v - of_v, v + of_v, low[2], high[2])


@np.errstate(all="ignore")
def is_decided(depth, points, sample, m, middle=None):
    """Whether a sample surely has one outcome for all points, the mapping's affine half behind them.

    ``middle``: ``middle_of`` them, of any display's module.
    """
    height, width = depth.shape
    low, high = np.fmin.reduce(points) + sample, np.fmax.reduce(points) + sample
    if middle is not None:
        image = image_of_display(low, high, m, sample, middle)
    else:
        image = image_of_slits(low, high, m) if len(sample) == 3 else image_of_matrix(low, high, points)
    if image is None:
        return False
    left, right, top, bottom, z_low, z_high = image
    if right < 0 or left >= width or bottom < 0 or top >= height:
        return True
    if not (left >= 0 and right < width and top >= 0 and bottom < height):
        return False
    column, columns, wide = span(left, right)
    row, rows, tall = span(top, bottom)
    if wide > MOST or tall > MOST:
        return False
    least, most = cells_bounds(depth, row, rows, column, columns)
    return least >= z_high or most < z_low


def middle_of(points, slopes):
    """A point in the middle of a tile's, and how far the images of all of them may lie from its: x, y, z, of u, of v.

    In the scalars of ``slopes``: L along x, y and the ray and e, of u and of v, and the ray's x and y for a z of 1.
    """
    half, (way_x, way_y) = slopes.dtype.type(0.5), slopes[8:]
    points = points[~np.isnan(points).all(axis=1)]
    a, b, c = points.T
    middle, off = [], []
    z = half * np.fmin.reduce(c) + half * np.fmax.reduce(c)
    for places, way in ((a, way_x), (b, way_y)):
        along = places - way * c
        low, high = np.fmin.reduce(along), np.fmax.reduce(along)
        at = (half * low + half * high) + way * z
        at = min(max(at, np.fmin.reduce(places)), np.fmax.reduce(places))
        middle.append(at)
        off.append(max((at - way * z) - low, high - (at - way * z)))
    off.append(max(z - np.fmin.reduce(c), np.fmax.reduce(c) - z))
    each = [((k[0] * off[0] + k[1] * off[1]) + k[2] * off[2]) + k[3] for k in (slopes[:4], slopes[4:8])]
    return *middle, z, *each


def unprojected(back, depth, j, i):
    """World coordinates of what a camera's texel sees."""
    half, d = depth.dtype.type(0.5), depth[j, i]
    x, y, z, w = (
        twins.affine_row(back, row, depth.dtype.type(i) + half, depth.dtype.type(j) + half, d) for row in range(4)
    )
    return x / w, y / w, z / w


def tile_points(depth, positions, m, j, i, back=None):
    """The points that a tile's texels see behind the mapping's affine half, (n, 3); (n, 4) of a camera."""
    tile = np.s_[j * TILE : (j + 1) * TILE, i * TILE : (i + 1) * TILE]
    there = np.argwhere(depth[tile] < np.inf) + np.array([j * TILE, i * TILE])
    seen_at = [positions[y, x] if back is None else unprojected(back, depth, y, x) for y, x in there]
    rows = range(3 if back is None else 4)
    return np.array([[twins.affine_row(m, row, *p) for row in rows] for p in seen_at], depth.dtype)


def tiles_of(depth):
    """How many tiles a texture has, down and across."""
    return -(-depth.shape[0] // TILE), -(-depth.shape[1] // TILE)


@np.errstate(all="ignore")
def boxes(depth, positions, m):
    """Least and largest coordinates of each tile's points, NaN left out."""
    made = np.empty((*tiles_of(depth), 3, 2), depth.dtype)
    made[...] = np.inf, -np.inf
    for place in np.ndindex(made.shape[:2]):
        points = tile_points(depth, positions, m, *place)
        if len(points):
            made[place] = np.stack([np.fmin.reduce(points), np.fmax.reduce(points)], axis=1)
    return made.reshape(*made.shape[:2], 6)


@np.errstate(all="ignore")
def looked_up(depth, positions, offsets, m, back=None, slopes=None):
    """Of each tile how many samples are not decided, and whether it sees a surface: two arrays of tiles.

    ``back``: a camera's matrix screen -> world, which its points are made by, as rows of four. ``slopes``: of blocks of
    2 x 2 tiles, of any display's module.
    """
    shape = tiles_of(depth)
    left, seen = np.zeros(shape, np.int64), np.zeros(shape, np.bool_)
    for j, i in np.ndindex(shape):
        points = tile_points(depth, positions, m, j, i, back)
        seen[j, i] = len(points) > 0
        if seen[j, i]:
            middle = None if slopes is None else middle_of(points, slopes[j // 2, i // 2])
            for offset in offsets:
                sample = np.array([twins.linear_row(m, row, *offset) for row in range(points.shape[1])])
                left[j, i] += not is_decided(depth, points, sample, m, middle)
    return left, seen
