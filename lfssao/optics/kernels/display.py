"""Any display of modules, screen and observers: physical space -> image, and the ray of a texel (DESIGN section 2).

A point on a curved screen is handed to the homography as its central projection from the lens onto the plane z = 0:
a projector's optics see directions. On a flat screen that is the point itself.
"""

from typing import Any, NamedTuple

import numpy as np

from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import as_float, known, number, plain, select, twice
from lfssao.core.vectors import Vector, dot

NEVER = 3e38  # finite in float32 too, as JSON has no infinity

VALID = 0
BEHIND_MODULE = 1  # at the module's lens or beyond it
BEHIND_OBSERVER = 2  # at the observers or beyond them
MISSES_SCREEN = 3  # no point of the curved screen shows it
FOLDED = 4  # the optics do not form a picture there
OUTSIDE = 5  # in the mapping's domain, but not in the texture

_NEWTON_STEPS = 60


class DisplayModule(NamedTuple):
    """The 32 numbers of one module in their order, float64 for rays, the arithmetic's dtype in AO kernels.

    The screen is a vertical cylinder through the origin with its axis at z = 1 / curvature: convex, towards the
    viewers, for a positive curvature, concave for a negative one. The arc passes through (0, z_o) in the same way.
    """

    m_x: Any  # the module's lens, metres
    m_y: Any
    m_z: Any
    y_o: Any  # height of the observers, metres
    z_o: Any  # z of their line, or of their arc at x = 0
    screen_curvature: Any  # 1 / radius; 0: a plane
    observer_curvature: Any  # 1 / radius; 0: a line
    conical: Any  # 1 for the conical diffuser (flat screens and observer lines only), 0 for the linear one
    homography: Any  # 9, rows of three, from the plane z = 0, as seen from the lens, to texels
    c_u: Any  # centre of the radial distortion, texels
    c_v: Any
    unit: Any  # its unit of length, texels
    k1: Any  # its coefficients
    k2: Any
    fold: Any  # square of the radius, in that unit, at which it folds, 1 + 3 k1 r^2 + 5 k2 r^4 = 0, or NEVER
    inverse: Any  # 9, of the homography


@formula
def display_module(d: Any) -> Any:
    """The numbers of one module, an array (32,), by their names."""
    homography = (d[8], d[9], d[10], d[11], d[12], d[13], d[14], d[15], d[16])
    inverse = (d[23], d[24], d[25], d[26], d[27], d[28], d[29], d[30], d[31])
    return DisplayModule(
        d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7], homography, d[17], d[18], d[19], d[20], d[21], d[22], inverse
    )


@formula
def circle_crossing(curvature, x, z, dx, dz):
    """The t at which the line (x, z) + t (dx, dz) leaves the circle curvature (x^2 + z^2) = 2 z; the discriminant.

    a t^2 + 2 b t + c = 0 with a = curvature |d|^2, b = curvature p . d - d_z, c = curvature |p|^2 - 2 p_z has the
    root t = -c / (b + sqrt(b^2 - a c)): the far one of a convex screen, the near one of a concave one, and for no
    curvature the crossing with z = 0, with no digits lost on the way there.
    """
    a = curvature * (dx * dx + dz * dz)
    b = curvature * (x * dx + z * dz) - dz
    c = curvature * (x * x + z * z) - twice(z)
    discriminant = b * b - a * c
    return -c / (b + np.sqrt(select(discriminant > 0, discriminant, 0))), discriminant


@formula
def screen_point(d, x, y, z):
    """Screen point that shows a physical point to the observers: s_x, s_y, s_z, and four conditions.

    The point lies before the module, and before the observers; the screen shows it; the diffuser does not turn its ray
    back. Here and in ``screen_to_image``
    nothing returns early, so that loops over points become vectors.
    """
    m_x, m_z = number(d.m_x, z), number(d.m_z, z)
    # Line from the lens through the point, seen from above: the screen at t_s, the observers at t_v.
    t_s, crosses_screen = circle_crossing(d.screen_curvature, m_x, m_z, x - m_x, z - m_z)
    t_v, crosses_observers = circle_crossing(d.observer_curvature, m_x, m_z - d.z_o, x - m_x, z - m_z)
    on_screen = ~(crosses_screen < 0) & (t_s > 0) & (t_s < t_v)
    observed = ~(crosses_observers < 0) & (t_v > 1)
    ahead, spread = z < m_z, z < np.inf
    s_y = d.y_o + (y - d.y_o) * ((t_v - t_s) / (t_v - 1))
    if d.conical == 0:
        s_x = m_x + t_s * (x - m_x)
        s_z = m_z + t_s * (z - m_z) if d.screen_curvature != 0 else number(0, z)
    else:
        # Conical diffuser: the ray keeps (s_x - m_x) / h_m, its slope against the screen's horizontal axis.
        h_m = np.sqrt((s_y - d.m_y) * (s_y - d.m_y) + m_z * m_z)
        h_e = np.sqrt((s_y - d.y_o) * (s_y - d.y_o) + number(d.z_o, z) * d.z_o)
        kappa = (z / d.z_o) * (h_e / h_m)
        s_x, s_z = (x + m_x * kappa) / (1 + kappa), number(0, z)
        spread = 1 + kappa > 0
    return s_x, s_y, s_z, ahead, observed, on_screen, spread


