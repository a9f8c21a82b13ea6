"""Which samples are decided for a whole tile, by interval arithmetic, one at a time; nothing here comes from lfssao."""

import math

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


@np.errstate(all="ignore")
def is_decided(depth, points, sample, m):
    """Whether a sample surely has one outcome for all points, the mapping's affine half behind them."""
    height, width = depth.shape
    z_m, z_o, u_0, v_0 = m[12:16]
    low, high = np.nanmin(points, axis=0) + sample, np.nanmax(points, axis=0) + sample
    near, far = z_m - high[2], z_m - low[2]
    below, above = low[2] - z_o, high[2] - z_o
    if not (near > 0 and below > 0):
        return False
    left, right = (u_0 + x for x in interval(low[0], high[0], near, far))
    top, bottom = (v_0 + x for x in interval(-high[1], -low[1], below, above))
    if right < 0 or left >= width or bottom < 0 or top >= height:
        return True
    if not (left >= 0 and right < width and top >= 0 and bottom < height):
        return False
    column, columns, wide = span(left, right)
    row, rows, tall = span(top, bottom)
    if wide > MOST or tall > MOST:
        return False
    least, most = cells_bounds(depth, row, rows, column, columns)
    return least >= high[2] or most < low[2]


@np.errstate(all="ignore")
def looked_up(depth, positions, offsets, m):
    """Of each tile how many samples are not decided, and whether it sees a surface: two arrays of tiles."""
    height, width = depth.shape
    shape = -(-height // TILE), -(-width // TILE)
    left, seen = np.zeros(shape, np.int64), np.zeros(shape, np.bool_)
    for j, i in np.ndindex(shape):
        tile = np.s_[j * TILE : (j + 1) * TILE, i * TILE : (i + 1) * TILE]
        seen[j, i] = (depth[tile] < np.inf).any()
        if seen[j, i]:
            there = positions[tile][depth[tile] < np.inf]
            points = np.array([[twins.affine_row(m, row, *p) for row in range(3)] for p in there])
            for offset in offsets:
                sample = np.array([twins.linear_row(m, row, *offset) for row in range(3)])
                left[j, i] += not is_decided(depth, points, sample, m)
    return left, seen
