"""The diagnosis of one texture that is outside its interval."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lfssao.verify.diagnosis.change import OUTSIDE, Candidate, Change, Places, percent
from lfssao.verify.diagnosis.estimated import ROOM, Estimated
from lfssao.verify.diagnosis.problems import Texture
from lfssao.verify.diagnosis.search import DECIDED, FEWEST, NEAR, ROUGH, Sample, Search, Trial, pair
from lfssao.verify.verdict import Flags, Verdict, texels

_SCREENED = 96  # texels on which all changes are tried
_TRIED = 256  # on which the likely are
_SEARCHED = 2400  # on which the best are refined
_POLISHED = 1_200_000  # samples or taps of the texels that the best change's values are made good on
_MOST = 640_000  # samples or taps that shares are counted over
_FEW, _ALL = 250, 5_000_000  # with fewer wrong texels so many samples or taps are: each texel made wrong counts
_NARROW = 1.2  # factor within which values are made good
_WIDER, _OFTEN = 2.0, 6  # the same of few wrong texels, and how often: their values may be far off
_FEWEST = 2_000  # texels
_LIKELY = 0.8  # share of the wrong texels that a change explains whose values are then made good
_SOME = 0.1  # share of the wrong texels that a change decides which explains other textures
_TOLD = 4  # changes that explain a texture, of which other textures may tell the right one
_INNER = 0.1  # share of the wrong texels whose samples all stay inside, at least, to be explained by themselves


@dataclass(frozen=True)
class Diagnosis:
    """Changes of the reference that were tried on one texture."""

    fits: bool  # whether the first candidate explains it
    # All that explain it, or at most two that come near, the best first
    candidates: tuple[Candidate, ...]
    equal: int  # number of the candidates that explain the texture equally well
    without: float  # share of the surface texels, 0 to 1, that agree with the reference as it is
    texels: int  # number of surface texels that the candidates' shares are of
    wrong: int  # number of wrong surface texels that shares of wrong texels are of
    nearest: float = 0.0  # share of the wrong texels that the nearest change explains, less those that it makes wrong
    left_out: int = 0  # number of wrong texels of which a sample leaves the texture, if these were left out
    subject: str = "the reference"  # whose settings were varied, such as an estimator
    background: str = ""  # what stands where there is no surface, if that is wrong

    def words(self, module: str) -> str:
        """The diagnosis of a module's texture in sentences."""
        if not self.wrong:
            hint = self.candidates[0].hint
            return f"{self.candidates[0].words} in {module}, whose surface is right{hint and f': {hint}'}"
        before = f"{self.background}; " if self.background else ""
        if self.wrong < FEWEST:
            few = "texel is" if self.wrong == 1 else "texels are"
            return f"{before}{self.wrong} wrong {few} too few to tell a cause in {module}"
        if not self.candidates:
            share = f"(best {percent(max(self.nearest, 0.0))} of {self.wrong} wrong texels)"
            return f"{before}no setting of {self.subject} comes near {module} {share}"
        best, number = self.candidates[0], f"the {self.wrong} wrong texels of {module}"
        if not self.fits:
            found = f"the nearest, {best.words}, explains {percent(best.explained)}"
            return f"{before}no change that was tried explains {number}; {found}"
        decided = "all" if best.decided == 1 else percent(best.decided)
        which = "".join(f", or {other.words}," for other in self.candidates[1 : self.equal])
        told = f"{best.words}{which} explains {percent(best.explained)} of {number} and decides {decided}"
        rest = f" (without {self.left_out} of which a sample leaves the texture)" if self.left_out else ""
        return f"{before}{told}{rest}{best.hint and f': {best.hint}'}"


def _spread(places: Places, most: int) -> Places:
    """At most so many of the places, spread evenly."""
    chosen = np.linspace(0, len(places) - 1, min(most, len(places))).astype(np.int64)
    return np.asarray(places[chosen])