@formula
def apply_homography(h, x, y):
    """(x, y, 1) times a homography, nine numbers: u, v and the divisor, which must be positive."""
    point = Vector(x, y, number(1, x))
    w = dot(Vector(number(h[6], x), number(h[7], x), number(h[8], x)), point)
    if h[6] == 0 and h[7] == 0 and h[8] == 1:
        w = known(w, 1)  # a divisor that a renderer may leave out
    u = dot(Vector(number(h[0], x), number(h[1], x), number(h[2], x)), point) / w
    v = dot(Vector(number(h[3], x), number(h[4], x), number(h[5], x)), point) / w
    return u, v, w


@formula
def distort(d, u, v):
    """Radial distortion of texel coordinates: c + f a (1 + k1 r^2 + k2 r^4), and r^2, from d.fold on of no picture."""
    a, b = (u - d.c_u) / d.unit, (v - d.c_v) / d.unit
    r2 = a * a + b * b
    factor = 1 + r2 * (d.k1 + r2 * d.k2)
    return d.c_u + d.unit * (a * factor), d.c_v + d.unit * (b * factor), r2


@formula
def screen_to_image(d, s_x, s_y, s_z):
    """Image point of a screen point, by way of the plane z = 0: u, v, and two conditions.

    The lens sees the point, and the optics form a picture there.
    """
    flat = s_z == 0
    scale = d.m_z / (d.m_z - s_z)
    x = select(flat, s_x, d.m_x + (s_x - d.m_x) * scale)
    y = select(flat, s_y, d.m_y + (s_y - d.m_y) * scale)
    u, v, w = apply_homography(d.homography, x, y)
    formed = w > 0
    if d.k1 != 0 or d.k2 != 0:
        u, v, r2 = distort(d, u, v)
        formed = formed & (r2 < d.fold)
    return u, v, flat | (scale > 0), formed


@formula
def display_to_image(d, x, y, z):
    """Image coordinates u and v of a physical point, and whether the mapping is defined there."""
    s_x, s_y, s_z, ahead, observed, on_screen, spread = screen_point(d, x, y, z)
    u, v, seen, formed = screen_to_image(d, s_x, s_y, s_z)
    return u, v, ahead & observed & on_screen & spread & seen & formed


@kernel(inline=True)
def physical_to_image(d: Any, x: Any, y: Any, z: Any) -> Any:
    """Image coordinates u and v, texels, of a physical point, metres, and its status.

    All numbers have the dtype of the module's; image z is z. u and v are 0 unless the status is VALID; a valid point
    may lie outside the texture.
    """
    zero = type(x)(0)
    s_x, s_y, s_z, ahead, observed, on_screen, spread = screen_point(d, as_float(x), as_float(y), as_float(z))
    u, v, seen, formed = screen_to_image(d, s_x, s_y, s_z)
    # The last status is the first that counts; off the screen: it is not reached, or only behind the observers.
    status = VALID if formed else FOLDED
    status = status if seen else MISSES_SCREEN
    status = status if spread else BEHIND_MODULE
    status = status if on_screen else MISSES_SCREEN
    status = status if observed else BEHIND_OBSERVER
    status = status if ahead else BEHIND_MODULE
    return plain(u) if status == VALID else zero, plain(v) if status == VALID else zero, status


