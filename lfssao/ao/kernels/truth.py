"""Ray-cast ambient occlusion, float64: rays and the values of their hits, in batches or through our own tree.

Equal bits anywhere. Whether a ray hits a triangle is decided by ``hit_triangle`` after its axes have been renamed so
that the ray's steepest is z. The tree only leaves out boxes that the ray cannot touch: they are larger than their
triangles by far more than the tests below can be off, so the result is that of trying every triangle.
"""

from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from lfssao.core.elementary import sincospi
from lfssao.core.jit import formula, kernel
from lfssao.core.philox import philox4x32
from lfssao.core.vectors import Vector, disk_axes
from lfssao.gbuffer.kernels.bvh import LEAF
from lfssao.gbuffer.kernels.triangle import Triangle, hit_triangle

COSINE, UNIFORM = 0, 1
CONSTANT, LINEAR, QUADRATIC, CUBIC, SHELL = 0, 1, 2, 3, 4
_WORD = 4294967296.0
_MASK = np.uint64(0xFFFFFFFF)
_32 = np.uint64(32)


class Cast(NamedTuple):
    """The numbers of a run of ray-cast ambient occlusion."""

    radius: float  # R, world units; it may be infinite
    step: float  # how far off the surface rays begin along the normal, world units
    weighting: int  # COSINE or UNIFORM
    falloff: int  # CONSTANT, LINEAR, QUADRATIC, CUBIC or SHELL
    strata: int  # a round has strata squared rays
    least: int  # rounds of a texel, 2 or more
    most: int
    tolerance: float  # a texel is done when its standard error is not above it
    seed: np.uint64  # key of the random numbers


@formula
def local_direction(u, v, weighting):
    """A direction about (0, 0, 1) from (u, v) in (0, 1)^2: COSINE (density cos / pi) or UNIFORM (1 / 2 pi)."""
    sine, cosine = sincospi(2.0 * v)
    if weighting == COSINE:
        r, z = sqrt(u), sqrt(1.0 - u)
    else:
        r, z = sqrt(1.0 - u * u), u
    return r * cosine, r * sine, z


