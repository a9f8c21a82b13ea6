"""Search for the change of the reference that explains a renderer's texture.

A change decides a wrong texel if the changed interval is narrower than the texel's deviation from the reference; only
decided texels count as explained. A change explains a texture if it decides most of the wrong texels, nearly all of
these lie in their intervals, and nearly no other texel leaves its interval.

Changes are screened on a hundred texels, half of them wrong, so that small and large errors have equal weight. Likely
changes are tried on more texels, and the best are refined on some thousands. Pairs of changes are tried only if one
change explains at least half.
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import exp, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.diagnosis.change import Change, Places, Problem, Values, pair
from lfssao.verify.verdict import Flags

DECIDED = 0.5  # least share of the wrong texels that an explanation decides
_MOST_LEFT = 0.05  # largest number of texels that it leaves or makes wrong, relative to the wrong texels
NEAR = 0.3  # least share of the wrong texels, less those made wrong, that the nearest change explains
_NEARLY = 0.005  # share of the wrong texels that a change may leave to end the search
_HALF = 0.5  # least gain of the first change of a pair
# Largest differences of changes that predict the same, as a share and as a number of wrong texels.
_EQUAL = 0.001
_EQUAL_TEXELS = 2.5
_GOLDEN = (sqrt(5.0) - 1.0) / 2.0
_SECTIONS = 36  # each narrows the bracket to 0.62 of its width, down to the rounding of float32
_LEVEL = 3  # number of level sections that end the search
ROUGH = 12  # sections for a screened change, to a thousandth of its value, which is refined again
_WIDE = 1.15  # factor within which sizes may fit equally well
_HALVED = 6  # number of bisections of that factor
_RANGE_END = 0.97  # share of the largest size of a value; larger sizes only show that the range ended
_LEAST_GAIN = 0.1  # least gain of a change that is tried further
_SCREENED = 40  # largest number of changes without values after screening
# Largest numbers of changes without and with values that are tried on more texels, and of refined changes.
_PLAIN = 12
_GRADED = 14
_REFINED = 6


@dataclass(frozen=True)
class Trial:
    """The result of a change with steps of its values on a sample."""

    change: Change
    steps: Values
    cost: float  # 0 if all texels are as predicted, about 1/2 if nothing is explained
    left: float = 1.0  # share of the weight outside the intervals
    decided: float = 0.0  # share of the wrong texels' weight
    explained: float = 0.0  # likewise

    @property
    def size(self) -> float:
        """The largest size of the steps."""
        return max(map(abs, self.steps), default=0.0)

    @property
    def ends(self) -> bool:
        """Whether a value lies at the end of its range."""
        return any(abs(step) > _RANGE_END * axis.most for step, axis in zip(self.steps, self.change.axes, strict=True))


@dataclass(frozen=True, eq=False)
class Sample:
    """Some wrong and other texels of a texture, each with the weight of the texels that it represents; the sum is 1."""

    problem: Problem
    wrong: Flags  # (K,)
    weights: FloatArray  # (K,)
    number: int  # number of wrong texels that the sample represents
    places: Places  # (K,), indices of the texels, row by row
    base: Problem | None = None  # the reference's problem, if this one is changed
    # Cost of a wrong texel inside an interval that does not decide it; 0 for polishing, as texels whose samples change
    # at the right value are not decided there.
    undecided: float = 0.5

    @cached_property
    def before(self) -> float:
        """Share of wrong texels in the weight, without a change."""
        return float(self.weights @ self.wrong)

    @cached_property
    def _balanced_weights(self) -> tuple[FloatArray, FloatArray]:
        """Weights of wrong and of other texels with sum 1: a half each, but others weigh less if most are wrong."""
        wrong_count = max(int(self.wrong.sum()), 1)
        other_count = max(int((~self.wrong).sum()), 1)
        wrong = self.wrong / wrong_count
        rest = ~self.wrong / max(wrong_count, other_count)
        if self.before > 0.5:
            rest = rest * ((1 - self.before) / self.before)
        total = float(wrong.sum() + rest.sum())
        return wrong / total, rest / total

    @cached_property
    def deviation(self) -> FloatArray:
        """The distance of each number from the middle of the reference's interval, at least its excess.

        A narrower interval that contains the number does not contain the reference's value.
        """
        base = self.base or self.problem
        low, high, _ = stored_interval(base)
        middle = 0.5 * (low + high)
        from_middle = distance_outside(base.mine, middle, middle)
        distance = np.where(np.isfinite(middle), from_middle, distance_outside(base.mine, low, high))
        return np.maximum(distance, base.excess)

    @cached_property
    def _usual_deviation(self) -> float:
        """The median deviation of texels."""
        deviations = channel_sums(self.deviation)
        positive = deviations[(deviations > 0) & np.isfinite(deviations)]
        return float(np.median(positive)) if len(positive) else 1.0

    def _changed(self, change: Change, steps: Values) -> Problem | None:
        """The changed problem; None for an option out of range, or a display that cannot exist."""
        with suppress(InputError):
            problem: Problem | None = change.apply(self.problem, change.values(steps))
            return problem
        return None

    @np.errstate(all="ignore")
    def outside(self, change: Change, steps: Values) -> Flags:
        """Flags of texels outside the interval of a change, (K,)."""
        problem = self._changed(change, steps)
        if problem is None:
            return np.zeros(len(self.wrong), np.bool_)
        low, high, _ = stored_interval(problem)
        return channel_sums(distance_outside(problem.mine, low, high)) > 0

    @cached_property
    def _trials(self) -> dict[tuple[Change, Values], Trial]:
        """The trials so far."""
        return {}

    def trial(self, change: Change, steps: Values) -> Trial:
        """Try a change, or return its trial of before: bounds of some hundred samples take seconds."""
        key = change, steps
        if key not in self._trials:
            self._trials[key] = self._try(change, steps)
        return self._trials[key]

    @np.errstate(all="ignore")  # an interval may be infinite
    def _try(self, change: Change, steps: Values) -> Trial:
        """Try a change. The cost grows with the distance from the interval, and far more slowly from its middle."""
        problem = self._changed(change, steps)
        if problem is None:
            return Trial(change, steps, np.inf)
        low, high, middle = stored_interval(problem)
        distance = channel_sums(distance_outside(problem.mine, low, high))
        middle_distance = channel_sums(distance_outside(problem.mine, middle, middle))
        decides = self.wrong & np.any(_as_columns(high - low < self.deviation), axis=1)

        def relative(d: FloatArray) -> FloatArray:
            return np.divide(d, d + self._usual_deviation, out=np.ones(len(d)), where=np.isfinite(d))

        inside = distance == 0
        texel_cost = np.where(
            inside, np.where(self.wrong & ~decides, self.undecided, 0.0), 0.5 + 0.5 * relative(distance)
        )
        wrong, others = self._balanced_weights
        cost = float(wrong @ texel_cost + others @ texel_cost) + 1e-4 * float(
            (wrong + others) @ relative(middle_distance)
        )
        total = self.before or 1.0
        return Trial(
            change,
            steps,
            cost,
            float(self.weights @ ~inside),
            float(self.weights @ decides) / total,
            float(self.weights @ (decides & inside)) / total,
        )

    def fits(self, trial: Trial, least: float = DECIDED) -> bool:
        """Whether a change explains the texture, and decides more than a share of the wrong texels."""
        enough = trial.decided > least and trial.decided * self.number >= self.problem.fewest * max(len(trial.steps), 1)
        kept = trial.left <= _MOST_LEFT * self.before and trial.explained >= (1 - _MOST_LEFT) * trial.decided
        return bool(enough and kept and not trial.ends)

    def gain(self, trial: Trial) -> float:
        """Share of the wrong texels that a change explains, less the texels that it makes wrong."""
        made_wrong = max(trial.left - self.before * (1 - trial.explained), 0.0)
        return trial.explained - made_wrong / (self.before or 1.0)

    @property
    def _gain_resolution(self) -> float:
        """Largest meaningless difference of gains: of few wrong texels two may be undecided at the right value."""
        return max(_EQUAL, _EQUAL_TEXELS / max(self.number, 1))

    def equals(self, trial: Trial, other: Trial) -> bool:
        """Whether two changes with the same number of values explain equally much."""
        difference = abs(self.gain(trial) - self.gain(other))
        return len(trial.steps) == len(other.steps) and difference <= self._gain_resolution

    def rank(self, trial: Trial) -> tuple[Any, ...]:
        """A key that sorts explanations first, then by the number of values, then by the gain."""
        if not self.fits(trial):
            return True, 0, 0, False, trial.cost
        # A fault of one stage precedes an equal change of the view, which would show in all stages.
        gain = round(-self.gain(trial) / self._gain_resolution)
        return False, len(trial.steps), gain, trial.change.shared, round(trial.cost, 9)

    def best_of_grid(self, change: Change) -> Trial:
        """The change with the best steps on its axes' grids; a single axis is refined around the best step."""
        grids = [axis.steps for axis in change.axes]
        trials = [self.trial(change, tuple(map(float, steps))) for steps in product(*grids)]
        best = min(trials, key=_order)
        if len(grids) > 1:
            return best
        axis = change.axes[0]
        (step,) = best.steps
        around = np.geomspace(1 / axis.ratio, axis.ratio, 9)[1:-1] * step
        return min([best, *(self.trial(change, (float(x),)) for x in around if abs(x) <= axis.most)], key=_order)

    def refined(self, best: Trial, reach: float, sections: int = _SECTIONS) -> Trial:
        """Golden sections along each step in turn, of sizes within a factor ``reach``."""
        for turn in range(1 if len(best.steps) == 1 else 3):
            for k in range(len(best.steps)):
                best = self._section(self.trial(best.change, best.steps), k, reach ** (1 / (1 + turn)), sections)
        return best

    def centred(self, best: Trial) -> Trial:
        """The middle of the sizes with an equal cost, for a change with one value: costs of counts have steps."""
        if len(best.steps) != 1:
            return best
        sign = np.sign(best.steps[0])
        size = abs(best.steps[0])
        limits = []
        for direction in (1 / _WIDE, _WIDE):
            near = 1.0
            far = direction
            for _ in range(_HALVED):
                middle = sqrt(near * far)
                is_equal = self.trial(best.change, (float(sign * size * middle),)).cost <= best.cost + 1e-9
                near, far = (middle, far) if is_equal else (near, middle)
            limits.append(near)
        return self.trial(best.change, (float(sign * size * sqrt(limits[0] * limits[1])),))

    def _section(self, best: Trial, k: int, reach: float, sections: int) -> Trial:
        """The best value of step number k; the others stay."""
        sign = np.sign(best.steps[k])
        size = abs(best.steps[k])

        def trial_at(place: float) -> Trial:
            step = float(sign * min(exp(place), best.change.axes[k].most))
            return self.trial(best.change, (*best.steps[:k], step, *best.steps[k + 1 :]))

        # The cost has steps: the best of many trials starts the sections at the right one.
        places = np.linspace(np.log(size / reach), np.log(size * reach), 9).tolist()
        scan = [trial_at(place) for place in places]
        k_best = min(range(9), key=lambda n: (round(scan[n].cost, 9), n))
        low = places[max(k_best - 1, 0)]
        high = places[min(k_best + 1, 8)]
        a = high - _GOLDEN * (high - low)
        b = low + _GOLDEN * (high - low)
        left = trial_at(a)
        right = trial_at(b)
        tried = [best, *scan]
        level = 0
        for _ in range(sections):
            tried += [left, right]
            level = level + 1 if left.cost == right.cost else 0
            if level == _LEVEL:
                break
            if left.cost <= right.cost:
                high = b
                b = a
                right = left
                a = high - _GOLDEN * (high - low)
                left = trial_at(a)
            else:
                low = a
                a = b
                left = right
                b = low + _GOLDEN * (high - low)
                right = trial_at(b)
        return min([*tried, left, right], key=_order)


