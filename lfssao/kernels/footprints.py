"""First hits where triangles are small: the texels that a triangle can cover, bounded in the image, are tried.

For flat screens with the linear diffuser and for cameras the x half of a ray depends on the texel's column alone and
the y half on its row. hit_triangle moves each corner along the ray into one plane, p = a_x - (o_x + d_x a_z), and a
hit needs a p <= 0 and a p >= 0 among the corners. Without rounding p = slope (u_a - u), with u_a the corner's image
and u the column's centre, so a hit needs a corner with u_a <= u and one with u_a >= u, up to what rounding adds.
Likewise for rows. No other texel can be hit, so the result is that of trying every triangle on every ray, as the tree's
is (``lfssao.kernels.visibility``), for less work as long as the bounds hold few texels. Of those of small triangles
the edges leave a third (``lfssao.kernels.coverage``).

Places in the image are whole numbers here, UNITS a texel, with 0 at the centre of the first column or row. Along
either axis u_a = (x - c) r A + B with r = 1 / (alpha + beta z): on a flat screen alpha = 1 and beta = -1 / m_z (of
rows -1 / z_o), in perspective 0 and 1, in orthographic projection 1 and 0. The slope is 1 / (|A| r). What rounding
does:

- p is off by less than 2^-47 scale, 64 times half an ulp of the numbers it is made of, for some dozen operations;
- r is off by less than 2^-43 of itself where r <= 256: alpha + beta z, then at least 2^-8, is rounded three times as
  1 + |z / m_z|, at most 2 + 2^-8, is; without a difference, in cameras, by less; u_a's product by little more;
- so the two together are less than 2^-41 scale |A| r texels, and below a quarter of a unit where ``limit`` holds r.

B is off by less than another quarter (``lfssao.footprints`` asks for numbers below 2^30), and a place is rounded
down. So a corner with place U lies between U - 1 and U + 2, and where r is not within its limit it lies anywhere.

Bands of rows are threads' shares: each thread goes through the triangles of its band. Those that turn their front come
before those that turn their back, as the first mostly hide the second; which come first changes the time, and no
result.
"""

import numpy as np
from numba import prange

from lfssao.kernels.coverage import ANYWHERE, UNITS, covered_texels
from lfssao.kernels.intrinsics import CHUNK, scratch
from lfssao.kernels.jit import kernel
from lfssao.kernels.rays import texel_ray

BAND = 16  # rows
LARGEST = 2**15 - 1  # columns or rows of a texture: a column and a row are two halves of an int32

_BAND_OF = 16 + 4  # of a column + 2^16 times a row, the bits below its band
_FARTHEST = 2.0**30 - 1.0  # where places beyond are held: outside of any texture


@kernel(inline=True)
def _place(x, z, alpha, beta, c, a, b, limit):
    """A corner's place along one axis of the image, and whether r is within its limit."""
    r = 1.0 / (alpha + beta * z)
    bounded = (r > 0.0) & (r <= limit)
    place = ((x - c) * r) * a + b if bounded else 0.0
    # A sum above 0, which conversion rounds down.
    held = np.int32(min(max(place, -_FARTHEST), _FARTHEST) + 2.0**30) - np.int32(2**30)
    return np.int32(held), bounded


@kernel(inline=True)
def centres_between(low, high, size):
    """First and last whole number k, 0 <= k < size, with low - 1 <= UNITS k <= high + 2, int32 all."""
    first = (low + np.int32(UNITS - 2)) >> np.int32(10)
    last = (high + np.int32(2)) >> np.int32(10)
    return np.int32(max(first, np.int32(0))), np.int32(min(last, np.int32(size - 1)))


@kernel(inline=True)
def _part(texel, number):
    """Which of the counts is a triangle's in the band of a row: 2 times the band, + 1 where it turns its back.

    texel is a column + 2^16 times a row; of the triangle's number the last bit says which way it turns.
    """
    return np.uint64(2 * (texel >> _BAND_OF) + (number & 1))


