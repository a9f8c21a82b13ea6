"""Displays a second time. Nothing here comes from lfssao.

The faithful half follows the order of operations that ``lfssao.kernels.display`` documents, in the scalars that it is
handed (np.float32 or np.float64), so its bits must agree. The textbook half (``textbook_image``) is DESIGN section 2
in Python's floats, written from the formulas and not from the kernel: its texels must agree.
"""

import math

import numpy as np

VALID, BEHIND_MODULE, BEHIND_OBSERVER, MISSES_SCREEN, FOLDED, OUTSIDE = range(6)


# The faithful half: d is the array of a module's 32 numbers, all scalars are of its dtype.


def circle_crossing(curvature, x, z, dx, dz):
    """The root t = -c / (b + sqrt(b^2 - a c)) of a t^2 + 2 b t + c = 0, and b^2 - a c."""
    a = curvature * (dx * dx + dz * dz)
    b = curvature * (x * dx + z * dz) - dz
    c = curvature * (x * x + z * z) - (z + z)
    discriminant = b * b - a * c
    return -c / (b + (np.sqrt(discriminant) if discriminant > 0 else type(x)(0))), discriminant


def screen_point(d, x, y, z):
    dtype = type(x)
    zero, one = dtype(0), dtype(1)
    m_x, m_y, m_z, y_o, z_o, of_screen, of_arc, conical = d[:8]
    t_s, screen = circle_crossing(of_screen, m_x, m_z, x - m_x, z - m_z)
    t_v, arc = circle_crossing(of_arc, m_x, m_z - z_o, x - m_x, z - m_z)
    if not z < m_z:
        return zero, zero, zero, BEHIND_MODULE
    if arc < 0 or not t_v > one:
        return zero, zero, zero, BEHIND_OBSERVER
    if screen < 0 or not (t_s > 0 and t_s < t_v):
        return zero, zero, zero, MISSES_SCREEN
    s_y = y_o + (y - y_o) * ((t_v - t_s) / (t_v - one))
    if conical:
        h_m = np.sqrt((s_y - m_y) * (s_y - m_y) + m_z * m_z)
        h_e = np.sqrt((s_y - y_o) * (s_y - y_o) + z_o * z_o)
        kappa = (z / z_o) * (h_e / h_m)
        if not one + kappa > 0:
            return zero, zero, zero, BEHIND_MODULE
        return (x + m_x * kappa) / (one + kappa), s_y, zero, VALID
    return m_x + t_s * (x - m_x), s_y, m_z + t_s * (z - m_z) if of_screen != 0 else zero, VALID


def homography(h, x, y):
    rows = [(h[3 * k] * x + h[3 * k + 1] * y) + h[3 * k + 2] for k in range(3)]
    return rows[0] / rows[2], rows[1] / rows[2], rows[2]


@np.errstate(all="ignore")
def physical_to_image(d, x, y, z):
    """u, v and the answer, as the kernel of that name."""
    zero = type(x)(0)
    s_x, s_y, s_z, answer = screen_point(d, x, y, z)
    if answer != VALID:
        return zero, zero, answer
    if s_z != 0:
        scale = d[2] / (d[2] - s_z)
        s_x, s_y = d[0] + (s_x - d[0]) * scale, d[1] + (s_y - d[1]) * scale
        if not scale > 0:
            return zero, zero, MISSES_SCREEN
    u, v, w = homography(d[8:17], s_x, s_y)
    if not w > 0:
        return zero, zero, FOLDED
    c_u, c_v, f, k1, k2, fold = d[17:23]
    if k1 != 0 or k2 != 0:
        a, b = (u - c_u) / f, (v - c_v) / f
        r2 = a * a + b * b
        factor = type(x)(1) + r2 * (k1 + r2 * k2)
        if not r2 < fold:
            return zero, zero, FOLDED
        u, v = c_u + f * (a * factor), c_v + f * (b * factor)
    return u, v, VALID


def row(m, number, x, y, z):
    """Row of M (x, y, z, 0): (m0 x + m1 y) + m2 z."""
    a, b, c, _ = m[4 * number : 4 * number + 4]
    return (a * x + b * y) + c * z


