"""World -> image of any mapping, on pairs: the steps of ``lfssao.optics.kernels``.

Rows of matrices. A row of T terms t_1 + ... + t_T (the products with the point, with the offset, and the constant;
terms of a zero coefficient are exact zeros) rounds each term at most once as a product and at most T - 1 times on its
way through the sums, whatever their order; M (p + o), with n coefficients and c constants (0 or 1), rounds it
1 + 1 + (n - 1) + c <= 2 n + c = T times. So the row is off by at most ((1 + r)^T - 1) sum abs(t_i): with T r < 2^-10,
T r (1 + T r) sum abs(t_i). Errors of the point and the offset themselves add abs(m_i) times their size.
An offset that is turned has two terms more, and each is a product twice: every term is rounded TURNED times more.

The display. Each operation of ``physical_to_image`` is done on pairs in the order it has there, sums of three in any
order. A decision of that order (behind the module, off the screen, folded) may fall either way where its number may be
0; the point may then lie in the domain and need not.
"""

from typing import NamedTuple

import numpy as np

from lfssao.core.jit import kernel
from lfssao.optics.kernels.display import display_module
from lfssao.optics.kernels.projection import CROSSED_SLITS, DISPLAY, MATRIX, affine_row, linear_row, slits_of
from lfssao.verify.bounds.kernels import pairs
from lfssao.verify.bounds.kernels.pairs import FLUSHED, SAFETY, Pair, add, div, dot, exact, mul, positive, sub, triple

TURNED = 3  # roundings more of each term of a row, where offsets are turned


class Place(NamedTuple):
    """A place P + o, three pairs each."""

    point: tuple[Pair, Pair, Pair]
    offset: tuple[Pair, Pair, Pair]
    sizes: tuple[float, float, float]  # of the terms that make o, which may cancel
    more: int  # roundings of each term of a row besides the row's own


class Projected(NamedTuple):
    """An image point with errors, and whether it may lie, and lies for sure, in the mapping's domain."""

    u: Pair
    v: Pair
    z: Pair
    may: bool
    must: bool


@kernel(inline=True)
def at_point(point):
    """The place of a point itself, three pairs."""
    return Place(point, (exact(0.0), exact(0.0), exact(0.0)), (0.0, 0.0, 0.0), 0)


@kernel(inline=True)
def row_of(m, row, place, r):
    """A row of M (P + o, 1)."""
    k, terms, own, flushed = 4 * row, place.more, 0.0, 4.0  # flushed may be operands, products and the sums
    size = abs(m[k + 3])
    terms += 1 if m[k + 3] != 0.0 else 0
    for c in range(3):
        a, p, o = abs(m[k + c]), place.point[c], place.offset[c]
        terms += 2 if a != 0.0 else 0
        size += a * ((abs(p.value) + p.error) + (place.sizes[c] + o.error))
        own += a * (p.error + o.error)
        flushed += 4.0 * a
    (x, y, z), (u, v, w) = place.point, place.offset
    value = affine_row(m, row, x.value, y.value, z.value) + linear_row(m, row, u.value, v.value, w.value)
    return Pair(value, terms * (1.0 + terms * r) * r * size + own + FLUSHED * flushed)


@kernel(inline=True)
def rows_of(projection, place, r):
    """All four rows of M (P + o, 1); the fourth is 1 for a mapping without one."""
    m = projection.numbers
    q = row_of(m, 3, place, r) if projection.kind == MATRIX else exact(1.0)
    return row_of(m, 0, place, r), row_of(m, 1, place, r), row_of(m, 2, place, r), q


@kernel(inline=True)
def crossing_pairs(curvature, x, z, dx, dz, by):
    """``circle_crossing`` of pairs; without curvature t = z / -dz twice over, as the root is of a square."""
    k = exact(curvature)
    xx, zz = mul(x, x, by), mul(z, z, by)
    c = sub(mul(k, add(xx, zz, by), by), Pair(2.0 * z.value, 2.0 * z.error), by)
    a = mul(k, add(mul(dx, dx, by), mul(dz, dz, by), by), by)
    b = sub(mul(k, add(mul(x, dx, by), mul(z, dz, by), by), by), dz, by)
    discriminant = sub(mul(b, b, by), mul(a, c, by), by)
    t = div(Pair(-c.value, c.error), add(b, pairs.root(discriminant, by), by), by)
    return t, discriminant