@formula
def ray_direction(texel, number, cell, cast, axes):
    """Direction of one ray of a texel's round, which has one in each of strata x strata cells of (u, v), row by row.

    The ray of cell c of round number r has Philox words 0 and 1 of counter (r strata^2 + c, 0, texel, 0).
    """
    strata, seed = cast.strata, cast.seed
    a, b, _, _ = philox4x32(number * strata * strata + cell, 0, texel, 0, seed & _MASK, seed >> _32)
    u = (np.float64(cell % strata) + (np.float64(a) + 0.5) / _WORD) / np.float64(strata)
    v = (np.float64(cell // strata) + (np.float64(b) + 0.5) / _WORD) / np.float64(strata)
    x, y, z = local_direction(u, v, cast.weighting)
    dx = (axes[0, 0] * x + axes[1, 0] * y) + axes[2, 0] * z
    dy = (axes[0, 1] * x + axes[1, 1] * y) + axes[2, 1] * z
    dz = (axes[0, 2] * x + axes[1, 2] * y) + axes[2, 2] * z
    return dx, dy, dz


@formula
def covered(t, far, falloff):
    """Value of a hit at distance t, 1 - rho, rho rising from 0 at 0 to 1 at far; 0 for no hit, t = infinity."""
    if not t <= far or t == np.inf:
        return 0.0
    if falloff == CONSTANT:
        return 1.0
    part = t / far
    if falloff == LINEAR:
        return 1.0 - part
    if falloff == QUADRATIC:
        return 1.0 - part * part
    if falloff == CUBIC:
        return 1.0 - part * part * part
    part = max(part, 0.8)
    return (1.0 - part * part * part) / 0.488  # 1 - 0.8^3


class Begun(NamedTuple):
    """Texels that cast rays: their numbers (n,) int64, where these begin (n, 3), two axes and the normal (n, 3, 3)."""

    texels: Any
    points: Any
    axes: Any


@kernel
def begin_texels(seen, positions, normals, step, begun):
    """Write, and count, those of the texels ``seen`` that have a normal; positions, normals: (T, 3), row by row."""
    found = 0
    for texel in seen:
        normal, point, axes = normals[texel], begun.points[found], begun.axes[found]
        x, y, z = np.float64(normal[0]), np.float64(normal[1]), np.float64(normal[2])
        length = sqrt((x * x + y * y) + z * z)
        if length > 0.0:
            x, y, z = x / length, y / length, z / length
            axes[2, 0], axes[2, 1], axes[2, 2] = x, y, z
            e, f = disk_axes(Vector(x, y, z), z >= 0.0)
            axes[0, 0], axes[0, 1], axes[0, 2] = e.x, e.y, e.z
            axes[1, 0], axes[1, 1], axes[1, 2] = f.x, f.y, f.z
            for axis in range(3):
                point[axis] = np.float64(positions[texel, axis]) + step * axes[2, axis]
            begun.texels[found] = texel
            found += 1
    return found


@kernel
def write_round(chosen, begun, number, cast, middle, unit, origins, directions):
    """Write round ``number``'s rays of chosen places in ``begun``, float32, about ``middle`` in units of ``unit``."""
    row = 0
    for place in chosen:
        point, axes = begun.points[place], begun.axes[place]
        x, y, z = (point[0] - middle[0]) / unit, (point[1] - middle[1]) / unit, (point[2] - middle[2]) / unit
        for cell in range(cast.strata * cast.strata):
            dx, dy, dz = ray_direction(begun.texels[place], number, cell, cast, axes)
            origins[row, 0], origins[row, 1], origins[row, 2] = x, y, z
            directions[row, 0], directions[row, 1], directions[row, 2] = dx, dy, dz
            row += 1


@kernel
def add_round(chosen, number, strata, distances, far, falloff, totals, squares, errors):
    """Add the mean m of a round to each chosen texel's sums, and write the standard error of the mean of k so far.

    The error is sqrt((sum m^2 - (sum m)^2 / k) / (k (k - 1))).
    number: rounds before this one. distances: (n strata^2,), of each ray's hit, infinity for none; far: the radius in
    their unit. totals, squares: sums of the rounds' means and of their squares, in and out. errors: out,
    infinity after the first round.
    """
    row, done = 0, np.float64(number + 1)
    for place in chosen:
        total = 0.0
        for _ in range(strata * strata):
            total += covered(np.float64(distances[row]), far, falloff)
            row += 1
        mean = total / np.float64(strata * strata)
        totals[place] += mean
        squares[place] += mean * mean
        rest = max(squares[place] - totals[place] * totals[place] / done, 0.0)
        errors[place] = sqrt(rest / (done * (done - 1.0))) if number else np.inf


@kernel
def add_directions(chosen, begun, number, cast, distances, far, sums):
    """Add the open part of a round's rays, each (1 - value of its hit) times its direction, to sums (n, 3).

    chosen, number, distances, far: as of ``add_round``.
    """
    row = 0
    for place in chosen:
        x, y, z = 0.0, 0.0, 0.0
        for cell in range(cast.strata * cast.strata):
            dx, dy, dz = ray_direction(begun.texels[place], number, cell, cast, begun.axes[place])
            part = 1.0 - covered(np.float64(distances[row]), far, cast.falloff)
            x, y, z = x + part * dx, y + part * dy, z + part * dz
            row += 1
        sums[place, 0] += x
        sums[place, 1] += y
        sums[place, 2] += z


_STACK = 128  # two nodes a level
_SMALL = 1e-200


@formula
def _enters(boxes, node, px, py, pz, ix, iy, iz, far):
    """Whether a ray touches a box between 0 and far; (ix, iy, iz): one over its direction."""
    a, b = (boxes[node, 0] - px) * ix, (boxes[node, 3] - px) * ix
    near, end = min(a, b), max(a, b)
    a, b = (boxes[node, 1] - py) * iy, (boxes[node, 4] - py) * iy
    near, end = max(near, min(a, b)), min(end, max(a, b))
    a, b = (boxes[node, 2] - pz) * iz, (boxes[node, 5] - pz) * iz
    near, end = max(near, min(a, b)), min(end, max(a, b))
    return (near <= end) & (end >= 0.0) & (near <= far)


@formula
def _inverse(d):
    """One over a component of a direction; finite, as 0 times infinity would be no number."""
    return 1.0 / d if abs(d) > _SMALL else 1.0 / _SMALL


@kernel
def first_distance(point, dx, dy, dz, far, any_hit, tree, stack):
    """Distance along a unit direction to the first triangle, or to any, in (0, far], else infinity; stack: scratch."""
    px, py, pz = point[0], point[1], point[2]
    corners, boxes = tree.corners, tree.boxes
    kz, way = 0 if abs(dx) >= abs(dy) and abs(dx) >= abs(dz) else 1 if abs(dy) >= abs(dz) else 2, (dx, dy, dz)
    kx, ky, o, d = (kz + 1) % 3, (kz + 2) % 3, point[kz], way[kz]
    sx, sy = way[kx] / d, way[ky] / d
    ox, oy = point[kx] - sx * o, point[ky] - sy * o
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
def tree_distances(chosen, begun, number, cast, tree, distances):
    """Write how far each ray of round ``number`` of chosen places in ``begun`` goes through the tree, world units."""
    stack, row, any_hit = np.empty(_STACK, np.int64), 0, cast.falloff == CONSTANT
    for place in chosen:
        texel, point, axes = begun.texels[place], begun.points[place], begun.axes[place]
        for cell in range(cast.strata * cast.strata):
            dx, dy, dz = ray_direction(texel, number, cell, cast, axes)
            distances[row] = first_distance(point, dx, dy, dz, cast.radius, any_hit, tree, stack)
            row += 1