@np.errstate(all="ignore")
def algorithm2(depth, positions, offsets, m):
    """LF Algorithm 2 with the DISPLAY mapping m, (44,): occlusion, and samples outside of each row."""
    dtype = depth.dtype.type
    height, width = depth.shape
    occlusion, outside = np.zeros((height, width), dtype), np.zeros(height, np.int64)
    for j, i in np.ndindex(height, width):  # line 1
        if not depth[j, i] < np.inf:
            continue
        pnt = [row(m, k, *positions[j, i]) + m[4 * k + 3] for k in range(3)]  # line 2, the affine half
        occluded = 0
        for offset in offsets:  # lines 3 and 4
            x, y, z = (pnt[k] + row(m, k, *offset) for k in range(3))  # lines 5 and 6
            u, v, answer = physical_to_image(m[12:], x, y, z)
            if answer != VALID or not (0 <= u < width and 0 <= v < height):
                outside[j] += 1
            elif depth[math.floor(v), math.floor(u)] < z:  # lines 7 and 8
                occluded += 1  # line 9
        occlusion[j, i] = dtype(occluded) / dtype(max(len(offsets), 1))
    return occlusion, outside


# The textbook half: plain numbers and DESIGN section 2.


def on_circle(curvature, z_0, start, end):
    """The t > 0 at which start + t (end - start) in the XZ plane crosses the circle of that curvature through (0, z_0).

    With the circle's centre and radius, by the quadratic formula: the far root of a circle that bulges towards the
    viewers, the near one of one that bulges away from them; the crossing with z = z_0 for no curvature.
    """
    (x, z), dx, dz = start, end[0] - start[0], end[1] - start[1]
    if curvature == 0:
        return (z_0 - z) / dz
    centre = z_0 + 1 / curvature
    a = dx * dx + dz * dz
    b = 2 * (x * dx + (z - centre) * dz)
    c = x * x + (z - centre) ** 2 - 1 / curvature**2
    root = math.sqrt(b * b - 4 * a * c)
    return (-b + math.copysign(root, curvature)) / (2 * a)


def textbook_screen(lens, observer, curvatures, conical, point):
    """The screen point, three numbers; lens and point are (x, y, z), observer is (y_o, z_o)."""
    (m_x, m_y, m_z), (y_o, z_o), (x, y, z) = lens, observer, point
    if curvatures == (0, 0):
        s_y = y_o + (y - y_o) * z_o / (z_o - z)
        if not conical:
            return m_x + (x - m_x) * m_z / (m_z - z), s_y, 0.0
        kappa = z / z_o * math.hypot(s_y - y_o, z_o) / math.hypot(s_y - m_y, m_z)
        return (x + m_x * kappa) / (1 + kappa), s_y, 0.0
    t_s = on_circle(curvatures[0], 0.0, (m_x, m_z), (x, z))
    t_v = on_circle(curvatures[1], z_o, (m_x, m_z), (x, z))
    s_y = y_o + (y - y_o) * (t_v - t_s) / (t_v - 1)
    return m_x + t_s * (x - m_x), s_y, m_z + t_s * (z - m_z)


def textbook_image(lens, observer, curvatures, conical, h, distortion, point):
    """Texels u, v of a physical point. distortion: centre c_u, c_v, unit f, k1, k2."""
    s = textbook_screen(lens, observer, curvatures, conical, point)
    on_plane = lens[2] / (lens[2] - s[2])  # central projection from the lens to z = 0
    x, y = (m + (c - m) * on_plane for m, c in zip(lens[:2], s[:2], strict=True))
    u, v, w = (h[3 * k] * x + h[3 * k + 1] * y + h[3 * k + 2] for k in range(3))
    c_u, c_v, f, k1, k2 = distortion
    a, b = (u / w - c_u) / f, (v / w - c_v) / f
    r = math.hypot(a, b)
    factor = 1 + k1 * r**2 + k2 * r**4
    return c_u + f * a * factor, c_v + f * b * factor


def rotation(axis, degrees):
    """Rotation matrix about axis 0, 1 or 2, right-handed, as rows."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[a, a], matrix[a, b], matrix[b, a], matrix[b, b] = c, -s, s, c
    return matrix