@kernel(inline=True)
def _linear_point(d, t_s, s_y, dx, dz, by):
    """Screen point of the linear diffuser, seen from the lens on the plane z = 0: s_x, s_y and the scale."""
    m_x, m_y, m_z = exact(d.m_x), exact(d.m_y), exact(d.m_z)
    s_x = add(m_x, mul(t_s, dx, by), by)
    scale = exact(1.0)
    if d.screen_curvature != 0.0:
        s_z = add(m_z, mul(t_s, dz, by), by)
        scale = div(m_z, sub(m_z, s_z, by), by)
        s_x = add(m_x, mul(sub(s_x, m_x, by), scale, by), by)
        s_y = add(m_y, mul(sub(s_y, m_y, by), scale, by), by)
    return s_x, s_y, scale


@kernel(inline=True)
def _length(x, y, z, by):
    """Square root of (x - y)^2 + z^2."""
    a = sub(x, y, by)
    return pairs.root(add(mul(a, a, by), mul(z, z, by), by), by)


@kernel(inline=True)
def _conical_point(d, x, z, s_y, by):
    """s_x of the conical diffuser and 1 + kappa."""
    m_x, z_o = exact(d.m_x), exact(d.z_o)
    h_m = _length(s_y, exact(d.m_y), exact(d.m_z), by)
    h_e = _length(s_y, exact(d.y_o), z_o, by)
    kappa = mul(div(z, z_o, by), div(h_e, h_m, by), by)
    room = add(exact(1.0), kappa, by)
    return div(add(x, mul(m_x, kappa, by), by), room, by), room


@kernel(inline=True)
def _distort_pairs(d, u, v, by):
    """Radial distortion of pairs: u, v and r^2."""
    c_u, c_v, f = exact(d.c_u), exact(d.c_v), exact(d.unit)
    a, b = div(sub(u, c_u, by), f, by), div(sub(v, c_v, by), f, by)
    r2 = add(mul(a, a, by), mul(b, b, by), by)
    s = add(exact(d.k1), mul(r2, exact(d.k2), by), by)
    s = add(exact(1.0), mul(r2, s, by), by)
    u = add(c_u, mul(f, mul(a, s, by), by), by)
    v = add(c_v, mul(f, mul(b, s, by), by), by)
    return u, v, r2


@kernel(inline=True)
def _and_positive(x, may, must):
    """Whether all demands may hold, and hold for sure, with one more: x > 0."""
    may_x, must_x = positive(x)
    return may & may_x, must & must_x


@kernel(inline=True)
def display_pairs(d, x, y, z, by):
    """``physical_to_image`` of pairs by a DisplayModule: u, v, whether the status may be VALID, and is for sure."""
    m_x, m_z, y_o, z_o = exact(d.m_x), exact(d.m_z), exact(d.y_o), exact(d.z_o)
    dx, dz = sub(x, m_x, by), sub(z, m_z, by)
    t_s, disc_s = crossing_pairs(d.screen_curvature, m_x, m_z, dx, dz, by)
    t_v, disc_v = crossing_pairs(d.observer_curvature, m_x, sub(m_z, z_o, by), dx, dz, by)
    over, ahead = sub(t_v, exact(1.0), by), sub(t_v, t_s, by)
    may, must = positive(Pair(-dz.value, dz.error))
    # A discriminant of zero will do, but roots next to zero have no bound: the error says so.
    for demand in (disc_s, disc_v, over, t_s, ahead):
        may, must = _and_positive(demand, may, must)
    if not may:
        return exact(0.0), exact(0.0), False, False
    s_y = add(y_o, mul(sub(y, y_o, by), div(ahead, over, by), by), by)
    if d.conical != 0.0:
        s_x, room = _conical_point(d, x, z, s_y, by)
    else:
        s_x, s_y, room = _linear_point(d, t_s, s_y, dx, dz, by)
    may, must = _and_positive(room, may, must)
    h, point = d.homography, (s_x, s_y, exact(1.0))
    w = dot(triple(h[6:9]), point, by)
    may, must = _and_positive(w, may, must)
    if h[6] == 0.0 and h[7] == 0.0 and h[8] == 1.0:
        w = exact(1.0)  # a divisor that a renderer may leave out
    u, v = div(dot(triple(h[0:3]), point, by), w, by), div(dot(triple(h[3:6]), point, by), w, by)
    if d.k1 != 0.0 or d.k2 != 0.0:
        u, v, r2 = _distort_pairs(d, u, v, by)
        may, must = _and_positive(Pair(d.fold - r2.value, r2.error), may, must)
    return u, v, may, must


