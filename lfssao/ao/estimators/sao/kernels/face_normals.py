"""Face normals rebuilt from positions (SAO section 2.3, equation 4), for cameras and modules.

Rows of texels are the inner loops, without branches, so that LLVM makes vectors of them. They go through blocks of rows
in chunks: a chunk of a row is taken apart once, one array a coordinate, and read by three rows' normals.
"""

from math import sqrt

import numpy as np
from numba import prange

from lfssao.ao.estimators.sao.kernels.reconstruct import SEPARABLE
from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import linear_row

CHUNK = 256
ROWS_A_BLOCK = 32

PITCH = CHUNK + 2  # a coordinate of a chunk with the texel before and the texel after it
_ROW = 4 * PITCH  # z, then x, y and z of the position
_KEPT = 4  # rows: one before, the texels' own and one after are needed; row j is number j & 3

_Z, _X, _Y, _W = np.uint64(0), np.uint64(PITCH), np.uint64(2 * PITCH), np.uint64(3 * PITCH)


@kernel(inline=True)
def unit(x, y, z):
    """A vector over its length, after a division by its largest component; (0, 0, 0) stays."""
    zero = type(x)(0)
    size = max(abs(x), abs(y), abs(z))
    there = size > zero
    x, y, z = x / size, y / size, z / size
    length = type(x)(sqrt((x * x + y * y) + z * z))
    return x / length if there else zero, y / length if there else zero, z / length if there else zero


@kernel(inline=True)
def surface_span(depths, first, n):
    """Start and end, among n texels from number ``first`` on, from the first that sees a surface to the last."""
    seen = np.int32(0)
    for i in range(n):
        seen = np.int32(seen + np.int32(depths[np.uint64(first + i)] < np.inf))
    start, end = 0, n if seen > 0 else 0
    while start < end and not depths[np.uint64(first + start)] < np.inf:
        start += 1
    while start < end and not depths[np.uint64(first + end - 1)] < np.inf:
        end -= 1
    return start, end


@kernel(inline=True)
def load_row(depths, places, row, height, left, n, width, kept):
    """Copy z and positions of a row's n texels from column ``left`` on, and of one on either side, to ``kept``.

    Texels outside the texture see no surface.
    """
    place = (row & (_KEPT - 1)) * _ROW
    for i in range(PITCH):
        kept[np.uint64(place + i)] = np.inf
    if not 0 <= row < height:
        return
    first, last = max(left - 1, 0), min(left + n + 1, width)
    texel = row * width + first
    start, end = surface_span(depths, texel, last - first)
    place, texel = place + first - left + 1 + start, texel + start
    for i in range(end - start):
        t, k = np.uint64(3) * np.uint64(texel + i), np.uint64(place + i)
        kept[k] = depths[np.uint64(texel + i)]
        kept[k + _X], kept[k + _Y], kept[k + _W] = places[t], places[t + np.uint64(1)], places[t + np.uint64(2)]


@kernel(inline=True)
def load_directions(rays, j, left, n, width, directions):
    """Directions in which row j's n texels from column ``left`` on look, world space, of any length, and their parity.

    directions: (4, CHUNK), flat: x, y, z, and 1 for the first of a pair of texels, 0 for the second. A loaded number
    costs less to compare than a 64-bit column number does.
    """
    m, numbers, table = rays.world, rays.numbers, rays.table
    zero, one, half = m.dtype.type(0), m.dtype.type(1), m.dtype.type(0.5)
    u_c, u_d, u_e = numbers[0], numbers[3], numbers[4]
    dy = numbers[8] + numbers[9] * ((m.dtype.type(j) + half) - numbers[5])
    for i in range(n):
        texel, k = np.uint64(j * width + left + i), np.uint64(i)
        separable = rays.kind == SEPARABLE
        x = u_d + u_e * ((m.dtype.type(np.int32(left + i)) + half) - u_c) if separable else table[1, texel]
        y = dy if separable else table[3, texel]
        directions[k] = linear_row(m, 0, x, y, one)
        directions[k + np.uint64(CHUNK)] = linear_row(m, 1, x, y, one)
        directions[k + np.uint64(2 * CHUNK)] = linear_row(m, 2, x, y, one)
        directions[k + np.uint64(3 * CHUNK)] = one if i % 2 == 0 else zero


@kernel(inline=True)
def toward(one, other, own, to_one, to_other):
    """A coordinate of one neighbour, or of the other, or of the texel itself, less the texel's own."""
    return (one if to_one else other if to_other else own) - own


