"""First hits by tries: triangles on the texels that they can cover, hundreds of pairs as vectors.

Pairs are collected first, without those of a triangle that is farther than what its texel sees already. Then the edge
functions and z of each are made as hit_triangle makes them, to the bit, and the nearest are kept. Where a sign is in
doubt as it rounds, hit_triangle itself decides.
"""

import numpy as np
from numba import prange

from lfssao.kernels.coverage import block_bits
from lfssao.kernels.footprints import BAND
from lfssao.kernels.intrinsics import CHUNK, HIGH, WIDE, prefetch, scratch, trailing_zeros
from lfssao.kernels.jit import kernel
from lfssao.kernels.runs import PIECE, sees_triangle
from lfssao.kernels.triangle import DOUBTFUL, hit_triangle

# Texels of a triangle that are collected together: fewer branches.
_AT_ONCE = 4

# Lanes of the widest vectors.
_LANES = 8


@kernel(inline=True)
def _difference(a, b, c, d):
    """The number a b - c d as it rounds, and whether its sign is beyond doubt."""
    p, q = a * b, c * d
    difference = p - q
    return difference, abs(difference) > DOUBTFUL * (abs(p) + abs(q))


@kernel(inline=True)
def _try(near, ox, dx, oy, dy, ax, ay, az, bx, by, bz, cx, cy, cz):
    """What hit_triangle finds: z, infinity where it misses or z <= near, NaN where it is in doubt; two weights.

    Two edge functions of different sign are a miss, whatever the third is.
    """
    ap, aq = ax - (ox + dx * az), ay - (oy + dy * az)
    bp, bq = bx - (ox + dx * bz), by - (oy + dy * bz)
    cp, cq = cx - (ox + dx * cz), cy - (oy + dy * cz)
    u, u_sure = _difference(bp, cq, bq, cp)
    v, v_sure = _difference(cp, aq, cq, ap)
    w, w_sure = _difference(ap, bq, aq, bp)
    negative = (u_sure & (u < 0.0)) | (v_sure & (v < 0.0)) | (w_sure & (w < 0.0))
    positive = (u_sure & (u > 0.0)) | (v_sure & (v > 0.0)) | (w_sure & (w > 0.0))
    area = (u + v) + w
    z = ((u * az + v * bz) + w * cz) / area
    z = max(z, min(az, bz, cz))
    z = min(z, max(az, bz, cz))
    z = z if u_sure & v_sure & w_sure else np.nan
    return np.inf if (negative & positive) | (z <= near) else z, v / area, w / area


@kernel(inline=True)
def _clear(far, first, end, best, triangle, place, at):
    """What a band begins with: nothing seen, and pairs that can be tried, as lanes beyond the last pair are."""
    for texel in range(first, end):
        triangle[texel] = -1
    for cell in range(best.shape[0]):
        best[cell] = far
    for lane in range(CHUNK):
        place[lane], at[lane] = 0, 0


@kernel(inline=True)
def _block(members, m, across, down, top, bottom):
    """The first texel of a block of those in a band that triangle m may cover, and how many columns and rows follow."""
    first, last = np.int64(members[m, 1]), np.int64(members[m, 2])
    i, j = (first & 0xFFFF) + across, max(first >> 16, top) + down
    return i, j, (last & 0xFFFF) - i, min(last >> 16, bottom - 1) - j


@kernel(inline=True)
def _texels(members, m, top, more_columns, more_rows):
    """Which texels of that block triangle m may cover."""
    above = max(top - np.int64(members[m, 1] >> 16), 0)
    bits = np.int64(members[m, 3]) >> min(8 * above, 31)
    return bits & block_bits(min(more_columns + 1, WIDE), min(more_rows + 1, HIGH))


@kernel(inline=True)
def _next_block(left, across, down, more_columns, more_rows):
    """Where the next block begins, the same one while texels are left, and 1 where it is the next triangle's.

    With masks, of which all bits are 1 or all 0: of truth values LLVM would make branches here.
    """
    block_ends = -np.int64(left == 0)
    row_ends = block_ends & ((more_columns - WIDE) >> 63)
    triangle_ends = row_ends & ((more_rows - HIGH) >> 63)
    return (across + (block_ends & WIDE)) & ~row_ends, (down + (row_ends & HIGH)) & ~triangle_ends, -triangle_ends


@kernel(inline=True)
def _write_depth(first, end, best, triangle, depth):
    """What a band ends with: z of the texels from number ``first`` to before ``end`` that see a triangle."""
    for start in range(first, end, np.uint64(PIECE)):
        stop = min(start + np.uint64(PIECE), end)
        if sees_triangle(triangle, start, stop):
            for texel in range(start, stop):
                if triangle[texel] >= 0:
                    depth[texel] = best[texel - first]


