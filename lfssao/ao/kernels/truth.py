"""Ray-cast ambient occlusion through our own tree: float64, equal bits anywhere.

Whether a ray hits a triangle is decided by ``hit_triangle`` after its axes have been renamed so that the ray's steepest
is z. The tree only leaves out boxes that the ray cannot touch: they are larger than their triangles by far more than
the tests below can be off, so the result is that of trying every triangle.
"""

import numpy as np
from numba import prange

from lfssao.ao.kernels.truth_rays import CONSTANT, begin_texel, covered, ray_direction, standard_error
from lfssao.core.jit import kernel
from lfssao.gbuffer.kernels.bvh import LEAF
from lfssao.gbuffer.kernels.triangle import Triangle, hit_triangle

_STACK = 128  # two nodes a level
_SMALL = 1e-200


@kernel(inline=True)
def _enters(boxes, node, px, py, pz, ix, iy, iz, far):
    """Whether a ray touches a box between 0 and far; (ix, iy, iz): one over its direction."""
    a, b = (boxes[node, 0] - px) * ix, (boxes[node, 3] - px) * ix
    near, end = min(a, b), max(a, b)
    a, b = (boxes[node, 1] - py) * iy, (boxes[node, 4] - py) * iy
    near, end = max(near, min(a, b)), min(end, max(a, b))
    a, b = (boxes[node, 2] - pz) * iz, (boxes[node, 5] - pz) * iz
    near, end = max(near, min(a, b)), min(end, max(a, b))
    return (near <= end) & (end >= 0.0) & (near <= far)


@kernel(inline=True)
def _inverse(d):
    """One over a component of a direction; finite, as 0 times infinity would be no number."""
    return 1.0 / d if abs(d) > _SMALL else 1.0 / _SMALL


@kernel
def first_distance(point, dx, dy, dz, far, any_hit, tree, stack):
    """Distance from a point along a unit direction to the first triangle, infinity where there is none in (0, far].

    any_hit: any distance to a triangle within reach will do. stack: (_STACK,) int64, scratch.
    """
    px, py, pz = point[0], point[1], point[2]
    corners, boxes = tree.corners, tree.boxes
    if abs(dx) >= abs(dy) and abs(dx) >= abs(dz):
        kx, ky, kz, o, d = 1, 2, 0, px, dx
        ox, oy, sx, sy = py - (dy / dx) * px, pz - (dz / dx) * px, dy / dx, dz / dx
    elif abs(dy) >= abs(dz):
        kx, ky, kz, o, d = 2, 0, 1, py, dy
        ox, oy, sx, sy = pz - (dz / dy) * py, px - (dx / dy) * py, dz / dy, dx / dy
    else:
        kx, ky, kz, o, d = 0, 1, 2, pz, dz
        ox, oy, sx, sy = px - (dx / dz) * pz, py - (dy / dz) * pz, dx / dz, dy / dz
    ix, iy, iz = _inverse(dx), _inverse(dy), _inverse(dz)
    first_leaf = (boxes.shape[0] + 1) // 2 - 1
    best = np.inf
    stack[0] = 0
    top = 1
    while top > 0:
        top -= 1
        node = stack[top]
        if not _enters(boxes, node, px, py, pz, ix, iy, iz, min(far, best)):
            continue
        if node < first_leaf:
            stack[top], stack[top + 1] = 2 * node + 1, 2 * node + 2
            top += 2
            continue
        start = LEAF * (node - first_leaf)
        for p in range(start, min(start + LEAF, corners.shape[0])):
            turned = Triangle(
                corners[p, kx], corners[p, ky], corners[p, kz],
                corners[p, 3 + kx], corners[p, 3 + ky], corners[p, 3 + kz],
                corners[p, 6 + kx], corners[p, 6 + ky], corners[p, 6 + kz],
            )  # fmt: skip
            hit, z = hit_triangle(ox, oy, sx, sy, turned)
            t = (z - o) / d
            if hit and 0.0 < t <= far and t < best:
                best = t
                if any_hit:
                    return best
    return best


@kernel
def round_mean(texel, number, cast, point, axes, tree, stack):
    """Mean value of a texel's rays of one round, from a point about its axes."""
    total, cells = 0.0, cast.strata * cast.strata
    for cell in range(cells):
        dx, dy, dz = ray_direction(texel, number, cell, cast, axes)
        t = first_distance(point, dx, dy, dz, cast.radius, cast.falloff == CONSTANT, tree, stack)
        total += covered(t, cast.radius, cast.falloff)
    return total / np.float64(cells)


@kernel(parallel=True)
def ray_cast_rows(rows, depth, positions, normals, cast, tree, occlusion, error, rays):
    """Ray-cast AO of the rows from rows[0] to before rows[1].

    depth, positions, normals: the textures, of which texels without a surface or a normal give 0. occlusion, error,
    rays: (H, W) float64, float64, int64, out: mean of the rounds' means; their standard error; rays cast.
    """
    first, last = rows
    width = depth.shape[1]
    for k in prange(last - first):
        j = first + k
        stack, point, axes = np.empty(_STACK, np.int64), np.empty(3), np.empty((3, 3))
        for i in range(width):
            occlusion[j, i], error[j, i], rays[j, i] = 0.0, 0.0, 0
            if not depth[j, i] < np.inf or not begin_texel(positions[j, i], normals[j, i], cast.step, point, axes):
                continue
            total, squares, done, spread = 0.0, 0.0, 0, np.inf
            while done < cast.least or (done < cast.most and spread > cast.tolerance):
                mean = round_mean(j * width + i, done, cast, point, axes, tree, stack)
                total += mean
                squares += mean * mean
                done += 1
                if done > 1:
                    spread = standard_error(total, squares, done)
            occlusion[j, i], error[j, i], rays[j, i] = total / done, spread, done * cast.strata * cast.strata
