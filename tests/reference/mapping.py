"""Spaces, offsets, mappings and the numbers of mappings: sections 7, 8 and 16 of the specification.

Kinds of mapping are those of the text. Arithmetic is that of the scalars handed in: np.float32 or np.float64.
"""

import math

import numpy as np

from reference.elementary import sincospi

ROWS = {"crossed slits": range(3), "matrix": range(4), "display": range(3)}


def rounded(numbers, dtype=np.float32):
    """A list of scalars, each rounded once."""
    return list(np.array(numbers, np.float64).ravel().astype(dtype))


def offsets(radius, samples, dtype=np.float32):
    return [rounded(offset, dtype) for offset in radius * np.asarray(samples)]


# Section 8


def affine_row(m, row, x, y, z):
    """A."""
    return ((m[4 * row] * x + m[4 * row + 1] * y) + m[4 * row + 2] * z) + m[4 * row + 3]


def linear_row(m, row, x, y, z):
    """L."""
    return (m[4 * row] * x + m[4 * row + 1] * y) + m[4 * row + 2] * z


def turned_row(m, row, x, y, z, cosine, sine):
    """T: the linear row of an offset that is turned about z."""
    a, b, c = m[4 * row : 4 * row + 3]
    return (cosine * (a * x + b * y) + sine * (b * x - a * y)) + c * z


def affine_rows(kind, m, point):
    return [affine_row(m, row, *point) for row in ROWS[kind]]


def linear_rows(kind, m, offset, turn=None):
    if turn is not None:
        return [turned_row(m, row, *offset, *turn) for row in ROWS[kind]]
    return [linear_row(m, row, *offset) for row in ROWS[kind]]


def turn_at(turns, j, i):
    """Cosine and sine of a texel, or None."""
    return None if turns is None else turns[:, j, i]


def to_image(kind, m, sums):
    """u, v, image z, status."""
    if kind == "crossed slits":
        a, b, c = sums
        z_m, z_o, u_0, v_0 = m[12:]
        return u_0 + a / (z_m - c), v_0 + b / (z_o - c), c, 0 if c < z_m and c > z_o else 1
    if kind == "matrix":
        a, b, c, q = sums
        return a / q, b / q, c / q, 0 if q > 0 else 1
    u, v, status = physical_to_image(m[12:], *sums)
    return u, v, sums[2], status


def images(kind, m, point, offsets):
    """The images of a point's samples, from the linear rows of their offsets."""
    affine = affine_rows(kind, m, point)
    for linear in offsets:
        yield to_image(kind, m, [a + b for a, b in zip(affine, linear, strict=True)])


def texel_at(shape, image):
    """Row and column of the texel that u, v, image z and status lie in; None outside."""
    u, v, _, status = image
    height, width = shape[:2]
    return (int(v), int(u)) if status == 0 and u >= 0 and u < width and v >= 0 and v < height else None


def crossing(curvature, x, z, dx, dz):
    a = curvature * (dx * dx + dz * dz)
    b = curvature * (x * dx + z * dz) - dz
    c = curvature * (x * x + z * z) - (z + z)
    d = b * b - a * c
    root = np.sqrt(d) if d > 0 else 0
    return -c / (b + root), d


def screen_point(d, x, y, z):
    """s_x, s_y, s_z, status."""
    zero = type(x)(0)
    m_x, m_y, m_z, y_o, z_o = d[:5]
    t_s, d_s = crossing(d[5], m_x, m_z, x - m_x, z - m_z)
    t_v, d_v = crossing(d[6], m_x, m_z - z_o, x - m_x, z - m_z)
    if not z < m_z:
        return zero, zero, zero, 1
    if d_v < 0 or not t_v > 1:
        return zero, zero, zero, 2
    if d_s < 0 or not (t_s > 0 and t_s < t_v):
        return zero, zero, zero, 3
    s_y = y_o + (y - y_o) * ((t_v - t_s) / (t_v - 1))
    if d[7] == 0:
        s_z = m_z + t_s * (z - m_z) if d[5] != 0 else zero
        return m_x + t_s * (x - m_x), s_y, s_z, 0
    h_m = np.sqrt((s_y - m_y) * (s_y - m_y) + m_z * m_z)
    h_e = np.sqrt((s_y - y_o) * (s_y - y_o) + z_o * z_o)
    k = (z / z_o) * (h_e / h_m)
    if not 1 + k > 0:
        return zero, zero, zero, 1
    return (x + m_x * k) / (1 + k), s_y, zero, 0


def screen_to_texel(d, s_x, s_y, s_z):
    """u, v, status of a screen point."""
    zero = type(s_x)(0)
    if s_z != 0:
        g = d[2] / (d[2] - s_z)
        s_x = d[0] + (s_x - d[0]) * g
        s_y = d[1] + (s_y - d[1]) * g
        if not g > 0:
            return zero, zero, 3
    h = d[8:17]
    w = (h[6] * s_x + h[7] * s_y) + h[8]
    u = ((h[0] * s_x + h[1] * s_y) + h[2]) / w
    v = ((h[3] * s_x + h[4] * s_y) + h[5]) / w
    if not w > 0:
        return zero, zero, 4
    c_u, c_v, f, k1, k2, fold = d[17:23]
    if k1 != 0 or k2 != 0:
        p, q = (u - c_u) / f, (v - c_v) / f
        r = p * p + q * q
        if not r < fold:
            return zero, zero, 4
        e = 1 + r * (k1 + r * k2)
        u, v = c_u + f * (p * e), c_v + f * (q * e)
    return u, v, 0


def physical_to_image(d, x, y, z):
    """u, v, status."""
    *screen, status = screen_point(d, x, y, z)
    return screen_to_texel(d, *screen) if status == 0 else (type(x)(0), type(x)(0), status)


# Section 16


def projector(module):
    """Homography of a module that is given by its angles."""
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


def numbers(display, index, guard, physical_from_world):
    module, g, rows = display["modules"][index], float(guard), [list(row) for row in physical_from_world]
    wide, high = float(module["width"]), float(module["height"])
    w, h = display["screen_width"], display["screen_height"]
    x, y, z, y_o, z_o = module["x"], module["y"], module["z"], display["observer_height"], display["observer_z"]
    c_u, c_v, k1, k2 = wide / 2 + g, high / 2 + g, module["k1"], module["k2"]
    curvatures = [display["screen_curvature"], display["observer_curvature"]]
    plain = module["field_of_view"] is None and module["homography"] is None and k1 == k2 == 0
    if plain and display["diffuser"] == "linear" and curvatures == [0, 0]:
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
    conical = 1.0 if display["diffuser"] == "conical" else 0.0
    return [
        *rows[0], *rows[1], *rows[2], x, y, z, y_o, z_o, *curvatures, conical,
        a, b, c, d, e, f, p, q, r, c_u, c_v, wide / 2, k1, k2, fold_of(k1, k2),
        *[entry / determinant for entry in adjugate],
    ]  # fmt: skip
