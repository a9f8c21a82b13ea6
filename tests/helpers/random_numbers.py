"""Renderers that round at random within an error model: numbers and a view on which formulas run uncompiled.

A ``Number`` holds one of each renderer, (R, T, n): of R renderers, T texels and n samples, or 1 where all are equal.
Numbers are real: the result of an operation is off by a relative error that the model allows, often by the largest, and
by none, so that a product and a sum are also fused. Nothing here knows how balls are computed.
"""

import sys
from contextlib import contextmanager
from dataclasses import replace
from functools import reduce
from operator import add, and_, or_

import numpy as np
import pytest

from lfssao.core import functions, numbers, vectors
from lfssao.core.corners import Corners
from lfssao.core.places import Rows
from lfssao.core.vectors import Vector
from lfssao.optics.kernels.projection import image_of

KINDS = {np.add: "operation", np.subtract: "operation", np.multiply: "operation", np.divide: "quotient",
         np.sqrt: "root"}  # fmt: skip
LOOK = 2.0**-20  # how far a coordinate of a viewing direction may be off
SMALLEST = 2.0**-126
ERRORS = "operation", "quotient", "root", "coordinate", "angle"
WORDS = "number", "rounded", "alternatives", "by_squaring", "smoothstep", "power", "twice", "log2"


def single(x):
    """Numbers rounded to float32, as every renderer has them, of three axes."""
    x = np.asarray(x, np.float64).astype(np.float32).astype(np.float64)
    return x.reshape((1,) * (3 - x.ndim) + x.shape)


def scaled(model, factor):
    """A model of errors that are so many times as large."""
    exponential = tuple(factor * part for part in model.exponential)
    return replace(model, exponential=exponential, **{kind: factor * getattr(model, kind) for kind in ERRORS})


def outside(made, found):
    """How many numbers lie outside; ends of bounds are float32 numbers, and the numbers real."""
    low = np.nextafter(found.lower, np.float32(-np.inf)).astype(float)
    high = np.nextafter(found.upper, np.float32(np.inf)).astype(float)
    return np.count_nonzero(~((made > low) & (made < high)))


