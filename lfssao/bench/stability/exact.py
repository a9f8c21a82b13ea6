"""Formulas of mappings and estimators run in Python, one texel at a time, on numbers with their exact value.

The numbers are those of ``tracked``, the text is that of the kernels, whose words ``lfssao.ao.formulas`` has. Here are
the drivers of sums and of steps, and the look-up: an image point may lie in all texels that its error reaches.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial, reduce
from itertools import product
from math import ceil, floor, inf
from operator import add
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.kernels.float_view import FloatView, shown
from lfssao.ao.kernels.levels import level_texel, mip_level
from lfssao.ao.kernels.moments import Pyramid, filtered_moments
from lfssao.ao.kernels.texel_rays import TexelRays
from lfssao.bench.stability.tracked import DOUBLE, Arithmetic, Doubt, Sectors, Tracked, holds, hull, in_doubt, unknown
from lfssao.core.numbers import select, where_none
from lfssao.core.places import Rows
from lfssao.optics.kernels.display import display_module, display_to_image
from lfssao.optics.kernels.projection import DISPLAY, image_of
from lfssao.samples.kernels.spiral import summed_angle, unit_of

OUTSIDE = None  # in place of a texel's number: there is no image, or it lies outside the texture
Image = tuple[Tracked, Tracked, Any]  # u, v, and whether the mapping is defined there: a bool or a doubt

FAR = 2**21  # texels, beyond which samples read the level of this distance
_CLOSE = 0.5  # texels, or levels, by which places of moments may be off; beyond, nothing is known
_MOST = 32  # texels that an image point may lie in; of more nothing is known


class _Table:
    """An array whose elements are numbers of an arithmetic, and whose rows are such arrays."""

    def __init__(self, array: NDArray[Any], work: Arithmetic) -> None:
        self._array = array
        self._work = work
        self._made: dict[Any, Any] = {}
        self.shape = array.shape

    def __getitem__(self, index: Any) -> Any:
        if index not in self._made:
            x = self._array[index]
            self._made[index] = _Table(x, self._work) if isinstance(x, np.ndarray) else self._work.given(x)
        return self._made[index]


def lifted(numbers: Any, work: Arithmetic) -> Any:
    """Return a named tuple whose floats, and those of its arrays, are numbers of an arithmetic.

    Depths and levels stay, and an infinity, by which a tuple says that there is no limit.
    """

    def lift(name: str, x: Any) -> Any:
        if isinstance(x, np.ndarray) and name != "depth":
            return _Table(x, work)
        if isinstance(x, TexelRays):
            return lifted(x, work)
        if isinstance(x, Pyramid):
            table: Any = _Table(x.numbers, DOUBLE if work.unit else work)
            return x._replace(numbers=table)
        return work.given(x) if isinstance(x, np.floating) and np.isfinite(x) else x

    lifted_type = _View if isinstance(numbers, FloatView) else type(numbers)
    return lifted_type(*(lift(name, x) for name, x in zip(numbers._fields, numbers, strict=True)))


class _View(FloatView):
    """A view of numbers of an arithmetic, with words of its own for what kernels look up by whole numbers."""

    def row(self, texel: Any) -> int:
        return int(texel) // self.width

    def column(self, texel: Any) -> int:
        return int(texel) % self.width

    def hashed_turn(self, at: Any, angle: Any) -> tuple[Tracked, Tracked]:
        """Return the kernels' own value: a sum in float32 is the same in every arithmetic."""
        sine, cosine = unit_of(summed_angle(at[0], at[1], float(angle.value)))
        return angle.arithmetic.given(cosine), angle.arithmetic.given(sine)

    def image(self, place: Rows) -> Image:
        return image(self.kind, self.lens, place, place.z)

    def moments(self, seen: tuple[Tracked, Tracked], level: Tracked) -> tuple[Tracked, ...]:
        """Those at the level and place rounded to float64, off by what they change where errors may move them.

        Moments are linear in each of the three between places where a whole number of ``look_up`` changes, and are the
        most and the least there or at the ends.
        """
        given = (level, *seen)
        last = len(self.moments_of.starts) - 1
        exact = filtered_moments(self.moments_of, *(np.float64(float(x.value)) for x in given))
        if not all(x.error < _CLOSE for x in given):
            return tuple(Tracked(x.value, inf, x.arithmetic) for x in exact)
        low, high = (min(max(floor(end), 0), last) for end in _ends_of(level))
        around = range(low, min(high + 1, last) + 1)
        ends = _places(level, range(last + 1)), *(_places(x, _middles(x, around)) for x in seen)
        others = [filtered_moments(self.moments_of, *map(np.float64, corner)) for corner in product(*ends)]
        return tuple(hull(x, [other[k] for other in others]) for k, x in enumerate(exact))

    def coarse_z(self, seen: Any, h: Any, log_q: int) -> tuple[Tracked, Any]:
        """The z of the level of a sample h texels away, off by what those of other levels differ that h may ask for."""
        levels = self.levels
        work = h.arithmetic
        off = Fraction(min(h.error, float(FAR)))
        place = partial(level_texel, levels.first, column=self.column(seen), row=self.row(seen), width=self.width)

        def level_of(distance: Fraction) -> int:
            held = max(Fraction(0), min(distance, Fraction(FAR)))
            return int(mip_level(np.float64(floor(held)), np.int32(log_q), np.int32(len(levels.first) - 1)))

        def z_of(level: int) -> float:
            return float(levels.z[place(level=np.int32(level))])

        exact = z_of(level_of(h.value))
        others = [z_of(level) for level in range(level_of(h.value - off), level_of(h.value + off) + 1)]
        visible = np.bool_(exact < inf)
        if any((z < inf) != visible for z in others):
            return Tracked(Fraction(exact if visible else 0), inf, work), Doubt(bool(visible), work)
        if not visible:
            return Tracked(Fraction(0), inf, work), visible
        return hull(work.given(exact), [work.given(z) for z in others]), visible


