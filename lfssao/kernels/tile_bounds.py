"""Samples that have one outcome for all points of a tile, decided by bounds of the depth texture (LF section 5).

The ball's samples are the same for every texel. The points of a tile, behind the mapping's affine half, lie in a box
a_0 <= a <= a_1, b_0 <= b <= b_1, c_0 <= c <= c_1, q_0 <= q <= q_1. Of a point and a sample (a_o, b_o, c_o, q_o)

    CROSSED_SLITS makes   z = c + c_o,   u = u_0 + (a + a_o) / (z_m - z),   v = v_0 + (b + b_o) / (z_o - z)
    MATRIX makes          z = (c + c_o) / d,   u = (a + a_o) / d,   v = (b + b_o) / d,   d = q + q_o
    DISPLAY makes         z = c + c_o,   u and v as lfssao.kernels.tile_images bounds them

Why the same operations on the ends of the box bound, to the last bit, what the kernel computes for each point of it:

- Rounding to nearest keeps the order of numbers, so the rounded x + y and x - y rise with x, and rise or fall with y,
  as the sums themselves do. A difference of floats is 0 only if they are equal, so z < z_m is z_m - z > 0 as computed.
- If 0 < near <= d <= far, then x / d >= x_0 / far for x >= x_0 >= 0, and x / d >= x_0 / near for x >= x_0, x_0 < 0;
  rounded, it is so again. Upper bounds are minus the lower ones of -x. Negatives are exact, and z_o - z = -(z - z_o).
- Where a bound of a divisor is not positive, nothing is decided; a bound that is not finite, or NaN, never compares
  as inside the texture. It decides a sample outside only if it is an infinity on that side, beyond which nothing is.
- A point with a NaN, as those of texels without a surface are, has no sample in the texture; bounds leave it out. With
  MATRIX it has if only c is one: where some numbers of a point are NaN and others are not, nothing is decided.

The texels that a sample reads lie between those of the bounds of u and v, as truncation keeps order too. It is behind
all of them if z > depth for the least z and the largest depth there, before all if z <= depth for the largest z and the
least depth; depths that are NaN, which nothing is behind, are taken as +infinity. Cells of depths, CELL texels on a
side, are kept in blocks of 3 x 3 that overlap, so that four blocks cover exactly any rectangle of 3 to 6 cells a side.
"""

import numpy as np
from numba import prange

from lfssao.kernels.intrinsics import CHUNK, element, scratch
from lfssao.kernels.jit import kernel, wide_vectors
from lfssao.kernels.mapping import DISPLAY, MATRIX
from lfssao.kernels.tile_images import image_of_display

CELL_BITS = 2
CELL = 1 << CELL_BITS  # texels
BLOCK = 3  # cells

# What a sample is for all points of a tile: not the same, before all surfaces, behind all, not in the texture.
_MIXED, _BEFORE, _BEHIND, _OUTSIDE = 0, 1, 2, 3


@kernel(inline=True)
def _bound_columns(depth, width, top, bottom, left, right, low, high):
    """Least and largest depth of each column, from ``left`` to before ``right``, over some rows of the texture."""
    far = type(depth[0])(np.inf)
    for i in range(CHUNK):
        low[i], high[i] = far, -far
    for j in range(top, bottom):
        for i in range(right - left):
            d = depth[np.uint64(j * width + left + i)]
            d = d if d < far else far
            low[i] = d if d < low[i] else low[i]
            high[i] = d if d > high[i] else high[i]