@kernel(parallel=True)
def bound_triangles(width, height, u_axis, v_axis, vertices, faces, deep, bend, places, found, counts, kept, tries):
    """The triangles that may cover texels, which ones, and how many each band has.

    Parameters
    ----------
    width, height : int
        Size of the texture, at most LARGEST.
    u_axis, v_axis : (6,) float64
        alpha, beta, c, A, B and the limit of r along columns and rows; A and B in units, B from the centre of column
        and row 0 on.
    vertices, faces : (3 V,) float64, (3 F,) int32
        The triangles, cast space.
    deep : (F,) float32
        How far each reaches along z.
    bend : float32
        Bound of delta of ``lfssao.kernels.coverage`` over that.
    places : (V,) int64
        Out: each vertex' place along columns in the upper half, along rows in the lower one. -2^31 in the upper half:
        anywhere.
    found : (>= F, 4) int32
        Out: from number ``chunk * ceil(F / chunks)`` on, those triangles of each chunk that may cover a texel: 2 times
        its number, + 1 where it turns its back; first and last column, + 2^16 times first and last row; which texels
        between these it may cover (``covered_texels``).
    counts : (chunks, 2 bands + 2) int64
        Out: how many triangles of each chunk reach into each band of rows, those in front and those that turn their
        back; none into the band behind the last.
    kept, tries : (chunks,) int64
        Out: how many triangles of each chunk may cover a texel, and how many texels they may cover together.
    """
    for k in prange(places.shape[0]):
        n = np.uint64(3) * np.uint64(k)
        x, y, z = vertices[n], vertices[n + np.uint64(1)], vertices[n + np.uint64(2)]
        u, u_bounded = _place(x, z, u_axis[0], u_axis[1], u_axis[2], u_axis[3], u_axis[4], u_axis[5])
        v, v_bounded = _place(y, z, v_axis[0], v_axis[1], v_axis[2], v_axis[3], v_axis[4], v_axis[5])
        u = u if u_bounded & v_bounded else ANYWHERE
        places[k] = (np.int64(u) << np.int64(32)) | (np.int64(v) & np.int64(0xFFFFFFFF))
    chunks = counts.shape[0]
    n_faces = faces.shape[0] // 3
    size = (n_faces + chunks - 1) // chunks
    for chunk in prange(chunks):
        first, last, turned, there = scratch(np.int32), scratch(np.int32), scratch(np.int32), scratch(np.int32)
        us_a, us_b, us_c, covered = scratch(np.int32), scratch(np.int32), scratch(np.int32), scratch(np.int32)
        vs_a, vs_b, vs_c = scratch(np.int32), scratch(np.int32), scratch(np.int32)
        for k in range(counts.shape[1]):
            counts[chunk, k] = 0
        area, n, end = np.int64(0), np.uint64(chunk * size), min((chunk + 1) * size, n_faces)
        for start in range(chunk * size, end, CHUNK):
            m = min(CHUNK, end - start)
            for k in range(m):  # without branches, which makes it vectors
                f = np.uint64(3) * (np.uint64(start) + np.uint64(k))
                a, b = places[np.uint64(faces[f])], places[np.uint64(faces[f + np.uint64(1)])]
                c = places[np.uint64(faces[f + np.uint64(2)])]
                ua, ub, uc = np.int32(a >> np.int64(32)), np.int32(b >> np.int64(32)), np.int32(c >> np.int64(32))
                va, vb, vc = np.int32(a), np.int32(b), np.int32(c)
                i0, i1 = centres_between(min(ua, ub, uc), max(ua, ub, uc), width)
                j0, j1 = centres_between(min(va, vb, vc), max(va, vb, vc), height)
                anywhere = min(ua, ub, uc) == ANYWHERE
                i1 = np.int32(width - 1) if anywhere else i1  # i0 is 0: the place is farther to the left
                j0, j1 = np.int32(0) if anywhere else j0, np.int32(height - 1) if anywhere else j1
                right, left = np.float32(ub) - np.float32(ua), np.float32(uc) - np.float32(ua)
                down, up = np.float32(vc) - np.float32(va), np.float32(vb) - np.float32(va)
                turned[k], there[k] = np.int32(right * down > left * up), np.int32((i0 <= i1) & (j0 <= j1))
                first[k], last[k] = np.int32(i0 | (j0 << np.int32(16))), np.int32(i1 | (j1 << np.int32(16)))
                area += np.int64(np.int32(i1 - i0 + 1)) * np.int64(np.int32(j1 - j0 + 1)) * there[k]
                us_a[k], us_b[k], us_c[k], vs_a[k], vs_b[k], vs_c[k] = ua, ub, uc, va, vb, vc
            for k in range(m):  # of its own, as it has numbers of 32 bits alone: twice as many in a vector
                covered[k] = covered_texels(
                    us_a[k], us_b[k], us_c[k], vs_a[k], vs_b[k], vs_c[k], first[k] & np.int32(0xFFFF),
                    last[k] & np.int32(0xFFFF), first[k] >> np.int32(16), last[k] >> np.int32(16),
                    np.float32(deep[np.uint64(start) + np.uint64(k)] * bend),
                )  # fmt: skip
                there[k] &= np.int32(covered[k] != 0)
            packed = n
            for k in range(m):  # again without branches: what does not count is overwritten by the next
                e = np.uint64(k)
                found[n, 0], found[n, 1] = 2 * (start + k) + turned[e], first[e]
                found[n, 2], found[n, 3] = last[e], covered[e]
                n += np.uint64(there[e])
            for e in range(packed, n):
                counts[chunk, _part(found[e, 1], found[e, 0])] += 1
                counts[chunk, _part(found[e, 2], found[e, 0]) + np.uint64(2)] -= 1
        for part in range(2, counts.shape[1]):
            counts[chunk, np.uint64(part)] += counts[chunk, np.uint64(part - 2)]
        tries[chunk], kept[chunk] = area, n - np.uint64(chunk * size)


