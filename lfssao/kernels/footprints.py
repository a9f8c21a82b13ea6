"""First hits where triangles are small: the texels that a triangle can cover, bounded in the image, are tried.

For flat screens with the linear diffuser and for cameras the x half of a ray depends on the texel's column alone and
the y half on its row. hit_triangle moves each corner along the ray into one plane, p = a_x - (o_x + d_x a_z), and a
hit needs a p <= 0 and a p >= 0 among the corners. Without rounding p = slope (u_a - u), with u_a the corner's image
and u the column's centre, so a hit needs a corner with u_a <= u and one with u_a >= u; what rounding adds is bounded
by ``margin`` / slope. Likewise for rows. No other texel can be hit, so the result is that of trying every triangle on
every ray, as the tree's is (``lfssao.kernels.visibility``), for less work as long as the bounds hold few texels.

Bands of rows are threads' shares: each thread goes through the triangles of its band.
"""

import numpy as np
from numba import prange

from lfssao.kernels.jit import kernel
from lfssao.kernels.rays import FLAT_LINEAR, PERSPECTIVE, texel_ray
from lfssao.kernels.threads import interleaved
from lfssao.kernels.triangle import hit_triangle

BAND = 8  # rows

# Rounding of o + d z, of p and of the corner's image: some dozen operations of half an ulp each, doubled.
_ULPS = 64 * 2.0**-53

# Nearer to the singular planes than this share of the way from the screen, rounding is not bounded by _ULPS.
_NEAREST = 2.0**-8


@kernel(inline=True)
def image_and_slopes(kind, lens, x, y, z):
    """Where a corner appears, u and v, and how much p and q change a texel: slopes, NaN near the singular planes."""
    if kind == FLAT_LINEAR:
        m_x, m_z, y_o, z_o = lens[0], lens[1], lens[2], lens[3]
        a, b = 1.0 - z / m_z, 1.0 - z / z_o
        if not min(a, b) > _NEAREST:
            return np.nan, np.nan, np.nan, np.nan
        u = lens[4] * (m_x + (x - m_x) / a) + lens[5]
        v = lens[6] * (y_o + (y - y_o) / b) + lens[7]
        return u, v, a / abs(lens[4]), b / abs(lens[6])
    depth = z if kind == PERSPECTIVE else 1.0
    return (
        lens[0] * (x / depth) + lens[2],
        lens[3] - lens[1] * (y / depth),
        depth / abs(lens[0]),
        depth / abs(lens[1]),
    )


@kernel(inline=True)
def centres_between(low, high, size):
    """First and last whole number k, 0 <= k < size, with low <= k + 0.5 <= high; all of them where a bound is NaN."""
    first = 0 if not low > 0.5 else np.int32(min(np.ceil(low - 0.5), size))
    last = size - 1 if not high < size - 0.5 else np.int32(max(np.floor(high - 0.5), -1.0))
    return np.int32(first), np.int32(last)


@kernel(inline=True)
def _reach(kind, lens, x, y, z, width, height, scale_x, scale_y, left, top):
    """Columns and rows, first and last, of the centres not farther from a corner's image than rounding may move it."""
    u, v, slope_u, slope_v = image_and_slopes(kind, lens, x, y, z)
    if not (slope_u > 0.0 and slope_v > 0.0):
        u, v = np.nan, np.nan  # anywhere
    # The millionth of a texel is for the rounding of u and v, which matters only in and near the texture.
    margin_u, margin_v = _ULPS * scale_x / slope_u + 1e-6, _ULPS * scale_y / slope_v + 1e-6
    i0, i1 = centres_between((u - margin_u) - left, (u + margin_u) - left, width)
    j0, j1 = centres_between((v - margin_v) - top, (v + margin_v) - top, height)
    return i0, i1, j0, j1


