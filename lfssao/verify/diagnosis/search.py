"""The search for a change of the reference that a renderer's texture shows.

A problem holds some texels of the renderer's texture and the interval that the reference, or a change of it, allows
there. Continuous changes are tried on a grid and refined by golden sections; all are ranked by the share of texels that
agree. Two changes at once are tried only if one explains at least half of the texels that are wrong.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import sqrt
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from lfssao.verify.bounds.bounds import FloatArray

Places = NDArray[np.int64]
Values = tuple[float, ...]
Function = Callable[[FloatArray], FloatArray]

# A change fits if it leaves at most this share of the wrong texels wrong.
_LEFT = 0.05
# Changes whose shares differ by less of the wrong texels are as good as each other.
_NEARLY = 0.005
_GOLDEN = (sqrt(5.0) - 1.0) / 2.0
_SCANNED = 13
_SECTIONS = 30  # each narrows the bracket to 0.62 of it: to the rounding of float32
_REFINED = 5  # changes with values, the best on the grid

# Values to try first. None is a round number: a renderer's own value is found by refinement.
FACTORS = np.concatenate([np.geomspace(0.11, 0.83, 7), np.linspace(0.871, 1.137, 7), np.geomspace(1.21, 9.3, 7)])
SHIFTS = np.concatenate([[-4.1, -2.9, -1.93], np.linspace(-1.43, 1.43, 12), [1.93, 2.9, 4.1]])
SHARES = np.concatenate([-np.geomspace(0.9, 0.0003, 12), np.geomspace(0.0003, 0.9, 12)])

INSIDE = ("clamp", "mirror", "wrap")  # rules by which a texel inside stands for those beyond the border


def hold(places: Places, size: int, border: str) -> Places:
    """Columns or rows inside 0 to size - 1 for any, by a rule of ``INSIDE``; by any other rule those of 'clamp'."""
    if border == "wrap":
        return np.asarray(places % size)
    if border == "mirror":
        folded = places % (2 * size)
        return np.where(folded < size, folded, 2 * size - 1 - folded)
    return np.clip(places, 0, size - 1)


@dataclass(frozen=True, eq=False, kw_only=True)
class Problem:
    """K texels of a texture, and what the reference, or a change of it, allows them to be."""

    mine: FloatArray  # (K,) or (K, C)
    columns: Places  # (K,)
    rows: Places
    room: FloatArray  # width of the reference's interval, of the shape of ``mine``
    cost: int = 16  # work that a texel makes, such as its number of samples or taps
    value: Function = np.asarray  # applied to the right values; monotone
    store: Callable[[FloatArray, FloatArray], Any] | None = None  # makes an interval that of what is read, if stored
    # Cached properties, and the fields that they do not depend on.
    kept: ClassVar[Mapping[str, frozenset[str]]] = {}

    def changes(self) -> "list[Change]":
        """All changes that are tried."""
        raise NotImplementedError

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest values that are right, of the shape of ``mine``, before ``value``."""
        raise NotImplementedError

    def interval(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest values that are right."""
        one, other = (self.value(end) for end in self.ends())
        return np.minimum(one, other), np.maximum(one, other)

    def changed(self, **fields: Any) -> Self:
        """A copy with other fields, which keeps what does not depend on them."""
        made = replace(self, **fields)
        for name, harmless in self.kept.items():
            if name in self.__dict__ and harmless.issuperset(fields):
                made.__dict__[name] = self.__dict__[name]
        return made

    def then(self, function: Function) -> Self:
        """A copy with a function of its right values."""
        before = self.value
        return self.changed(value=lambda x: function(before(x)))


@dataclass(frozen=True)
class Change:
    """One way in which a renderer may differ from the reference."""

    kind: str  # its name, such as 'radius'
    apply: Callable[[Any, Values], Any]  # the changed problem, of a problem and the values
    words: str  # the change as a report says it, its values in braces
    grids: tuple[FloatArray, ...] = ()  # the values to try first, sorted, one array for each


def plain(kind: str, apply: Callable[[Any], Any]) -> Change:
    """A change without values."""
    return Change(kind, lambda problem, _: apply(problem), kind)


def fixed(kind: str, **fields: Any) -> Change:
    """A change without values that gives the problem other fields."""
    return plain(kind, lambda problem: problem.changed(**fields))


def scaled(
    kind: str, apply: Callable[[Any, float], Any], grid: FloatArray = FACTORS, words: str | None = None
) -> Change:
    """A change with one value."""
    return Change(kind, lambda problem, v: apply(problem, v[0]), words or f"{kind} x {{:.4f}}", (np.sort(grid),))


def shifts(apply: Callable[[Any, float, float], Any]) -> list[Change]:
    """Shifts by texels along u, along v and along both."""
    one, both, words = (SHIFTS,), (SHIFTS[::2], SHIFTS[::2]), "shifted by {:.3f} texels"
    return [
        Change("shift of u", lambda p, s: apply(p, s[0], 0.0), f"u {words}", one),
        Change("shift of v", lambda p, s: apply(p, 0.0, s[0]), f"v {words}", one),
        Change("shift of u and v", lambda p, s: apply(p, *s), "u and v shifted by {:.3f} and {:.3f} texels", both),
    ]


@dataclass(frozen=True)
class Candidate:
    """A change that was tried."""

    kind: str  # the change's name; of two, both, joined by ' and '
    values: Values  # in the order in which ``words`` has them
    words: str  # the change with its values
    share: float  # of the texels, 0 to 1, that are inside the changed reference's interval


@dataclass(frozen=True)
class Found:
    """A candidate with the change that it is of."""

    change: Change
    values: Values
    share: float
    cost: float


def excess(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """How far each texel is outside the interval and from its middle, (K,): infinite for NaN."""
    low, high = problem.interval()
    middle = 0.5 * (low + high)
    low, high = (low, high) if problem.store is None else problem.store(low, high)
    return _outside(problem.mine, low, high), _outside(problem.mine, middle, middle)


def _outside(mine: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    off = np.where(mine < low, low - mine, np.where(mine > high, mine - high, 0.0))
    off = np.where(np.isnan(mine) | np.isnan(low) | np.isnan(high) | np.isnan(off), np.inf, off)
    return off if off.ndim == 1 else np.asarray(off.sum(axis=1))


def fits(share: float, without: float) -> bool:
    """Whether a change explains a texture: nearly all texels that are wrong without it."""
    return 1.0 - share <= _LEFT * (1.0 - without)


@dataclass(frozen=True, eq=False)
class Search:
    """A problem with the weight of each of its texels, (K,), which sum to 1."""

    problem: Problem
    weights: FloatArray

    @cached_property
    def _without(self) -> float:
        """The share of the texels that are inside as the problem is."""
        return self._share(excess(self.problem)[0])

    @cached_property
    def _scale(self) -> float:
        """How far texels outside the interval usually are."""
        off, _ = excess(self.problem)
        usual = off[(off > 0) & np.isfinite(off)]
        return float(np.median(usual)) if len(usual) else 1.0

    def best(self, changes: Sequence[Change]) -> list[Found]:
        """The changes, best first; as pairs too, if one explains half of what is wrong and none all."""
        found = self._tried(changes)
        best = found[0]
        if fits(best.share, self._without) or best.share - self._without < 0.5 * (1.0 - self._without):
            return found
        changed = replace(self, problem=best.change.apply(self.problem, best.values))
        others = [change for change in changes if change.kind != best.change.kind]
        pairs = [_pair(best, other) for other in changed._tried(others)[:1]]
        return _ranked([*found, *pairs], self._without)

    def candidate(self, found: Found) -> Candidate:
        """The candidate that is told, its share of these texels."""
        change, values = found.change, found.values
        share = self._share(excess(change.apply(self.problem, values))[0])
        return Candidate(change.kind, values, change.words.format(*values), share)

    def polished(self, found: Found) -> Found:
        """A change with values that were found on fewer texels, each within a few hundredths of them."""
        best = self._trial(found.change, found.values)
        for k, value in enumerate(found.values):
            best = self._section(best, k, (0.96 * value, 1.04 * value), sections=4)
        return best

    def _tried(self, changes: Sequence[Change]) -> list[Found]:
        trials = [self._on_grid(change) for change in changes if not change.grids]
        if trials and 1.0 - max(trial.share for trial in trials) <= _NEARLY * (1.0 - self._without):
            return _ranked(trials, self._without)  # a change with values would come after it
        graded = [self._on_grid(change) for change in changes if change.grids]
        graded.sort(key=lambda trial: trial.cost)
        for number, trial in enumerate(graded[:_REFINED]):
            graded[number] = self._refined(trial)
            if len(trial.values) == 1 and 1.0 - graded[number].share <= _NEARLY * (1.0 - self._without):
                break  # another change explains no more
        return _ranked([*trials, *graded], self._without)

    def _on_grid(self, change: Change) -> Found:
        """The change with the best values of its grid."""
        return min((self._trial(change, values) for values in product(*change.grids)), key=lambda trial: trial.cost)

    def _refined(self, start: Found) -> Found:
        """Golden sections along each value in turn, between its neighbours on the grid."""
        grids, best = start.change.grids, start
        for turn in range(1 if len(grids) == 1 else 3):
            for k, grid in enumerate(grids):
                at = int(np.argmin(np.abs(grid - start.values[k])))
                low, high = (float(grid[min(max(at + step, 0), len(grid) - 1)]) for step in (-1, 1))
                if turn:
                    reach = (high - low) * 0.2**turn
                    low, high = best.values[k] - reach, best.values[k] + reach
                best = self._section(best, k, (low, high))
        return best

    def _section(self, best: Found, k: int, ends: tuple[float, float], sections: int = _SECTIONS) -> Found:
        """The best value number k between two ends, the others as they are."""

        def at(value: float) -> Found:
            return self._trial(best.change, (*best.values[:k], value, *best.values[k + 1 :]))

        # The cost of occlusion has steps: the best of many trials keeps the sections from an earlier one.
        scan = [at(float(value)) for value in np.linspace(*ends, _SCANNED)]
        k_best = int(np.argmin([trial.cost for trial in scan]))
        low, high = scan[max(k_best - 1, 0)].values[k], scan[min(k_best + 1, _SCANNED - 1)].values[k]
        left, right = at(high - _GOLDEN * (high - low)), at(low + _GOLDEN * (high - low))
        for _ in range(sections):
            if left.cost <= right.cost:
                high, right = right.values[k], left
                left = at(high - _GOLDEN * (high - low))
            else:
                low, left = left.values[k], right
                right = at(low + _GOLDEN * (high - low))
        return min((best, *scan, left, right), key=lambda trial: trial.cost)

    def _trial(self, change: Change, values: Values) -> Found:
        """One try. Its cost grows with the distance from the interval and, far more slowly, from its middle."""
        off, from_middle = excess(change.apply(self.problem, values))
        far = [np.divide(d, d + self._scale, out=np.ones(len(d)), where=np.isfinite(d)) for d in (off, from_middle)]
        cost = float(self.weights @ far[0]) + 1e-4 * float(self.weights @ far[1])
        return Found(change, values, self._share(off), cost)

    def _share(self, off: FloatArray) -> float:
        """The share of the texels that are not off."""
        return 1.0 - float(self.weights @ (off > 0))


def _ranked(found: Sequence[Found], without: float) -> list[Found]:
    """The largest shares first, but before all those nearly as large as the largest, with the fewest values first."""
    enough = max(each.share for each in found) - _NEARLY * (1.0 - without)
    return sorted(found, key=lambda f: (f.share < enough, len(f.values) * (f.share >= enough), -f.share, f.cost))


def _pair(first: Found, second: Found) -> Found:
    one, other, split = first.change, second.change, len(first.values)

    def apply(problem: Problem, values: Values) -> Problem:
        changed: Problem = other.apply(one.apply(problem, values[:split]), values[split:])
        return changed

    change = Change(f"{one.kind} and {other.kind}", apply, f"{one.words} and {other.words}")
    return Found(change, (*first.values, *second.values), second.share, second.cost)
