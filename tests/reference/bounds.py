"""The oracle's bounds, a sample at a time: numbers with errors as objects, outcomes as sets.

Arithmetic is float64 in the order that the kernels document, so u, v, z and their errors agree bit for bit.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

CROSSED_SLITS, MATRIX, DISPLAY = 0, 1, 2
FLUSHED, SAFETY = np.float64(2.0**-124), np.float64(1 + 2.0**-20)


@dataclass(frozen=True)
class Pair:
    """A number and how far off it may be.

    ``by`` has the relative errors ``operation``, ``quotient``, ``root`` and ``offset``, and ``coordinate``, by which a
    look-up may miss.
    """

    x: float
    e: float
    by: Any

    def of(self, other):
        return other if isinstance(other, Pair) else Pair(np.float64(other), np.float64(0), self.by)

    def rounded(self, x, e, relative, flushed):
        return Pair(x, e + relative * (abs(x) + e) + flushed, self.by)

    def __add__(self, other):
        o = self.of(other)
        return self.rounded(self.x + o.x, self.e + o.e, self.by.operation, FLUSHED)

    def __neg__(self):
        return Pair(-self.x, self.e, self.by)

    def __sub__(self, other):
        return self + -self.of(other)

    def __mul__(self, other):
        o = self.of(other)
        e = (abs(self.x) * o.e + abs(o.x) * self.e) + self.e * o.e
        return self.rounded(self.x * o.x, e, self.by.operation, FLUSHED * (1 + abs(self.x) + abs(o.x)))

    def __truediv__(self, other):
        o = self.of(other)
        q, room = self.x / o.x, abs(o.x) - o.e
        if not room > FLUSHED:
            return Pair(q, np.inf, self.by)
        return self.rounded(q, (self.e + abs(q) * o.e) / room, self.by.quotient, FLUSHED * (1 + 1 / room))

    def root(self):
        if not self.x - self.e >= 0:
            return Pair(np.float64(0), np.inf, self.by)
        s = np.sqrt(self.x)
        e = self.e / (np.sqrt(self.x - self.e) + s) if s > 0 else np.sqrt(self.e)
        return Pair(s, e + self.by.root * (s + e) + FLUSHED, self.by)

    def positive(self):
        """The truths that "it is > 0" may have."""
        room = self.e * SAFETY
        return {truth for truth, may in ((True, not self.x <= -room), (False, not self.x > room)) if may}


def number(x, by):
    return Pair(np.float64(x), np.float64(0), by)


def row(m, k, point, by, offset=(0, 0, 0)):
    """Row of M (p + o, 1), p three pairs and o exact but for the rounding of R s: every term is rounded T times."""
    a = [np.float64(c) for c in m[4 * k : 4 * k + 4]]
    terms = sum(2 for c in a[:3] if c != 0) + (a[3] != 0)
    size, own, flushed = abs(a[3]), 0.0, 4.0
    for c, p, o in zip(a[:3], point, offset, strict=True):
        off = by.offset * abs(o)
        size += abs(c) * ((abs(p.x) + p.e) + (abs(o) + off))
        own += abs(c) * (p.e + off)
        flushed += 4 * abs(c)
    value = ((a[0] * point[0].x + a[1] * point[1].x) + a[2] * point[2].x) + a[3]
    value = value + ((a[0] * offset[0] + a[1] * offset[1]) + a[2] * offset[2])
    return Pair(value, terms * (1 + terms * by.operation) * by.operation * size + own + FLUSHED * flushed, by)


def three(a, x, b, y, c, by):
    """(a x + b y) + c, in any order."""
    r = by.operation
    size = (abs(a) * (abs(x.x) + x.e) + abs(b) * (abs(y.x) + y.e)) + abs(c)
    own = abs(a) * x.e + abs(b) * y.e
    flushed = 3 + (abs(a) + abs(x.x)) + (abs(b) + abs(y.x)) + (abs(c) + 1)
    return Pair((a * x.x + b * y.x) + c, own + 3 * (1 + 3 * r) * r * size + FLUSHED * flushed, by)


def crossing(curvature, x, z, dx, dz):
    """The t at which the line leaves the circle, and the discriminant."""
    c = (x * x + z * z) * curvature + -Pair(2 * z.x, 2 * z.e, z.by)
    a, b = (dx * dx + dz * dz) * curvature, (x * dx + z * dz) * curvature + -dz
    discriminant = b * b - a * c
    return -c / (b + discriminant.root()), discriminant


def display_image(d, x, y, z, by):
    """Image point of a physical point, and the truths that "it is valid" may have."""
    d = [np.float64(n) for n in d]
    m_x, m_y, m_z, y_o, z_o = (number(n, by) for n in d[:5])
    dx, dz = x - m_x, z - m_z
    t_s, meets_screen = crossing(d[5], m_x, m_z, dx, dz)
    t_v, meets_observers = crossing(d[6], m_x, m_z - z_o, dx, dz)
    over, ahead = t_v + -1.0, t_v - t_s
    demands = [p.positive() for p in (-dz, meets_screen, meets_observers, over, t_s, ahead)]
    nowhere = number(0, by)
    if {False} in demands:
        return nowhere, nowhere, {False}
    s_y = y_o + (y - y_o) * (ahead / over)
    if d[7]:
        a, b = s_y - m_y, s_y - y_o
        h_m, h_e = (a * a + m_z * m_z).root(), (b * b + z_o * z_o).root()
        kappa = (z / z_o) * (h_e / h_m)
        room = kappa + 1.0
        demands.append(room.positive())
        s_x = (x + m_x * kappa) / room
    else:
        s_x = m_x + t_s * dx
        if d[5]:
            scale = m_z / (m_z - (m_z + t_s * dz))
            demands.append(scale.positive())
            s_x, s_y = m_x + (s_x - m_x) * scale, m_y + (s_y - m_y) * scale
    w = three(d[14], s_x, d[15], s_y, d[16], by)
    demands.append(w.positive())
    w = number(1, by) if (d[14], d[15], d[16]) == (0, 0, 1) else w
    u, v = (three(d[k], s_x, d[k + 1], s_y, d[k + 2], by) / w for k in (8, 11))
    if d[20] or d[21]:
        c_u, c_v, f = (number(n, by) for n in d[17:20])
        a, b = (u - c_u) / f, (v - c_v) / f
        r2 = a * a + b * b
        factor = number(1, by) + r2 * (number(d[20], by) + r2 * d[21])
        u, v = c_u + f * (a * factor), c_v + f * (b * factor)
        demands.append(Pair(d[22] - r2.x, r2.e, by).positive())
    return u, v, all_of(demands)


def all_of(demands):
    """The truths that "all of these are true" may have."""
    may_hold, may_fail = all(True in t for t in demands), any(False in t for t in demands)
    return {truth for truth, may in ((True, may_hold), (False, may_fail)) if may}


def image(kind, m, a, b, c, q, by):
    """Image point and depth of the rows' pairs, and the truths of its being valid."""
    if kind == CROSSED_SLITS:
        f, g = number(m[12], by) - c, number(m[13], by) - c
        u, v = number(m[14], by) + a / f, number(m[15], by) + b / g
        return u, v, c, all_of([f.positive(), (-g).positive()])
    if kind == MATRIX:
        return a / q, b / q, c / q, q.positive()
    u, v, truths = display_image(m[12:], a, b, c, by)
    return u, v, c, truths


