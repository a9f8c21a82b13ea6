"""The part of the kit's reader on mappings and their numbers, by SPECIFICATION.md alone (sections 8 and 16)."""

import math

import numpy as np

from reference.elementary import F, binary32, sincospi

# Section 8


def sum_l(m, row, x, y, z):
    return (m[4 * row] * x + m[4 * row + 1] * y) + m[4 * row + 2] * z


def sum_a(m, row, x, y, z):
    return ((m[4 * row] * x + m[4 * row + 1] * y) + m[4 * row + 2] * z) + m[4 * row + 3]


def to_image(kind, m, sums):
    """u, v, image z, answer."""
    if kind == "crossed slits":
        a, b, c = sums
        z_m, z_o, u_0, v_0 = m[12:]
        return u_0 + a / (z_m - c), v_0 + b / (z_o - c), c, 0 if c < z_m and c > z_o else 1
    if kind == "matrix":
        a, b, c, q = sums
        return a / q, b / q, c / q, 0 if q > 0 else 1
    return display(m[12:], *sums)


def crossing(curvature, x, z, dx, dz):
    a = curvature * (dx * dx + dz * dz)
    b = curvature * (x * dx + z * dz) - dz
    c = curvature * (x * x + z * z) - (z + z)
    d = b * b - a * c
    root = np.sqrt(d) if d > 0 else F(0)
    return -c / (b + root), d


def screen_point(d, x, y, z):
    """s_x, s_y, s_z, answer."""

    def no(answer):
        return F(0), F(0), F(0), answer

    one = F(1)
    m_x, m_y, m_z, y_o, z_o = d[:5]
    t_s, d_s = crossing(d[5], m_x, m_z, x - m_x, z - m_z)
    t_v, d_v = crossing(d[6], m_x, m_z - z_o, x - m_x, z - m_z)
    if not z < m_z:
        return no(1)
    if d_v < 0 or not t_v > 1:
        return no(2)
    if d_s < 0 or not (t_s > 0 and t_s < t_v):
        return no(3)
    s_y = y_o + (y - y_o) * ((t_v - t_s) / (t_v - one))
    if d[7] == 0:
        s_z = m_z + t_s * (z - m_z) if d[5] != 0 else F(0)
        s_x = m_x + t_s * (x - m_x)
    else:
        h_m = np.sqrt((s_y - m_y) * (s_y - m_y) + m_z * m_z)
        h_e = np.sqrt((s_y - y_o) * (s_y - y_o) + z_o * z_o)
        k = (z / z_o) * (h_e / h_m)
        if not one + k > 0:
            return no(1)
        s_x, s_z = (x + m_x * k) / (one + k), F(0)
    return s_x, s_y, s_z, 0


def display(d, x, y, z):
    """u, v, image z, answer."""

    def no(answer):
        return F(0), F(0), F(0), answer

    m_x, m_y, m_z = d[:3]
    s_x, s_y, s_z, answer = screen_point(d, x, y, z)
    if answer != 0:
        return no(answer)
    if s_z != 0:
        g = m_z / (m_z - s_z)
        s_x = m_x + (s_x - m_x) * g
        s_y = m_y + (s_y - m_y) * g
        if not g > 0:
            return no(3)
    h = d[8:17]
    w = (h[6] * s_x + h[7] * s_y) + h[8]
    u = ((h[0] * s_x + h[1] * s_y) + h[2]) / w
    v = ((h[3] * s_x + h[4] * s_y) + h[5]) / w
    if not w > 0:
        return no(4)
    c_u, c_v, f, k1, k2, fold = d[17:23]
    if k1 != 0 or k2 != 0:
        p, q = (u - c_u) / f, (v - c_v) / f
        r = p * p + q * q
        if not r < fold:
            return no(4)
        e = F(1) + r * (k1 + r * k2)
        u, v = c_u + f * (p * e), c_v + f * (q * e)
    return u, v, z, 0