@kernel(parallel=True)
def sort_into_bands(n_faces, found, kept, starts, members):
    """The triangles of each band, in order, those that turn their back behind the others.

    Parameters
    ----------
    n_faces : int
        F of bound_triangles.
    found, kept : (>= F, 4) int32, (chunks,) int64
        What bound_triangles found.
    starts : (chunks, 2 bands + 2) int64
        In: where in ``members`` each chunk's triangles of each band begin; used up.
    members : (n, 4) int32
        Out: a triangle's number; first and last column, + 2^16 times first and last row; which texels between these.
    """
    size = (n_faces + starts.shape[0] - 1) // starts.shape[0]
    for chunk in prange(starts.shape[0]):
        for k in range(chunk * size, chunk * size + kept[chunk]):
            number, first, last = found[k, 0], found[k, 1], found[k, 2]
            for part in range(_part(first, number), _part(last, number) + np.uint64(1), np.uint64(2)):
                n = np.uint64(starts[chunk, part])
                members[n, 0], members[n, 1], members[n, 2], members[n, 3] = number >> 1, first, last, found[k, 3]
                starts[chunk, part] += 1


@kernel
def ray_tables(kind, lens, columns, rows, left=0, top=0):
    """Out: o and d of the x half of each column's rays, (2, W), of the y half of each row's, (2, H); near and far.

    Columns are counted from ``left`` on, rows from ``top`` on.
    """
    for i in range(columns.shape[1]):
        columns[0, i], _, _, columns[1, i], _, _, _, _ = texel_ray(kind, lens, (left + i) + 0.5, 0.5)
    for j in range(rows.shape[1]):
        _, rows[0, j], _, _, rows[1, j], _, _, _ = texel_ray(kind, lens, 0.5, (top + j) + 0.5)
    _, _, _, _, _, _, near, far = texel_ray(kind, lens, 0.5, 0.5)
    return near, far
