"""The problems of a wrong texture: some of its texels, and what each stage's changes are made of."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.registry import ESTIMATORS, find_estimator
from lfssao.ao.ssao import unprojected
from lfssao.ao.textures import Buffers
from lfssao.core.affine import Matrix
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.display import Display
from lfssao.optics.quilt import Quilt
from lfssao.optics.view import without_guard
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.stored import TextureFormat
from lfssao.verify.case import (
    Arrays,
    Case,
    described_buffers,
    described_neighbours,
    described_options,
    described_view,
)
from lfssao.verify.diagnosis import post, surface
from lfssao.verify.diagnosis.change import Places, Problem, no_textures
from lfssao.verify.diagnosis.estimated import Estimated
from lfssao.verify.diagnosis.formulated import Formulated, longer
from lfssao.verify.diagnosis.occlusion import Counted
from lfssao.verify.diagnosis.search import beyond
from lfssao.verify.diagnosis.views import Sight, sight_of
from lfssao.verify.verdict import Judgement, Verdict

Texels = dict[str, Any]  # what all problems have, by the names of their fields


@dataclass(frozen=True, eq=False)
class Texture:
    """A wrong texture of a view and what its cause is searched in."""

    name: str
    mine: NDArray[Any]  # the texture, (H, W) or (H, W, 3)
    inputs: Arrays  # of the stages before, the renderer's own where there are some
    case: Case
    judged: Judgement
    model: ErrorModel  # not an exact one
    stored: TextureFormat | None = None  # the texture's format
    display: tuple[Display | Quilt, int] | None = None  # the display or quilt, and the module's or view's number
    others: Mapping[str, Sight] = field(default_factory=dict)  # other modules, by name
    # Textures of a layer of other modules, by the module, of the size of this module's
    textures: Callable[[str], Mapping[str, NDArray[Any]]] = field(default_factory=lambda: no_textures)
    # Columns and rows at which this view lies in one texture of all of them, by how they are laid out
    places: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    caster: Callable[[], RayCaster | None] | None = None  # of the mesh, where it is at hand
    sampling: Mapping[str, Any] = field(default_factory=dict)  # method and seed of the samples
    channel: str = ""  # the renderer's own name of the texture

    def cropped(self, texture: NDArray[Any]) -> NDArray[Any]:
        """A texture without the guard band by which it is larger than this one."""
        return without_guard(texture, (len(texture) - len(self.mine)) // 2)

    @property
    def layers(self) -> dict[str, float]:
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
    def _back(self) -> Matrix | None:
        """The matrix by which Algorithm 1 makes points of depth; None where points are those of a texture."""
        lf = self.case.parameters["estimator"] == "lf"
        return described_view(self.case.parameters).screen_to_world if lf else None

    @cached_property
    def _buffers(self) -> Buffers:
        """The textures that estimators read."""
        inputs = self.inputs
        if self._back is not None:
            view = described_view(self.case.parameters)
            positions = unprojected(view.image_z(inputs["depth"]), self._back)
            inputs = {**inputs, "positions": np.where(np.isnan(positions), np.inf, positions)}
        return described_buffers(self.case.parameters, inputs)

    @cached_property
    def _longer(self) -> dict[int, Any]:
        """Textures with what formulas read behind them, by their identity (``Formulated``)."""
        made = self._buffers
        textures = [t for t in (made.depth, made.positions, made.normals) if t is not None]
        return {id(t): longer(t, t.size // made.depth.size) for t in textures}

    @cached_property
    def _view(self) -> Texels:
        """The reference's sight, the centre of its region of interest, and other modules' sights."""
        display, index = self.display or (None, None)
        sight = sight_of(described_view(self.case.parameters), display, index)
        centre = None if sight.display is None or display is None else np.mean(np.array(display.roi), axis=0)
        return {"sight": sight, "centre": centre, "others": self.others}

    def problem(self, places: Places) -> Problem | None:
        """The problem of some texels, by their numbers; None if a texture that it is made of is not known."""
        rows, columns = np.divmod(places, self.mine.shape[1])
        return self._problem_at(_taken(self.mine, columns, rows), columns, rows)

    def _problem_at(self, own: FloatArray, columns: Places, rows: Places) -> Problem | None:
        """The problem of numbers that stand for texels."""
        makers: dict[str, Callable[[Texels], Problem | None]] = {
            "depth": self._image,
            "positions": self._positions,
            "color": self._image,
            **dict.fromkeys(self.layers, self._ao),
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

        off = np.zeros_like(own)
        if bounds is not None:
            off = beyond(own, _taken(bounds.lower, columns, rows), _taken(bounds.upper, columns, rows))
        elif self.judged.verdict is Verdict.DIFFERENT:
            off = np.abs(own - _taken(self.case.outputs[self.name], columns, rows))

        def elsewhere() -> dict[str, FloatArray]:
            others = self.textures(self.name) if self.name != "shaded" else {}
            return {view: _taken(texture, columns, rows) for view, texture in others.items()}

        at: Texels = {"off": off, "mine": own, "columns": columns, "rows": rows, "room": room, "flipped": flipped}
        at["elsewhere"] = elsewhere
        if self.stored is not None:
            at["store"] = partial(self.stored.ends, model=self.model)
            at["floored"] = partial(self.stored.ends, model=self.model, floor=True) if self.stored.has_codes else None
        return makers[self.name](at)

    def _image(self, at: Texels) -> surface.Image | None:
        if self._interval is None:
            return None
        if self.name == "color":
            return surface.Color(**at, **self._interval)
        caster = None if self.caster is None else self.caster()
        more = {**self._interval, **self._view}
        return surface.Depth(**at, **more, model=self.model, textures=self.textures, caster=caster)

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

    def _ao(self, at: Texels) -> Estimated | None:
        """Occlusion of one radius by its estimator, in the places of depth; None where it needs what is not there."""
        parameters, inputs, name = self.case.parameters, self.inputs, self.case.parameters["estimator"]
        if "depth" not in inputs or name not in ESTIMATORS or ("positions" not in inputs and self._back is None):
            return None
        if described_neighbours(parameters, inputs) is None:
            return None
        guard, radius = (len(inputs["depth"]) - len(self.mine)) // 2, self.layers[self.name]
        at = {**at, **self._view, "columns": at["columns"] + guard, "rows": at["rows"] + guard}
        at |= {"rotation": parameters.get("rotation", "none"), "sampling": self.sampling, "radius": radius}
        at |= {"seed": int(parameters.get("rotation_seed", 0)), "textures": self.textures, "places": self.places}
        estimator, options = find_estimator(name), described_options(parameters, radius)
        if estimator.reads_normals(options) and "normals" not in inputs:
            return None
        kind: type[Estimated] = Estimated
        more: Texels = {"points": inputs.get("points"), "weights": inputs.get("weights")}
        if name == "lf":
            estimator, more["points"] = find_estimator("point"), np.asarray(inputs["samples"], np.float64)
            options, more["unprojected"] = estimator.parameters, self._back is not None
        if estimator.reads_texels:
            kind, more["longer"], more["look_ups"] = Formulated, self._longer, estimator.options(**options)
        if name in ("lf", "point", "hemisphere"):
            kind = Counted
        made = kind(
            **at,
            **more,
            estimator=estimator,
            buffers=self._buffers,
            options=options,
            bounded=self.judged.bounds is not None,
            asked=tuple(each["name"] for each in parameters.get("neighbours", ())),
            cost=1,  # a run of a whole texture makes all texels
        )
        return made.changed(cost=made.samples * (4 if made.counts else 1)) if isinstance(made, Formulated) else made

    def _merged(self, at: Texels) -> post.Merge | None:
        if not set(self.layers) <= set(self.inputs):
            return None
        layers = [_taken(self.inputs[name], at["columns"], at["rows"]) for name in self.layers]
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
            image=_taken(self.cropped(image), i, j),
            occlusion=_taken(blurred, i, j),
            merged=None if merged is None else _taken(merged, i, j),
        )


def _taken(texture: NDArray[Any], columns: Places, rows: Places) -> FloatArray:
    return np.asarray(texture[rows, columns], np.float64)
