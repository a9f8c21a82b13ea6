"""Balls hold what renderers make of any numbers in their operands, by fractions, and hardly more.

Operands are drawn, and in each a number; ``Rounded`` computes exactly, then rounds by as much as an error model allows.
"""

from fractions import Fraction
from functools import reduce
from math import floor, isqrt, trunc
from operator import add

import number_forms
import numpy as np
import pytest
from number_forms import operations, several

from lfssao.core.balls import SAFETY, UNKNOWN, Ball, ball_of
from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import is_finite
from lfssao.core.places import offset_spot, point_spot, row_of_spot
from lfssao.core.vectors import Vector, unit_vector

# Relative errors of + - *, quotients and roots, and of exp; large, as SAFETY hides small ones.
ERRORS = np.array([2.0**-16, 2.0**-14, 2.0**-13, 2.0**-16, 2.0**-17])
SMALLEST = Fraction(2) ** -126
ONES, SEVERAL, COMPARED, WAYS = 29, 26, 9, 8  # formulas of one operation, of several; comparisons; ways of a renderer
FORMS = ONES + SEVERAL + 3
SELECTED, SMOOTH = (18, 19, 20, 21, 22, 26, 28, 44), 29  # formulas that are decided by some operand; smoothstep
OF_OTHERS = {3, 9, 30, 47, 48, 49, 53, 54, 55, 56, 57}  # formulas that of zeros are no exact zero: x / 0, 0.1, a row


@formula
def comparisons(x, y):
    return x < y, x <= y, x > y, x >= y, x == y, ~(x < y), (x < y) | (x > y), (x <= y) & (y <= x), is_finite(x)


@kernel
def bounded(given, rows, by, made, doubts):
    """Values and errors of all formulas, a unit vector among them; may and must of comparisons; given: (N, 6, 2)."""
    zero = ball_of(0.0, 0.0, by)
    for i in range(given.shape[0]):
        x = Ball(given[i, 0, 0], given[i, 0, 1], zero)
        y = Ball(given[i, 1, 0], given[i, 1, 1], zero)
        z = Ball(given[i, 2, 0], given[i, 2, 1], zero)
        u = Ball(given[i, 3, 0], given[i, 3, 1], zero)
        v = Ball(given[i, 4, 0], given[i, 4, 1], zero)
        w = Ball(given[i, 5, 0], given[i, 5, 1], zero)
        p = Vector(x, y, z)
        o = offset_spot(Vector(u, v, w))
        place = point_spot(p) + x * o + y * o
        one = operations(x, y, z)
        more = several(x, y, z, u, v, w)
        rest = comparisons(x, y)
        last = row_of_spot(rows[i], 0, point_spot(p)), row_of_spot(rows[i], 0, place), unit_vector(p).x
        for k in range(len(one)):
            made[i, k, 0], made[i, k, 1] = one[k].value, one[k].error
        for k in range(len(more)):
            made[i, len(one) + k, 0], made[i, len(one) + k, 1] = more[k].value, more[k].error
        for k in range(len(last)):
            made[i, len(one) + len(more) + k, 0], made[i, len(one) + len(more) + k, 1] = last[k].value, last[k].error
        for k in range(len(rest)):
            doubts[i, k, 0], doubts[i, k, 1] = rest[k].may, rest[k].must


