"""Physical space -> image of any display, on pairs of ``kernels.pairs``: the steps of ``kernels.display``.

Each operation of ``physical_to_image`` is done on pairs, in the order it has there, sums of three in any order. A
decision of that order (behind the module, off the screen, folded) may fall either way where its number may be 0; the
point may then lie in the domain and need not.
"""

from lfssao.core.jit import kernel
from lfssao.verify.bounds.kernels.pairs import Pair, add, affine, divide, exact, is_positive, multiply, root, subtract


@kernel(inline=True)
def crossing_pairs(curvature, x, z, dx, dz, by):
    """``circle_crossing`` of pairs: t and the discriminant.

    Without curvature the square root is of a square: t = z / -dz twice over, so it is -2 z / (2 (-dz)).
    """
    k = exact(curvature)
    xx, zz = multiply(x, x, by), multiply(z, z, by)
    c = subtract(multiply(k, add(xx, zz, by), by), Pair(2.0 * z.value, 2.0 * z.error), by)
    a = multiply(k, add(multiply(dx, dx, by), multiply(dz, dz, by), by), by)
    b = subtract(multiply(k, add(multiply(x, dx, by), multiply(z, dz, by), by), by), dz, by)
    discriminant = subtract(multiply(b, b, by), multiply(a, c, by), by)
    t = divide(Pair(-c.value, c.error), add(b, root(discriminant, by), by), by)
    return t, discriminant


@kernel(inline=True)
def _linear_point(d, t_s, s_y, dx, dz, by):
    """Screen point of the linear diffuser, seen from the lens on the plane z = 0: s_x, s_y and the scale."""
    m_x, m_y, m_z = exact(d[0]), exact(d[1]), exact(d[2])
    s_x = add(m_x, multiply(t_s, dx, by), by)
    scale = exact(1.0)
    if d[5] != 0.0:
        s_z = add(m_z, multiply(t_s, dz, by), by)
        scale = divide(m_z, subtract(m_z, s_z, by), by)
        s_x = add(m_x, multiply(subtract(s_x, m_x, by), scale, by), by)
        s_y = add(m_y, multiply(subtract(s_y, m_y, by), scale, by), by)
    return s_x, s_y, scale


@kernel(inline=True)
def _length(x, y, z, by):
    """Square root of (x - y)^2 + z^2."""
    a = subtract(x, y, by)
    return root(add(multiply(a, a, by), multiply(z, z, by), by), by)


@kernel(inline=True)
def _conical_point(d, x, z, s_y, by):
    """s_x of the conical diffuser and 1 + kappa."""
    m_x, z_o = exact(d[0]), exact(d[4])
    h_m = _length(s_y, exact(d[1]), exact(d[2]), by)
    h_e = _length(s_y, exact(d[3]), z_o, by)
    kappa = multiply(divide(z, z_o, by), divide(h_e, h_m, by), by)
    room = add(exact(1.0), kappa, by)
    return divide(add(x, multiply(m_x, kappa, by), by), room, by), room


@kernel(inline=True)
def _distort_pairs(d, u, v, by):
    """Radial distortion of pairs: u, v and r^2."""
    c_u, c_v, f = exact(d[17]), exact(d[18]), exact(d[19])
    a, b = divide(subtract(u, c_u, by), f, by), divide(subtract(v, c_v, by), f, by)
    r2 = add(multiply(a, a, by), multiply(b, b, by), by)
    s = add(exact(d[20]), multiply(r2, exact(d[21]), by), by)
    s = add(exact(1.0), multiply(r2, s, by), by)
    u = add(c_u, multiply(f, multiply(a, s, by), by), by)
    v = add(c_v, multiply(f, multiply(b, s, by), by), by)
    return u, v, r2


@kernel(inline=True)
def _and_positive(x, may, must):
    """Both answers, may and must, after a demand that x > 0."""
    may_x, must_x = is_positive(x)
    return may & may_x, must & must_x


@kernel(inline=True)
def display_pairs(d, x, y, z, by):
    """``physical_to_image`` of pairs.

    Parameters
    ----------
    d : (32,) float64
        The module's numbers (``lfssao.optics.kernels.display``).
    x, y, z : Pair
        Physical coordinates.
    by : Errors
        What an operation may be off by.

    Returns
    -------
    u, v : Pair
        Image point.
    may, must : bool
        Whether the answer may be VALID, and whether it is for sure.
    """
    m_x, m_z, y_o, z_o = exact(d[0]), exact(d[2]), exact(d[3]), exact(d[4])
    dx, dz = subtract(x, m_x, by), subtract(z, m_z, by)
    t_s, disc_s = crossing_pairs(d[5], m_x, m_z, dx, dz, by)
    t_v, disc_v = crossing_pairs(d[6], m_x, subtract(m_z, z_o, by), dx, dz, by)
    over, ahead = subtract(t_v, exact(1.0), by), subtract(t_v, t_s, by)
    may, must = is_positive(Pair(-dz.value, dz.error))
    # A discriminant of zero will do, but roots next to zero have no bound: the error says so.
    for demand in (disc_s, disc_v, over, t_s, ahead):
        may, must = _and_positive(demand, may, must)
    if not may:
        return exact(0.0), exact(0.0), False, False
    s_y = add(y_o, multiply(subtract(y, y_o, by), divide(ahead, over, by), by), by)
    if d[7] != 0.0:
        s_x, room = _conical_point(d, x, z, s_y, by)
    else:
        s_x, s_y, room = _linear_point(d, t_s, s_y, dx, dz, by)
    may, must = _and_positive(room, may, must)
    w = affine(d[14], s_x, d[15], s_y, d[16], by)
    may, must = _and_positive(w, may, must)
    if d[14] == 0.0 and d[15] == 0.0 and d[16] == 1.0:
        w = exact(1.0)  # a divisor that a renderer may leave out
    u = divide(affine(d[8], s_x, d[9], s_y, d[10], by), w, by)
    v = divide(affine(d[11], s_x, d[12], s_y, d[13], by), w, by)
    if d[20] != 0.0 or d[21] != 0.0:
        u, v, r2 = _distort_pairs(d, u, v, by)
        may, must = _and_positive(Pair(d[22] - r2.value, r2.error), may, must)
    return u, v, may, must