@kernel
def undistort(d, u, v):
    """Inverse of distort, float64, by Newton's steps between bounds that close in; NaN beyond all that it reaches."""
    a, b = (u - d.c_u) / d.unit, (v - d.c_v) / d.unit
    target = np.sqrt(a * a + b * b)
    if target == 0.0:
        return u, v
    fold = d.fold
    if fold < NEVER and target >= np.sqrt(fold) * (1.0 + fold * (d.k1 + fold * d.k2)):
        return np.nan, np.nan
    low, high = 0.0, min(np.sqrt(fold), max(2.0 * target, 1.0) * 1e3)
    r = min(target, 0.5 * high)
    for _ in range(_NEWTON_STEPS):
        r2 = r * r
        value = r * (1.0 + r2 * (d.k1 + r2 * d.k2)) - target
        if value == 0.0:
            break
        if value > 0.0:
            high = r
        else:
            low = r
        slope = 1.0 + r2 * (3.0 * d.k1 + r2 * (5.0 * d.k2))
        step = r - value / slope if slope > 0.0 else -1.0
        step = step if low < step < high else 0.5 * (low + high)
        if step == r:
            break
        r = step
    scale = r / target
    return d.c_u + d.unit * (a * scale), d.c_v + d.unit * (b * scale)


@kernel
def display_ray(d, u, v):
    """The line of physical points that land on image point (u, v): o_x, o_y, d_x, d_y, z_near, z_far, float64.

    x = o_x + d_x z, y = o_y + d_y z for z from the observers, z_near, to the lens, z_far; z_near >= z_far where the
    texel has no ray.
    """
    if d.k1 != 0.0 or d.k2 != 0.0:
        u, v = undistort(d, u, v)
        if np.isnan(u):
            return 0.0, 0.0, 0.0, 0.0, 1.0, 0.0
    s_x, s_y, w = apply_homography(d.inverse, u, v)
    if not w > 0.0:
        return 0.0, 0.0, 0.0, 0.0, 1.0, 0.0
    m_x, m_y, m_z, y_o, z_o = d.m_x, d.m_y, d.m_z, d.y_o, d.z_o
    if d.conical != 0.0:
        h_m = np.sqrt((s_y - m_y) * (s_y - m_y) + m_z * m_z)
        h_e = np.sqrt((s_y - y_o) * (s_y - y_o) + z_o * z_o)
        # The ray meets the observer line at e_x = s_x + (s_x - m_x) h_e / h_m.
        slope = (s_x - m_x) * (h_e / h_m)
        return s_x, s_y, slope / z_o, (y_o - s_y) / z_o, z_o, min(m_z, -z_o * (h_m / h_e))
    # From the lens through the screen to the observers, seen from above; lens at t = 0, plane z = 0 at t = 1.
    dx, dz = s_x - m_x, -m_z
    t_s, crosses_screen = circle_crossing(d.screen_curvature, m_x, m_z, dx, dz)
    t_v, crosses_observers = circle_crossing(d.observer_curvature, m_x, m_z - z_o, dx, dz)
    if crosses_screen < 0.0 or crosses_observers < 0.0 or not 0.0 < t_s < t_v:
        return 0.0, 0.0, 0.0, 0.0, 1.0, 0.0
    on_y, on_z = m_y + t_s * (s_y - m_y), m_z + t_s * dz
    e_z = m_z + t_v * dz
    d_x, d_y = dx / dz, (y_o - on_y) / (e_z - on_z)
    return s_x, on_y - d_y * on_z, d_x, d_y, e_z, m_z


@kernel
def map_points(numbers, points, width, height, image, statuses):
    """physical_to_image of (n, 3) points into image and statuses: NaN for none, OUTSIDE beyond the texture."""
    d = display_module(numbers)
    for k in range(points.shape[0]):
        z = points[k, 2]
        u, v, status = physical_to_image(d, points[k, 0], points[k, 1], z)
        if status == VALID:
            image[k, 0], image[k, 1], image[k, 2] = u, v, z
            if not (0 <= u < width and 0 <= v < height):
                status = OUTSIDE
        else:
            image[k, 0], image[k, 1], image[k, 2] = np.nan, np.nan, np.nan
        statuses[k] = status


@kernel
def trace_texels(numbers, u, v, lines):
    """display_ray of n image points; numbers: (32,) of a module; lines: (n, 6) float64."""
    d = display_module(numbers)
    for k in range(u.shape[0]):
        lines[k, 0], lines[k, 1], lines[k, 2], lines[k, 3], lines[k, 4], lines[k, 5] = display_ray(d, u[k], v[k])