class Renderers:
    """So many renderers, what they do at random, and the words of formulas as they compute them."""

    def __init__(self, rng, count, model):
        self.rng, self.count, self.model = rng, count, model
        self.flushes = self.lot(0.5)
        self.habit = rng.integers(0, 12, (count, 1, 1))  # one of seven, or from 7 on anew for each operation

    def lot(self, chance):
        """By lot for each renderer."""
        return self.rng.random((self.count, 1, 1)) < chance

    def within(self, like):
        """Numbers of [-1, 1] for every renderer."""
        lots = self.rng.integers(0, 7, (self.count, 1, 1))
        mode = np.where(self.habit < 7, self.habit, lots)
        ends, signs = (np.array(each)[mode] for each in ([-1.0, 1, 0, 0, 0, 0, 0], [0.0, 0, -1, 1, 0, 0, 0]))
        made = np.sign(like) * signs + ends
        for which, change in ((5, np.asarray), (6, np.sign)):
            rows = np.flatnonzero(mode == which)
            made[rows] = change(self.rng.uniform(-1, 1, (rows.size, *made.shape[1:])))
        return made

    def off(self, x, relative, exact=False):
        """Results that are off by a relative error, or flushed."""
        factor = self.within(x)
        factor *= relative
        factor += 1
        np.copyto(factor, 1, where=exact)
        return Number(self, self.flushed(np.multiply(x, factor, out=factor)))

    def flushed(self, x):
        return np.where(self.flushes & (np.abs(x) < SMALLEST), 0.0, x)

    def values(self, x):
        return x.x if isinstance(x, Number) else single(x)

    def choose(self, x, y, chance=0.5):
        """One of two for each renderer."""
        return self.where(self.lot(chance), x, y)

    def where(self, condition, x, y):
        return Number(self, np.where(condition, self.values(x), self.values(y)))

    def total(self, factors, values):
        """A sum of products in any order, cut into two sums or not."""
        order = self.rng.permutation(len(values))
        cut = int(self.rng.integers(1, len(values) + 1))
        products = [self.number(factors[k], None) * values[k] for k in order]
        return reduce(add, [reduce(add, part) for part in (products[:cut], products[cut:]) if part])

    # Words

    def number(self, x, _like):
        return x if isinstance(x, Number) else Number(self, single(x))

    def rounded(self, x, times, _like, quotients=0):
        kinds = [self.model.operation] * times + [self.model.quotient] * quotients
        return reduce(lambda made, relative: self.off(made.x, relative), kinds, self.number(x, None))

    def alternatives(self, x, y):
        if isinstance(x, Number) or isinstance(y, Number):
            return self.choose(x, y)
        return np.where(self.lot(0.5), x, y)

    def twice(self, x):
        return Number(self, 2 * x.x)

    def smoothstep(self, x):
        return self.choose((x * x) * (3 - (x + x)), 3 * (x * x) - 2 * (x * x * x))

    def by_squaring(self, x, times):
        return self.choose(reduce(lambda made, _: made * made, range(times), x), self.power(x, 2.0**times))

    def power(self, x, k):
        """x^k as exp2(k log2 x), log2 off by 2^-21, below 1/2 by 3 ulp."""
        if k in (0, 1):
            return x if k else self.number(1, None)
        logarithm = np.log2(x.x)
        near = np.where(x.x >= 0.5, 2.0**-21, 3 * 2.0**-23 * 2.0 ** np.floor(np.log2(np.abs(logarithm))))
        y = k * Number(self, logarithm + near * self.within(logarithm))
        constant, slope = self.model.exponential
        return self.where(x.x > 0, self.off(np.exp2(y.x), constant + slope * np.abs(y.x)), 0)

    def exponential(self, x):
        constant, slope = self.model.exponential
        return self.off(np.exp(x.x), constant + slope * np.abs(x.x))

    def log2(self, x):
        """Off by 2^-21, outside [1/2, 2] by 3 ulp."""
        logarithm = np.log2(np.maximum(x.x, 2.0**-1000))
        near = np.where(np.abs(logarithm) <= 1, 2.0**-21, 3 * 2.0**-23 * 2.0 ** np.floor(np.log2(np.abs(logarithm))))
        return Number(self, logarithm + near * self.within(logarithm))

    def dot(self, a, b):
        return self.total([a.x, a.y, a.z], [b.x, b.y, b.z])

    @contextmanager
    def compute(self):
        """In the block, formulas have these words."""
        words = [getattr(numbers, name) for name in WORDS] + [vectors.dot, functions.exponential]
        own = {word: getattr(self, word.__name__) for word in words}
        with pytest.MonkeyPatch.context() as patch, np.errstate(all="ignore"):
            for module in [each for name, each in sys.modules.items() if name.startswith("lfssao.")]:
                for word, made in own.items():
                    if vars(module).get(word.__name__) is word:
                        patch.setattr(module, word.__name__, made)
            yield


class Number(np.lib.mixins.NDArrayOperatorsMixin):
    """A number of every renderer."""

    def __init__(self, by, x):
        self.by, self.x = by, x

    def __array_ufunc__(self, ufunc, method, *inputs):
        x = [self.by.values(each) for each in inputs]
        if ufunc not in KINDS:
            made = ufunc(*x)
            return made if made.dtype == bool else Number(self.by, made)
        x = [self.by.flushed(each) for each in x]
        made = ufunc(*x)
        exact = False
        if ufunc not in (np.divide, np.sqrt):  # what a float32 number is, of float32 numbers, is rounded correctly
            exact = reduce(and_, (each == each.astype(np.float32) for each in (*x, made)))
            alike = [np.abs(each) == 1 for each in x] if ufunc is np.multiply else [each == 0 for each in x]
            exact = reduce(or_, alike, exact)
        return self.by.off(made, getattr(self.by.model, KINDS[ufunc]), exact | (made == 0))

    def __array_function__(self, function, types, given, named):
        assert function is np.where
        return self.by.where(*given)

    def crude_root(self):
        """The root by half of a float32's bits."""
        bits = self.x.astype(np.float32).view(np.int32)
        return Number(self.by, (np.int32(0x1FBD1DF5) + (bits >> 1)).view(np.float32).astype(float))

    def sectors_to(self, last):
        """Bits from this number to before another."""
        first, last = (x.astype(np.int64) for x in np.broadcast_arrays(self.x, self.by.values(last)))
        return ((1 << last) - 1) & ~((1 << first) - 1)

    def __mul__(self, other):
        by_itself = isinstance(other, Vector | Rows | Place)
        return NotImplemented if by_itself else np.multiply(self, other)

    def __getitem__(self, _all):
        return self


