"""Depths on the triangles that Embree names, in float64."""

from numba import prange

from lfssao.core.jit import kernel
from lfssao.gbuffer.kernels.triangle import edge_function
from lfssao.optics.kernels.rays import texel_ray


@kernel(parallel=True)
def hits_on_triangles(kind, lens, width, corners, place_of, triangle, z, weights, top=0):
    """Depth and barycentric weights of each texel's ray on a given triangle, as ``hit_triangle`` computes them.

    Embree's float32 may name a triangle that the ray passes by: negative weights are then set to 0, which gives a
    point of the triangle next to the ray.

    Parameters
    ----------
    kind, lens : int, float64 array
        The rays (``lfssao.optics.kernels.rays``).
    width : int
        Width of the texture.
    corners, place_of
        The tree (``gbuffer.kernels.bvh``): corners of the triangles in its order, the place of each triangle there.
    triangle : (n,) int32
        Number of the triangle, -1 where there is none; set to -1 where the ray sees the triangle exactly edge on.
    z : (n,) float64
        Out: z of the hit in cast space; untouched where there is none.
    weights : (n, 2) float64
        Out: weights of the triangle's second and third corner; untouched where there is none.
    top : int
        The row of the view that row 0 here is.
    """
    for texel in prange(triangle.shape[0]):
        if triangle[texel] < 0:
            continue
        j = texel // width
        ox, oy, _, dx, dy, _, _, _ = texel_ray(kind, lens, (texel - j * width) + 0.5, (top + j) + 0.5)
        p = place_of[triangle[texel]]
        az, bz, cz = corners[p, 2], corners[p, 5], corners[p, 8]
        ap, aq = corners[p, 0] - (ox + dx * az), corners[p, 1] - (oy + dy * az)
        bp, bq = corners[p, 3] - (ox + dx * bz), corners[p, 4] - (oy + dy * bz)
        cp, cq = corners[p, 6] - (ox + dx * cz), corners[p, 7] - (oy + dy * cz)
        u = edge_function(bp, cq, bq, cp)
        v = edge_function(cp, aq, cq, ap)
        w = edge_function(ap, bq, aq, bp)
        area = (u + v) + w
        if area == 0.0:
            triangle[texel] = -1
            continue
        side = 1.0 if area > 0.0 else -1.0
        u, v, w = max(side * u, 0.0), max(side * v, 0.0), max(side * w, 0.0)
        area = (u + v) + w
        depth = ((u * az + v * bz) + w * cz) / area
        z[texel] = min(max(depth, min(az, bz, cz)), max(az, bz, cz))
        weights[texel, 0], weights[texel, 1] = v / area, w / area
