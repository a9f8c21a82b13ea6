"""LF Algorithm 2 of displays, Algorithm 1 of cameras, a tile of texels after the other: for many samples.

With 256 samples most have one outcome for all points of a tile, which bounds of the depths decide
(``lfssao.kernels.tile_bounds``); the others are listed, and only those are looked up, by the loops of
``lfssao.kernels.ssao``. Its arithmetic and its counts, so its bits.
"""

import numpy as np

from lfssao.kernels.intrinsics import CHUNK, scratch, scratch_rows
from lfssao.kernels.jit import kernel, wide_vectors
from lfssao.kernels.mapping import CROSSED_SLITS, DISPLAY, MATRIX, affine_row
from lfssao.kernels.runs import sees_surface
from lfssao.kernels.ssao import count_crossed_slits, count_display, count_matrix, transform_offsets
from lfssao.kernels.threads import ROWS_A_BLOCK, interleaved
from lfssao.kernels.tile_bounds import divisors_of, undecided
from lfssao.kernels.tile_images import BLOCK, bounds_of, middle_of

TILE = 8  # texels of each of the ROWS_A_BLOCK rows
_TEXELS = TILE * ROWS_A_BLOCK


@kernel(inline=True)
def _world_point(kind, back, depth, places, width, j, i):
    """World coordinates of the surface that texel (i, j) sees; x is NaN where it sees none (lines 1 to 3)."""
    texel, half = np.uint64(j * width + i), type(depth[0])(0.5)
    d = depth[texel]
    if kind == MATRIX:
        u, v = type(d)(i) + half, type(d)(j) + half
        w = affine_row(back, 3, u, v, d)
        x, y = affine_row(back, 0, u, v, d) / w, affine_row(back, 1, u, v, d) / w
        z = affine_row(back, 2, u, v, d) / w
    else:
        t = np.uint64(3) * texel
        x, y, z = places[t], places[t + np.uint64(1)], places[t + np.uint64(2)]
    return x if d < np.inf else type(d)(np.nan), y, z


@kernel
def _load_tile(kind, back, m, depth, places, width, left, right, top, bottom, a, b, c, q, count):
    """Points of a tile behind the mapping's affine half, row after row of TILE texels, NaN beyond the texture.

    Returns whether one sees a surface; without one nothing is loaded. q is 0 but for a camera.
    """
    some = False
    for j in range(top, bottom):
        some |= sees_surface(depth, np.uint64(j * width + left), np.uint64(j * width + right))
    if some:
        for i in range(_TEXELS):
            a[i], b[i], c[i], count[i] = np.nan, np.nan, np.nan, 0
            q[i] = np.nan if kind == MATRIX else 0.0
        for j in range(top, bottom):
            first = (j - top) * TILE
            for i in range(right - left):
                k = np.uint64(first + i)
                x, y, z = _world_point(kind, back, depth, places, width, j, left + i)
                a[k], b[k], c[k] = affine_row(m, 0, x, y, z), affine_row(m, 1, x, y, z), affine_row(m, 2, x, y, z)
                if kind == MATRIX:
                    q[k] = affine_row(m, 3, x, y, z)
    return some


@kernel(inline=True)
def _extent(kind, slopes, block, a, b, c, q):
    """What the images of a tile's points are bounded by (``undecided``); ``block``: number of its slopes."""
    box, unknown = bounds_of(_TEXELS, a, b, c), q[0]
    divisors = divisors_of(_TEXELS, a, b, c, q) if kind == MATRIX else (unknown, unknown)
    nothing = unknown, unknown, unknown, unknown, unknown
    return box, divisors, middle_of(_TEXELS, a, b, c, box, slopes, block) if kind == DISPLAY else nothing