class Table:
    """An array of an estimator, whose elements are numbers of renderers."""

    def __init__(self, by, array):
        self.by, self.array, self.shape = by, array, array.shape

    def __getitem__(self, index):
        return Number(self.by, single(self.array[index]))


def lifted(by, estimator):
    """An estimator whose arrays give numbers of renderers."""
    return type(estimator)(*(Table(by, x) if isinstance(x, np.ndarray) else x for x in estimator))


class Place:
    """A point and offsets, and rows of each: renderers apply a row to each of them, to point and offset, or the sum."""

    def __init__(self, view, points, offsets, rows):
        self.view, self.points, self.offsets, self.rows = view, points, offsets, rows

    def __add__(self, other):
        parts = ((getattr(self, name) + getattr(other, name)) for name in ("points", "offsets", "rows"))
        return Place(self.view, *parts)

    def __sub__(self, other):
        return self + (-1.0) * other

    def __rmul__(self, factor):
        assert not self.points
        return Place(self.view, [], *([factor * each for each in parts] for parts in (self.offsets, self.rows)))

    def row(self, k):
        by = self.view.by
        m = self.view.rows[4 * k : 4 * k + 4]
        each = by.total([1.0] * len(self.rows), [getattr(r, "uvqz"[k]) for r in self.rows])
        if not self.offsets:
            return each
        p = self.points[0]
        o = reduce(add, [self.offsets[k] for k in by.rng.permutation(len(self.offsets))])
        both = by.total([*m, *m[:3]], [p.x, p.y, p.z, 1.0, o.x, o.y, o.z])
        summed = by.total(m, [p.x + o.x, p.y + o.y, p.z + o.z, 1.0])
        return by.choose(each, by.choose(both, summed), 0.4)


