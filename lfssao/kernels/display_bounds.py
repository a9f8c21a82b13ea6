"""Physical space -> image of any display, on pairs of ``lfssao.kernels.rounding``: the steps of ``kernels.display``.

Each operation of ``physical_to_image`` is done on pairs, in the order it has there, sums of three in any order. Where
a decision of that order (behind the module, off the screen, folded) may fall either way the point may lie in the
domain and need not.
"""

from lfssao.kernels.jit import kernel
from lfssao.kernels.rounding import FLUSHED, SAFETY, add, divide, multiply, root


@kernel(inline=True)
def _three(a, x, e_x, b, y, e_y, c, r):
    """(a x + b y) + c of exact numbers a, b, c and pairs x, y, in any order: three roundings of each term."""
    value = (a * x + b * y) + c
    size = (abs(a) * (abs(x) + e_x) + abs(b) * (abs(y) + e_y)) + abs(c)
    own = abs(a) * e_x + abs(b) * e_y
    return value, own + 3.0 * (1.0 + 3.0 * r) * r * size + FLUSHED * (4.0 + abs(a) + abs(b))


@kernel(inline=True)
def crossing_pairs(curvature, x, z, dx, e_dx, dz, e_dz, r, quotient, root_error):
    """circle_crossing of pairs: t, its error, the discriminant, its error. x, e.g. of a lens, is exact.

    Without curvature the square root is of a square: t = z / -dz twice over, so it is -2 z / (2 (-dz)).
    """
    k = curvature
    xx, e_xx = multiply(x, 0.0, x, 0.0, r)
    zz, e_zz = multiply(z[0], z[1], z[0], z[1], r)
    s, e_s = add(xx, e_xx, zz, e_zz, r)
    s, e_s = multiply(k, 0.0, s, e_s, r)
    c, e_c = add(s, e_s, -2.0 * z[0], 2.0 * z[1], r)
    ddx, e_ddx = multiply(dx, e_dx, dx, e_dx, r)
    ddz, e_ddz = multiply(dz, e_dz, dz, e_dz, r)
    s, e_s = add(ddx, e_ddx, ddz, e_ddz, r)
    a, e_a = multiply(k, 0.0, s, e_s, r)
    xd, e_xd = multiply(x, 0.0, dx, e_dx, r)
    zd, e_zd = multiply(z[0], z[1], dz, e_dz, r)
    s, e_s = add(xd, e_xd, zd, e_zd, r)
    s, e_s = multiply(k, 0.0, s, e_s, r)
    b, e_b = add(s, e_s, -dz, e_dz, r)
    bb, e_bb = multiply(b, e_b, b, e_b, r)
    ac, e_ac = multiply(a, e_a, c, e_c, r)
    disc, e_disc = add(bb, e_bb, -ac, e_ac, r)
    h, e_h = root(disc, e_disc, root_error)
    s, e_s = add(b, e_b, h, e_h, r)
    t, e_t = divide(-c, e_c, s, e_s, quotient)
    return t, e_t, disc, e_disc


@kernel(inline=True)
def _linear_point(m, first, x, e_x, y, e_y, z, e_z, t_s, e_ts, s_y, e_sy, dx, e_dx, dz, e_dz, r, quotient):
    """Screen point of the linear diffuser, seen from the lens on the plane z = 0: s_x, s_y as pairs, and the scale."""
    m_x, m_y, m_z, curved = m[first], m[first + 1], m[first + 2], m[first + 5] != 0.0
    s_x, e_sx = multiply(t_s, e_ts, dx, e_dx, r)
    s_x, e_sx = add(m_x, 0.0, s_x, e_sx, r)
    if not curved:
        return s_x, e_sx, s_y, e_sy, 1.0, 0.0
    s_z, e_sz = multiply(t_s, e_ts, dz, e_dz, r)
    s_z, e_sz = add(m_z, 0.0, s_z, e_sz, r)
    room, e_room = add(m_z, 0.0, -s_z, e_sz, r)
    scale, e_scale = divide(m_z, 0.0, room, e_room, quotient)
    a, e_a = add(s_x, e_sx, -m_x, 0.0, r)
    a, e_a = multiply(a, e_a, scale, e_scale, r)
    b, e_b = add(s_y, e_sy, -m_y, 0.0, r)
    b, e_b = multiply(b, e_b, scale, e_scale, r)
    s_x, e_sx = add(m_x, 0.0, a, e_a, r)
    s_y, e_sy = add(m_y, 0.0, b, e_b, r)
    return s_x, e_sx, s_y, e_sy, scale, e_scale


