"""The diagnosis of one texture that is outside its interval."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lfssao.verify.diagnosis.change import (
    OUTSIDE,
    Candidate,
    Change,
    Places,
    Problem,
    advice,
    named_change,
    one_of,
    pair,
    percent,
    share_of,
    without,
)
from lfssao.verify.diagnosis.estimated import TOLERANCE, Estimated
from lfssao.verify.diagnosis.post import ZEROS
from lfssao.verify.diagnosis.problems import Texture
from lfssao.verify.diagnosis.search import DECIDED, NEAR, ROUGH, Sample, Search, Trial
from lfssao.verify.verdict import Flags, Verdict, texels

# Texels on which all changes are tried, on which the likely ones are, and on which the best ones are refined.
_SCREENED = 96
_TRIED = 256
_SEARCHED = 2400
# Samples or taps of the latter, and their least number of texels: more samples of a texel tell more.
_SEARCHED_SAMPLES = 640_000
_LEAST_SEARCHED = 600

# Samples or taps of the texels on which values are polished, and over which shares are counted. With fewer wrong texels
# than _FEW, shares are counted over _ALL, as each further wrong texel counts. Both use at least _FEWEST texels.
_POLISHED = 1_200_000
_MOST = 640_000
_FEW = 250
_ALL = 5_000_000
_FEWEST = 2_000

# Factors within which values are polished. Those of few wrong texels may be far off: a wider factor is tried again.
_NARROW = 1.2
_WIDER = 2.0
_REPEATS = 6

_LIKELY = 0.8  # a change that explains this share of the wrong texels is polished
_DECIDED_AGAIN = 0.1  # least share of the wrong texels that a change of other textures must decide
_MOST_NEAREST = 2  # largest number of changes that come near, where none explains the texture
_MOST_CANDIDATES = 4  # largest number of explanations; other textures may decide among them
_INNER = 0.1  # least share of the wrong texels whose samples stay inside, to explain them separately


@dataclass(frozen=True)
class Diagnosis:
    """The result of a search for a change of the reference that explains one texture."""

    fits: bool  # whether the first candidate explains it
    # All explanations, or at most two changes that come near, the best first
    candidates: tuple[Candidate, ...]
    equal: int  # number of the candidates that explain the texture equally well
    without: float  # share of the surface texels, 0 to 1, that agree with the unchanged reference
    texels: int  # number of surface texels, the denominator of the candidates' shares
    wrong: int  # number of wrong surface texels, the denominator of shares of wrong texels
    nearest: float = 0.0  # share of the wrong texels that the nearest change explains, less those that it makes wrong
    left_out: int = 0  # number of wrong texels that were left out, as a sample leaves the texture
    subject: str = "the reference"  # the owner of the varied settings, such as an estimator
    background: str = ""  # a sentence on the background, if it is wrong
    too_few: bool = False  # whether fewer texels are wrong than tell a cause

    def words(self, module: str) -> str:
        """The diagnosis of a module's texture in sentences."""
        if not self.wrong:
            only = self.candidates[0]
            return f"{only.words} in {module}, whose surface is right{advice(only.hint)}"
        prefix = f"{self.background}; " if self.background else ""
        if self.too_few:
            few = "texel is" if self.wrong == 1 else "texels are"
            return f"{prefix}{self.wrong} wrong {few} too few to tell a cause in {module}"
        if not self.candidates:
            best_share = f"best {percent(max(self.nearest, 0.0))} of {self.wrong} wrong texels"
            shares = ", ".join(filter(None, [best_share, without(self.left_out)]))
            return f"{prefix}no setting of {self.subject} comes near {module} ({shares})"
        rest = f" ({without(self.left_out)})" if self.left_out else ""
        best = self.candidates[0]
        number = f"the {self.wrong} wrong texels of {module}"
        if not self.fits:
            nearest = f"the nearest, {best.words}, explains {percent(best.explained)}"
            return f"{prefix}no change that was tried explains {number}{rest}; {nearest}"
        changes = one_of(self.candidates[: max(self.equal, 1)])
        explanation = f"{changes} explains {percent(best.explained)} of {number} and decides {share_of(best.decided)}"
        return f"{prefix}{explanation}{rest}{advice(best.hint)}"


def _spread_evenly(places: Places, most: int) -> Places:
    """At most ``most`` of the places, spread evenly."""
    chosen = np.linspace(0, len(places) - 1, min(most, len(places))).astype(np.int64)
    return np.asarray(places[chosen])