@kernel(inline=True)
def normals_of_row(kept, j, start, end, directions, upright):
    """Unit normals of texels start to end of row j's chunk, (3, CHUNK), flat, out; returns how many have none, 0 there.

    A difference is to the other one of the pair (0, 1), (2, 3), ... if it sees a surface, else to the one on the other
    side, else 0.
    """
    zero, nothing, odd = type(directions[0])(0), type(directions[0])(np.inf), j & 1
    own = (j & (_KEPT - 1)) * _ROW + 1 + start
    pair = ((j + 1 - 2 * odd) & (_KEPT - 1)) * _ROW + 1 + start  # the row below an even one, above an odd one
    beyond = ((j - 1 + 2 * odd) & (_KEPT - 1)) * _ROW + 1 + start
    surfaces, clear_ones = np.int32(0), np.int32(0)
    for i in range(end - start):  # from 0 on: from ``start`` on it is a third slower
        here, one, other, k = np.uint64(own + i), np.uint64(pair + i), np.uint64(beyond + i), np.uint64(start + i)
        left, right = here - np.uint64(1), here + np.uint64(1)
        x, y, z = kept[here + _X], kept[here + _Y], kept[here + _W]
        first = directions[k + np.uint64(3 * CHUNK)] > zero
        before, after = kept[left] < nothing, kept[right] < nothing
        on, back = after & (first | (not before)), before & ((not first) | (not after))
        ax = toward(kept[right + _X], kept[left + _X], x, on, back)
        ay = toward(kept[right + _Y], kept[left + _Y], y, on, back)
        az = toward(kept[right + _W], kept[left + _W], z, on, back)
        on, back = kept[one] < nothing, kept[other] < nothing
        bx = toward(kept[one + _X], kept[other + _X], x, on, back)
        by = toward(kept[one + _Y], kept[other + _Y], y, on, back)
        bz = toward(kept[one + _W], kept[other + _W], z, on, back)
        nx, ny, nz = unit(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
        away = (nx * directions[k] + ny * directions[k + np.uint64(CHUNK)]) + nz * directions[k + np.uint64(2 * CHUNK)]
        seen, behind = kept[here] < nothing, away > zero
        clear = seen & (behind | (away < zero))
        upright[k] = (-nx if behind else nx) if clear else zero
        upright[k + np.uint64(CHUNK)] = (-ny if behind else ny) if clear else zero
        upright[k + np.uint64(2 * CHUNK)] = (-nz if behind else nz) if clear else zero
        surfaces = np.int32(surfaces + np.int32(seen))
        clear_ones = np.int32(clear_ones + np.int32(clear))
    return surfaces - clear_ones


@kernel
def face_viewer(kept, j, start, end, directions, upright):
    """For texels that see a surface and have no normal: the direction towards the viewer."""
    own, zero = (j & (_KEPT - 1)) * _ROW + 1, type(directions[0])(0)
    for i in range(start, end):
        if (
            kept[own + i] < np.inf
            and upright[i] == zero
            and upright[CHUNK + i] == zero
            and upright[2 * CHUNK + i] == zero
        ):
            upright[i], upright[CHUNK + i], upright[2 * CHUNK + i] = unit(
                -directions[i], -directions[CHUNK + i], -directions[2 * CHUNK + i]
            )


@kernel(parallel=True)
def face_normals(z, positions, rays, normals):
    """Equation 4: unit normals from the differences of neighbouring positions, towards the viewer.

    A gradient is that of GPUs, within quads of 2x2 texels whose first corner is even: both texels of a pair share one
    difference. Readings: where the pair's other texel is outside or sees no surface, the difference is to the other
    side; where there is neither, or the differences are parallel, the normal is the direction towards the viewer.
    The product's sign is that with which the normal points against the texel's ray.

    Parameters
    ----------
    z : (H, W) float32 or float64
        +infinity where there is no surface.
    positions : (H, W, 3), same dtype
        World positions.
    rays : TexelRays
        The texels' rays.
    normals : (H, W, 3), same dtype
        Out: unit normals in world space, 0 where there is no surface.
    """
    height, width = z.shape
    dtype, zero = z.dtype, z.dtype.type(0)
    depths, places, out = z.reshape(-1), positions.reshape(-1), normals.reshape(-1)
    for block in prange((height + ROWS_A_BLOCK - 1) // ROWS_A_BLOCK):
        kept = np.empty(_KEPT * _ROW, dtype)
        directions, upright = np.empty(4 * CHUNK, dtype), np.empty(3 * CHUNK, dtype)
        top = np.int64(block) * ROWS_A_BLOCK
        for left in range(0, width, CHUNK):
            n = min(CHUNK, width - left)
            for row in range(top - 1, min(height, top + ROWS_A_BLOCK) + 1):
                load_row(depths, places, row, height, left, n, width, kept)
                j = row - 1  # its neighbours are there now
                if j < top:
                    continue
                start, end = surface_span(depths, j * width + left, n)
                load_directions(rays, j, left, n, width, directions)
                if normals_of_row(kept, j, start, end, directions, upright) > 0:
                    face_viewer(kept, j, start, end, directions, upright)
                first = 3 * (j * width + left)
                for i in range(3 * start):
                    out[np.uint64(first + i)] = zero
                for i in range(3 * end, 3 * n):
                    out[np.uint64(first + i)] = zero
                for i in range(start, end):
                    k, t = np.uint64(i), np.uint64(first + 3 * i)
                    out[t], out[t + np.uint64(1)] = upright[k], upright[k + np.uint64(CHUNK)]
                    out[t + np.uint64(2)] = upright[k + np.uint64(2 * CHUNK)]