@kernel(inline=True)
def _length(x, e_x, y, e_y, square, e_square, r, root_error):
    """Square root of (x - y)^2 + square, of pairs."""
    a, e_a = add(x, e_x, -y, e_y, r)
    a, e_a = multiply(a, e_a, a, e_a, r)
    a, e_a = add(a, e_a, square, e_square, r)
    return root(a, e_a, root_error)


@kernel(inline=True)
def _conical_point(m, first, x, e_x, z, e_z, s_y, e_sy, r, quotient, root_error):
    """s_x of the conical diffuser and 1 + kappa, as pairs."""
    m_x, m_y, m_z, y_o, z_o = m[first], m[first + 1], m[first + 2], m[first + 3], m[first + 4]
    q, e_q = multiply(m_z, 0.0, m_z, 0.0, r)
    h_m, e_hm = _length(s_y, e_sy, m_y, 0.0, q, e_q, r, root_error)
    q, e_q = multiply(z_o, 0.0, z_o, 0.0, r)
    h_e, e_he = _length(s_y, e_sy, y_o, 0.0, q, e_q, r, root_error)
    q, e_q = divide(h_e, e_he, h_m, e_hm, quotient)
    kappa, e_k = divide(z, e_z, z_o, 0.0, quotient)
    kappa, e_k = multiply(kappa, e_k, q, e_q, r)
    room, e_room = add(1.0, 0.0, kappa, e_k, r)
    s, e_s = multiply(m_x, 0.0, kappa, e_k, r)
    s, e_s = add(x, e_x, s, e_s, r)
    s_x, e_sx = divide(s, e_s, room, e_room, quotient)
    return s_x, e_sx, room, e_room


@kernel(inline=True)
def _distort_pairs(m, first, u, e_u, v, e_v, r, quotient):
    """Radial distortion of pairs: u, v, and r^2 with its error."""
    c_u, c_v, f = m[first + 17], m[first + 18], m[first + 19]
    k1, k2 = m[first + 20], m[first + 21]
    a, e_a = add(u, e_u, -c_u, 0.0, r)
    a, e_a = divide(a, e_a, f, 0.0, quotient)
    b, e_b = add(v, e_v, -c_v, 0.0, r)
    b, e_b = divide(b, e_b, f, 0.0, quotient)
    p, e_p = multiply(a, e_a, a, e_a, r)
    q, e_q = multiply(b, e_b, b, e_b, r)
    r2, e_r2 = add(p, e_p, q, e_q, r)
    s, e_s = multiply(r2, e_r2, k2, 0.0, r)
    s, e_s = add(k1, 0.0, s, e_s, r)
    s, e_s = multiply(r2, e_r2, s, e_s, r)
    s, e_s = add(1.0, 0.0, s, e_s, r)
    a, e_a = multiply(a, e_a, s, e_s, r)
    a, e_a = multiply(f, 0.0, a, e_a, r)
    u, e_u = add(c_u, 0.0, a, e_a, r)
    b, e_b = multiply(b, e_b, s, e_s, r)
    b, e_b = multiply(f, 0.0, b, e_b, r)
    v, e_v = add(c_v, 0.0, b, e_b, r)
    return u, e_u, v, e_v, r2, e_r2


@kernel(inline=True)
def _positive(x, e, may, must):
    """Both answers, may and must, after a demand that x > 0."""
    room = e * SAFETY
    return may & (not x <= -room), must & (x > room)