@dataclass(frozen=True, eq=False)
class _Sampler:
    """Draws samples of the wrong texels of a texture and of its other texels."""

    texture: "WrongTexture"
    wrong: Places
    right: Places
    cost: int  # work for a texel

    @property
    def has_few_wrong(self) -> bool:
        """Whether so few texels are wrong that each of the others counts."""
        return len(self.wrong) < _FEW

    @property
    def most_polished(self) -> int:
        """Number of changes to polish: few wrong texels allow more."""
        return _MOST_CANDIDATES if self.has_few_wrong else 2

    def _sample(self, wrong: Places, right: Places) -> Sample:
        """A sample of these texels, each with the weight of the texels that it represents."""
        places = np.concatenate([wrong, right])
        weights = []
        for drawn, represented in ((wrong, self.wrong), (right, self.right)):
            weight = len(represented) / max(len(drawn), 1) / (len(self.wrong) + len(self.right))
            weights.append(np.full(len(drawn), weight))
        problem = self.texture.problem(places)
        assert problem is not None
        flags = np.arange(len(places)) < len(wrong)
        return Sample(problem, flags, np.concatenate(weights), len(self.wrong), places)

    def even_sample(self, most: int) -> Sample:
        """A sample of texels, at most half of them wrong."""
        wrong = _spread_evenly(self.wrong, most // 2)
        return self._sample(wrong, _spread_evenly(self.right, most - len(wrong)))

    def counted_sample(self) -> Sample:
        """The sample over which shares are counted."""
        sample = self.even_sample(max((_ALL if self.has_few_wrong else _MOST) // self.cost, _FEWEST))
        return replace(sample, problem=sample.problem.changed(model=self.texture.model))

    def polishing_sample(self, counted: Sample) -> Sample:
        """The sample on which values of counts are polished: counts have steps, and few texels leave values open."""
        sample = counted if self.has_few_wrong else self.even_sample(max(_POLISHED // self.cost, _FEWEST))
        return replace(sample, problem=sample.problem.changed(model=None), undecided=0.0)

    def polish(self, trial: Trial, sample: Sample) -> Trial:
        """The trial with polished values; few wrong texels are polished with all texels that nearby values change."""
        nearby = sample
        if self.has_few_wrong:
            wide_steps = tuple(_WIDER * step for step in trial.steps)
            sensitive = sample.outside(trial.change, trial.steps) | sample.outside(trial.change, wide_steps)
            nearby = replace(self._sample(self.wrong, sample.places[sensitive & ~sample.wrong]), undecided=0.0)
        best = nearby.trial(trial.change, trial.steps)
        for _ in range(_REPEATS if self.has_few_wrong else 0):
            wider = nearby.refined(best, _WIDER, ROUGH)
            if 1 / _NARROW < wider.size / best.size < _NARROW:
                break
            best = wider
        best = nearby.refined(best, _NARROW)
        return sample.trial(best.change, nearby.centred(best).steps)


@dataclass(frozen=True, eq=False)
class WrongTexture(Texture):
    """A wrong texture of a view, and the search for its cause."""

    background: Candidate | None = None  # the background, if it was wrong

    @property
    def _wrong(self) -> Flags:
        """Flags of wrong texels; occlusion without a known interval is wrong if it differs by more than rounding."""
        wrong = texels(self.judged.outside)
        if self.judged.verdict is Verdict.DIFFERENT and self.name in self.layers:
            wrong = wrong & ~(np.abs(self.mine - self.case.outputs[self.name]) <= TOLERANCE)
        return wrong

    @np.errstate(all="ignore")  # a broken texture may hold any numbers
    def diagnose(self, known: Sequence[Candidate] = (), search: bool = True) -> Diagnosis | None:
        """Find the change that explains the texture; None if its problem is not known.

        Candidates of other textures, ``known``, are tried first, and alone without ``search``.
        """
        depth = self.inputs.get("depth")
        wrong = self._wrong
        has_surface = np.True_ if depth is None else np.isfinite(self.cropped(depth))
        wrong_places = np.flatnonzero(wrong & has_surface)
        right_places = np.flatnonzero(~wrong & has_surface)
        if len(wrong_places) == 0 and self.background is not None:
            return Diagnosis(True, (self.background,), 1, 1.0, len(right_places), 0)
        constant = self._diagnose_constant(wrong_places, right_places)
        diagnosis = self._diagnose_surface(wrong_places, right_places, known, search and constant is None)
        if constant is not None and (diagnosis is None or not diagnosis.fits):
            diagnosis = constant
        if diagnosis is None or self.background is None:
            return diagnosis
        return replace(diagnosis, background=f"{self.background.words}{advice(self.background.hint)}")

    def _diagnose_constant(self, wrong: Places, right: Places) -> Diagnosis | None:
        """The diagnosis of occlusion that has one value everywhere; None of any other.

        Many changes make another constant of a plain wall, so none of them is a cause.
        """
        values = self.mine.ravel()[np.concatenate([wrong, right])]
        occlusion = self.name in (*self.layers, "merged", "blurred")
        if not occlusion or len(wrong) < Problem.fewest or not (values == values[0]).all():
            return None
        words = f"ao of {values[0]:.7g} everywhere"
        constant = Candidate(words, (), words, 1.0, 1.0, 1.0)
        return Diagnosis(True, (constant,), 1, len(right) / len(values), len(values), len(wrong))

    def _diagnose_surface(
        self, wrong: Places, right: Places, known: Sequence[Candidate], search: bool
    ) -> Diagnosis | None:
        """The diagnosis of the wrong texels that show a surface, among others."""
        problem = self.problem(wrong[:1]) if len(wrong) else None
        if problem is None:
            return None
        if len(wrong) < problem.fewest:
            number = len(right) + len(wrong)
            return Diagnosis(False, (), 0, len(right) / number, number, len(wrong), too_few=True)
        cost = problem.cost
        again = self._diagnose_texels(wrong, right, cost, known, False) if known else None
        if again is not None and again.fits:
            return again
        inner_wrong = wrong[~self._leaves_texture(wrong)]
        inner_right = right[~self._leaves_texture(right)]
        if len(inner_wrong) < max(problem.fewest, _INNER * len(wrong)) or len(inner_wrong) == len(wrong):
            return self._diagnose_texels(wrong, right, cost, known, search)
        # Samples that leave the texture may have another fault: texels without such samples are explained first.
        diagnosis = self._diagnose_texels(inner_wrong, inner_right, cost, known, search)
        if diagnosis is None or not diagnosis.fits:
            return diagnosis and replace(diagnosis, left_out=len(wrong) - len(inner_wrong))
        whole = self._diagnose_texels(wrong, right, cost, diagnosis.candidates, False, borders=True)
        return replace(diagnosis, left_out=len(wrong) - len(inner_wrong)) if whole is None else whole

    def _leaves_texture(self, places: Places) -> Flags:
        """Flags of texels with a sample that may leave the texture."""
        problem = self.problem(places)
        assert problem is not None
        return problem.leaves_texture()

    def _diagnose_texels(
        self, wrong: Places, right: Places, cost: int, known: Sequence[Candidate], search: bool, borders: bool = False
    ) -> Diagnosis | None:
        """The diagnosis of wrong texels among others; with ``borders``, known changes are joined with border rules."""
        sampler = _Sampler(self, wrong, right, cost)
        counted = sampler.counted_sample()
        small = sampler.even_sample(_TRIED)
        large = sampler.even_sample(min(_SEARCHED, max(_SEARCHED_SAMPLES // cost, _LEAST_SEARCHED)))
        # A run computes a whole texture for any number of texels; with few texels of hbao another radius is overlooked.
        tiny = small if isinstance(small.problem, Estimated) else sampler.even_sample(_SCREENED)
        changes = small.problem.changes()
        by_kind = {change.kind: change for change in changes}
        if any(named_change(candidate.kind, by_kind) is None for candidate in known):
            by_kind |= {change.kind: change for change in small.problem.solved(small.wrong)}
        retried = (self._retry(candidate, by_kind, large, counted) for candidate in known)
        again = [trial for trial in retried if trial is not None]  # those that explain equally well stay several
        best = again[0] if again else None
        if best is None and borders:
            best = self._with_border(known[0], by_kind, counted)
            again = [best] if best is not None else []
        if best is None and not search:
            return None
        search_changes = Search(tiny, small, large, changes)
        trials = again or self._searched(search_changes, sampler, counted)
        tried = again or [counted.trial(t.change, t.steps) for t in trials[:_MOST_NEAREST]]
        if tried and not again and counted.fits(tried[0]):
            tried += [counted.trial(t.change, t.steps) for t in trials[_MOST_NEAREST:_MOST_CANDIDATES]]
            tried = _without_causes_of_zeros(tried, by_kind, counted)
        statistics = (1.0 - counted.before, len(counted.weights), len(wrong))
        subject = self.case.parameters["estimator"] if self.name in self.layers else f"the reference's {self.name}"
        least_decided = DECIDED if best is None or not best.change.shared else _DECIDED_AGAIN
        if tried and counted.fits(tried[0], least_decided):
            fitting = [trial for trial in tried if counted.fits(trial, least_decided)]
            fitting.sort(key=lambda trial: not counted.equals(trial, tried[0]))
            equal = sum(counted.equals(trial, tried[0]) for trial in fitting)
            return Diagnosis(True, tuple(map(self._candidate, fitting)), equal, *statistics, subject=subject)
        gains = [counted.gain(trial) for trial in tried[:_MOST_NEAREST]]
        nearest = tuple(self._candidate(t) for t, gain in zip(tried, gains, strict=False) if gain >= NEAR)
        return Diagnosis(False, nearest, 0, *statistics, max(gains, default=0.0), subject=subject)

    def _searched(self, search: Search, sampler: "_Sampler", counted: Sample) -> Sequence[Trial]:
        """The changes that a search finds, the best first, with polished values; pairs of changes if none fits."""
        # Costs of counts have steps, and so have costs of other occlusion if few texels decide a value.
        stepped = not counted.problem.whole and (sampler.has_few_wrong or counted.problem.counts)
        has_steps = self.name in self.layers and stepped
        larger = sampler.polishing_sample(counted) if has_steps else counted

        def polished(trials: Sequence[Trial]) -> Sequence[Trial]:
            """The trials with polished values of the likely ones."""
            likely = [t for t in trials if search.large.fits(t) or t.explained > _LIKELY or not has_steps]
            better = [larger.trial(trial.change, trial.steps) for trial in likely[:_MOST_CANDIDATES]]
            if has_steps:
                first = better[: sampler.most_polished]
                better[: len(first)] = [sampler.polish(t, larger) if t.steps else t for t in first]
            better.sort(key=larger.rank)
            kinds = {trial.change.kind for trial in better}
            return [*better, *(trial for trial in trials if trial.change.kind not in kinds)]

        trials = polished(search.best())
        if not trials or larger.fits(trials[0]):
            return trials
        pair = search.paired(trials[0])
        return trials if pair is None else [*polished([pair]), *trials]

    def _retry(self, known: Candidate, changes: Mapping[str, Change], large: Sample, counted: Sample) -> Trial | None:
        """A change of another texture, with the same or similar values, if it explains this texture."""
        change = named_change(known.kind, changes)
        if change is None or len(change.axes) != len(known.values):
            return None
        steps = tuple(axis.step(value) for axis, value in zip(change.axes, known.values, strict=True))
        trial = counted.trial(change, steps)
        if known.shared:  # its values are those of another texture, so it may decide less of this one
            return trial if counted.fits(trial, _DECIDED_AGAIN) else None
        if counted.fits(trial) or not steps:
            return trial if counted.fits(trial) else None
        trial = counted.trial(change, large.refined(large.trial(change, steps), 1.2).steps)
        return trial if counted.fits(trial) else None

    def _with_border(self, known: Candidate, changes: Mapping[str, Change], counted: Sample) -> Trial | None:
        """A change joined with another rule for samples outside the texture, if both explain it."""
        first = named_change(known.kind, changes)
        if first is None:
            return None
        steps = tuple(axis.step(value) for axis, value in zip(first.axes, known.values, strict=True))
        rules = [change for kind, change in changes.items() if kind.startswith(OUTSIDE)]
        pairs = [counted.trial(pair(first, second), steps) for second in rules]
        return next((trial for trial in pairs if counted.fits(trial)), None)

    def _candidate(self, trial: Trial) -> Candidate:
        """The candidate of a trial on the counted sample."""
        change = trial.change
        hint = change.option(trial.steps).replace("{layer}=", "{own}=")
        hint_text = hint.format(own=self.channel or self.name, layer=self.name)
        shares = 1.0 - trial.left, trial.decided, trial.explained
        return Candidate(
            change.kind, change.values(trial.steps), change.text(trial.steps), *shares, change.shared, hint_text
        )


def _without_causes_of_zeros(tried: list[Trial], changes: Mapping[str, Change], counted: Sample) -> list[Trial]:
    """The trials; if zeros everywhere explain the texture, too, those that explain most of its other wrong texels.

    A change that makes nearly all of a texture 0 explains any texture of zeros. Zeros are left if nothing else is.
    """
    zeros = changes.get(ZEROS)
    is_occlusion = counted.problem.mine.ndim == 1  # zeros beneath a shaded colour are no zeros of the texture
    if zeros is None or not is_occlusion or not counted.fits(counted.trial(zeros, ())):
        return tried
    rest = replace(counted, wrong=counted.wrong & (counted.problem.mine != 0))
    if not rest.wrong.any():
        return tried
    return [t for t in tried if rest.trial(t.change, t.steps).explained > DECIDED] or [counted.trial(zeros, ())]