class RandomPyramid:
    """Moments of depth of each renderer, level by level, each with a border of zeros (VO section 4.2)."""

    def __init__(self, view, prefilter):
        self.by, (height, width) = view.by, view.shape
        there = np.broadcast_to(view.given.depth < np.inf, view.surfaces.shape).reshape(-1, height, width)
        z = np.where(there, view.surfaces.reshape(there.shape), 0.0)
        level = [there * 1.0, z, self.by.off(z * z, self.by.model.operation).x]
        self.levels, taps = [level], (0.125, 0.375, 0.375, 0.125) if prefilter else (0.0, 0.5, 0.5, 0.0)
        while max(level[0].shape[1:]) > 1:
            level = [self.half(each, taps) for each in level]
            self.levels.append(level)

    def half(self, numbers, taps):
        """The next level: a mean by taps along both axes, in any order."""
        high, wide = (np.array(numbers.shape[1:]) + 1) // 2
        bordered = np.zeros((len(numbers), 2 * high + 2, 2 * wide + 2))
        bordered[:, 1 : 1 + numbers.shape[1], 1 : 1 + numbers.shape[2]] = numbers
        factors = []
        values = []
        for j, i in np.ndindex(4, 4):
            if taps[j] * taps[i]:
                factors.append(taps[j] * taps[i])
                values.append(Number(self.by, bordered[:, j : j + 2 * high : 2, i : i + 2 * wide : 2]))
        return self.by.total(factors, values).x

    def between(self, a, b, part):
        """From a to b, by one of two formulas."""
        return self.by.choose(a + part * (b - a), (1 - part) * a + part * b)

    def bilinear(self, k, u, v):
        """Three numbers of level k at an image point."""
        off = self.by.model.coordinate
        of = np.arange(self.by.count)[:, None, None]
        x, y = (each.x * 2.0**-k - 0.5 + off * self.by.within(each.x) for each in (u, v))
        i = np.floor(x).astype(int)
        j = np.floor(y).astype(int)
        f = Number(self.by, x - i)
        g = Number(self.by, y - j)
        made = []
        for texture in self.levels[k]:
            high, wide = texture.shape[1:]

            def at(row, column, texture=texture, high=high, wide=wide):
                inside = (row >= 0) & (column >= 0) & (row < high) & (column < wide)
                return Number(self.by, np.where(inside, texture[of, row % high, column % wide], 0.0))

            upper = self.between(at(j, i), at(j, i + 1), f)
            made.append(self.between(upper, self.between(at(j + 1, i), at(j + 1, i + 1), f), g))
        return made

    def at(self, u, v, level):
        """The three numbers at an image point and a level, which is held between 0 and the coarsest."""
        u, v = (
            Number(self.by, np.broadcast_to(each.x, np.broadcast_shapes(u.x.shape, level.x.shape))) for each in (u, v)
        )
        off = self.by.model.coordinate
        last = len(self.levels) - 1
        level = np.clip(level.x + off * self.by.within(level.x), 0, last)
        fine = np.minimum(np.floor(level), last - 1) if last else np.zeros_like(level)
        part = Number(self.by, level - fine)
        found = [self.bilinear(k, u, v) for k in range(last + 1)]
        made = []
        for number in range(3):
            values = [each[number] for each in found]
            of_level = [values[0]] * 2 if last == 0 else [values[0], values[1]]
            a, b = of_level
            for k in range(1, last):
                a = self.by.where(fine >= k, values[k], a)
                b = self.by.where(fine >= k, values[k + 1], b)
            made.append(self.between(a, b, part) if last else a)
        return made


def place_in(place, size, border):
    """The column or row in the texture that stands for any, by a border of GPU samplers."""
    if border == "clamp":
        return np.clip(place, 0, size - 1)
    ways = {"repeat": np.arange(size), "mirror": np.arange(size)[::-1]}
    return np.concatenate([np.arange(size), ways[border]])[np.mod(place, 2 * size)]