class Rounded:
    """A number of a renderer that flushes or not, and rounds as its way is, by all that is allowed or not at all."""

    rng = np.random.default_rng(3)
    flushes = False
    way = 0

    def __init__(self, x):
        self.x = x if isinstance(x, Fraction) else Fraction(float(x))

    @classmethod
    def flushed(cls, x):
        return Fraction(0) if cls.flushes and abs(x) < SMALLEST else x

    @classmethod
    def of(cls, x):
        if isinstance(x, Rounded):
            return x.x
        return Fraction(float(np.float32(x))) if x < np.inf else x

    @classmethod
    def off(cls, x, kind):
        way = cls.way * (1 if x > 0 else -1) if cls.way else int(cls.rng.integers(-1, 2))  # up, down or as it comes
        return Rounded(cls.flushed(x * (1 + way * Fraction(ERRORS[kind]))))

    def operands(self, other):
        return self.flushed(self.x), self.flushed(self.of(other))

    def __add__(self, other):
        x, y = self.operands(other)
        return self.off(x + y, 0) if x and y else Rounded(x + y)

    def __mul__(self, other):
        if isinstance(other, Vector):
            return NotImplemented
        x, y = self.operands(other)
        return Rounded(x * y) if 1 in (x, y) else self.off(x * y, 0)

    def __truediv__(self, other):
        x, y = self.operands(other)
        return self.off(x / y, 1) if y else NOWHERE

    def sqrt(self):
        x = self.flushed(self.x)
        return self.off(Fraction(isqrt(int(x * 4**300)), 2**300), 2) if x >= 0 else NOWHERE

    def __floor__(self):
        return Rounded(Fraction(floor(self.flushed(self.x))))

    def __trunc__(self):
        return Rounded(Fraction(trunc(self.flushed(self.x))))

    def __sub__(self, other):
        return self + -Rounded(self.of(other))

    def __rsub__(self, other):
        return -self + other

    def __rtruediv__(self, other):
        return Rounded(self.of(other)) / self

    def __neg__(self):
        return Rounded(-self.x)

    def __abs__(self):
        return Rounded(abs(self.x))

    def __lt__(self, other):
        return np.bool(self.x < self.of(other))

    def __le__(self, other):
        return np.bool(self.x <= self.of(other))

    def __gt__(self, other):
        return np.bool(self.x > self.of(other))

    def __ge__(self, other):
        return np.bool(self.x >= self.of(other))

    def __eq__(self, other):
        return np.bool(self.x == self.of(other))

    __radd__ = __add__
    __rmul__ = __mul__
    __hash__ = None


NOWHERE = Rounded(1e300)  # what nobody knows: no ball but the unknown one holds it


def total(terms):
    """The sum of terms in any order, cut into two sums or not."""
    order = Rounded.rng.permutation(len(terms))
    cut = Rounded.rng.integers(1, len(terms) + 1)
    return reduce(add, [reduce(add, part) for part in (terms[order[:cut]], terms[order[cut:]]) if len(part)])


def products(a, b):
    return np.array([Rounded(1.0) * x * y for x, y in zip(a, b, strict=True)], object)


def row_of(m, p, offsets):
    """A row of a point and of offsets, applied to each, to the point and the offsets' sum, or to the sum of all."""
    way = Rounded.rng.integers(3)
    if way == 0 or not offsets:
        made = total(products(m, [*p, 1]))
        for factor, o in offsets:
            made = made + factor * total(products(m[:3], o))
        return made
    o = [total(np.array([factor * x[k] for factor, x in offsets], object)) for k in range(3)]
    if way == 1:
        return total(products([*m, *m[:3]], [*p, 1, *o]))
    return total(products(m, [*(x + y for x, y in zip(p, o, strict=True)), 1]))


def rounded(x, times, _like, quotients=0):
    kinds = [0] * times + [1] * quotients
    return reduce(lambda made, kind: Rounded.off(made.x, kind), kinds, Rounded(np.float32(x)))


def power(x, k):
    """x^k as exp2(k log2 x), log2 off by 2^-21, below 1/2 by 3 ulp."""
    x = Rounded(Rounded.of(x))
    if k == 1 or not x.x > 0:
        return x
    logarithm, (a, b, c) = np.log2(float(x.x)), Rounded.rng.choice([-1, 0, 1], 3)
    logarithm += a * (2.0**-21 if x.x >= 0.5 else 3 * 2.0**-24 * 2.0 ** np.frexp(logarithm)[1])
    exponent = k * logarithm * (1 + b * 2.0**-23)
    return Rounded(float(np.exp2(exponent) * (1 + c * (ERRORS[3] + ERRORS[4] * abs(exponent)))))


def log2(x):
    """Off by 2^-21, outside [1/2, 2] by 3 ulp."""
    logarithm = np.log2(float(Rounded.of(x)))
    off = 2.0**-21 if abs(logarithm) <= 1 else 3 * 2.0**-24 * 2.0 ** np.frexp(logarithm)[1]
    return Rounded(logarithm + Rounded.rng.choice([-1, 0, 1]) * off)