def exact_depth(m, point, offset):
    """Whether all that row 2 of M (p + o, 1) can add up to is representable: by exact fractions."""
    if not np.isfinite([*point, *offset]).all():
        return False
    fits, terms = True, [Fraction(float(m[11]))]
    for a, p, o in zip(m[8:11], point, offset, strict=True):
        if a == 0:
            continue
        both = [Fraction(float(p)), Fraction(float(o))]
        fits = fits and held(both) and quantum(both) >= Fraction(1, 2**126)
        terms += [Fraction(float(a)) * n for n in both]
    return fits and held(terms) and quantum(terms) >= Fraction(1, 2**126)


def quantum(numbers):
    """The largest power of two that all are multiples of; a huge one for zeros."""
    powers = [Fraction(n.numerator & -n.numerator, n.denominator) for n in numbers if n]
    return min(powers, default=Fraction(2**2000))


def held(numbers):
    return sum(abs(n) for n in numbers) <= 2**24 * quantum(numbers)


def outcomes(depth, u, v, z, truths):
    """All outcomes, True: occluded, that a sample may have, as a set of one or two."""
    height, width = depth.shape
    if True not in truths:
        return {False}
    (u0, u1), (v0, v1), (z0, z1) = ((p.x - p.e, p.x + p.e) for p in (u, v, z))
    if u1 < 0 or u0 >= width or v1 < 0 or v0 >= height:
        return {False}
    if not (abs(u.x) + u.e < 1e15 and abs(v.x) + v.e < 1e15 and abs(z.x) + z.e < np.inf):
        return {False, True}
    found = set()
    if False in truths or u0 < 0 or u1 >= width or v0 < 0 or v1 >= height:
        found.add(False)
    columns = range(max(math.floor(u0), 0), min(math.floor(u1), width - 1) + 1)
    for j in range(max(math.floor(v0), 0), min(math.floor(v1), height - 1) + 1):
        for i in columns:
            surface = float(depth[j, i])
            values = {surface, 0.0} if abs(surface) < 2.0**-126 else {surface}
            found |= {True for value in values if value < z1}
            found |= {False for value in values if not value < z0}
    return found


@np.errstate(all="ignore")
def sample(depth, point, offset, offset_exact, kind, m, by, given=True):
    """Image point u, v, z of a sample as pairs, the truths of its validity, and its outcomes."""
    rows = 4 if kind == MATRIX else 3
    parts = [row(m, k, point, by, offset) for k in range(rows)]
    u, v, z, truths = image(kind, m, *parts, *[None] * (4 - rows), by)
    u, v = (Pair(p.x, p.e * SAFETY + by.coordinate, by) for p in (u, v))
    z = Pair(z.x, z.e * SAFETY, by)
    found = outcomes(depth, u, v, z, truths)
    exact = offset_exact and given and kind != MATRIX
    if len(found) == 2 and exact and exact_depth(m, [p.x for p in point], offset):
        z = Pair(z.x, np.float64(0), by)
        found = outcomes(depth, u, v, z, truths)
    return u, v, z, truths, found


@np.errstate(all="ignore")
def texel_point(back, i, j, d, by):
    """LF Algorithm 1, lines 1 to 3."""
    screen = [number(n, by) for n in (i + 0.5, j + 0.5, d)]
    a, b, c, w = (row(back, k, screen, by) for k in range(4))
    return a / w, b / w, c / w