@kernel(inline=True)
def _write_shares(depth, start, n, samples, first, count, occlusion):
    """Write count / samples, 0 without a surface, of the n texels from number ``start`` on, counts from ``first`` on.

    Returns how many of them see a surface.
    """
    zero, total = depth.dtype.type(0), depth.dtype.type(max(samples, 1))
    visible = np.int32(0)
    for i in range(n):
        texel = np.uint64(start + i)
        there = depth[texel] < np.inf
        share = depth.dtype.type(count[np.uint64(first + i)]) / total
        occlusion[texel] = share if there else zero
        visible = np.int32(visible + np.int32(there))
    return np.int64(visible)


@kernel
def _finish_tile(depth, width, left, right, top, bottom, samples, a, b, c, behind, inside, found, count, occlusion):
    """Add the decided samples, so many ``behind``, to each point's count, and write its share of all samples.

    Returns how many samples of the visible points are outside, where ``found`` of those not decided are not.
    """
    points = 0
    for i in range(_TEXELS):
        there = np.int32((a[i] == a[i]) & (b[i] == b[i]) & (c[i] == c[i]))
        count[i] += there * np.int32(behind)
        points += there
    visible = 0
    for j in range(top, bottom):
        visible += _write_shares(depth, j * width + left, right - left, samples, (j - top) * TILE, count, occlusion)
    return visible * samples - points * inside - found