def _ends_of(x: Tracked) -> tuple[float, float]:
    """Return the least and the most that a number may be, its rounding to float64 included."""
    off = x.error + 2.0**-51 * max(x.size, 1.0)
    return float(x.value) - off, float(x.value) + off


def _middles(x: Tracked, levels: Iterable[int]) -> Iterator[float]:
    """Yield the middles of texels of some levels among what a coordinate may be."""
    low, high = _ends_of(x)
    for size in (2.0**level for level in levels):
        yield from ((m + 0.5) * size for m in range(ceil(low / size - 0.5), floor(high / size - 0.5) + 1))


def _places(x: Tracked, kinks: Iterable[float]) -> list[float]:
    """Return the ends of what a number may be, and the kinks between them."""
    low, high = _ends_of(x)
    return [low, *(kink for kink in kinks if low < kink < high), high]


def image(kind: int, lens: Any, place: Rows, z: Tracked) -> Image:
    """Return the image point of a place at image z; kind, lens: the mapping's, as of ``FloatView``."""
    to_image: Callable[[], Image] = partial(image_of, kind, lens, place.u, place.v, place.q, z)
    if kind == DISPLAY:  # compiled code gives its numbers their names
        to_image = partial(display_to_image, display_module(lens), place.u, place.v, z)
    return to_image()


def landed(seen: Image, size: tuple[int, int]) -> tuple[int | None, Sequence[int | None] | None]:
    """Return the number, row * width + column, of the texel that an image point lies in, and those it may lie in.

    Either may be ``OUTSIDE``. size: rows and columns. The others are None where rounding may move it into any.
    """
    u, v, valid = seen
    rows, columns = size
    here = _texel(floor(u.value), floor(v.value), size) if holds(valid) else OUTSIDE
    if not (holds(valid) or in_doubt(valid)):
        return here, []
    across = _reach(u, columns)
    down = _reach(v, rows)
    if not 0 < len(across) * len(down) <= _MOST:
        return here, None
    others = {_texel(i, j, size) for i, j in product(across, down)} | ({OUTSIDE} if in_doubt(valid) else set())
    return here, list(others - {here})


