"""The diagnosis of one texture that is outside its interval."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.registry import ESTIMATORS, find_estimator
from lfssao.ao.textures import Buffers
from lfssao.optics.view import WorldToImage, without_guard
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.stored import Stored
from lfssao.verify.case import Arrays, Case, described_mapping, described_options, described_turns, described_view
from lfssao.verify.diagnosis import post, surface
from lfssao.verify.diagnosis.estimated import ROOM, Estimated, estimated_changes, face_normals
from lfssao.verify.diagnosis.occlusion import Occlusion, occlusion_changes
from lfssao.verify.diagnosis.search import Candidate, Change, Found, Places, Problem, Search, fits
from lfssao.verify.verdict import Judgement, texels

_SEARCHED = 2400  # texels
_SEARCHED_IN_ALL = 240_000  # times samples or taps
_POLISHED = 500_000  # samples or taps of the texels that the best change's values are made good on
_MOST = 2_000_000  # samples or taps that the share is counted over
_FEWEST = 2_000  # texels
_SAME = 0.01  # of the wrong texels: so many may stay wrong by the values of another texture
Made = tuple[Callable[[Places, Places], Problem], Callable[[Any], list[Change]], int]


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
        best, *others = self.candidates
        if self.fits:
            return f"{best.words} explains {_percent(best.share)} of {where} ({without})"
        tried = ", ".join(f"{c.words} ({_percent(c.share)})" for c in (best, *others))
        return f"no change that was tried explains {where} ({_percent(self.without)} agree); the nearest: {tried}"


def _percent(share: float) -> str:
    """A share in percent, never rounded up to 100."""
    return f"{min(100 * share, 99.99) if share < 1 else 100:.2f} %"


def _spread(places: Places, most: int) -> Places:
    """At most so many of the places, spread evenly."""
    if len(places) <= most:
        return places
    return np.asarray(places[np.linspace(0, len(places) - 1, most).astype(np.int64)])


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

    @property
    def _guard(self) -> int:
        """Texels by which textures before the merge are larger than this one."""
        return 0 if self.name in ("depth", "positions", "color") else int(self.case.parameters["guard"])

    def _cropped(self, texture: NDArray[Any]) -> NDArray[Any]:
        return texture if texture.shape[:2] == self.mine.shape[:2] else without_guard(texture, self._guard)

    @np.errstate(all="ignore")  # a broken texture may hold any numbers
    def diagnose(self, first: Sequence[Diagnosis] = ()) -> Diagnosis | None:
        """The change that explains the texture; None if none is known. Other textures' diagnoses are tried first."""
        makers: dict[str, Callable[[], Made | None]] = {
            "depth": self._depth,
            "positions": self._positions,
            "color": partial(self._image, surface.color_changes),
            "merged": self._merged,
        }
        makers |= {"blurred": self._blurred, "shaded": self._shaded, **dict.fromkeys(self._layers, self._ao)}
        made = makers[self.name]() if self.name in makers else None
        if made is None:
            return None
        (make, changes_of, cost), depth = made, self.inputs.get("depth")
        seen = np.ones(self.mine.shape[:2], np.bool_) if depth is None else np.isfinite(self._cropped(depth))
        wrong, stored = texels(self.judged.outside), self.stored
        bad, good = np.flatnonzero(wrong & seen), np.flatnonzero(~wrong & seen)
        if not len(bad):
            return None
        store = None if stored is None else partial(stored.ends, model=self.model)

        def drawn(most: int) -> Search:
            """Texels, up to half of them wrong ones, each with the weight of those that it stands for."""
            picks = [_spread(bad, most // 2)]
            picks.append(_spread(good, most - len(picks[0])))
            weights = [np.full(len(p), len(all_) / max(len(p), 1)) for p, all_ in zip(picks, (bad, good), strict=True)]
            rows, columns = np.divmod(np.concatenate(picks), self.mine.shape[1])
            problem = make(columns, rows).changed(store=store)
            return Search(problem, np.concatenate(weights) / (len(bad) + len(good)))

        search, without = drawn(min(_SEARCHED, max(_SEARCHED_IN_ALL // cost, 100))), len(good) / (len(good) + len(bad))
        changes, known = changes_of(search.problem), {d.candidates[0].kind: d.candidates[0] for d in first if d.fits}
        counted = drawn(max(_MOST // cost, _FEWEST))
        if isinstance(counted.problem, Estimated):  # by bounds of its own, where some are known
            counted = replace(counted, problem=counted.problem.changed(model=self.model))
        for change in changes:
            if change.kind in known:  # a texture of the same cause: a tenth of a second, where a search takes two
                same = counted.candidate(Found(change, known[change.kind].values, 0.0, 0.0))
                if 1.0 - same.share <= _SAME * (1.0 - without):
                    return Diagnosis(True, (same,), without, len(counted.weights))
        likely = [change for change in changes if change.kind in known]
        found = search.best(likely) if likely else []
        if not found or not fits(found[0].share, without):
            found = search.best(changes)
        if self.name.startswith("ao_"):  # counts have steps: fewer texels leave values open
            found[0] = drawn(max(_POLISHED // cost, _FEWEST)).polished(found[0])
        told = tuple(counted.candidate(each) for each in found[:2])
        return Diagnosis(fits(told[0].share, without), told, without, len(counted.weights))

    def _taken(self, texture: NDArray[Any], columns: Places, rows: Places) -> FloatArray:
        return np.asarray(texture[rows, columns], np.float64)

    def _room(self, columns: Places, rows: Places) -> FloatArray:
        """Width of the reference's interval, at most so much as rounding makes."""
        bounds = self.judged.bounds
        if bounds is None:
            return np.zeros((len(columns), *self.mine.shape[2:]))
        return self._taken(bounds.upper, columns, rows) - self._taken(bounds.lower, columns, rows)

    def _depth(self) -> Made | None:
        """Depth against the reference's, or other modules', with room as rounding makes."""

        def changes(problem: surface.Image) -> list[Change]:
            others = {}
            for words, depth in self.depths().items():
                if depth.shape == self.mine.shape:
                    there = depth.astype(np.float64)
                    room = np.where(np.isfinite(there), 16 * self.model.operation * np.abs(there), 0.0)
                    others[words] = there - room, there + room
            return surface.depth_changes(problem, others)

        return self._image(changes)

    def _image(self, changes: Callable[[surface.Image], list[Change]]) -> Made | None:
        # The mesh knows what codes of a format were before they were stored.
        bounds = (self.stored and self.case.bounds.get(self.name)) or self.judged.bounds
        if bounds is None:
            return None
        lower, upper = bounds.lower.astype(np.float64), bounds.upper.astype(np.float64)
        bend = surface.bend(lower)

        def make(i: Places, j: Places) -> surface.Image:
            own = self._taken(self.mine, i, j)
            return surface.Image(mine=own, columns=i, rows=j, lower=lower, upper=upper, bend=bend)

        return make, changes, 16

    def _positions(self) -> Made | None:
        """Positions against depth."""
        depth = self.inputs.get("depth")
        if depth is None:
            return None
        mapping, (height, width) = described_mapping(self.case.parameters), depth.shape

        def make(i: Places, j: Places) -> surface.Positions:
            points, z = self._taken(self.mine, i, j), self._taken(depth, i, j)
            return surface.Positions(mine=points, columns=i, rows=j, depth=z, mapping=mapping, model=self.model)

        return make, lambda p: surface.positions_changes(p, self.case, (width, height)), 16

    def _ao(self) -> Made | None:
        """Occlusion of one radius against depth and positions."""
        parameters, depth = self.case.parameters, self.inputs.get("depth")
        estimator, options = parameters["estimator"], parameters["options"]
        positions, back = self.inputs.get("positions"), parameters["screen_to_world"]
        half = estimator == "hemisphere"
        if estimator not in ("lf", "point", "hemisphere"):
            return self._estimated()
        if depth is None or (half and "normals" not in self.inputs):
            return None
        mapping, guard, turns = described_mapping(parameters), self._guard, described_turns(parameters, self.inputs)
        by_matrix = estimator == "lf" and back is not None
        if positions is None and not by_matrix:
            return None
        radius = self._layers[self.name]
        samples = np.asarray(self.inputs["samples" if estimator == "lf" else "points"], np.float64)
        surfaces = depth if options.get("surface") != "positions" or positions is None else mapping(positions)[..., 2]
        if options.get("background") == "occludes":
            surfaces = np.where(np.isfinite(depth), surfaces, -np.inf)
        faces = None
        if half and positions is not None:
            faces = face_normals(Buffers(described_view(parameters), depth, positions))

        def make(i: Places, j: Places) -> Occlusion:
            x, y = i + guard, j + guard
            corners = None
            if positions is None or by_matrix:
                z = self._taken(depth, x, y)
                points, errors = _unprojected(np.array(back), x + 0.5, y + 0.5, z, self.model)
                corners, _ = _unprojected(np.array(back), x, y, z, self.model)
            else:
                points, errors = self._taken(positions, x, y), np.zeros((len(x), 3))
            return Occlusion(
                mine=self._taken(self.mine, i, j),
                depth=surfaces,
                points=points,
                errors=errors,
                mapping=mapping,
                samples=samples,
                radius=radius,
                model=self.model,
                texels=(x, y),
                rotation=parameters.get("rotation", "none"),
                seed=parameters.get("rotation_seed", 0),
                turns=None if turns is None else np.asarray(turns[:, y, x], np.float64),
                normals=self._taken(self.inputs["normals"], x, y) if half else None,
                corners=corners,
                face_normals=None if faces is None else self._taken(faces, x, y),
                positions=positions if options.get("range_check") else None,
                remap=bool(options.get("remap")),
            )

        return make, lambda p: occlusion_changes(p, self.case, self.mappings), 4 * len(samples)

    def _estimated(self) -> Made | None:
        """Occlusion of one radius by running its estimator; None where it needs a texture that is not there."""
        parameters, inputs = self.case.parameters, self.inputs
        name, guard = parameters["estimator"], self._guard
        there = {"depth", "positions"} <= set(inputs) and name in ESTIMATORS
        if not there or (find_estimator(name).reads_normals(parameters["options"]) and "normals" not in inputs):
            return None
        textures = inputs["depth"], inputs["positions"], inputs.get("normals"), described_turns(parameters, inputs)
        buffers, radius = Buffers(described_view(parameters), *textures), self._layers[self.name]

        def make(i: Places, j: Places) -> Estimated:
            return Estimated(
                mine=self._taken(self.mine, i, j),
                estimator=find_estimator(name),
                buffers=buffers,
                radius=radius,
                points=inputs.get("points"),
                weights=inputs.get("weights"),
                options=described_options(parameters, radius),
                columns=i + guard,
                rows=j + guard,
                room=self._room(i, j) + ROOM,
                seed=int(parameters.get("rotation_seed", 0)),
            )

        return make, lambda p: estimated_changes(p, parameters.get("rotation", "none")), 1

    @property
    def _layers(self) -> dict[str, float]:
        """Names of the layers of occlusion, each with its radius."""
        return {f"ao_{k}": radius for k, radius in enumerate(self.case.parameters["radii"], start=1)}

    def _merged(self) -> Made | None:
        """The merge of the layers."""
        if not set(self._layers) <= set(self.inputs):
            return None

        def make(i: Places, j: Places) -> post.Merge:
            layers = np.stack([self._taken(self.inputs[name], i, j) for name in self._layers])
            return post.Merge(mine=self._taken(self.mine, i, j), layers=layers)

        return make, post.merge_changes, 8 * len(self._layers)

    def _blurred(self) -> Made | None:
        """The blur of the merged texture; with a guard band away from the border."""
        sigma, merged = float(self.case.parameters["sigma"]), self.inputs.get("merged")
        if merged is None or sigma == 0:
            return None

        def make(i: Places, j: Places) -> post.Blur:
            own, room = self._taken(self.mine, i, j), self._room(i, j)
            return post.Blur(mine=own, columns=i, rows=j, merged=merged, room=room, sigma=sigma)

        return make, post.blur_changes, int(2 * np.ceil(4 * sigma) + 1) ** 2

    def _shaded(self) -> Made | None:
        """The shading of the image."""
        image, blurred, merged = (self.inputs.get(name) for name in ("image", "blurred", "merged"))
        if image is None or blurred is None:
            return None
        colors = self._cropped(image)

        def make(i: Places, j: Places) -> post.Shade:
            return post.Shade(
                mine=self._taken(self.mine, i, j),
                image=self._taken(colors, i, j),
                occlusion=self._taken(blurred, i, j),
                merged=None if merged is None else self._taken(merged, i, j),
                room=self._room(i, j),
            )

        return make, post.shade_changes, 16


def _unprojected(
    back: FloatArray, u: NDArray[Any], v: NDArray[Any], depth: FloatArray, model: ErrorModel
) -> tuple[FloatArray, FloatArray]:
    """World coordinates of image points by line 3 of Algorithm 1, and how far each is off."""
    at = np.stack([u, v, depth, np.ones(len(depth))], axis=-1)
    rounded = back.astype(np.float32).astype(np.float64)
    homogeneous, sizes = at @ rounded.T, np.abs(at) @ np.abs(rounded).T
    off, w = 5 * model.operation * sizes, homogeneous[:, 3:]
    points = homogeneous[:, :3] / w
    return points, (off[:, :3] + np.abs(points) * off[:, 3:]) / np.abs(w) + model.quotient * np.abs(points)