@kernel(parallel=True)
def bound_depths(depth, cells, blocks):
    """Least and largest depth of each block of BLOCK x BLOCK cells, as far as the texture goes.

    Parameters
    ----------
    depth : (H, W) float32 or float64
        The depth texture.
    cells : (2, R + BLOCK - 1, C + BLOCK - 1), same dtype
        R = ceil(H / CELL), C = ceil(W / CELL). In: +infinity everywhere in the first half, -infinity in the second.
        Out: least and largest depth of each cell.
    blocks : (2, R, C), same dtype
        Out: the same of the block whose first cell it is.
    """
    height, width = depth.shape
    _, rows, columns = blocks.shape
    texels = depth.reshape(height * width)
    for row in prange(rows):
        low, high = scratch(depth.dtype), scratch(depth.dtype)
        for first in range(0, columns, CHUNK // CELL):
            left = first * CELL
            _bound_columns(
                texels, width, row * CELL, min(height, (row + 1) * CELL), left, min(width, left + CHUNK), low, high
            )
            for k in range(min(CHUNK // CELL, columns - first)):
                least, most = low[k * CELL], high[k * CELL]
                for i in range(1, CELL):
                    least = low[k * CELL + i] if low[k * CELL + i] < least else least
                    most = high[k * CELL + i] if high[k * CELL + i] > most else most
                cells[0, row, first + k], cells[1, row, first + k] = least, most
    for row in prange(rows):
        for column in range(columns):
            least, most = cells[0, row, column], cells[1, row, column]
            for j in range(BLOCK):
                for i in range(BLOCK):
                    low, high = (
                        cells[0, np.uint64(row + j), np.uint64(column + i)],
                        cells[1, np.uint64(row + j), np.uint64(column + i)],
                    )
                    least = low if low < least else least
                    most = high if high > most else most
            blocks[0, row, column], blocks[1, row, column] = least, most


@kernel
def divisors_of(n, a, b, c, q):
    """The same of q; from -infinity on where a point has both numbers and NaN, so that nothing is decided."""
    far = type(q[0])(np.inf)
    q0, q1, odd = far, -far, np.int32(0)
    for i in range(n):
        w = q[i]
        q0, q1 = w if w < q0 else q0, w if w > q1 else q1
        missing = np.int32(np.isnan(a[i])) + np.int32(np.isnan(b[i])) + np.int32(np.isnan(c[i])) + np.int32(np.isnan(w))
        odd |= np.int32((missing != 0) & (missing != 4))
    return -far if odd != 0 else q0, q1


@kernel(inline=True)
def _least_quotient(low, near, far):
    """Lower bound of x / d over x >= low and 0 < near <= d <= far."""
    return low / (far if low >= type(low)(0) else near)


@kernel(inline=True)
def _cell(u, inside):
    """Number of the cell that an image coordinate lies in, 0 where it is not inside."""
    return np.int32(np.int32(u if inside else type(u)(0)) >> np.int32(CELL_BITS))


@kernel(inline=True)
def _image_of_slits(z_module, z_observer, u_0, v_0, box, a, b, c):
    """Bounds of u, v and z of the sample (a, b, c) over a box, CROSSED_SLITS; u, v are NaN where nothing is known."""
    a0, a1, b0, b1, c0, c1 = box
    zero, unknown = type(a)(0), type(a)(np.nan)
    z0, z1 = c0 + c, c1 + c
    near_u, far_u, near_v, far_v = z_module - z1, z_module - z0, z0 - z_observer, z1 - z_observer
    known = (near_u > zero) & (near_v > zero)
    origin_u, origin_v = u_0 if known else unknown, v_0 if known else unknown
    return (
        origin_u + _least_quotient(a0 + a, near_u, far_u), origin_u - _least_quotient(-(a1 + a), near_u, far_u),
        origin_v + _least_quotient(-(b1 + b), near_v, far_v), origin_v - _least_quotient(b0 + b, near_v, far_v), z0, z1,
    )  # fmt: skip


@kernel(inline=True)
def _image_of_matrix(box, divisors, a, b, c, q):
    """The same of the sample (a, b, c, q), MATRIX."""
    a0, a1, b0, b1, c0, c1 = box
    near, far = divisors[0] + q, divisors[1] + q
    near = near if near > type(a)(0) else type(a)(np.nan)  # of which no quotient compares
    far = far if near > type(a)(0) else near
    return (
        _least_quotient(a0 + a, near, far), -_least_quotient(-(a1 + a), near, far),
        _least_quotient(b0 + b, near, far), -_least_quotient(-(b1 + b), near, far),
        _least_quotient(c0 + c, near, far), -_least_quotient(-(c1 + c), near, far),
    )  # fmt: skip


@kernel(inline=True)
def _outcome(image, width, height, columns, half, blocks):
    """What a sample is between such bounds; arguments as of ``undecided``.

    One look-up tells which of 'before' and 'behind' is possible, so that the other four are in one half of the bounds.
    """
    left, right, top, bottom, z0, z1 = image
    zero, wide, high = type(z0)(0), type(z0)(width), type(z0)(height)
    outside = (right < zero) | (left >= wide) | (bottom < zero) | (top >= high)
    inside = (left >= zero) & (right < wide) & (top >= zero) & (bottom < high)
    i0, i1, j0, j1 = _cell(left, inside), _cell(right, inside), _cell(top, inside), _cell(bottom, inside)
    most = np.int32(2 * BLOCK)
    covered = inside & (np.int32(i1 - i0) < most) & (np.int32(j1 - j0) < most)
    i1, j1 = np.int32(i1 - np.int32(BLOCK - 1)), np.int32(j1 - np.int32(BLOCK - 1))
    i1, j1 = i1 if i1 > i0 else i0, j1 if j1 > j0 else j0
    upper, lower = np.int32(j0 * np.int32(columns)), np.int32(j1 * np.int32(columns))
    open_ = element(blocks, np.int32(upper + i0)) >= z1
    skipped = np.int32(0) if open_ else np.int32(half)
    upper, lower = np.int32(upper + skipped), np.int32(lower + skipped)
    p, q = element(blocks, np.int32(upper + i0)), element(blocks, np.int32(upper + i1))
    r, s = element(blocks, np.int32(lower + i0)), element(blocks, np.int32(lower + i1))
    before = open_ & (q >= z1) & (r >= z1) & (s >= z1)
    behind = (p < z0) & (q < z0) & (r < z0) & (s < z0)
    decided = np.int32(_BEHIND) if behind else np.int32(_MIXED)
    decided = np.int32(_BEFORE) if before else np.int32(_MIXED) if open_ else decided
    return np.int32(decided if covered else np.int32(_OUTSIDE) if outside else np.int32(_MIXED))


@kernel
def undecided(
    kind, m, module, width, height, columns, half, blocks, extent, samples, columns_of, offsets, first, n, mixed
):
    """Copy the samples that have not the same outcome for all points of a tile.

    Parameters
    ----------
    kind, m : int, (16,) or (44,) array
        The mapping.
    module : (32,) array
        With DISPLAY a module's numbers, else not read.
    width, height : int
        Size of the texture.
    columns, half : int
        How many blocks a row has; how many there are.
    blocks : (2 * half,) array
        Their least depths, then their largest.
    extent : tuples of six, of two and of five numbers
        ``bounds_of`` the tile's points; with MATRIX ``divisors_of`` them, else not read; with DISPLAY
        ``lfssao.kernels.tile_images.middle_of`` them, else not read.
    samples : int
        How many there are.
    columns_of, offsets : (4 * samples,) and (samples, 4) arrays
        The samples behind the mapping's linear part, number by number, and sample by sample.
    first, n : int
        Which of them; n <= CHUNK.
    mixed : (CHUNK, 4) array
        Out: those that are left.

    Returns
    -------
    left, behind, inside : int
        How many are left; behind all surfaces; behind all or before all, which lie in the texture.
    """
    wide_vectors()
    z_module, z_observer, u_0, v_0 = m[12], m[13], m[14], m[15]
    box, divisors, middle = extent
    outcome = scratch(np.int32)
    behind, inside = np.int32(0), np.int32(0)
    if kind == MATRIX:
        for k in range(n):
            s = first + k
            a, b = columns_of[np.uint64(s)], columns_of[np.uint64(samples + s)]
            c, q = columns_of[np.uint64(2 * samples + s)], columns_of[np.uint64(3 * samples + s)]
            outcome[k] = _outcome(_image_of_matrix(box, divisors, a, b, c, q), width, height, columns, half, blocks)
    elif kind == DISPLAY:
        for k in range(n):
            s = first + k
            a, b = columns_of[np.uint64(s)], columns_of[np.uint64(samples + s)]
            image = image_of_display(module, box, middle, a, b, columns_of[np.uint64(2 * samples + s)])
            outcome[k] = _outcome(image, width, height, columns, half, blocks)
    else:
        for k in range(n):
            s = first + k
            a, b = columns_of[np.uint64(s)], columns_of[np.uint64(samples + s)]
            image = _image_of_slits(z_module, z_observer, u_0, v_0, box, a, b, columns_of[np.uint64(2 * samples + s)])
            outcome[k] = _outcome(image, width, height, columns, half, blocks)
    for k in range(n):
        behind = np.int32(behind + np.int32(outcome[k] == _BEHIND))
        inside = np.int32(inside + np.int32((outcome[k] == _BEHIND) | (outcome[k] == _BEFORE)))
    left = 0
    for k in range(n):
        for row in range(4):
            mixed[np.uint64(left), row] = offsets[np.uint64(first + k), row]
        left += np.int64(outcome[k] == _MIXED)
    return left, np.int64(behind), np.int64(inside)