def _texel(column: int, row: int, size: tuple[int, int]) -> int | None:
    inside = 0 <= row < size[0] and 0 <= column < size[1]
    return row * size[1] + column if inside else OUTSIDE


def _reach(coordinate: Tracked, size: int) -> range:
    """The columns or rows that a coordinate can be rounded into, -1 and size outside the texture; none if all."""
    if coordinate.error > size:
        return range(0)
    error = Fraction(coordinate.error)
    low = floor(coordinate.value - error)
    high = floor(coordinate.value + error)
    return range(min(max(low, -1), size), min(max(high, -1), size) + 1)


@dataclass(frozen=True)
class Formulas:
    """An estimator's formulas and a view, numbers of an arithmetic."""

    view: Any  # ``FloatView``
    estimator: Any  # ``Summed`` or ``Folded``
    rows: int  # of the textures
    work: Arithmetic

    @classmethod
    def of(cls, view: FloatView, estimator: Any, rows: int, work: Arithmetic) -> "Formulas":
        """View and estimator as the kernels take them (``lfssao.ao.formulas``), in an arithmetic."""
        return cls(lifted(view, work), lifted(estimator, work), rows, work)

    def occlusion(self, texel: int) -> Tracked:
        """Occlusion of a texel that shows a surface."""
        here = self.estimator.start(self.view, texel)
        parts = (self._rises if hasattr(self.estimator, "steps") else self._terms)(here, texel)
        occlusion = self.estimator.end(reduce(add, parts, self.work.given(0)))
        found: Tracked = self._number(select(self.estimator.counts(self.view, here), self._number(occlusion), 0))
        return found

    def _look_up(self, seen: Image, numbers: Callable[[int | None], Sequence[Any]]) -> list[Any]:
        """Return numbers of the texel that an image point lies in, or may lie in."""
        here, others = landed(seen, (self.rows, self.view.width))
        exact = [self._number(x) for x in numbers(here)]
        if others is None:
            return [unknown(x) for x in exact]
        ends = [[self._number(x) for x in numbers(other)] for other in others]
        return [hull(x, [other[k] for other in ends]) for k, x in enumerate(exact)]

    def _number(self, x: Any) -> Any:
        return x if isinstance(x, Tracked | Sectors) else self.work.given(x)

    def _terms(self, here: Any, texel: int) -> Iterator[Tracked]:
        """Yield the terms of a texel's samples."""
        view = self.view
        own = self.estimator
        for s in range(own.points.shape[0]):
            place = own.place(view, here, s)
            z = view.depth_at(place)
            point = image(view.kind, view.lens, place, z)

            def term(seen: int | None, s: int = s, z: Any = z, at: Any = point[:2]) -> Sequence[Any]:
                if seen is OUTSIDE:
                    return (0,)
                found = where_none(view.moments_of, seen, at)
                return (own.term(view, here, s, z, texel, found) if shown(view, found) else own.background(),)

            yield from self._look_up(point, term)

    def _rises(self, here: Any, texel: int) -> Iterator[Tracked]:
        """Yield the numbers that a texel's steps add."""
        view = self.view
        own = self.estimator
        half = self.work.given(0.5)
        column = texel % view.width + half
        row = texel // view.width + half
        state: Any = None
        for s in range(own.points.shape[0]):
            place = own.place(view, here, s)
            u, v, valid = image(view.kind, view.lens, place, view.depth_at(place))
            across = u - column
            down = v - row
            state = own.begin(view, here, s) if s % own.sides == 0 else state
            for step in range(1, own.steps + 1):
                k = self.work.given(step)
                part = own.part(view, texel, k)

                def rise(seen: int | None, s: int = s, k: Any = k, state: Any = state) -> Sequence[Any]:
                    visible = seen is not OUTSIDE and view.shows(seen)
                    return own.step(view, here, s, k, state, texel, seen) if visible else (0, state)

                added, state = self._look_up((column + part * across, row + part * down, valid), rise)
                yield added
            if (s + 1) % own.sides == 0:
                yield self._number(own.leave(view, here, s, state))
