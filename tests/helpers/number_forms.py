"""Formulas of all operators and words, which tests run on each kind of number."""

import numpy as np

from lfssao.core.functions import exponential
from lfssao.core.jit import formula
from lfssao.core.numbers import (
    alternatives,
    by_squaring,
    double,
    larger,
    line,
    log2,
    middle_of,
    number,
    power,
    rounded,
    select,
    smaller,
    smoothstep,
    spread_of,
)
from lfssao.core.vectors import Vector, cross, dot


@formula
def operations(x, y, z):
    """One operation each: those that round, then those that do not, then comparisons."""
    return (
        x + y, x - y, x * y, x / y, np.sqrt(x), 0.1 + x, x - 0.1, 3 * x, x * 0.1, 1 / x, x / 3,
        -x, abs(x), larger(x, y), smaller(x, y), larger(0, x), smaller(1, x), number(0.1, x),
        select(x < y, x, z), select(x <= y, x, z), select(x > y, x, z), select(x >= y, x, z), select(x == y, x, z),
        select(x < 0.1, x, 0), select(x >= 1, 1, x), select((x < y) & (y < z), x, y), select((x < y) | (y < z), x, y),
        select(~(x < y), x, y), select((x < y) & ~(y >= z), x, z),
    )  # fmt: skip


@formula
def several(x, y, z, u, v, w):
    """Several operations each, which may be made in other ways."""
    a = Vector(x, y, z)
    b = Vector(u, v, w)
    c = cross(a, b)
    d = x * a + (a - b)
    zero = number(0, x)
    one = number(1, x)
    return (
        smoothstep(smaller(1, larger(0, x))), rounded(0.1, 3, x), dot(a, b), dot(a, Vector(one, zero, zero)),
        dot(Vector(x, y, one), b), dot(a, Vector(zero, v, w)), dot(Vector(one, one, zero), b),
        c.x, c.y, c.z, d.x, d.y, d.z, alternatives(x, y), alternatives(y, x), select(alternatives(x < y, y >= z), x, y),
        power(smaller(1, larger(0, x)), 2.5), power(smaller(1, larger(0, y)), 1.0), rounded(0.1, 1, x, 2),
        by_squaring(smaller(1, larger(0, x)), 3), number(log2(double(larger(2.0**-100, abs(x)))), x),
        middle_of(x) + spread_of(x), np.floor(4 * x), np.trunc(4 * x), line(0.5, 0.1, x, 0.3),
        exponential(-abs(x)),
    )  # fmt: skip
