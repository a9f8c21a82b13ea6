"""The ray of a texel: the straight line of points that land on the texel's centre, nearest to the viewer first.

Rays live in cast space: physical space for a display's module (metres, z away from the viewers), eye space for a
camera (world units, z forward). A ray is origin + t direction for t in [t_near, t_far]. All in float64.

Kinds and their numbers, eight for the first three:

FLAT_LINEAR    m_x, m_z, y_o, z_o, and screen -> texel: u = u_scale s_x + u_0, v = v_scale s_y + v_0
PERSPECTIVE    focal lengths f_u, f_v and centre c_u, c_v in texels, near, far
ORTHOGRAPHIC   texels per unit f_u, f_v and centre c_u, c_v, near, far

DISPLAY        any module of any display: the 32 numbers of lfssao.optics.kernels.display
"""

import numpy as np

from lfssao.core.jit import kernel
from lfssao.optics.kernels.display import display_ray

FLAT_LINEAR = 0
PERSPECTIVE = 1
ORTHOGRAPHIC = 2
DISPLAY = 3


@kernel(inline=True)
def texel_ray(kind, lens, u, v):
    """Ray through image point (u, v): origin, direction (with z component 1, so that t is a depth), t_near, t_far.

    FLAT_LINEAR, S = (s_x, s_y) the screen point: x(z) = m_x + (s_x - m_x)(m_z - z) / m_z and
    y(z) = y_o + (s_y - y_o)(z - z_o) / (-z_o), written as S + z direction.
    """
    if kind == FLAT_LINEAR:
        m_x, m_z, y_o, z_o = lens[0], lens[1], lens[2], lens[3]
        s_x = (u - lens[5]) / lens[4]
        s_y = (v - lens[7]) / lens[6]
        return s_x, s_y, 0.0, (m_x - s_x) / m_z, (y_o - s_y) / z_o, 1.0, z_o, m_z
    if kind == DISPLAY:
        o_x, o_y, d_x, d_y, z_near, z_far = display_ray(lens, u, v)
        return o_x, o_y, 0.0, d_x, d_y, 1.0, z_near, z_far
    x = (u - lens[2]) / lens[0]
    y = (lens[3] - v) / lens[1]
    if kind == PERSPECTIVE:
        return 0.0, 0.0, 0.0, x, y, 1.0, lens[4], lens[5]
    return x, y, 0.0, 0.0, 0.0, 1.0, lens[4], lens[5]


@kernel
def image_depth(kind, lens, z):
    """The depth texture's value for a point at z of cast space.

    Displays: z itself. Cameras: the screen space z of Algorithm 1, 0 at the near plane, 1 at the far plane:
    far / (far - near) (1 - near / z) in perspective, (z - near) / (far - near) in orthographic projection.
    """
    if kind in (FLAT_LINEAR, DISPLAY):
        return z
    near, far = lens[4], lens[5]
    if kind == PERSPECTIVE:
        return far / (far - near) * (1.0 - near / z)
    return (z - near) / (far - near)


@kernel(inline=True)
def clip_to_slab(origin, direction, low, high, t0, t1):
    """The part of [t0, t1] in which low <= origin + t direction <= high; empty (t0 > t1) where there is none."""
    if direction == 0.0:
        if low <= origin <= high:
            return t0, t1
        return 1.0, 0.0
    a = (low - origin) / direction
    b = (high - origin) / direction
    return max(t0, min(a, b)), min(t1, max(a, b))


@kernel(inline=True)
def clip_to_box(ox, oy, oz, dx, dy, dz, box, t0, t1):
    """The part of [t0, t1] inside a box, (2, 3) lower and upper corner; empty (t0 > t1) where there is none."""
    t0, t1 = clip_to_slab(ox, dx, box[0, 0], box[1, 0], t0, t1)
    if t0 > t1:
        return t0, t1
    t0, t1 = clip_to_slab(oy, dy, box[0, 1], box[1, 1], t0, t1)
    if t0 > t1:
        return t0, t1
    return clip_to_slab(oz, dz, box[0, 2], box[1, 2], t0, t1)


@kernel(inline=True)
def _grid_ray(kind, lens, box, width, height, step, i, j, top):
    """The ray of the texel in the middle of cell (i, j) of step x step texels, clipped to a box: empty for t0 > t1."""
    u = min(i * step + step // 2, width - 1) + 0.5
    v = (top + min(j * step + step // 2, height - 1)) + 0.5
    ox, oy, oz, dx, dy, dz, t0, t1 = texel_ray(kind, lens, u, v)
    t0, t1 = clip_to_box(ox, oy, oz, dx, dy, dz, box, t0, t1)
    return ox, oy, oz, dx, dy, dz, t0, t1


# Not parallel, as one ray a tile is asked for: threads would save less than they cost to compile.
@kernel
def count_rays(kind, lens, box, width, height, step, columns, counts, top=0):
    """How many cells of each row of cells have a ray that meets the box; counts: (rows of cells,) int64.

    Arguments as of make_rays.
    """
    for j in range(counts.shape[0]):
        n = 0
        for i in range(columns):
            _, _, _, _, _, _, t0, t1 = _grid_ray(kind, lens, box, width, height, step, i, j, top)
            n += np.int64(t0 <= t1)
        counts[j] = n


@kernel
def make_rays(kind, lens, box, width, height, step, columns, starts, cells, origins, directions, lengths, top=0):
    """The rays that count_rays counted, from where they enter the box.

    Parameters
    ----------
    kind, lens : int, float64 array
        The kind of ray and its numbers.
    box : (2, 3) float64
        Lower and upper corner of what is to be hit, cast space.
    width, height : int
        Size of the texture.
    step, columns : int
        One ray for each cell of step x step texels; how many cells a row has.
    starts : (rows of cells,) int64
        Number of the first ray of each row of cells.
    cells : (n,) int32
        Out: row * columns + column of the ray's cell.
    origins, directions : (n, 3) float32
        Out: rounded once. The origin lies where the ray enters the box, so that float32 has its digits where the
        surfaces are.
    lengths : (n,) float32
        Out: the t, from the origin, at which the ray has left the box.
    top : int
        The row of the view that row 0 here is.
    """
    for j in range(starts.shape[0]):
        n = starts[j]
        for i in range(columns):
            ox, oy, oz, dx, dy, dz, t0, t1 = _grid_ray(kind, lens, box, width, height, step, i, j, top)
            if t0 <= t1:
                cells[n] = j * columns + i
                origins[n, 0] = ox + t0 * dx
                origins[n, 1] = oy + t0 * dy
                origins[n, 2] = oz + t0 * dz
                directions[n, 0], directions[n, 1], directions[n, 2] = dx, dy, dz
                lengths[n] = t1 - t0
                n += 1
