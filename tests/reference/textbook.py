"""The geometry of displays by the textbook, in Python's floats: from its formulas, not from the kernels' order of them.

Its texels must agree with the kernels', its bits need not.
"""

import math

import numpy as np


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


def screen(lens, observer, curvatures, conical, point):
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


def image(lens, observer, curvatures, conical, h, distortion, point):
    """Texels u, v of a physical point. distortion: centre c_u, c_v, unit f, k1, k2."""
    s = screen(lens, observer, curvatures, conical, point)
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