class RandomView:
    """A view with the words of ``lfssao.ao.formulas.Seen``; given: a ``BallView``, of which textures are read.

    shape: (height, width). options: those of the estimator, of which border and background are read.
    """

    def __init__(self, by, given, shape, options):
        self.by, self.given, self.rows, self.lens, self.shape = by, given, given.rows, given.lens, shape
        self.border, self.cleared = options.get("border", "open"), options.get("background") == "cleared"
        self.linear = options.get("filter") == "linear"
        part = np.clip(0.5 + by.within(np.ones((1, 1, given.depth.size))), 0, 1)[:, 0]
        with np.errstate(invalid="ignore"):
            self.surfaces = np.where(given.low < given.high, given.low + part * (given.high - given.low), given.low)
        self.filtered = None if given.moments_of is None else RandomPyramid(self, given.moments_of.roundings > 4)
        self.away = LOOK * by.rng.choice([-1, 0, 1, 0.5], (by.count, given.directions.size))

    def _vector(self, texture, texel):
        return Vector(*(Number(self.by, single(texture[3 * texel + k])) for k in range(3)))

    def between(self, read, seen):
        """Return what ``read`` gives of a texel, or between four."""
        if not isinstance(seen, Corners):
            return read(seen)
        (a, b, c, d), (x, y) = map(read, seen[:4]), seen[4:]
        if isinstance(a, Vector):
            parts = ([getattr(each, k) for each in (a, b, c, d)] for k in "xyz")
            return Vector(*(self.mixed(*part, x, y) for part in parts))
        return self.mixed(a, b, c, d, x, y)

    def mixed(self, a, b, c, d, x, y):
        """A number between four, by one of two formulas."""
        upper = a + x * (b - a)
        lower = c + x * (d - c)
        weighed = ((1 - x) * (1 - y)) * a + (x * (1 - y)) * b + (((1 - x) * y) * c + (x * y) * d)
        return self.by.choose(upper + y * (lower - upper), weighed)

    def position(self, seen):
        if self.given.remade:
            return self.point_at(self.column(seen) + 0.5, self.row(seen) + 0.5, self.surface(seen))
        return self.between(self._position, seen)

    def point_at(self, u, v, z):
        """The point at z on the ray of an image point, whose terms may be multiplied out."""
        m = self.given.rays.numbers
        world = self.given.rays.world

        def line(start, slope, at, middle):
            return self.by.choose(
                start + slope * (at - middle), (start - slope * self.by.number(middle, None)) + slope * at
            )

        u, v = (self.by.number(each, None) if not isinstance(each, Number) else each for each in (u, v))
        x = line(m[1], m[2], u, m[0]) + z * line(m[3], m[4], u, m[0])
        y = line(m[6], m[7], v, m[5]) + z * line(m[8], m[9], v, m[5])
        return Vector(*(self.by.total(world[4 * k : 4 * k + 4], [x, y, z, 1.0]) for k in range(3)))

    def apart(self, there, here):
        return there - here

    def _position(self, texel):
        made = self._vector(self.given.positions, texel)
        if not self.cleared:
            return made
        parts = made.x.x, made.y.x, made.z.x  # a cleared place is exact in other axes
        off = 2.0**-24 * sum(map(abs, parts)) * ~(self.given.depth[texel] < np.inf)
        return Vector(*(Number(self.by, x + off * self.by.within(x)) for x in parts))

    def normal(self, texel):
        return self._vector(self.given.normals, texel)

    def direction(self, texel):
        exact = self._vector(self.given.directions, texel)
        of = np.arange(self.by.count)[:, None, None]
        made = [each.x + self.away[of, 3 * texel + k] for k, each in enumerate((exact.x, exact.y, exact.z))]
        return Vector(*(Number(self.by, x) for x in made))

    def turn(self, texel):
        return tuple(Number(self.by, single(self.given.turns[k][texel])) for k in range(2))

    def noise(self, texel):
        parts = [Number(self.by, single(row[texel])) for row in self.given.turns]
        axes = [self._vector(self.given.axes, k) for k in range(len(parts))]
        first, *others = (part * axis for part, axis in zip(parts, axes, strict=True))
        return sum(others, first)

    def jitter(self, texel):
        return (
            Number(self.by, single(self.given.third[texel])) if len(self.given.turns) == 3 else self.by.number(0, None)
        )

    def turn_by_angle(self, texel):
        off = self.by.model.angle if self.given.turned else 0.0
        return tuple(Number(self.by, part.x + off * self.by.within(part.x)) for part in self.turn(texel))

    def sine_of_angle(self, x):
        return Number(self.by, x.x + self.by.model.angle * self.by.within(x.x))

    def arc_cosine(self, x):
        """Off by a part of itself, of a cosine that is off by a rounding."""
        cosine = np.clip(x.x * (1 + self.by.model.operation * self.by.within(x.x)), -1, 1)
        return self.by.off(np.arccos(cosine), self.by.model.angle)

    def cosine_and_sine(self, angle):
        """Each is off by an absolute error."""
        return tuple(
            Number(self.by, made + self.by.model.angle * self.by.within(made))
            for made in (np.cos(angle.x), np.sin(angle.x))
        )

    def fork(self, condition):
        return condition

    def row(self, texel):
        return texel // self.shape[1]

    def column(self, texel):
        return texel % self.shape[1]

    def surface(self, seen):
        of = np.arange(self.by.count)[:, None, None]
        return self.between(lambda texel: Number(self.by, self.surfaces[of, texel]), seen)

    def coarse_z(self, seen, h, log_q):
        """Z of a surface in a level of rotated sub-samples, and whether there is one."""
        exponent = np.frexp(np.maximum(np.floor(h.x), 1.0))[1] - 1
        level = np.clip(exponent - log_q, 0, len(self.given.levels.first) - 1)
        made = 0.0
        (height, width), column, row = self.shape, self.column(seen), self.row(seen)
        for k in range(len(self.given.levels.first)):
            u = column >> k
            v = row >> k
            for below in range(k, 0, -1):  # the texel of the level below that stands for it
                wide = -(-width >> (below - 1))
                high = -(-height >> (below - 1))
                u, v = np.minimum(2 * u + (v & 1 ^ 1), wide - 1), np.minimum(2 * v + (u & 1 ^ 1), high - 1)
            made = np.where(level == k, v * width + u, made)
        texel = made.astype(int)
        return self.surface(texel), self.given.depth[texel] < np.inf

    def other(self, seen, texel):
        if not isinstance(seen, Corners):
            return seen != texel
        return (seen.texel != texel) | (seen.x > 0) | (seen.y > 0)

    def shows(self, texel):
        if isinstance(texel, Corners):
            return reduce(and_, map(self.shows, texel[:4]))
        return np.ones(np.shape(texel), bool) if self.cleared else self.given.depth[texel] < np.inf

    def rightward(self):
        return self._vector(self.given.axes, np.zeros((1, 1, 1), int))

    def upward(self):
        return self._vector(self.given.axes, np.ones((1, 1, 1), int))

    def at(self, point):
        x = [point.x, point.y, point.z, 1.0]
        rows = [self.by.total(self.rows[4 * k : 4 * k + 4], x) for k in range(4)]
        return Place(self, [point], [], [Rows(*rows)])

    def along(self, direction):
        x = [direction.x, direction.y, direction.z]
        rows = [self.by.total(self.rows[4 * k : 4 * k + 3], x) for k in range(4)]
        return Place(self, [], [direction], [Rows(*rows)])

    def image_z(self, texel):
        return self.surface(texel)

    def sample_offset(self, x):
        """R s, rounded once, or the product of R and s that are rounded."""
        exact = self.by.number(x, None).x
        twice = (1 + 2.0**-24 * self.by.within(exact)) * (1 + 2.0**-24 * self.by.within(exact))
        return self.by.choose(Number(self.by, exact), self.by.off(exact * twice, self.by.model.operation))

    def depth_at(self, place):
        place = self.placed(place)
        if not self.given.divides:
            return place.row(3)
        q = place.row(2)
        return self.by.where(q > 0, place.row(3) / q, np.inf)

    def placed(self, place):
        """A place, or that of an image point."""
        return place if isinstance(place, Place) else Place(self, [], [], [place])

    def depth_along(self, direction):
        return self.by.total(self.rows[12:15], [direction.x, direction.y, direction.z])

    def moments(self, seen, level):
        return self.filtered.at(*seen, level)

    def image(self, place, z=None):
        """The image point of a place, and whether it has one."""
        place = self.placed(place)
        again = self.depth_at(place) if z is None else self.by.choose(z, self.depth_at(place))
        return image_of(self.given.kind, self.lens, place.row(0), place.row(1), place.row(2), again)

    def look(self, u, v, valid):
        """Whether an image point is looked up in a texel, and its number, (R, T, n)."""
        off, (height, width) = self.by.model.coordinate, self.shape
        u, v = (each.x + off * self.by.within(each.x) for each in (u, v))
        inside, texel = self.nearest(np.floor(u), np.floor(v), valid)
        if not self.linear:
            return inside, texel
        middles = [single(z - 0.5) for z in (u, v)]
        left, top = (np.floor(z) for z in middles)
        parts = [Number(self.by, np.where(inside, z - at, 0)) for z, at in zip(middles, (left, top), strict=True)]
        corners = [(left + i, top + j) for j in (0, 1) for i in (0, 1)]
        if self.border == "open":  # the nearest texel inside stands for one that is none
            corners = [(np.clip(column, 0, width - 1), np.clip(row, 0, height - 1)) for column, row in corners]
        return inside, Corners(*(self.nearest(*corner, inside)[1] for corner in corners), *parts)

    def nearest(self, u, v, valid):
        """Whether a column and a row have a texel, and its number."""
        height, width = self.shape
        inside = valid & (u >= 0) & (v >= 0) & (u < width) & (v < height)
        if self.border == "open":
            return inside, np.where(inside, v * width + u, 0).astype(int)
        if self.border == "background":
            return valid, np.where(inside, v * width + u, height * width).astype(int)
        u, v = (np.where(valid & np.isfinite(each), np.clip(each, -1e6, 1e6), 0).astype(int) for each in (u, v))
        return valid, place_in(v, height, self.border) * width + place_in(u, width, self.border)


