"""The diagnosis of one texture that is outside its interval."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.registry import ESTIMATORS, find_estimator
from lfssao.ao.textures import Buffers
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
from lfssao.verify.diagnosis.search import Candidate, Found, Places, Problem, Search, fits
from lfssao.verify.verdict import Judgement, texels

_SEARCHED = 2400  # texels
_SEARCHED_IN_ALL = 240_000  # times samples or taps
_POLISHED = 500_000  # samples or taps of the texels that the best change's values are made good on
_MOST = 2_000_000  # samples or taps that the share is counted over
_FEWEST = 2_000  # texels
_SAME = 0.01  # of the wrong texels: so many may stay wrong by the values of another texture
Texels = dict[str, Any]  # what all problems have, by the names of their fields


@dataclass(frozen=True)
class Diagnosis:
    """Changes of the reference that were tried on one texture."""

    fits: bool  # whether the first candidate explains it: at most a twentieth of the wrong texels stay wrong
    candidates: tuple[Candidate, ...]  # the best, at most two, the best first
    without: float  # share of the surface texels, 0 to 1, that agree with the reference as it is
    texels: int  # number of surface texels that the candidates' shares are of

    def words(self, module: str) -> str:
        """The diagnosis of a module's texture as a sentence."""
        where, without = f"the surface texels of {module}", f"{_percent(self.without)} agree without it"
        best = self.candidates[0]
        if self.fits:
            return f"{best.words} explains {_percent(best.share)} of {where} ({without})"
        tried = ", ".join(f"{c.words} ({_percent(c.share)})" for c in self.candidates)
        return f"no change that was tried explains {where} ({_percent(self.without)} agree); the nearest: {tried}"


def _percent(share: float) -> str:
    """A share in percent, never rounded up to 100."""
    return f"{min(100 * share, 99.99) if share < 1 else 100:.2f} %"


def _spread(places: Places, most: int) -> Places:
    """At most so many of the places, spread evenly."""
    chosen = np.linspace(0, len(places) - 1, min(most, len(places))).astype(np.int64)
    return np.asarray(places[chosen])


@dataclass(frozen=True, eq=False)
class Wrong:
    """A wrong texture of a view, and all that may tell the cause."""

    name: str
    mine: NDArray[Any]  # the texture, (H, W) or (H, W, 3)
    inputs: Arrays  # of the stages before, the renderer's own where there are some
    case: Case
    judged: Judgement
    model: ErrorModel  # not an exact one
    stored: Stored | None = None  # the texture's format
    mappings: Mapping[str, WorldToImage] = field(default_factory=dict)  # of other modules, by name
    depths: Callable[[], Mapping[str, NDArray[Any]]] = dict  # of other modules, by what is wrong with them

    @np.errstate(all="ignore")  # a broken texture may hold any numbers
    def diagnose(self, first: Sequence[Diagnosis] = ()) -> Diagnosis | None:
        """The change that explains the texture; None if none is known. Other textures' diagnoses are tried first."""
        depth, wrong = self.inputs.get("depth"), texels(self.judged.outside)
        seen = np.True_ if depth is None else np.isfinite(self._cropped(depth))
        bad, good = np.flatnonzero(wrong & seen), np.flatnonzero(~wrong & seen)
        problem = self._problem(bad[:1]) if len(bad) else None
        if problem is None:
            return None
        cost, without = problem.cost, len(good) / (len(good) + len(bad))

        def drawn(most: int) -> Search:
            """Texels, up to half of them wrong ones, each with the weight of those that it stands for."""
            picks = [_spread(bad, most // 2)]
            picks.append(_spread(good, most - len(picks[0])))
            weights = [np.full(len(p), len(all_) / max(len(p), 1)) for p, all_ in zip(picks, (bad, good), strict=True)]
            problem = self._problem(np.concatenate(picks))
            assert problem is not None
            return Search(problem, np.concatenate(weights) / (len(bad) + len(good)))

        search, counted = drawn(min(_SEARCHED, max(_SEARCHED_IN_ALL // cost, 100))), drawn(max(_MOST // cost, _FEWEST))
        if isinstance(counted.problem, Estimated):  # by bounds of its own, where some are known
            counted = replace(counted, problem=counted.problem.changed(model=self.model))
        changes, known = search.problem.changes(), {d.candidates[0].kind: d.candidates[0] for d in first if d.fits}
        likely = [change for change in changes if change.kind in known]
        for change in likely:  # a texture of the same cause: a tenth of a second, where a search takes two
            same = counted.candidate(Found(change, known[change.kind].values, 0.0, 0.0))
            if 1.0 - same.share <= _SAME * (1.0 - without):
                return Diagnosis(True, (same,), without, len(counted.weights))
        found = search.best(likely) if likely else []
        if not found or not fits(found[0].share, without):
            found = search.best(changes)
        if self.name in self._layers:  # counts have steps: fewer texels leave values open
            found[0] = drawn(max(_POLISHED // cost, _FEWEST)).polished(found[0])
        told = tuple(counted.candidate(each) for each in found[:2])
        return Diagnosis(fits(told[0].share, without), told, without, len(counted.weights))

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

    def _problem(self, places: Places) -> Problem | None:
        """The problem of some texels, by their numbers; None if a texture that it is made of is not known."""
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
        rows, columns = np.divmod(places, self.mine.shape[1])
        own, bounds = _taken(self.mine, columns, rows), self.judged.bounds
        room = np.zeros_like(own)
        if bounds is not None:
            room = _taken(bounds.upper, columns, rows) - _taken(bounds.lower, columns, rows)
        store = None if self.stored is None else partial(self.stored.ends, model=self.model)
        return makers[self.name]({"mine": own, "columns": columns, "rows": rows, "room": room, "store": store})

    def _image(self, at: Texels) -> surface.Image | None:
        if self._interval is None:
            return None
        if self.name == "color":
            return surface.Color(**at, **self._interval)
        return surface.Depth(**at, **self._interval, model=self.model, others=self.depths)

    def _positions(self, at: Texels) -> surface.Positions | None:
        depth, parameters = self.inputs.get("depth"), self.case.parameters
        if depth is None:
            return None
        return surface.Positions(
            **at,
            depth=_taken(described_view(parameters).image_z(depth), at["columns"], at["rows"]),
            mapping=described_mapping(parameters),
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
        at = {**at, "columns": at["columns"] + guard, "rows": at["rows"] + guard}
        at |= {"rotation": self.case.parameters.get("rotation", "none")}
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
            mapping=mapping,
            samples=samples,
            model=self.model,
            cast_from_world=parameters["view"]["cast_from_world"],
            mappings=self.mappings,
            turns=None if turns is None else np.asarray(turns[:, y, x], np.float64),
            normals=_taken(inputs["normals"], x, y) if half else None,
            corners=corners,
            face_normals=_taken(self._face_normals, x, y) if half else None,
            positions=positions if options.get("range_check") else None,
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