@dataclass(frozen=True, eq=False)
class _Draw:
    """The wrong texels of a texture and others, of which samples are drawn."""

    texture: "WrongTexture"
    bad: Places
    good: Places
    cost: int  # work that a texel makes

    @property
    def few(self) -> bool:
        """Whether so few are wrong that each of the others counts."""
        return len(self.bad) < _FEW

    @property
    def most(self) -> int:
        """Number of changes whose values are made good: of few wrong texels that is soon done."""
        return _TOLD if self.few else 2

    def _of(self, wrong: Places, right: Places) -> Sample:
        """A sample of such texels, each with the weight of those that it stands for."""
        places, weights = np.concatenate([wrong, right]), []
        for some, all_ in ((wrong, self.bad), (right, self.good)):
            weights.append(np.full(len(some), len(all_) / max(len(some), 1) / (len(self.bad) + len(self.good))))
        problem = self.texture.problem(places)
        assert problem is not None
        flags = np.arange(len(places)) < len(wrong)
        return Sample(problem, flags, np.concatenate(weights), len(self.bad), places)

    def drawn(self, most: int) -> Sample:
        """A sample of texels, up to half of them wrong ones."""
        wrong = _spread(self.bad, most // 2)
        return self._of(wrong, _spread(self.good, most - len(wrong)))

    def counted(self) -> Sample:
        """The texels that shares are counted over."""
        made = self.drawn(max((_ALL if self.few else _MOST) // self.cost, _FEWEST))
        return replace(made, problem=made.problem.changed(model=self.texture.model))

    def polishing(self, counted: Sample) -> Sample:
        """Texels on which values of counts are made good: these have steps, and few texels leave them open."""
        made = counted if self.few else self.drawn(max(_POLISHED // self.cost, _FEWEST))
        return replace(made, problem=made.problem.changed(model=None), undecided=0.0)

    def made_good(self, trial: Trial, sample: Sample) -> Trial:
        """A trial on a sample with values made good: of few wrong texels on those that turn at values near them."""
        near = sample
        if self.few:
            wide = tuple(_WIDER * step for step in trial.steps)
            turned = sample.outside(trial.change, trial.steps) | sample.outside(trial.change, wide)
            near = replace(self._of(self.bad, sample.places[turned & ~sample.wrong]), undecided=0.0)
        best = near.trial(trial.change, trial.steps)
        for _ in range(_OFTEN if self.few else 0):
            wider = near.refined(best, _WIDER, ROUGH)
            if 1 / _NARROW < wider.size / best.size < _NARROW:
                break
            best = wider
        best = near.refined(best, _NARROW)
        return sample.trial(best.change, near.centred(best).steps)


@dataclass(frozen=True, eq=False)
class WrongTexture(Texture):
    """A wrong texture of a view, whose cause is searched."""

    background: Candidate | None = None  # what stood where there is no surface, if that was wrong

    @property
    def _wrong(self) -> Flags:
        """Texels that are wrong; of occlusion without a known interval those that are off by more than rounding."""
        wrong = texels(self.judged.outside)
        if self.judged.verdict is Verdict.DIFFERENT and self.name in self.layers:
            wrong = wrong & ~(np.abs(self.mine - self.case.outputs[self.name]) <= ROOM)
        return wrong

    @np.errstate(all="ignore")  # a broken texture may hold any numbers
    def diagnose(self, known: Sequence[Candidate] = (), search: bool = True) -> Diagnosis | None:
        """The change that explains the texture; None if none can be known.

        Known candidates, of other textures, are tried first; without ``search`` nothing else is.
        """
        depth, wrong = self.inputs.get("depth"), self._wrong
        seen = np.True_ if depth is None else np.isfinite(self.cropped(depth))
        bad, good = np.flatnonzero(wrong & seen), np.flatnonzero(~wrong & seen)
        if len(bad) == 0 and self.background is not None:
            return Diagnosis(True, (self.background,), 1, 1.0, len(good), 0)
        found = self._surface(bad, good, known, search)
        if found is None or self.background is None:
            return found
        return replace(found, background=f"{self.background.words}: {self.background.hint}".removesuffix(": "))

    def _surface(self, bad: Places, good: Places, known: Sequence[Candidate], search: bool) -> Diagnosis | None:
        """The diagnosis of the wrong texels that see a surface, and of others."""
        problem = self.problem(bad[:1]) if len(bad) else None
        if problem is None:
            return None
        if len(bad) < FEWEST:
            return Diagnosis(False, (), 0, len(good) / (len(good) + len(bad)), len(good) + len(bad), len(bad))
        cost = problem.cost
        same = self._explained(bad, good, cost, known, False) if known else None
        if same is not None and same.fits:
            return same
        inner, others = bad[~self._leaving(bad)], good[~self._leaving(good)]
        if len(inner) < max(FEWEST, _INNER * len(bad)) or len(inner) == len(bad):
            return self._explained(bad, good, cost, known, search)
        # Samples that leave the texture may be a fault of their own: the others are explained before them.
        found = self._explained(inner, others, cost, known, search)
        if found is None or not found.fits:
            return found and replace(found, left_out=len(bad) - len(inner))
        whole = self._explained(bad, good, cost, found.candidates, False, borders=True)
        return replace(found, left_out=len(bad) - len(inner)) if whole is None else whole

    def _leaving(self, places: Places) -> Flags:
        """Whether a sample of a texel may leave the texture."""
        problem = self.problem(places)
        assert problem is not None
        return problem.leaves()

    def _explained(
        self, bad: Places, good: Places, cost: int, known: Sequence[Candidate], search: bool, borders: bool = False
    ) -> Diagnosis | None:
        """The diagnosis of wrong texels among others; ``borders``: known changes with a fault of the border as well."""
        draw = _Draw(self, bad, good, cost)
        counted = draw.counted()
        small, large = draw.drawn(_TRIED), draw.drawn(_SEARCHED)
        # A run makes a whole texture however few texels are asked for; by few of hbao's another radius is overlooked.
        tiny = small if isinstance(small.problem, Estimated) else draw.drawn(_SCREENED)
        changes = small.problem.changes()
        by_kind = {change.kind: change for change in changes}
        if any(each.kind not in by_kind for each in known):
            by_kind |= {change.kind: change for change in small.problem.solved(small.wrong)}
        told = (self._again(each, by_kind, large, counted) for each in known)
        best = next((trial for trial in told if trial is not None), None)
        if best is None and borders:
            best = self._with_border(known[0], by_kind, counted)
        if best is None and not search:
            return None
        search_of = Search(tiny, small, large, changes)
        found = [best] if best is not None else self._searched(search_of, draw, counted)
        tried = [best] if best is not None else [counted.trial(t.change, t.steps) for t in found[:_TOLD]]
        share = (1.0 - counted.before, len(counted.weights), len(bad))
        subject = self.case.parameters["estimator"] if self.name in self.layers else f"the reference's {self.name}"
        least = DECIDED if best is None or not best.change.shared else _SOME
        if tried and counted.fits(tried[0], least):
            fitting = [trial for trial in tried if counted.fits(trial, least)]
            fitting.sort(key=lambda trial: not counted.equals(trial, tried[0]))
            equal = sum(counted.equals(trial, tried[0]) for trial in fitting)
            return Diagnosis(True, tuple(map(self._candidate, fitting)), equal, *share, subject=subject)
        gains = [counted.gain(trial) for trial in tried[:2]]
        near = tuple(self._candidate(t) for t, gain in zip(tried, gains, strict=False) if gain >= NEAR)
        return Diagnosis(False, near, 0, *share, max(gains, default=0.0), subject=subject)

    def _searched(self, search: Search, draw: "_Draw", counted: Sample) -> Sequence[Trial]:
        """The changes that a search finds, the best first, with values made good on more texels; pairs if none fits."""
        # Costs of shares of samples have steps; those of other occlusion have some where few texels tell a value.
        stepped = not counted.problem.whole and (draw.few or counted.problem.counts)
        has_steps = self.name in self.layers and stepped
        more = draw.polishing(counted) if has_steps else counted

        def polished(found: Sequence[Trial]) -> Sequence[Trial]:
            """The same with the values of the likely ones made good."""
            likely = [t for t in found if search.large.fits(t) or t.explained > _LIKELY or not has_steps][:_TOLD]
            better = [more.trial(trial.change, trial.steps) for trial in likely]
            if has_steps:
                better[: draw.most] = [draw.made_good(t, more) if t.steps else t for t in better[: draw.most]]
            better.sort(key=more.rank)
            kinds = {trial.change.kind for trial in better}
            return [*better, *(trial for trial in found if trial.change.kind not in kinds)]

        found = polished(search.best())
        if not found or more.fits(found[0]):
            return found
        pair = search.paired(found[0])
        return found if pair is None else [*polished([pair]), *found]

    def _again(self, known: Candidate, changes: Mapping[str, Change], large: Sample, counted: Sample) -> Trial | None:
        """A change of another texture, with its values or others near them, if it explains this one."""
        change = changes.get(known.kind)
        if change is None or len(change.axes) != len(known.values):
            return None
        steps = tuple(axis.step(value) for axis, value in zip(change.axes, known.values, strict=True))
        trial = counted.trial(change, steps)
        if known.shared:  # it was not made for this texture: less of it need be decided
            return trial if counted.fits(trial, _SOME) else None
        if counted.fits(trial) or not steps:
            return trial if counted.fits(trial) else None
        trial = counted.trial(change, large.refined(large.trial(change, steps), 1.2).steps)
        return trial if counted.fits(trial) else None

    def _with_border(self, known: Candidate, changes: Mapping[str, Change], counted: Sample) -> Trial | None:
        """A change together with another rule for samples outside the texture, if both explain it."""
        first = changes.get(known.kind)
        if first is None:
            return None
        steps = tuple(axis.step(value) for axis, value in zip(first.axes, known.values, strict=True))
        rules = [change for kind, change in changes.items() if kind.startswith(OUTSIDE)]
        pairs = [counted.trial(*pair(first, steps, second, ())) for second in rules]
        return next((trial for trial in pairs if counted.fits(trial)), None)

    def _candidate(self, trial: Trial) -> Candidate:
        """The candidate of a trial on the counted texels."""
        change, hint = trial.change, trial.change.hint.replace("{layer}=", "{own}=")
        told = hint.format(own=self.channel or self.name, layer=self.name)
        shares = 1.0 - trial.left, trial.decided, trial.explained
        return Candidate(
            change.kind, change.values(trial.steps), change.text(trial.steps), *shares, change.shared, told
        )
