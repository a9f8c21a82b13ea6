"""Conservative rasterisation: the texels in which a triangle can be hit, by the images of its corners.

Rays are separable here, on flat screens with the linear diffuser and in cameras: the x of a ray depends on the texel's
column alone, its y on the row. hit_triangle moves each corner along the ray into one plane, p = x - (o_x + d_x z), and
a hit needs a corner with p <= 0 and one with p >= 0. Without rounding p = slope (u - i), with u the corner's image and
i the column, both counted from the centre of the first column. So a triangle is hit only in columns between the images
of its corners, however its edges are curved between them. The same holds for rows.

The image is u = (x - c) r a + b with r = 1 / (alpha + beta z), and slope = 1 / (|a| r). On a flat screen alpha = 1
and beta = -1 / m_z (for rows -1 / z_o), in perspective 0 and 1, in orthographic projection 1 and 0. Rounding:

- p is off by less than 2^-47 scale, 64 times half an ulp of the numbers it is made of, for some dozen operations;
- r is off by less than 2^-43 of itself where r <= 256: alpha + beta z, then at least 2^-8, is rounded three times as
  1 + |z / m_z|, at most 2 + 2^-8, is; in cameras by less;
- both together are less than 2^-41 scale |a| r texels, and below 2^-12 texels where r is within its limit;
- b and the sum are off by less than 2^-12, as all numbers in them are below 2^30.

So a margin of 2^-10 texels is enough. A corner whose r is not within its limit may appear anywhere.

Every pair of a triangle and a texel between its bounds is a candidate, which hit_triangle decides. This takes a quarter
of the tree's time on the armadillo (``benchmarks/bench_gbuffer.py``).
"""

from math import ceil, floor
from typing import Any, NamedTuple

import numpy as np

from lfssao.core.jit import formula, kernel
from lfssao.gbuffer.kernels.triangle import hit_triangle, triangle_at
from lfssao.optics.kernels.rays import texel_ray

BAND = 16  # rows
MARGIN = 2.0**-10  # texels


class SeparableRays(NamedTuple):
    """Rays x = o + d z, whose x depends on the column alone and y on the row alone."""

    columns: Any  # (2, W) float64: o and d of x, of each column
    rows: Any  # (2, H) float64: o and d of y, of each row
    near: float  # z at which rays begin
    far: float  # and end


@kernel
def separable_rays(rays, columns, rows, top=0):
    """Write o and d of x of each column's rays, (2, W), and of y of each row's, (2, H); return near and far."""
    for i in range(columns.shape[1]):
        columns[0, i], _, _, columns[1, i], _, _, _, _ = texel_ray(rays, i + 0.5, 0.5)
    for j in range(rows.shape[1]):
        _, rows[0, j], _, _, rows[1, j], _, _, _ = texel_ray(rays, 0.5, (top + j) + 0.5)
    _, _, _, _, _, _, near, far = texel_ray(rays, 0.5, 0.5)
    return near, far


@formula
def _image(x, z, axis, size):
    """A corner's image along one axis, clamped to a texel beside the texture, and whether its rounding is bounded."""
    alpha, beta, c, a, b, limit = axis[0], axis[1], axis[2], axis[3], axis[4], axis[5]
    r = 1.0 / (alpha + beta * z)
    if not 0.0 < r <= limit:
        return 0.0, False
    return min(max(((x - c) * r) * a + b, -1.0), size), True


@kernel(rows="vertices")
def bound_corners(begin, stop, width, height, u_axis, v_axis, vertices, texels):
    """Write the texels that lie beside the image of each vertex.

    u_axis, v_axis: (6,) float64, alpha, beta, c, a, b and the limit of r along columns and rows. texels: (V, 4) int32,
    the first column at or after a vertex's image, the last column at or before it, then rows; all columns and rows
    where its rounding is not bounded.
    """
    for k in range(begin, stop):
        u, u_bounded = _image(vertices[k, 0], vertices[k, 2], u_axis, width)
        v, v_bounded = _image(vertices[k, 1], vertices[k, 2], v_axis, height)
        if u_bounded and v_bounded:
            texels[k, 0], texels[k, 1] = np.int32(ceil(u - MARGIN)), np.int32(floor(u + MARGIN))
            texels[k, 2], texels[k, 3] = np.int32(ceil(v - MARGIN)), np.int32(floor(v + MARGIN))
        else:
            texels[k, 0], texels[k, 1], texels[k, 2], texels[k, 3] = 0, width - 1, 0, height - 1