@kernel(inline=True)
def project(projection, rows, by):
    """The image point of a point from its four rows: the half of a mapping that is not affine."""
    a, b, c, q = rows
    if projection.kind == CROSSED_SLITS:
        slits = slits_of(projection.numbers)
        f, g = sub(exact(slits.z_m), c, by), sub(exact(slits.z_o), c, by)
        u = add(exact(slits.u_0), div(a, f, by), by)
        v = add(exact(slits.v_0), div(b, g, by), by)
        may_f, must_f = positive(f)
        may_g, must_g = positive(Pair(-g.value, g.error))
        return Projected(u, v, c, may_f & may_g, must_f & must_g)
    if projection.kind == DISPLAY:
        u, v, may, must = display_pairs(display_module(projection.numbers[12:]), a, b, c, by)
        return Projected(u, v, c, may, must)
    may, must = positive(q)
    return Projected(div(a, q, by), div(b, q, by), div(c, q, by), may, must)


@kernel(inline=True)
def linear_room(m, depth, by):
    """By how much a window depth d may seem off where a perspective camera's renderer makes a distance of it first.

    d = a - b / z, so a renderer may divide by D = s (a - d) in float32 and compare z of sample and surface. As z grows
    with d, errors of D / s count as those of d: r abs(2 d - 1) for 2 d - 1 and its product (r abs(d) without it),
    r a / 2 for the first sum of far + near - (2 d - 1) (far - near) in any order, and (r + 2 q) (a - d) for the last
    sum, the quotient, and another by far. Constants are the same for both depths, and keep their order. a follows from
    rows 2 and 3 of the mapping, ``m``. Infinite where D may be 0; 0 of an orthographic camera, and of image z that is
    made of distances.
    """
    size = (m[12] * m[12] + m[13] * m[13]) + m[14] * m[14]
    if size == 0.0 or (m[8] == 0.0 and m[9] == 0.0 and m[10] == 0.0):
        return 0.0
    a = ((m[8] * m[12] + m[9] * m[13]) + m[10] * m[14]) / size
    d, e, r = depth.value, depth.error, by.operation
    room = r * (max(abs(d), abs(2.0 * d - 1.0)) + 2.0 * e + 0.5 * abs(a)) + (r + 2.0 * by.quotient) * (abs(a - d) + e)
    room *= 1.0 + 2.0**-16  # a of rounded numbers, and rooms that grow with the distance
    return room if e + room < abs(a - d) else np.inf


@kernel(inline=True)
def widen(image, by):
    """An image point with its errors as they count: a look-up's miss added, float64's own rounding outweighed."""
    u = Pair(image.u.value, image.u.error * SAFETY + by.coordinate)
    v = Pair(image.v.value, image.v.error * SAFETY + by.coordinate)
    return Projected(u, v, Pair(image.z.value, image.z.error * SAFETY), image.may, image.must)


@kernel(inline=True)
def image_of(projection, place, by):
    """The image point of a place with its errors as they count."""
    return widen(project(projection, rows_of(projection, place, by.operation), by), by)


@kernel(rows="positions", few=50_000)
def map_positions(begin, stop, positions, allowance, projection, by, image, error, sure):
    """Write image points of positions off by ``allowance``, their errors, u's -infinity for none, and what is sure."""
    for k in range(begin, stop):
        x, y, z = positions[k]
        a, b, c = allowance[k]
        place = at_point((Pair(x, a), Pair(y, b), Pair(z, c)))
        found = project(projection, rows_of(projection, place, by.operation), by)
        image[k, 0], error[k, 0] = found.u
        image[k, 1], error[k, 1] = found.v
        image[k, 2], error[k, 2] = found.z
        sure[k] = found.must
        if not found.may:
            error[k, 0] = -np.inf
