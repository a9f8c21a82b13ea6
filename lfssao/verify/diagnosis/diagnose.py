"""The diagnosis of one texture that is outside its interval."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.registry import ESTIMATORS, find_estimator
from lfssao.ao.textures import Buffers
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.display import Display
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import WorldToImage, without_guard
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.ssao import project_positions
from lfssao.verify.bounds.stored import Stored
from lfssao.verify.case import Arrays, Case, described_mapping, described_options, described_turns, described_view
from lfssao.verify.diagnosis import post, surface
from lfssao.verify.diagnosis.estimated import Estimated, face_normals
from lfssao.verify.diagnosis.occlusion import Occlusion
from lfssao.verify.diagnosis.search import (
    DECIDED,
    FEWEST,
    NEAR,
    OUTSIDE,
    Candidate,
    Change,
    Places,
    Problem,
    Sample,
    Search,
    Trial,
    pair,
)
from lfssao.verify.diagnosis.views import Sight, sight_of
from lfssao.verify.verdict import Flags, Judgement, texels

_SCREENED = 256  # texels on which all changes are tried
_SEARCHED = 2400  # on which the best are refined
_POLISHED = 800_000  # samples or taps of the texels that the best change's values are made good on
_MOST = 2_000_000  # samples or taps that shares are counted over
_FEWEST = 2_000  # texels
_LIKELY = 0.8  # share of the wrong texels that a change explains whose values are then made good
_SOME = 0.1  # share of the wrong texels that a change decides which explains other textures
_TOLD = 4  # changes that explain a texture, of which other textures may tell the right one
_INNER = 0.1  # share of the wrong texels whose samples all stay inside, at least, to be explained by themselves
Texels = dict[str, Any]  # what all problems have, by the names of their fields


@dataclass(frozen=True)
class Diagnosis:
    """Changes of the reference that were tried on one texture."""

    fits: bool  # whether the first candidate explains it
    # All that explain it, or at most two that come near, the best first
    candidates: tuple[Candidate, ...]
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
            share = f"(best {_percent(max(self.nearest, 0.0))} of {self.wrong} wrong texels)"
            return f"{before}no setting of {self.subject} comes near {module} {share}"
        best, number = self.candidates[0], f"the {self.wrong} wrong texels of {module}"
        if not self.fits:
            found = f"the nearest, {best.words}, explains {_percent(best.explained)}"
            return f"{before}no change that was tried explains {number}; {found}"
        decided = "all" if best.decided == 1 else _percent(best.decided)
        told = f"{best.words} explains {_percent(best.explained)} of {number} and decides {decided}"
        rest = f" (without {self.left_out} of which a sample leaves the texture)" if self.left_out else ""
        return f"{before}{told}{rest}{best.hint and f': {best.hint}'}"


def _percent(share: float) -> str:
    """A share in percent, never rounded up to 100."""
    return f"{min(100 * share, 99.99) if share < 1 else 100:.2f} %"


def _spread(places: Places, most: int) -> Places:
    """At most so many of the places, spread evenly."""
    chosen = np.linspace(0, len(places) - 1, min(most, len(places))).astype(np.int64)
    return np.asarray(places[chosen])


@dataclass(frozen=True, eq=False)
class WrongTexture:
    """A wrong texture of a view and what its cause is searched in."""

    name: str
    mine: NDArray[Any]  # the texture, (H, W) or (H, W, 3)
    inputs: Arrays  # of the stages before, the renderer's own where there are some
    case: Case
    judged: Judgement
    model: ErrorModel  # not an exact one
    stored: Stored | None = None  # the texture's format
    display: tuple[Display, int] | None = None  # the display, and the module's number
    others: Mapping[str, WorldToImage | Sight] = field(default_factory=dict)  # other modules, by name
    depths: Callable[[], Mapping[str, NDArray[Any]]] = dict  # of other modules, by what is wrong with them
    caster: Callable[[], RayCaster | None] = lambda: None  # of the mesh, where it is at hand
    sampling: Mapping[str, Any] = field(default_factory=dict)  # method and seed of the samples
    channel: str = ""  # the renderer's own name of the texture
    background: Candidate | None = None  # what stood where there is no surface, if that was wrong

    @np.errstate(all="ignore")  # a broken texture may hold any numbers
    def diagnose(self, known: Sequence[Candidate] = (), search: bool = True) -> Diagnosis | None:
        """The change that explains the texture; None if none can be known.

        Known candidates, of other textures, are tried first; without ``search`` nothing else is.
        """
        depth, wrong = self.inputs.get("depth"), texels(self.judged.outside)
        seen = np.True_ if depth is None else np.isfinite(self._cropped(depth))
        bad, good = np.flatnonzero(wrong & seen), np.flatnonzero(~wrong & seen)
        if len(bad) == 0 and self.background is not None:
            return Diagnosis(True, (self.background,), 1.0, len(good), 0)
        found = self._surface(bad, good, known, search)
        if found is None or self.background is None:
            return found
        return replace(found, background=f"{self.background.words}: {self.background.hint}".removesuffix(": "))

    def _surface(self, bad: Places, good: Places, known: Sequence[Candidate], search: bool) -> Diagnosis | None:
        """The diagnosis of the wrong texels that see a surface, and of others."""
        problem = self._problem(bad[:1]) if len(bad) else None
        if problem is None:
            return None
        if len(bad) < FEWEST:
            return Diagnosis(False, (), len(good) / (len(good) + len(bad)), len(good) + len(bad), len(bad))
        cost = problem.cost
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
        problem = self._problem(places)
        assert problem is not None
        return problem.leaves()

    def _explained(
        self, bad: Places, good: Places, cost: int, known: Sequence[Candidate], search: bool, borders: bool = False
    ) -> Diagnosis | None:
        """The diagnosis of wrong texels among others; ``borders``: known changes with a fault of the border as well."""

        def drawn(most: int) -> Sample:
            """Texels, up to half of them wrong ones, each with the weight of those that it stands for."""
            picks = [_spread(bad, most // 2)]
            picks.append(_spread(good, most - len(picks[0])))
            weights = [np.full(len(p), len(all_) / max(len(p), 1)) for p, all_ in zip(picks, (bad, good), strict=True)]
            problem = self._problem(np.concatenate(picks))
            assert problem is not None
            flags = np.arange(len(problem.columns)) < len(picks[0])
            return Sample(problem, flags, np.concatenate(weights) / (len(bad) + len(good)), len(bad))

        counted = drawn(max(_MOST // cost, _FEWEST))
        if isinstance(counted.problem, Estimated):  # by bounds of its own, where some are known
            counted = replace(counted, problem=counted.problem.changed(model=self.model))
        small, large = drawn(_SCREENED), drawn(_SEARCHED)
        changes = small.problem.changes()
        by_kind = {change.kind: change for change in changes}
        told = [self._again(each, by_kind, large, counted) for each in known]
        best = next((trial for trial in told if trial is not None), None)
        if best is None and borders:
            best = self._with_border(known[0], by_kind, counted)
        if best is None and not search:
            return None
        found = [best] if best is not None else self._searched(Search(small, large, changes), counted, cost, drawn)
        tried = [counted.trial(trial.change, trial.steps) for trial in found[:_TOLD]]
        share = (1.0 - counted.before, len(counted.weights), len(bad))
        subject = self.case.parameters["estimator"] if self.name in self._layers else f"the reference's {self.name}"
        least = DECIDED if best is None or not best.change.shared else _SOME
        if tried and counted.fits(tried[0], least):
            fitting = tuple(self._candidate(trial) for trial in tried if counted.fits(trial, least))
            return Diagnosis(True, fitting, *share, subject=subject)
        gains = [counted.gain(trial) for trial in tried[:2]]
        near = tuple(self._candidate(t) for t, gain in zip(tried, gains, strict=False) if gain >= NEAR)
        return Diagnosis(False, near, *share, max(gains, default=0.0), subject=subject)

    def _searched(self, search: Search, counted: Sample, cost: int, drawn: Callable[[int], Sample]) -> Sequence[Trial]:
        """What a search finds, its values made good on more texels, the best first; pairs if no change fits."""
        more = counted
        if self.name in self._layers and not isinstance(counted.problem, Estimated):
            # Counts have steps: fewer texels leave values open.
            more = replace(drawn(max(_POLISHED // cost, _FEWEST)), undecided=0.0)

        def polished(found: Sequence[Trial]) -> Sequence[Trial]:
            """The same with the values of the likely ones made good."""
            likely = [trial for trial in found if search.large.fits(trial) or trial.explained > _LIKELY][:_TOLD]
            if not likely:
                return found
            again = [t for t in likely if t.steps and more is not counted]
            better = [more.refined(t, 1.2) if t in again else more.trial(t.change, t.steps) for t in likely]
            fewest = min((len(t.steps) for t in better if more.fits(t)), default=0)
            better.sort(key=lambda t: (not more.fits(t), len(t.steps) > fewest, t.cost))
            better[0] = more.centred(better[0]) if better[0].steps and more is not counted else better[0]
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

    def _cropped(self, texture: NDArray[Any]) -> NDArray[Any]:
        """A texture without the guard band by which it is larger than this one."""
        return without_guard(texture, (len(texture) - len(self.mine)) // 2)

    @property
    def _layers(self) -> dict[str, float]:
        """Names of the layers of occlusion, each with its radius."""
        return {f"ao_{k}": radius for k, radius in enumerate(self.case.parameters["radii"], start=1)}

    @cached_property
    def _interval(self) -> Texels | None:
        """The reference's interval of depth or colour, and how far it bends between texels."""
        # The mesh knows what codes of a format were before they were stored.
        bounds = (self.stored and self.case.bounds.get(self.name)) or self.judged.bounds
        if bounds is None:
            return None
        lower, upper = bounds.lower.astype(np.float64), bounds.upper.astype(np.float64)
        return {"lower": lower, "upper": upper, "bend": surface.bend(lower)}

    @cached_property
    def _turns(self) -> NDArray[np.float32] | None:
        """Cosine and sine by which each texel's samples turn."""
        return described_turns(self.case.parameters, self.inputs)

    @cached_property
    def _face_normals(self) -> NDArray[Any]:
        """Normals made from positions."""
        textures = self.inputs["depth"], self.inputs["positions"]
        return face_normals(Buffers(described_view(self.case.parameters), *textures))

    @cached_property
    def _view(self) -> Texels:
        """The reference's sight, the centre of its region of interest, and other modules' sights."""
        display, index = self.display or (None, None)
        sight = sight_of(described_view(self.case.parameters), display, index)
        centre = None if display is None else np.mean(np.array(display.roi, np.float64), axis=0)
        others = {
            name: other if isinstance(other, Sight) else replace(sight, view=replace(sight.view, world_to_image=other))
            for name, other in self.others.items()
        }
        return {"sight": sight, "centre": centre, "others": others}

    def _problem(self, places: Places) -> Problem | None:
        """The problem of some texels, by their numbers; None if a texture that it is made of is not known."""
        rows, columns = np.divmod(places, self.mine.shape[1])
        return self._problem_at(_taken(self.mine, columns, rows), columns, rows)

    def _problem_at(self, own: FloatArray, columns: Places, rows: Places) -> Problem | None:
        """The problem of numbers that stand for texels."""
        makers: dict[str, Callable[[Texels], Problem | None]] = {
            "depth": self._image,
            "positions": self._positions,
            "color": self._image,
            **dict.fromkeys(self._layers, self._ao),
            "merged": self._merged,
            "blurred": self._blurred,
            "shaded": self._shaded,
        }
        if self.name not in makers:
            return None
        bounds, (height, width) = self.judged.bounds, self.mine.shape[:2]
        room = np.zeros_like(own)
        if bounds is not None:
            room = _taken(bounds.upper, columns, rows) - _taken(bounds.lower, columns, rows)

        def flipped(across: bool, down: bool) -> Problem | None:
            places = width - 1 - columns if across else columns, height - 1 - rows if down else rows
            return self._problem_at(own, *places)

        at: Texels = {"mine": own, "columns": columns, "rows": rows, "room": room, "flipped": flipped}
        if self.stored is not None:
            at["store"] = partial(self.stored.ends, model=self.model)
            at["floored"] = partial(self.stored.ends, model=self.model, floor=True) if self.stored.has_codes else None
        return makers[self.name](at)

    def _image(self, at: Texels) -> surface.Image | None:
        if self._interval is None:
            return None
        if self.name == "color":
            return surface.Color(**at, **self._interval)
        view = {key: self._view[key] for key in ("sight", "centre")}
        return surface.Depth(**at, **self._interval, **view, model=self.model, others=self.depths, caster=self.caster())

    def _positions(self, at: Texels) -> surface.Positions | None:
        depth, parameters = self.inputs.get("depth"), self.case.parameters
        if depth is None:
            return None
        return surface.Positions(
            **at,
            **self._view,
            depth=_taken(described_view(parameters).image_z(depth), at["columns"], at["rows"]),
            model=self.model,
            cast_from_world=parameters["view"]["cast_from_world"],
            size=depth.shape[::-1],
        )

    def _ao(self, at: Texels) -> Problem | None:
        """Occlusion of one radius against depth and positions, in the places of these."""
        depth, estimator = self.inputs.get("depth"), self.case.parameters["estimator"]
        if depth is None:
            return None
        guard = (len(depth) - len(self.mine)) // 2
        at = {**at, **self._view, "columns": at["columns"] + guard, "rows": at["rows"] + guard}
        at |= {"rotation": self.case.parameters.get("rotation", "none"), "sampling": self.sampling}
        at |= {"seed": int(self.case.parameters.get("rotation_seed", 0)), "radius": self._layers[self.name]}
        return self._samples(at) if estimator in ("lf", "point", "hemisphere") else self._estimated(at)

    def _samples(self, at: Texels) -> Occlusion | None:
        """Occlusion of Algorithms 1 and 2, and of ``point`` and ``hemisphere``."""
        parameters, inputs = self.case.parameters, self.inputs
        depth = described_view(parameters).image_z(inputs["depth"])
        estimator, options, back = parameters["estimator"], parameters["options"], parameters["screen_to_world"]
        positions, mapping, half = inputs.get("positions"), described_mapping(parameters), estimator == "hemisphere"
        by_matrix = estimator == "lf" and back is not None
        if (half and "normals" not in inputs) or (positions is None and not by_matrix):
            return None
        surfaces = depth if options.get("surface") != "positions" or positions is None else mapping(positions)[..., 2]
        if options.get("background") == "occludes":
            surfaces = np.where(np.isfinite(depth), surfaces, -np.inf)
        x, y = at["columns"], at["rows"]
        corners, turns = None, self._turns
        if by_matrix:
            places, to_world = np.stack([x, y, _taken(depth, x, y)], axis=-1), WorldToImage(MATRIX, np.ravel(back))
            corners, _, _ = project_positions(places, np.zeros_like(places), to_world, self.model)
            places[:, :2] += 0.5
            points, errors, _ = project_positions(places, np.zeros_like(places), to_world, self.model)
        else:
            points, errors = _taken(inputs["positions"], x, y), np.zeros((len(x), 3))
        samples = np.asarray(inputs["samples" if estimator == "lf" else "points"], np.float64)
        return Occlusion(
            **at,
            cost=4 * len(samples),
            depth=surfaces,
            points=points,
            errors=errors,
            samples=samples,
            model=self.model,
            cast_from_world=parameters["view"]["cast_from_world"],
            turns=None if turns is None else np.asarray(turns[:, y, x], np.float64),
            normals=_taken(inputs["normals"], x, y) if half else None,
            corners=corners,
            face_normals=_taken(self._face_normals, x, y) if half else None,
            positions=positions,
            reach=at["radius"] if options.get("range_check") else None,
            remap=bool(options.get("remap")),
        )

    def _estimated(self, at: Texels) -> Estimated | None:
        """Occlusion of one radius by running its estimator; None where it needs a texture that is not there."""
        parameters, inputs, name = self.case.parameters, self.inputs, self.case.parameters["estimator"]
        if "positions" not in inputs or name not in ESTIMATORS:
            return None
        estimator = find_estimator(name)
        if estimator.reads_normals(parameters["options"]) and "normals" not in inputs:
            return None
        textures = inputs["depth"], inputs["positions"], inputs.get("normals"), self._turns
        return Estimated(
            **at,
            estimator=estimator,
            buffers=Buffers(described_view(parameters), *textures),
            points=inputs.get("points"),
            weights=inputs.get("weights"),
            options=described_options(parameters, at["radius"]),
            cost=1,  # each run makes a whole texture
        )

    def _merged(self, at: Texels) -> post.Merge | None:
        if not set(self._layers) <= set(self.inputs):
            return None
        layers = [_taken(self.inputs[name], at["columns"], at["rows"]) for name in self._layers]
        return post.Merge(**at, layers=np.stack(layers), cost=8 * len(layers))

    def _blurred(self, at: Texels) -> post.Blur | None:
        sigma, merged = float(self.case.parameters["sigma"]), self.inputs.get("merged")
        if merged is None or sigma == 0:
            return None
        return post.Blur(**at, merged=merged, sigma=sigma, cost=int(2 * np.ceil(4 * sigma) + 1) ** 2)

    def _shaded(self, at: Texels) -> post.Shade | None:
        image, blurred, merged = (self.inputs.get(name) for name in ("image", "blurred", "merged"))
        if image is None or blurred is None:
            return None
        i, j = at["columns"], at["rows"]
        return post.Shade(
            **at,
            image=_taken(self._cropped(image), i, j),
            occlusion=_taken(blurred, i, j),
            merged=None if merged is None else _taken(merged, i, j),
        )


def _taken(texture: NDArray[Any], columns: Places, rows: Places) -> FloatArray:
    return np.asarray(texture[rows, columns], np.float64)