@kernel(inline=True)
def display_pairs(m, x, e_x, y, e_y, z, e_z, r, quotient, root_error):
    """physical_to_image of pairs.

    Parameters
    ----------
    m : (44,) float64
        The mapping's numbers (``lfssao.kernels.mapping``); the module's begin at 12.
    x, e_x, y, e_y, z, e_z : float
        Physical coordinates and errors.
    r, quotient, root_error : float
        Relative errors of + - *, of a quotient, of a square root.

    Returns
    -------
    u, e_u, v, e_v : float
        Image point and errors.
    may, must : bool
        Whether the answer may be VALID, and whether it is for sure.
    """
    first = 12
    m_x, m_z, y_o, z_o = m[first], m[first + 2], m[first + 3], m[first + 4]
    conical = m[first + 7] != 0.0
    dx, e_dx = add(x, e_x, -m_x, 0.0, r)
    dz, e_dz = add(z, e_z, -m_z, 0.0, r)
    t_s, e_ts, disc_s, e_ds = crossing_pairs(m[first + 5], m_x, (m_z, 0.0), dx, e_dx, dz, e_dz, r, quotient, root_error)
    far = add(m_z, 0.0, -z_o, 0.0, r)
    t_v, e_tv, disc_v, e_dv = crossing_pairs(m[first + 6], m_x, far, dx, e_dx, dz, e_dz, r, quotient, root_error)
    over, e_over = add(t_v, e_tv, -1.0, 0.0, r)
    ahead, e_ahead = add(t_v, e_tv, -t_s, e_ts, r)
    may, must = _positive(-dz, e_dz, True, True)
    # A discriminant of zero will do, but roots next to zero have no bound: the error says so.
    may, must = _positive(disc_s, e_ds, may, must)
    may, must = _positive(disc_v, e_dv, may, must)
    may, must = _positive(over, e_over, may, must)
    may, must = _positive(t_s, e_ts, may, must)
    may, must = _positive(ahead, e_ahead, may, must)
    if not may:
        return 0.0, 0.0, 0.0, 0.0, False, False
    s_y, e_sy = divide(ahead, e_ahead, over, e_over, quotient)
    g, e_g = add(y, e_y, -y_o, 0.0, r)
    s_y, e_sy = multiply(g, e_g, s_y, e_sy, r)
    s_y, e_sy = add(y_o, 0.0, s_y, e_sy, r)
    if conical:
        s_x, e_sx, room, e_room = _conical_point(m, first, x, e_x, z, e_z, s_y, e_sy, r, quotient, root_error)
    else:
        s_x, e_sx, s_y, e_sy, room, e_room = _linear_point(
            m, first, x, e_x, y, e_y, z, e_z, t_s, e_ts, s_y, e_sy, dx, e_dx, dz, e_dz, r, quotient
        )
    may, must = _positive(room, e_room, may, must)
    h = first + 8
    w, e_w = _three(m[h + 6], s_x, e_sx, m[h + 7], s_y, e_sy, m[h + 8], r)
    may, must = _positive(w, e_w, may, must)
    u, e_u = _three(m[h], s_x, e_sx, m[h + 1], s_y, e_sy, m[h + 2], r)
    v, e_v = _three(m[h + 3], s_x, e_sx, m[h + 4], s_y, e_sy, m[h + 5], r)
    if m[h + 6] != 0.0 or m[h + 7] != 0.0 or m[h + 8] != 1.0:
        u, e_u = divide(u, e_u, w, e_w, quotient)
        v, e_v = divide(v, e_v, w, e_w, quotient)
    else:  # the divisor is 1, which a renderer may leave out
        u, e_u = divide(u, e_u, 1.0, 0.0, quotient)
        v, e_v = divide(v, e_v, 1.0, 0.0, quotient)
    if m[first + 20] != 0.0 or m[first + 21] != 0.0:
        u, e_u, v, e_v, r2, e_r2 = _distort_pairs(m, first, u, e_u, v, e_v, r, quotient)
        may, must = _positive(m[first + 22] - r2, e_r2, may, must)
    return u, e_u, v, e_v, may, must