@kernel(parallel=True)
def first_hits_by_tries(columns, rows, near, far, corners, nearest, order, members, ends, triangle, depth, weights):
    """The first triangle of every texel's ray: the smallest z, and of equal z the smallest number.

    Parameters
    ----------
    columns, rows : (2 W,) float64, (2 H,) float64
        o of the x half of each column's rays, then d; of the y half of each row's.
    near, far : float
        Where rays begin and end.
    corners, nearest, order : (9 F,) float64, (F,) float64, (F,) int64
        Corners of the triangles, the smallest z of each, and their numbers.
    members, ends : (n, 4) int32, (bands,) int64
        The triangles of each band of rows and the texels that each may cover (``sort_into_bands``); where bands end.
    triangle : (H * W,) int32
        Out: number of the triangle, -1 where there is none.
    depth : (H * W,) float64
        Out: z of the hit in cast space; untouched where there is none.
    weights : (2 H * W,) or (0,) float64
        Out: barycentric weights of the triangle's second and third corner; untouched where there is none. Empty: none
        are asked for.
    """
    width, height, bands = columns.shape[0] // 2, rows.shape[0] // 2, ends.shape[0]
    cells, weighted = BAND * width, weights.shape[0] > 0
    for band in prange(bands):
        # z of the band's texels. Where a block has none left, the one below its first column is looked at.
        best = np.empty(cells + HIGH * width)
        place, at, chosen = scratch(np.int32), scratch(np.int32), scratch(np.int32)
        z_of, b_of, c_of = scratch(np.float64), scratch(np.float64), scratch(np.float64)
        top, bottom = band * BAND, min(height, (band + 1) * BAND)
        _clear(far, top * width, bottom * width, best, triangle, place, at)
        m, end, n = np.uint64(0 if band == 0 else ends[band - 1]), np.uint64(ends[band]), np.uint64(0)
        # Of triangle m: columns and rows before the block that is looked at, and the bits of its texels that are left.
        across, down, left = np.int64(0), np.int64(0), np.int64(0)
        while m < end:
            p, (i, j, more_columns, more_rows) = members[m, 0], _block(members, m, across, down, top, bottom)
            left = left if left != 0 else _texels(members, m, top, more_columns, more_rows)
            # A pair that does not count is overwritten by the next: no branches, which nothing could foretell.
            z = nearest[np.uint64(p)]
            for _ in range(_AT_ONCE):
                k = trailing_zeros(np.uint64(left | (1 << 32)))
                column, row = i + (k & 7), j + (k >> 3)
                cell = np.uint64((row - top) * width + column)
                place[n], at[n] = p, np.int32(column | (row << 16))
                n += np.uint64((left != 0) & (not z > best[cell]))
                left &= left - 1
            prefetch(corners, np.uint64(9) * np.uint64(p))
            prefetch(corners, np.uint64(9) * np.uint64(p) + np.uint64(8))
            across, down, triangle_ends = _next_block(left, across, down, more_columns, more_rows)
            m += np.uint64(triangle_ends)
            if n <= CHUNK - _AT_ONCE and m < end:
                continue
            for lane in range((n + np.uint64(_LANES - 1)) // np.uint64(_LANES) * np.uint64(_LANES)):
                c = np.uint64(9) * np.uint64(place[lane])
                i, j = np.uint64(at[lane] & 0xFFFF), np.uint64(at[lane] >> 16)
                z_of[lane], b_of[lane], c_of[lane] = _try(
                    near, columns[i], columns[np.uint64(width) + i], rows[j], rows[np.uint64(height) + j],
                    corners[c], corners[c + np.uint64(1)], corners[c + np.uint64(2)],
                    corners[c + np.uint64(3)], corners[c + np.uint64(4)], corners[c + np.uint64(5)],
                    corners[c + np.uint64(6)], corners[c + np.uint64(7)], corners[c + np.uint64(8)],
                )  # fmt: skip
            # Those that are farther are left out first, again without branches; most that are left are the nearest.
            kept = np.uint64(0)
            for lane in range(n):
                cell = np.uint64(((at[lane] >> 16) - top) * width + (at[lane] & 0xFFFF))
                chosen[kept] = lane
                kept += np.uint64(not z_of[lane] > best[cell])
            for number in range(kept):
                lane = np.uint64(chosen[number])
                p, z = np.uint64(place[lane]), z_of[lane]
                i, j = np.int64(at[lane] & 0xFFFF), np.int64(at[lane] >> 16)
                cell, texel = np.uint64((j - top) * width + i), np.uint64(j * width + i)
                if np.isnan(z):  # in doubt
                    c = np.uint64(9) * p
                    hit, z, b_of[lane], c_of[lane] = hit_triangle(
                        columns[i], rows[j], columns[width + i], rows[height + j],
                        corners[c], corners[c + 1], corners[c + 2], corners[c + 3], corners[c + 4], corners[c + 5],
                        corners[c + 6], corners[c + 7], corners[c + 8],
                    )  # fmt: skip
                    z = z if hit and z > near else np.inf
                face = np.int32(order[p])
                if z < best[cell] or (z == best[cell] and face < triangle[texel]):
                    best[cell], triangle[texel] = z, face
                    if weighted:
                        t = np.uint64(2) * texel
                        weights[t], weights[t + np.uint64(1)] = b_of[lane], c_of[lane]
            n = np.uint64(0)
        _write_depth(np.uint64(top * width), np.uint64(bottom * width), best, triangle, depth)
