"""The ray of a texel: the straight line of points that land on the texel's centre, nearest to the viewer first.

Rays live in cast space: physical space for a display's module (metres, z away from the viewers), eye space for a
camera (world units, z forward). A ray is origin + t direction for t in [t_near, t_far]. All in float64.

Rays have the kind of the projection that they belong to, and numbers of their own.
"""

from math import sqrt
from typing import Any, NamedTuple

from lfssao.core.jit import formula, kernel
from lfssao.optics.kernels.display import display_module, display_ray
from lfssao.optics.kernels.projection import CROSSED_SLITS, DISPLAY, MATRIX, affine_row


class Rays(NamedTuple):
    """The rays of a texture's texels."""

    kind: int  # CROSSED_SLITS, MATRIX or DISPLAY
    numbers: Any  # FlatModule, Pinhole or DisplayModule as an array, (8,) or (32,) float64


class FlatModule(NamedTuple):
    """CROSSED_SLITS: lens and observer line, and screen -> texel, u = u_scale s_x + u_0, v = v_scale s_y + v_0."""

    m_x: Any
    m_z: Any
    y_o: Any
    z_o: Any
    u_scale: Any
    u_0: Any
    v_scale: Any
    v_0: Any


class Pinhole(NamedTuple):
    """MATRIX: focal lengths and centre, texels, near and far plane; an orthographic camera has texels per unit.

    Depth is z of cast space where ``linear`` is not 0, else screen space z.
    """

    f_u: Any
    f_v: Any
    c_u: Any
    c_v: Any
    near: Any
    far: Any
    orthographic: Any
    linear: Any


@formula
def pinhole(n):
    """The numbers of a camera, an array (8,), by their names."""
    return Pinhole(n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7])


@kernel(inline=True)
def texel_ray(rays: Any, u: Any, v: Any) -> Any:
    """Ray through image point (u, v): origin, direction (with z component 1, so that t is a depth), t_near, t_far.

    CROSSED_SLITS, S = (s_x, s_y) the screen point: x(z) = m_x + (s_x - m_x)(m_z - z) / m_z and
    y(z) = y_o + (s_y - y_o)(z - z_o) / (-z_o), written as S + z direction.
    """
    kind, n = rays
    if kind == CROSSED_SLITS:
        flat = FlatModule(n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7])
        s_x = (u - flat.u_0) / flat.u_scale
        s_y = (v - flat.v_0) / flat.v_scale
        d_x, d_y = (flat.m_x - s_x) / flat.m_z, (flat.y_o - s_y) / flat.z_o
        return s_x, s_y, 0.0, d_x, d_y, 1.0, flat.z_o, flat.m_z
    if kind == DISPLAY:
        o_x, o_y, d_x, d_y, z_near, z_far = display_ray(display_module(n), u, v)
        return o_x, o_y, 0.0, d_x, d_y, 1.0, z_near, z_far
    camera = pinhole(n)
    x = (u - camera.c_u) / camera.f_u
    y = (camera.c_v - v) / camera.f_v
    if camera.orthographic == 0.0:
        return 0.0, 0.0, 0.0, x, y, 1.0, camera.near, camera.far
    return x, y, 0.0, 0.0, 0.0, 1.0, camera.near, camera.far


@kernel(rows="directions")
def write_directions(begin, stop, rays, m, directions):
    """Write unit directions of texels' rays in world space, (H, W, 3), m the map cast -> world, (12,); 0 for no ray."""
    for j in range(begin, stop):
        for i in range(directions.shape[1]):
            _, _, _, dx, dy, _, _, _ = texel_ray(rays, i + 0.5, j + 0.5)
            x = (m[0] * dx + m[1] * dy) + m[2]
            y = (m[4] * dx + m[5] * dy) + m[6]
            z = (m[8] * dx + m[9] * dy) + m[10]
            length = sqrt((x * x + y * y) + z * z)
            has_ray = length > 0.0  # False for NaN
            directions[j, i, 0] = x / length if has_ray else 0.0
            directions[j, i, 1] = y / length if has_ray else 0.0
            directions[j, i, 2] = z / length if has_ray else 0.0


@kernel
def write_lines(rays, m, u, v, lines):
    """Write the rays through n image points as lines of the world, (n, 8); m the map cast -> world, (12,).

    A line is the world points at cast z = 0 and 1, then cast z of the ray's ends.
    """
    for k in range(lines.shape[0]):
        ox, oy, _, dx, dy, _, near, far = texel_ray(rays, u[k], v[k])
        for row in range(3):
            lines[k, row] = affine_row(m, row, ox, oy, 0.0)
            lines[k, 3 + row] = affine_row(m, row, ox + dx, oy + dy, 1.0)
        lines[k, 6], lines[k, 7] = near, far


@kernel
def image_depth(rays, z):
    """The depth texture's value for a point at z of cast space: z of a display or a linear camera, else screen z."""
    kind, numbers = rays
    if kind != MATRIX:
        return z
    camera = pinhole(numbers)
    if camera.linear != 0.0:
        return z
    near, far = camera.near, camera.far
    if camera.orthographic == 0.0:
        return far / (far - near) * (1.0 - near / z)
    return (z - near) / (far - near)


@formula
def clip_to_slab(origin, direction, low, high, t0, t1):
    """The part of [t0, t1] in which low <= origin + t direction <= high; empty (t0 > t1) where there is none."""
    if direction == 0.0:
        if low <= origin <= high:
            return t0, t1
        return 1.0, 0.0
    a = (low - origin) / direction
    b = (high - origin) / direction
    return max(t0, min(a, b)), min(t1, max(a, b))


# Not parallel, as one ray a tile is asked for: threads would save less than they cost to compile.
@kernel
def make_rays(rays, box, width, height, step, cells, origins, directions, lengths, top=0):
    """Write the rays of the cells' middle texels that meet a box, from their entries into it, and return their number.

    Cells are of step x step texels of a texture of width x height, numbered row by row; row 0 is the view's ``top``.
    The ray's cell goes into cells, (n,) int32 for all n cells, its origin and direction, rounded once, into (n, 3)
    float32, the t from the origin at which it leaves the box into lengths, (n,) float32. Origins lie on the box, so
    that float32 has its digits near the surfaces.
    """
    n, columns = 0, (width + step - 1) // step
    for cell in range(cells.shape[0]):
        j, i = cell // columns, cell % columns
        u = min(i * step + step // 2, width - 1) + 0.5
        v = (top + min(j * step + step // 2, height - 1)) + 0.5
        ox, oy, oz, dx, dy, dz, t0, t1 = texel_ray(rays, u, v)
        t0, t1 = clip_to_slab(ox, dx, box[0, 0], box[1, 0], t0, t1)
        t0, t1 = clip_to_slab(oy, dy, box[0, 1], box[1, 1], t0, t1)
        t0, t1 = clip_to_slab(oz, dz, box[0, 2], box[1, 2], t0, t1)
        if t0 <= t1:
            cells[n] = cell
            origins[n, 0], origins[n, 1], origins[n, 2] = ox + t0 * dx, oy + t0 * dy, oz + t0 * dz
            directions[n, 0], directions[n, 1], directions[n, 2] = dx, dy, dz
            lengths[n] = t1 - t0
            n += 1
    return n
