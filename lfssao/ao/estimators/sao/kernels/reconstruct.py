"""Positions rebuilt from depth, and face normals from positions (SAO section 2.3, equations 3 and 4)."""

from typing import Any

import numpy as np

from lfssao.ao.kernels.texel_rays import ray, ray_of, ray_point
from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import as_float, number, plain, select, surely
from lfssao.core.vectors import Vector, cross, dot, unit_vector


@formula
def _to_world(m, v):
    """World coordinates of a vector of cast space."""
    x = Vector(number(m[0], v.x), number(m[1], v.x), number(m[2], v.x))
    y = Vector(number(m[4], v.x), number(m[5], v.x), number(m[6], v.x))
    z = Vector(number(m[8], v.x), number(m[9], v.x), number(m[10], v.x))
    return Vector(dot(x, v), dot(y, v), dot(z, v))


@formula
def _ray_gap(view, one, other, z):
    """Distance in world space between two texels' rays at one cast z."""
    (a, b), (c, d) = ray_of(view, one, z)
    (p, q), (r, s) = ray_of(view, other, z)
    v = _to_world(view.rays.world, Vector((p - a) + z * (r - c), (q - b) + z * (s - d), number(0, z)))
    return np.sqrt(dot(v, v))


@formula
def _spacing(table, view, texel, size, z):
    if table is None:
        m = view.rays.numbers
        return abs(m[2] + z * m[4]), abs(m[7] + z * m[9])
    (height, width), here = size, np.int64(texel)
    column, row = np.int64(view.column(texel)), np.int64(view.row(texel))
    right = here + 1 if column + 1 < width else here - min(column, 1)
    below = here + width if row + 1 < height else here - width * min(row, 1)
    return _ray_gap(view, here, right, z), _ray_gap(view, here, below, z)


@formula
def spacing(view: Any, texel: Any, size: Any, z: Any) -> Any:
    """Lengths across and down of a texel at one cast z, size (height, width).

    Separable rays: |b + z d|, cast space; equation 5's z / S' of a camera. A table: distances in world space from its
    ray to the next texel's across and down (the one before it at the end of a row or column, 0 where it is alone).
    """
    return _spacing(view.rays.table, view, texel, size, z)


@formula
def _partner(view, texel, step, odd, before, after):
    """Texel number for the difference along an axis: the pair's other one, else that on the other side, else ``texel``.

    step: between neighbours along the axis; odd: whether this is the pair's second; before, after: whether there are
    neighbours in the texture.
    """
    one, other = np.uint32(select(before, texel - step, texel)), np.uint32(select(after, texel + step, texel))
    before, after = before & view.shows(one), after & view.shows(other)
    first, second = select(before, one, np.uint32(texel)), select(after, other, np.uint32(texel))
    return select(odd, select(before, one, second), select(after, other, first))


@formula
def face_normal(view, texel, column, row, size):
    """Equation 4: the unit normal of texel (column, row) from differences of positions, towards the viewer.

    A gradient is that of GPUs, within quads of 2x2 texels whose first corner is even: both texels of a pair share one
    difference. Readings: where the pair's other texel is outside or sees no surface, the difference is to the other
    side; where there is neither, or the differences are parallel, the normal is the direction towards the viewer.
    The product's sign is that with which the normal points against the texel's ray.
    """
    (height, width), here = size, view.position(texel)
    across = _partner(view, texel, 1, (column & 1) == 1, column > 0, column + 1 < width)
    down = _partner(view, texel, width, (row & 1) == 1, row > 0, row + 1 < height)
    _, (c, d) = ray(view.rays.table, view.rays.numbers, column, row, texel, here.x)
    away = _to_world(view.rays.world, Vector(c, d, number(1, here.x)))
    n = cross(view.apart(view.position(across), here), view.apart(view.position(down), here))
    alone = (across == texel) | (down == texel)  # without branches: beside a view they cost six times the rest
    n = unit_vector(Vector(select(alone, away.x, n.x), select(alone, away.y, n.y), select(alone, away.z, n.z)))
    behind = dot(n, away)
    n = select(view.fork(behind > 0), number(-1, behind), 1) * n
    turned = (behind > 0) | (behind < 0)
    if not surely(turned):
        other = number(-1, behind) * unit_vector(away)
        n = Vector(select(turned, n.x, other.x), select(turned, n.y, other.y), select(turned, n.z, other.z))
    return n


@kernel(rows="positions")
def rebuild_positions(begin, stop, view, positions):
    """Equation 3: world positions of all texels, (H, W, 3), out; +infinity where there is no surface.

    view: ``FloatView``, whose ``surfaces`` are cast z and which has rays.
    """
    width, nothing, out = positions.shape[1], positions.dtype.type(np.inf), positions.reshape(-1)
    for j in range(begin, stop):
        for i in range(width):
            texel = np.uint64(j * width + i)
            there, place = view.shows(texel), np.uint64(3) * texel
            at = ray_point(view.rays, np.int32(i), np.int32(j), texel, view.surface(texel))
            out[place] = plain(at.x) if there else nothing
            out[place + np.uint64(1)] = plain(at.y) if there else nothing
            out[place + np.uint64(2)] = plain(at.z) if there else nothing


@kernel(rows="normals")
def face_normals(begin, stop, view, normals):
    """Unit normals of all texels (``face_normal``), (H, W, 3), out; 0 where there is no surface; view: ``FloatView``.

    Its depth is +infinity where there is no surface, and it has rays.
    """
    height, width, _ = normals.shape
    zero, out = as_float(normals.dtype.type(0)), normals.reshape(-1)
    for j in range(begin, stop):
        for i in range(width):
            texel = np.uint32(j * width + i)
            n = Vector(zero, zero, zero)
            if view.shows(texel):
                n = face_normal(view, texel, np.uint32(i), np.uint32(j), (height, width))
            place = np.uint64(3) * np.uint64(texel)
            out[place], out[place + np.uint64(1)], out[place + np.uint64(2)] = plain(n.x), plain(n.y), plain(n.z)


@kernel(rows="depth")
def linear_depth(begin, stop, depth, perspective, c_0, c_1, c_2, z):
    """Distances of all texels from the eye's plane (SAO section 2.2, equation 2).

    SAO's z is negative, ours grows away from the viewer: z = -z_SAO, with near and far plane at n and f. Equation 2
    with c = (n, -1, 1) for f = infinity and (n f, n - f, f) otherwise gives it as printed. An orthographic camera's
    depth is linear already, c_0 + d c_1 with c = (n, f - n); the paper has none.
    depth, (H, W): 0 at the near plane and 1 at the far plane, +infinity where there is no surface. z, (H, W): out,
    +infinity there and where equation 2 puts the point at infinity or behind the eye.
    """
    width = depth.shape[1]
    nothing = depth.dtype.type(np.inf)
    for j in range(begin, stop):
        for i in range(width):
            d = depth[j, i]
            below = d * c_1 + c_2
            seen = (c_0 / below if below > 0 else nothing) if perspective else c_0 + d * c_1
            z[j, i] = seen if d < np.inf else nothing