def exponential(x):
    x = Rounded.of(x)
    return Rounded(float(np.exp(float(x)) * (1 + Rounded.rng.choice([-1, 0, 1]) * (ERRORS[3] + ERRORS[4] * abs(x)))))


def by_squaring(x, times):
    return [reduce(lambda made, _: made * made, range(times), x), power(x, 2.0**times)][Rounded.rng.integers(2)]


def line(start, slope, at, middle):
    """As it is written, or multiplied out."""
    if Rounded.rng.integers(2):
        return slope * (at - middle) + start
    return slope * at + (Rounded(np.float32(start)) - Rounded(np.float32(slope)) * middle)


def over_length(v):
    """Divided by its largest coordinate before, or not; by a root and a product, or by a quotient."""
    parts = [v.x, v.y, v.z]
    if Rounded.rng.integers(2) and any(each.x for each in parts):
        size = max((abs(each) for each in parts), key=lambda each: each.x)
        parts = [each / size for each in parts]
    length = total(products(parts, parts)).sqrt()
    if not length.x:
        return Vector(NOWHERE, NOWHERE, NOWHERE)
    by_root = Rounded.rng.integers(2)
    return Vector(*(each * (1 / length) if by_root else each / length for each in parts))


WORDS = {
    "line": line,
    "log2": log2,
    "exponential": exponential,
    "by_squaring": by_squaring,
    "smoothstep": lambda x: [(x * x) * (3 - (x + x)), 3 * (x * x) - 2 * (x * x * x)][Rounded.rng.integers(2)],
    "rounded": rounded,
    "power": power,
    "alternatives": lambda x, y: (x, y)[Rounded.rng.integers(2)],
    "dot": lambda a, b: total(products([a.x, a.y, a.z], [b.x, b.y, b.z])),
}