@dataclass(frozen=True, eq=False)
class Search:
    """Samples of a texture, each with more texels than the one before; the first is for screening."""

    tiny: Sample
    small: Sample
    large: Sample
    changes: Sequence[Change]

    def best(self) -> list[Trial]:
        """The likely changes, tried on the large sample, the best first."""
        tiny = self.tiny
        small = self.small
        large = self.large
        trials = self._trials_without_values(c for c in self.changes if not c.late)
        if any(large.fits(t) and t.left <= _NEARLY * large.before for t in trials):
            return self._ranked(trials)
        for count in (1, 2):  # number of values: two only if one does not explain the texture
            sample = tiny if count == 1 else small  # one right value of two improves little
            graded = _cheapest(sample.best_of_grid(c) for c in self.changes if len(c.axes) == count)[:_GRADED]
            near = _cheapest(small.refined(t, 1.6, ROUGH) for t in graded if t.cost < np.inf)
            trials += [large.refined(t, 1.5) for t in _likely(small, near, _REFINED)]
            if any(large.fits(t) for t in trials):
                return self._ranked(trials)
        late = [c for c in self.changes if c.late]
        return self._ranked([*trials, *self._trials_without_values([*late, *small.problem.solved(small.wrong)])])

    def _trials_without_values(self, changes: Iterable[Change]) -> list[Trial]:
        """The likely changes without values, tried on the large sample."""
        screened = _cheapest(self.tiny.trial(c, ()) for c in changes if not c.axes)[:_SCREENED]
        if self.tiny is not self.small:
            screened = _cheapest(self.small.trial(trial.change, ()) for trial in screened)
        return [self.large.trial(trial.change, ()) for trial in _likely(self.small, screened, _PLAIN)]

    def paired(self, best: Trial) -> Trial | None:
        """A change joined with the one that explains most of the rest; None if its gain is below a half."""
        if self.large.gain(best) < _HALF:
            return None
        # A change that creates a new problem cannot come second: it would undo the first change.
        others = [c for c in self.changes if c.kind != best.change.kind and not c.first]

        def with_change(sample: Sample) -> Sample:
            """The sample with the changed problem."""
            problem = best.change.apply(sample.problem, best.change.values(best.steps))
            return replace(sample, problem=problem, base=sample.problem)

        small = with_change(self.small)
        trials = Search(small, small, with_change(self.large), others).best()
        second = trials[0] if trials else None
        if second is None:
            return None
        joined = self.large.trial(pair(best.change, second.change), (*best.steps, *second.steps))
        return self.large.refined(joined, 1.2) if joined.steps else joined

    def _ranked(self, found: Sequence[Trial]) -> list[Trial]:
        return sorted(found, key=self.large.rank)