@kernel(parallel=True)
def tile_boxes(depth, positions, m, every, boxes):
    """Boxes around the points of tiles, behind the affine half of a mapping of kind DISPLAY.

    Parameters
    ----------
    depth, positions, m
        As of ``occlusion_in_tiles``.
    every : int
        A multiple of BLOCK: of the blocks of tiles only those with a tile that ``count_decided`` looks at; BLOCK: all.
    boxes : (ceil(H / ROWS_A_BLOCK), ceil(W / TILE), 6), same dtype
        Out: least and largest x, y and z of each tile, metres; +infinity and -infinity where there are none.
    """
    height, width = depth.shape
    surface, places = depth.reshape(height * width), positions.reshape(positions.size)
    for row in interleaved(boxes.shape[0]):
        a, b, c, q, count = scratch(m.dtype), scratch(m.dtype), scratch(m.dtype), scratch(m.dtype), scratch(np.int32)
        top, bottom = row * ROWS_A_BLOCK, min(height, (row + 1) * ROWS_A_BLOCK)
        chosen = row // every % every // BLOCK  # of each so many blocks of the row
        for left in range(0, width, TILE):
            right = min(left + TILE, width)
            some = row % every < BLOCK and left // (BLOCK * TILE) % (every // BLOCK) == chosen
            if some:
                some = _load_tile(DISPLAY, m, m, surface, places, width, left, right, top, bottom, a, b, c, q, count)
            box = bounds_of(_TEXELS if some else 0, a, b, c)
            for end in range(6):
                boxes[row, left // TILE, end] = box[end]


@kernel(parallel=True)
def occlusion_in_tiles(depth, positions, offsets, kind, back, m, blocks, slopes, occlusion, outside):
    """``lfssao.kernels.ssao.algorithm2``, and for mappings of kind MATRIX ``algorithm1``.

    Parameters
    ----------
    depth, positions, offsets, kind
        As there; ``positions`` is not read for kind MATRIX.
    back : (16,), same dtype
        Algorithm 1's ``screen_to_world``; read for kind MATRIX only.
    m
        As there.
    blocks : (2, R, C), same dtype
        The depths' bounds (``bound_depths``).
    slopes : (R, C, SLOPES), same dtype
        ``lfssao.tile_slopes``; read for kind DISPLAY only.
    occlusion : (H, W), same dtype
        Out: as there.
    outside : (ceil(H / ROWS_A_BLOCK),) int64
        Out: samples of so many rows each outside the texture or the mapping's domain.
    """
    height, width = depth.shape
    surface, places = depth.reshape(height * width), positions.reshape(positions.size)
    shares, bounds = occlusion.reshape(height * width), blocks.reshape(blocks.size)
    columns, half, samples, texels = blocks.shape[2], blocks.size // 2, offsets.shape[0], _TEXELS
    module, across, near = m[12:].copy(), slopes.shape[1], slopes.reshape(slopes.size)
    image_offsets = transform_offsets(offsets, kind, m)
    by_number = image_offsets.T.copy().reshape(image_offsets.size)
    for row in interleaved(outside.shape[0]):
        wide_vectors()
        a, b, c, q = scratch(m.dtype), scratch(m.dtype), scratch(m.dtype), scratch(m.dtype)
        count, mixed = scratch(np.int32), scratch_rows(m.dtype)
        top, bottom = row * ROWS_A_BLOCK, min(height, (row + 1) * ROWS_A_BLOCK)
        outside[row] = 0
        for left in range(0, width, TILE):
            right = min(left + TILE, width)
            found = behind = inside = 0
            if _load_tile(kind, back, m, surface, places, width, left, right, top, bottom, a, b, c, q, count):
                extent = _extent(kind, near, row // BLOCK * across + left // (BLOCK * TILE), a, b, c, q)
                for first in range(0, samples, CHUNK):
                    some, hidden, known = undecided(
                        kind, m, module, width, height, columns, half, bounds, extent, samples, by_number,
                        image_offsets, first, min(samples - first, CHUNK), mixed,
                    )  # fmt: skip
                    if kind == CROSSED_SLITS:
                        found += count_crossed_slits(m, surface, width, height, texels, a, b, c, 0, some, mixed, count)
                    elif kind == DISPLAY:
                        found += count_display(module, surface, width, height, texels, a, b, c, 0, some, mixed, count)
                    else:
                        found += count_matrix(m, surface, width, height, texels, a, b, c, q, 0, some, mixed, count)
                    behind, inside = behind + hidden, inside + known
                outside[row] += _finish_tile(
                    surface, width, left, right, top, bottom, samples, a, b, c, behind, inside, found, count, shares
                )
            else:
                for j in range(top, bottom):
                    for texel in range(np.uint64(j * width + left), np.uint64(j * width + right)):
                        shares[texel] = m.dtype.type(0)


@kernel(parallel=True)
def count_decided(depth, positions, offsets, kind, back, m, blocks, slopes, every, looked_up, given):
    """How many samples ``occlusion_in_tiles`` decides, of every so many tiles of every so many of their rows.

    Parameters
    ----------
    depth, positions, offsets, kind, back, m, blocks, slopes
        As there.
    every : int
        How many.
    looked_up, given : (ceil(ceil(H / ROWS_A_BLOCK) / every),) int64
        Out: samples of tiles that are looked up, of each of those rows of tiles, and samples of all its tiles with a
        surface.
    """
    height, width = depth.shape
    surface, places = depth.reshape(height * width), positions.reshape(positions.size)
    columns, half, samples = blocks.shape[2], blocks.size // 2, offsets.shape[0]
    bounds = blocks.reshape(blocks.size)
    module, across, near = m[12:].copy(), slopes.shape[1], slopes.reshape(slopes.size)
    image_offsets = transform_offsets(offsets, kind, m)
    by_number = image_offsets.T.copy().reshape(image_offsets.size)
    for k in interleaved(given.shape[0]):
        a, b, c, q = scratch(m.dtype), scratch(m.dtype), scratch(m.dtype), scratch(m.dtype)
        count, mixed = scratch(np.int32), scratch_rows(m.dtype)
        top, bottom = k * every * ROWS_A_BLOCK, min(height, (k * every + 1) * ROWS_A_BLOCK)
        looked_up[k] = given[k] = 0
        for left in range(k % every * TILE, width, every * TILE):
            right = min(left + TILE, width)
            if _load_tile(kind, back, m, surface, places, width, left, right, top, bottom, a, b, c, q, count):
                extent = _extent(kind, near, k * every // BLOCK * across + left // (BLOCK * TILE), a, b, c, q)
                given[k] += samples
                for first in range(0, samples, CHUNK):
                    some, _, _ = undecided(
                        kind, m, module, width, height, columns, half, bounds, extent, samples, by_number,
                        image_offsets, first, min(samples - first, CHUNK), mixed,
                    )  # fmt: skip
                    looked_up[k] += some
