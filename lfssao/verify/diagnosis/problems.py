"""The problems of a wrong texture: some of its texels, and the inputs of each stage's changes."""

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
from lfssao.verify.diagnosis.formulated import Formulated, with_extra_texels
from lfssao.verify.diagnosis.occlusion import Counted
from lfssao.verify.diagnosis.search import distance_outside
from lfssao.verify.diagnosis.views import Sight, sight_of
from lfssao.verify.verdict import Judgement, Verdict

Fields = dict[str, Any]  # arguments of problems, by the names of their fields


@dataclass(frozen=True, eq=False)
class Texture:
    """A wrong texture of a view, and the data in which its cause is searched."""

    name: str
    mine: NDArray[Any]  # the texture, (H, W) or (H, W, 3)
    inputs: Arrays  # of the stages, the renderer's own where it has them
    case: Case
    judged: Judgement
    model: ErrorModel  # not an exact one
    stored: TextureFormat | None = None  # the texture's format
    display: tuple[Display | Quilt, int] | None = None  # the display or quilt, and the module's or view's number
    others: Mapping[str, Sight] = field(default_factory=dict)  # other modules, by name
    # Textures of a layer of other modules, by the module, of the size of this module's
    textures: Callable[[str], Mapping[str, NDArray[Any]]] = field(default_factory=lambda: no_textures)
    # This view's column and row in one texture of all views, by the layout of that texture
    places: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    caster: Callable[[], RayCaster | None] | None = None  # of the mesh, if it is available
    sampling: Mapping[str, Any] = field(default_factory=dict)  # method and seed of the samples
    channel: str = ""  # the renderer's own name of the texture

    def cropped(self, texture: NDArray[Any]) -> NDArray[Any]:
        """The texture without its guard band, in the size of this texture."""
        return without_guard(texture, (len(texture) - len(self.mine)) // 2)

    @property
    def layers(self) -> dict[str, float]:
        """Names of the layers of occlusion, each with its radius."""
        return {f"ao_{k}": radius for k, radius in enumerate(self.case.parameters["radii"], start=1)}

    @cached_property
    def _interval(self) -> Fields | None:
        """The reference's interval of depth or colour, and its second differences."""
        # Bounds from the mesh are those before storing.
        bounds = (self.stored and self.case.bounds.get(self.name)) or self.judged.bounds
        if bounds is None:
            return None
        lower = bounds.lower.astype(np.float64)
        upper = bounds.upper.astype(np.float64)
        return {"lower": lower, "upper": upper, "second_differences": surface.second_differences(lower)}

    @cached_property
    def _inverse(self) -> Matrix | None:
        """The matrix with which Algorithm 1 reconstructs points from depth; None if points come from a texture."""
        lf = self.case.parameters["estimator"] == "lf"
        return described_view(self.case.parameters).screen_to_world if lf else None

    @cached_property
    def _buffers(self) -> Buffers:
        """The textures that estimators read."""
        inputs = self.inputs
        if self._inverse is not None:
            view = described_view(self.case.parameters)
            positions = unprojected(view.image_z(inputs["depth"]), self._inverse)
            inputs = {**inputs, "positions": np.where(np.isnan(positions), np.inf, positions)}
        return described_buffers(self.case.parameters, inputs)

    @cached_property
    def _extended_textures(self) -> dict[int, Any]:
        """Textures with two extra texels at their end, by the identity of the original (``Formulated``)."""
        buffers = self._buffers
        textures = [t for t in (buffers.depth, buffers.positions, buffers.normals) if t is not None]
        return {id(t): with_extra_texels(t, t.size // buffers.depth.size) for t in textures}

    @cached_property
    def _view(self) -> Fields:
        """The reference's sight, the centre of its region of interest, and other modules' sights."""
        display, index = self.display or (None, None)
        sight = sight_of(described_view(self.case.parameters), display, index)
        centre = None if sight.display is None or display is None else np.mean(np.array(display.roi), axis=0)
        return {"sight": sight, "centre": centre, "others": self.others}

    def problem(self, places: Places) -> Problem | None:
        """The problem of some texels, by their indices; None if one of its textures is not known."""
        rows, columns = np.divmod(places, self.mine.shape[1])
        return self._problem_at(_values_at(self.mine, columns, rows), columns, rows)

    def _problem_at(self, values: FloatArray, columns: Places, rows: Places) -> Problem | None:
        """The problem of values at some columns and rows."""
        problems_of_layers: dict[str, Callable[[Fields], Problem | None]] = {
            "depth": self._image,
            "positions": self._positions,
            "color": self._image,
            **dict.fromkeys(self.layers, self._ao),
            "merged": self._merged,
            "blurred": self._blurred,
            "shaded": self._shaded,
        }
        if self.name not in problems_of_layers:
            return None
        bounds = self.judged.bounds
        height, width = self.mine.shape[:2]
        interval_width = np.zeros_like(values)
        if bounds is not None:
            interval_width = _values_at(bounds.upper, columns, rows) - _values_at(bounds.lower, columns, rows)

        def flipped(across: bool, down: bool) -> Problem | None:
            places = width - 1 - columns if across else columns, height - 1 - rows if down else rows
            return self._problem_at(values, *places)

        excess = np.zeros_like(values)
        if bounds is not None:
            excess = distance_outside(
                values, _values_at(bounds.lower, columns, rows), _values_at(bounds.upper, columns, rows)
            )
        elif self.judged.verdict is Verdict.DIFFERENT:
            excess = np.abs(values - _values_at(self.case.outputs[self.name], columns, rows))

        def other_views() -> dict[str, FloatArray]:
            others = self.textures(self.name) if self.name != "shaded" else {}
            return {view: _values_at(texture, columns, rows) for view, texture in others.items()}

        fields: Fields = {
            "excess": excess,
            "mine": values,
            "columns": columns,
            "rows": rows,
            "interval_width": interval_width,
            "flipped": flipped,
        }
        fields["other_views"] = other_views
        if self.stored is not None:
            fields["store"] = partial(self.stored.ends, model=self.model)
            fields["floored"] = (
                partial(self.stored.ends, model=self.model, floor=True) if self.stored.has_codes else None
            )
        return problems_of_layers[self.name](fields)

    def _image(self, fields: Fields) -> surface.Image | None:
        if self._interval is None:
            return None
        if self.name == "color":
            return surface.Color(**fields, **self._interval)
        caster = None if self.caster is None else self.caster()
        arguments = {**self._interval, **self._view}
        return surface.Depth(**fields, **arguments, model=self.model, textures=self.textures, caster=caster)

    def _positions(self, fields: Fields) -> surface.Positions | None:
        depth = self.inputs.get("depth")
        parameters = self.case.parameters
        if depth is None:
            return None
        return surface.Positions(
            **fields,
            **self._view,
            depth=_values_at(described_view(parameters).image_z(depth), fields["columns"], fields["rows"]),
            model=self.model,
            cast_from_world=parameters["view"]["cast_from_world"],
            size=depth.shape[::-1],
        )

    def _ao(self, fields: Fields) -> Estimated | None:
        """Occlusion of one radius by its estimator, at texels of depth; None if one of its inputs is missing."""
        parameters = self.case.parameters
        inputs = self.inputs
        name = self.case.parameters["estimator"]
        if "depth" not in inputs or name not in ESTIMATORS or ("positions" not in inputs and self._inverse is None):
            return None
        if described_neighbours(parameters, inputs) is None:
            return None
        guard = (len(inputs["depth"]) - len(self.mine)) // 2
        radius = self.layers[self.name]
        fields = {**fields, **self._view, "columns": fields["columns"] + guard, "rows": fields["rows"] + guard}
        fields |= {"rotation": parameters.get("rotation", "none"), "sampling": self.sampling, "radius": radius}
        fields |= {"seed": int(parameters.get("rotation_seed", 0)), "textures": self.textures, "places": self.places}
        estimator = find_estimator(name)
        options = described_options(parameters, radius)
        if estimator.reads_normals(options) and "normals" not in inputs:
            return None
        kind: type[Estimated] = Estimated
        arguments: Fields = {"points": inputs.get("points"), "weights": inputs.get("weights")}
        if name == "lf":
            estimator = find_estimator("point")
            arguments["points"] = np.asarray(inputs["samples"], np.float64)
            options = estimator.parameters
            arguments["unprojected"] = self._inverse is not None
        if estimator.reads_texels:
            kind = Formulated
            arguments["padded_textures"] = self._extended_textures
            arguments["look_ups"] = estimator.options(**options)
        if name in ("lf", "point", "hemisphere"):
            kind = Counted
        problem = kind(
            **fields,
            **arguments,
            estimator=estimator,
            buffers=self._buffers,
            options=options,
            has_interval=self.judged.bounds is not None,
            neighbour_names=tuple(each["name"] for each in parameters.get("neighbours", ())),
            cost=1,  # a run computes all texels
        )
        if isinstance(problem, Formulated):
            return problem.changed(cost=problem.samples * (4 if problem.counts else 1))
        return problem

    def _merged(self, fields: Fields) -> post.Merge | None:
        if not set(self.layers) <= set(self.inputs):
            return None
        layers = [_values_at(self.inputs[name], fields["columns"], fields["rows"]) for name in self.layers]
        return post.Merge(**fields, layers=np.stack(layers), cost=8 * len(layers))

    def _blurred(self, fields: Fields) -> post.Blur | None:
        sigma = float(self.case.parameters["sigma"])
        merged = self.inputs.get("merged")
        if merged is None or sigma == 0:
            return None
        return post.Blur(**fields, merged=merged, sigma=sigma, cost=int(2 * np.ceil(4 * sigma) + 1) ** 2)

    def _shaded(self, fields: Fields) -> post.Shade | None:
        image, blurred, merged = (self.inputs.get(name) for name in ("image", "blurred", "merged"))
        if image is None or blurred is None:
            return None
        light = self.case.parameters.get("light")
        normals = None if light is None else self.inputs.get("normals")
        if light is not None and normals is None:
            return None
        i = fields["columns"]
        j = fields["rows"]
        return post.Shade(
            **fields,
            image=_values_at(self.cropped(image), i, j),
            occlusion=_values_at(blurred, i, j),
            merged=None if merged is None else _values_at(merged, i, j),
            light=light,
            normals=None if normals is None else _values_at(self.cropped(normals), i, j),
        )


def _values_at(texture: NDArray[Any], columns: Places, rows: Places) -> FloatArray:
    return np.asarray(texture[rows, columns], np.float64)