def _likely(sample: Sample, trials: Sequence[Trial], most: int) -> list[Trial]:
    """The best trials with a gain, at least one."""
    return [t for k, t in enumerate(trials[:most]) if k == 0 or sample.gain(t) > _LEAST_GAIN]


def _cheapest(trials: Iterable[Trial]) -> list[Trial]:
    """Trials by their costs; equal ones stay in their order."""
    return sorted(trials, key=lambda trial: round(trial.cost, 9))


def _order(trial: Trial) -> tuple[float, float]:
    """A key that sorts by cost, then by size: a larger value may break texels outside the sample."""
    return round(trial.cost, 9), trial.size


def stored_interval(problem: Problem) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ends of a problem's interval after storing, and its middle before storing."""
    low, high = problem.interval()
    middle = 0.5 * (low + high)
    return (low, high, middle) if problem.store is None else (*problem.store(low, high), middle)


def distance_outside(mine: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Distance of each number from an interval, 0 inside; infinite for NaN."""
    distance = np.where(mine < low, low - mine, np.where(mine > high, mine - high, 0.0))
    return np.where(np.isnan(mine) | np.isnan(low) | np.isnan(high) | np.isnan(distance), np.inf, distance)


def channel_sums(numbers: FloatArray) -> FloatArray:
    """The sum of a texel's channels, (K,)."""
    return np.asarray(_as_columns(numbers).sum(axis=1))


def _as_columns(numbers: NDArray[Any]) -> NDArray[Any]:
    return numbers if numbers.ndim == 2 else numbers[:, None]