def summed(view, numbers, here, texel):
    """The terms of all samples."""
    s = np.arange(numbers.points.shape[0])
    place = numbers.place(view, here, s)
    counts = numbers.counts(view, here)
    z = view.depth_at(place)
    u, v, valid = view.image(place, z)
    inside, seen = view.look(u, v, valid)
    if view.filtered:
        point = [np.clip(np.where(inside, each.x, 0), 0, k) for each, k in zip((u, v), view.shape[::-1], strict=True)]
        term = numbers.term(view, here, s, z, texel, [Number(view.by, each) for each in point])
    else:
        term = view.by.where(view.shows(seen), numbers.term(view, here, s, z, texel, seen), numbers.background())
    return [np.where(inside & counts, term.x, 0.0)]


def folded(view, numbers, here, texel):
    """Numbers that steps and ends of directions add: first sides of all directions together, then second ones."""
    count = numbers.points.shape[0]
    sides = numbers.sides
    by = view.by
    made = []
    state = None
    column = view.column(texel) + 0.5
    row = view.row(texel) + 0.5
    counts = numbers.counts(view, here)
    for side in range(sides):
        s = np.arange(side, count, sides)
        place = numbers.place(view, here, s)
        u, v, valid = view.image(place, view.depth_at(place))
        across = u - column
        down = v - row
        state = state if side else numbers.begin(view, here, s)
        for step in range(1, numbers.steps + 1):
            k = by.number(step, None)
            part = numbers.part(view, texel, k)
            inside, seen = view.look(part * across + column, part * down + row, valid)
            added, after = numbers.step(view, here, s, k, state, texel, seen)
            there = inside & view.shows(seen)
            made.append(np.where(there & counts, by.values(added), 0.0))
            state = np.where(there, after, state)  # numbers, or ints of sectors
    return [*made, np.where(counts, by.values(numbers.leave(view, here, s, state)), 0.0)]


def occlusion(seed, renderers, model, given, estimator, shape, options):
    """Occlusion of so many renderers of a model, (R, H, W); given: ``BallView``; options: of ``RandomView``."""
    by = Renderers(np.random.default_rng(seed), renderers, model)
    texel = np.flatnonzero(given.depth < np.inf)
    texel = texel[None, :, None]
    made = np.zeros((renderers, shape[0] * shape[1]))
    if not texel.size:
        return made.reshape(-1, *shape)
    with by.compute():
        view = RandomView(by, given, shape, options)
        numbers = lifted(by, estimator)
        here = numbers.start(view, texel)
        parts = (folded if hasattr(estimator, "steps") else summed)(view, numbers, here, texel)
        terms = np.concatenate(np.broadcast_arrays(*parts, np.zeros((renderers, texel.size, 1)))[:-1], axis=2)
        order = by.rng.permuted(np.tile(np.arange(terms.shape[2]), (renderers, 1)), axis=1)[:, None]
        terms = np.take_along_axis(terms, order, axis=2)
        total = reduce(add, (Number(by, terms[..., s, None]) for s in range(terms.shape[2])))
        made[:, texel[0, :, 0]] = by.values(numbers.end(total))[..., 0]
    return made.reshape(-1, *shape)