def drawn(rng, n):
    """Balls of many sizes, next to one another and to flushed numbers; exact, nearly exact or wide."""
    x = rng.choice([-1, 1], (n, 6)) * 2.0 ** rng.uniform(-2, 2, (n, 6))
    few = n // 6, 6
    x[: n // 6] *= np.where(rng.random(few) < 0.7, 2.0 ** rng.uniform(-128, -122, few), 2.0**9)
    near = rng.random((n, 6)) < 0.2
    fixed = rng.random((n, 6))
    x = np.where(near, x[:, :1] * rng.choice([1, -1], (n, 6)) * (1 + rng.normal(size=(n, 6)) * 2.0**-21), x)
    x = np.select([fixed < 0.06, fixed < 0.12], [0.0, 1.0], x).astype(np.float32).astype(float)
    off = rng.choice([0.0, 2.0**-22, 2.0**-12, 0.3, 1.2], (n, 6), p=[0.4, 0.3, 0.1, 0.1, 0.1])
    off[:, 0] = np.where(rng.random(n) < 0.2, abs(x[:, 0] - x[:, 1]) / abs(x[:, 0] + 1e-99), off[:, 0])
    return np.stack([x, off * abs(x)], axis=-1)


def bounds(given, rows, errors):
    n = len(given)
    made = np.empty((n, FORMS, 2))
    doubts = np.empty((n, COMPARED, 2), bool)
    bounded(given, rows, errors, made, doubts)
    return made, doubts


def renderers(given, rows):
    """Results of renderers, of numbers in the balls: (N, WAYS, FORMS) fractions, and what they compare."""
    made = np.empty((len(given), WAYS, FORMS), object)
    compared = []
    rng = np.random.default_rng(7)
    parts = rng.choice([-1.0, 1.0, 0.0, 0.6], (len(given), WAYS, 6), p=[0.4, 0.4, 0.1, 0.1])
    for i, k in np.ndindex(len(given), WAYS):
        Rounded.flushes, Rounded.way = bool(k % 2), (0, 1, -1)[rng.integers(3)]
        x = [Rounded(Fraction(v) + Fraction(e) * Fraction(parts[i, k, j])) for j, (v, e) in enumerate(given[i])]
        if k == 0 and abs(x[0].x - Fraction(given[i, 1, 0])) <= Fraction(given[i, 1, 1]):
            x[1] = x[0]
        m = [float(a) for a in rows[i]]
        o = x[3:]
        last = row_of(m, x[:3], []), row_of(m, x[:3], [(x[0], o), (x[1], o)]), over_length(Vector(*x[:3])).x
        made[i, k] = [Rounded.of(y) for y in (*operations(*x[:3]), *several(*x), *last)]
        compared.append(comparisons(*x[:2]))
    return made, np.array(compared).reshape(len(given), WAYS, -1)


@pytest.fixture(scope="module")
def seen():
    """Balls, rows, what is said of them, and what renderers make of numbers in them."""
    rng = np.random.default_rng(2)
    given = drawn(rng, 300)
    rows = rng.choice([0.0, 1.0, -0.3, 2.0**-130], (300, 4), p=[0.2, 0.3, 0.4, 0.1])
    rows = rows.astype(np.float32).astype(float)
    with pytest.MonkeyPatch.context() as patch:
        for name, word in WORDS.items():
            patch.setattr(number_forms, name, word)
        made, compared = renderers(given, rows)
    return given, rows, bounds(given, rows, ERRORS), made, compared


def is_held(compared, doubts):
    return (compared <= doubts[:, None, :, 0]) & (compared >= doubts[:, None, :, 1])


def test_renderers_lie_in_balls(seen):
    _, _, (found, doubts), made, compared = seen
    exact = np.vectorize(Fraction, otypes=[object])
    known = found[..., 1] < BEYOND
    limit = exact(np.where(known, found[..., 1] * SAFETY, 0))[:, None]
    assert not ((abs(made - exact(found[..., 0])[:, None]) > limit) & known[:, None]).any()
    assert known.mean() > 0.9
    assert is_held(compared, doubts).all()


BEYOND = 2.0**200  # an error beyond all float32 numbers
# Dot products with 0 and 1, and a middle and its error, whose roundings are counted and not made.
CONSTANT = {32, 33, 34, 35, 50}


@pytest.mark.parametrize("operand", range(7))
def test_some_renderer_lies_outside_of_each_smaller_ball(seen, operand):
    """By half the error of an operand, or a quarter of the errors of operations: each of the formulas notices."""
    given, rows, (found, doubts), made, compared = seen
    small = given.copy()
    small[:, operand % 6, 1] *= 0.5 if operand < 6 else 1
    narrow, fewer = bounds(small, rows, ERRORS * (1 if operand < 6 else 0.25))
    changed = (narrow != found).any(axis=(0, 2))
    doubted = (fewer != doubts).any(axis=(0, 2))
    off = abs(made.astype(float) - narrow[:, None, :, 0]) > narrow[:, None, :, 1] * SAFETY
    assert changed.sum() >= 7
    changed[list(CONSTANT)] = False
    assert off.any(axis=(0, 1))[changed].all()
    assert not is_held(compared, fewer).all(axis=(0, 1))[doubted].any()
    assert doubted[:-1].all() == (operand < 2)


def test_what_is_unknown_stays_unknown():
    """Whatever it meets, 0 among it; but smoothstep is of numbers from 0 to 1, and a decision's other way is free."""
    given = np.tile([[2.0, 0.5], [0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, 0.0], [-3.0, 1.0]], (7, 1, 1))
    given[range(6), range(6), 1] = UNKNOWN
    made, doubts = bounds(given, np.ones((7, 4)), ERRORS)
    assert not np.isnan(made).any()
    assert (abs(made[..., 0]) < np.inf).all()
    affected = (made[:6] != made[6]).any(axis=2)
    assert affected.sum() > 80
    assert set(np.argwhere(affected & (made[:6, :, 1] < BEYOND))[:, 1]) <= {*SELECTED, SMOOTH, 45, 46, 48, 49}
    assert made[0, 2, 1] > BEYOND  # 0 times what is unknown may be NaN
    assert (doubts[:2, :-1, 0] & ~doubts[:2, :-1, 1]).all()
    assert not doubts[0, -1, 1]


def test_zero_is_exact():
    made, doubts = bounds(np.zeros((1, 6, 2)), np.zeros((1, 4)), ERRORS)
    assert set(np.flatnonzero(made[0, :, 1])) == OF_OTHERS | {5, 6}
    assert set(np.flatnonzero(made[0, :, 0])) <= OF_OTHERS | {5, 6, 17}
    assert (doubts[..., 0] == doubts[..., 1]).all()