def mapping(parameters, inputs):
    kind, m = parameters["mapping"]["kind"], binary32(parameters["mapping"]["numbers"])
    rows = range(4 if kind == "matrix" else 3)
    image, answers = [], []
    for point in inputs["points"]:
        *place, answer = to_image(kind, m, [sum_a(m, row, *point) for row in rows])
        image.append(place if answer == 0 else [F(0)] * 3)
        answers.append(answer)
    return {"image": np.array(image, F), "answers": np.array(answers, np.int32)}


# Section 16


def projector(module):
    w, h = float(module["width"]), float(module["height"])
    s, c = sincospi(module["field_of_view"] / 360)
    focal = ((0.5 * w) * c) / s
    (sy, cy), (sp, cp), (sr, cr) = (sincospi(module[angle] / 180) for angle in ("yaw", "pitch", "roll"))
    forward = (sy * cp, sp, -(cy * cp))
    pairs = list(zip((cy, 0.0, sy), (-(sy * sp), cp, cy * sp), strict=True))
    rows = (
        [focal * (cr * r + sr * u) + (0.5 * w) * f for (r, u), f in zip(pairs, forward, strict=True)],
        [(-focal) * (cr * u - sr * r) + (0.5 * h) * f for (r, u), f in zip(pairs, forward, strict=True)],
        forward,
    )
    x, y, z = module["x"], module["y"], module["z"]
    return [number for p, q, r in rows for number in (p, q, -((p * x + q * y) + r * z))]


def fold_of(k1, k2):
    a, b = 5 * k2, 3 * k1
    found = math.inf
    if a == 0:
        found = -1 / b if b < 0 else math.inf
    elif b * b - 4 * a >= 0:
        root = math.sqrt(b * b - 4 * a)
        q = -0.5 * (b + root) if b >= 0 else -0.5 * (b - root)
        found = min([f for f in (q / a, 1 / q if q != 0 else math.inf) if f > 0], default=math.inf)
    return found if found < 3e38 else 3e38


def numbers(parameters):
    screen, g = parameters["display"], float(parameters["guard"])
    module = screen["modules"][parameters["module"]]
    rows = [list(row) for row in parameters["physical_from_world"]]
    wide, high, (w, h) = (
        float(module["width"]),
        float(module["height"]),
        (screen["screen_width"], screen["screen_height"]),
    )
    x, y, z, y_o, z_o = module["x"], module["y"], module["z"], screen["observer_height"], screen["observer_z"]
    c_u, c_v, k1, k2 = wide / 2 + g, high / 2 + g, module["k1"], module["k2"]
    curvatures = [screen["screen_curvature"], screen["observer_curvature"]]
    plain = module["field_of_view"] is None and module["homography"] is None and k1 == k2 == 0
    if plain and screen["diffuser"] == "linear" and curvatures == [0, 0]:
        a, b = wide / w, -high / h
        rows[0][3] -= x
        rows[1][3] -= y_o
        rows[0], rows[1] = [r * (a * z) for r in rows[0]], [r * (b * z_o) for r in rows[1]]
        return [*rows[0], *rows[1], *rows[2], z, z_o, c_u + a * x, c_v + b * y_o]
    if module["homography"] is not None:
        sign = -1.0 if module["homography"][8] < 0 else 1.0
        matrix = [sign * number for number in module["homography"]]
    elif module["field_of_view"] is not None:
        matrix = projector(module)
    else:
        matrix = [wide / w, 0.0, wide / 2, 0.0, -high / h, high / 2, 0.0, 0.0, 1.0]
    a, b, c, d, e, f, p, q, r = [matrix[k] + g * matrix[6 + k % 3] for k in range(6)] + matrix[6:]
    adjugate = [e * r - f * q, c * q - b * r, b * f - c * e, f * p - d * r, a * r - c * p, c * d - a * f,
                d * q - e * p, b * p - a * q, a * e - b * d]  # fmt: skip
    determinant = (a * adjugate[0] + b * adjugate[3]) + c * adjugate[6]
    conical = 1.0 if screen["diffuser"] == "conical" else 0.0
    return [
        *rows[0], *rows[1], *rows[2], x, y, z, y_o, z_o, *curvatures, conical,
        a, b, c, d, e, f, p, q, r, c_u, c_v, wide / 2, k1, k2, fold_of(k1, k2),
        *[entry / determinant for entry in adjugate],
    ]  # fmt: skip