@kernel(parallel=True)
def bound_triangles(
    kind, lens, width, height, scale_x, scale_y, vertices, faces, reaches, boxes, counts, tests, left=0, top=0
):
    """The texels that each triangle may cover, and how many triangles each band has.

    Whole numbers are made of each vertex once; first ones rise with the bound that they are made of, so the first of a
    triangle is the smallest of its corners', and the last the largest.

    Parameters
    ----------
    kind, lens : int, float64 array
        The rays: FLAT_LINEAR, PERSPECTIVE or ORTHOGRAPHIC (``lfssao.kernels.rays``).
    width, height : int
        Size of the texture.
    scale_x, scale_y : float
        Upper bounds of all numbers that x, and y, of corners and rays are made of, cast space.
    vertices, faces : (V, 3) float64, (F, 3) int32
        The triangles.
    reaches : (V, 4) int32
        Out: first and last column, first and last row of each vertex, between which no centre need be.
    boxes : (F, 4) int32
        Out: first and last column, first and last row; the first after the last where there is no texel.
    counts : (chunks, bands) int64
        Out: how many triangles of each chunk, ceil(F / chunks) of them, reach into each band of rows.
    tests : (chunks,) int64
        Out: how many texels the triangles of each chunk may cover.
    left, top : int
        The column and the row of the view that column and row 0 here are: a window of a larger texture.
    """
    for k in prange(vertices.shape[0]):
        reaches[k, 0], reaches[k, 1], reaches[k, 2], reaches[k, 3] = _reach(
            kind, lens, vertices[k, 0], vertices[k, 1], vertices[k, 2], width, height, scale_x, scale_y, left, top
        )
    chunks, bands = counts.shape
    size = (faces.shape[0] + chunks - 1) // chunks
    for chunk in prange(chunks):
        for band in range(bands):
            counts[chunk, band] = 0
        area, first, end = 0, chunk * size, min((chunk + 1) * size, faces.shape[0])
        # Two loops, as the first then has no branches: less time than in one.
        for p in range(first, end):
            a, b, c = np.uint64(faces[p, 0]), np.uint64(faces[p, 1]), np.uint64(faces[p, 2])
            boxes[p, 0] = min(reaches[a, 0], reaches[b, 0], reaches[c, 0])
            boxes[p, 1] = max(reaches[a, 1], reaches[b, 1], reaches[c, 1])
            boxes[p, 2] = min(reaches[a, 2], reaches[b, 2], reaches[c, 2])
            boxes[p, 3] = max(reaches[a, 3], reaches[b, 3], reaches[c, 3])
        for p in range(first, end):
            i0, i1, j0, j1 = boxes[p, 0], boxes[p, 1], boxes[p, 2], boxes[p, 3]
            if i0 <= i1 and j0 <= j1:
                area += np.int64(i1 - i0 + 1) * np.int64(j1 - j0 + 1)
                for band in range(np.uint32(j0) // np.uint32(BAND), np.uint32(j1) // np.uint32(BAND) + 1):
                    counts[chunk, band] += 1
        tests[chunk] = area


@kernel(parallel=True)
def sort_into_bands(boxes, starts, members):
    """The triangles of each band, in order.

    Parameters
    ----------
    boxes : (F, 4) int32
        As bound_triangles made them.
    starts : (chunks, bands) int64
        In: where in ``members`` each chunk's triangles of each band begin; used up.
    members : (n,) int32
        Out: triangles' places, band by band.
    """
    chunks = starts.shape[0]
    size = (boxes.shape[0] + chunks - 1) // chunks
    for chunk in prange(chunks):
        for p in range(chunk * size, min((chunk + 1) * size, boxes.shape[0])):
            if boxes[p, 0] <= boxes[p, 1] and boxes[p, 2] <= boxes[p, 3]:
                for band in range(boxes[p, 2] // BAND, boxes[p, 3] // BAND + 1):
                    members[starts[chunk, band]] = p
                    starts[chunk, band] += 1


@kernel
def ray_tables(kind, lens, columns, rows, left=0, top=0):
    """Out: o and d of the x half of each column's rays, (W, 2), of the y half of each row's, (H, 2); near and far.

    Columns are counted from ``left`` on, rows from ``top`` on.
    """
    for i in range(columns.shape[0]):
        columns[i, 0], _, _, columns[i, 1], _, _, _, _ = texel_ray(kind, lens, (left + i) + 0.5, 0.5)
    for j in range(rows.shape[0]):
        _, rows[j, 0], _, _, rows[j, 1], _, _, _ = texel_ray(kind, lens, 0.5, (top + j) + 0.5)
    _, _, _, _, _, _, near, far = texel_ray(kind, lens, 0.5, 0.5)
    return near, far


@kernel(parallel=True)
def first_hits_by_footprint(columns, rows, near, far, corners, order, boxes, members, ends, triangle, depth, weights):
    """The first triangle of every texel's ray: the smallest z, and of equal z the smallest number.

    Parameters
    ----------
    columns, rows, near, far
        The rays (``ray_tables``).
    corners, order : (F, 9) float64, (F,) int64
        Corners of the triangles and their numbers.
    boxes, members : (F, 4) int32, (n,) int32
        The texels that each may cover; the triangles of each band of rows.
    ends : (bands,) int64
        Where in ``members`` each band's triangles end.
    triangle : (H * W,) int32
        Out: number of the triangle, -1 where there is none.
    depth : (H * W,) float64
        Out: z of the hit in cast space; ``far`` where there is none.
    weights : (H * W, 2) float64
        Out: barycentric weights of the triangle's second and third corner; untouched where there is none.
    """
    width, height, bands = columns.shape[0], rows.shape[0], ends.shape[0]
    for band in interleaved(bands):
        top, bottom = band * BAND, min(height, (band + 1) * BAND)
        for texel in range(top * width, bottom * width):
            triangle[texel], depth[texel] = -1, far
        for n in range(0 if band == 0 else ends[band - 1], ends[band]):
            p = members[n]
            face = order[p]
            ax, ay, az = corners[p, 0], corners[p, 1], corners[p, 2]
            bx, by, bz = corners[p, 3], corners[p, 4], corners[p, 5]
            cx, cy, cz = corners[p, 6], corners[p, 7], corners[p, 8]
            nearest = min(az, bz, cz)
            for j in range(max(top, boxes[p, 2]), min(bottom, boxes[p, 3] + 1)):
                for i in range(boxes[p, 0], boxes[p, 1] + 1):
                    texel = j * width + i
                    if nearest > depth[texel]:
                        continue
                    hit, z, weight_b, weight_c = hit_triangle(
                        columns[i, 0], rows[j, 0], columns[i, 1], rows[j, 1], ax, ay, az, bx, by, bz, cx, cy, cz
                    )
                    first = z < depth[texel] or (z == depth[texel] and face < triangle[texel])
                    if hit and first and near < z:
                        depth[texel], triangle[texel] = z, face
                        weights[texel, 0], weights[texel, 1] = weight_b, weight_c