@kernel(rows="faces")
def bound_triangles(begin, stop, width, height, faces, texels, bounds):
    """Write the texels that lie between the images of each triangle's corners, ``texels`` of ``bound_corners``.

    bounds: (F, 4) int32, first and last column, first and last row in which the triangle can be hit; none where the
    first is behind the last.
    """
    for f in range(begin, stop):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        bounds[f, 0] = max(min(texels[a, 0], texels[b, 0], texels[c, 0]), 0)
        bounds[f, 1] = min(max(texels[a, 1], texels[b, 1], texels[c, 1]), width - 1)
        bounds[f, 2] = max(min(texels[a, 2], texels[b, 2], texels[c, 2]), 0)
        bounds[f, 3] = min(max(texels[a, 3], texels[b, 3], texels[c, 3]), height - 1)


@kernel
def count_candidates(bounds, counts):
    """Number of candidate pairs. Adds the triangles that reach into each band to counts, (bands,) int64."""
    pairs = 0
    for f in range(bounds.shape[0]):
        i0, i1, j0, j1 = bounds[f, 0], bounds[f, 1], bounds[f, 2], bounds[f, 3]
        if i0 <= i1 and j0 <= j1:
            pairs += np.int64(i1 - i0 + 1) * np.int64(j1 - j0 + 1)
            for band in range(j0 // BAND, j1 // BAND + 1):
                counts[band] += 1
    return pairs


@kernel
def sort_into_bands(bounds, starts, members):
    """Write the triangles of each band, in order, into members, (n,) int32.

    bounds: (F, 4) int32, of bound_triangles. starts: (bands,) int64, the place of each band in members; overwritten.
    """
    for f in range(bounds.shape[0]):
        if bounds[f, 0] <= bounds[f, 1] and bounds[f, 2] <= bounds[f, 3]:
            for band in range(bounds[f, 2] // BAND, bounds[f, 3] // BAND + 1):
                members[starts[band]] = f
                starts[band] += 1


@kernel(rows="ends")
def first_hits(begin, stop, rays, tree, bounds, members, ends, triangle, z):
    """Write the first triangle of every texel's ray: the smallest z, and of equal z the smallest number.

    bounds: of bound_triangles. members, ends: (n,) int32 and (bands,) int64, the triangles of each band of rows, one
    band after the other, and the end of each band. triangle, z: (H, W) int32 and float64, -1 and far where there is no
    hit.
    """
    height, near = triangle.shape[0], rays.near
    for band in range(begin, stop):
        top, bottom = band * BAND, min((band + 1) * BAND, height)
        triangle[top:bottom], z[top:bottom] = -1, rays.far
        for m in range(0 if band == 0 else ends[band - 1], ends[band]):
            f = members[m]
            face, t = tree.order[f], triangle_at(tree.corners, f)
            nearest = min(t.az, t.bz, t.cz)
            for j in range(max(bounds[f, 2], top), min(bounds[f, 3] + 1, bottom)):
                for i in range(bounds[f, 0], bounds[f, 1] + 1):
                    if nearest > z[j, i]:
                        continue
                    hit, here = hit_triangle(
                        rays.columns[0, i], rays.rows[0, j], rays.columns[1, i], rays.rows[1, j], t
                    )
                    first = here < z[j, i] or (here == z[j, i] and face < triangle[j, i])
                    if hit and first and near < here:
                        triangle[j, i], z[j, i] = np.int32(face), here
