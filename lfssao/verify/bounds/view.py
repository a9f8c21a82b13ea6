"""Bounds of the textures of a view, each computed from the renderer's own textures of earlier passes.

Bounds of depth and colour come from the mesh. Without a mesh they are estimated from the reference's textures, and
``depth.outlier_limit`` texels may be outside. The next pass may read a texture from before or after it is ``stored`` in
a format. The blur with a guard band reads texels outside the merged texture. Their bounds are computed from depth on,
or are 0 to 1 where the renderer's merged texture is wrong.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from lfssao.verify.bounds.bounds import Bounds, Texture, exact_bounds
from lfssao.verify.bounds.depth import PositionBounds, texture_color_bounds, texture_depth_bounds
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.post import blur_bounds, merge_bounds, shade_bounds
from lfssao.verify.bounds.problem import Problem
from lfssao.verify.bounds.registry import has_bounds
from lfssao.verify.bounds.ssao import ao_bounds, image_depth
from lfssao.verify.bounds.stored import TextureFormat
from lfssao.verify.case import (
    Arrays,
    Parameters,
    described_buffers,
    described_mapping,
    described_neighbours,
    described_options,
    described_turns,
    described_view,
)


def occlusion_bounds(parameters: Parameters, inputs: Arrays, radius: float, model: ErrorModel) -> Bounds | None:
    """Bounds of the occlusion of radius R, guard band included; None where none are known."""
    mapping = described_mapping(parameters)
    name = parameters.get("estimator", "lf")
    depth = inputs.get("depth")
    positions = inputs.get("positions")
    inverse = parameters.get("screen_to_world")
    if depth is None or (positions is None and inverse is None):
        return None
    if name == "lf":
        turns = described_turns(parameters, inputs)
        depth_error = 0.0
        inverse = None if inverse is None else np.array(inverse)
        if "view" in parameters:
            depth, depth_error = image_depth(described_view(parameters), depth, model)
        return ao_bounds(depth, positions, mapping, inputs["samples"], radius, model, inverse, turns, depth_error)
    unknown = positions is None or described_neighbours(parameters, inputs) is None
    if unknown or not has_bounds(name) or model.exact:
        return None
    from lfssao.verify.bounds.points import point_bounds  # late: ``lf`` has bounds of its own

    problem = described_problem(parameters, inputs, radius, model)
    return point_bounds(name, problem.buffers, radius, inputs.get("points"), problem.weights, problem.options, model)


def bent_normal_bounds(parameters: Parameters, inputs: Arrays, radius: float, model: ErrorModel) -> Bounds | None:
    """Bounds of bent normals, (H, W, 3), with the arguments of ``occlusion_bounds``."""
    if model.exact or not {"depth", "positions"} <= set(inputs):
        return None
    from lfssao.verify.bounds.bent import bent_bounds  # late: few ask for them

    return bent_bounds(described_problem(parameters, inputs, radius, model), radius, parameters["estimator"])


def described_problem(parameters: Parameters, inputs: Arrays, radius: float, model: ErrorModel) -> Problem:
    """The arguments of an estimator's bounds, from a view's parameters and inputs; the estimator is not ``lf``."""
    seen = described_buffers(parameters, inputs)
    options = described_options(parameters, radius)
    points = inputs.get("points")
    weights = inputs.get("weights")
    return Problem(seen, np.asarray([] if points is None else points, np.float64), weights, options, model)


class ViewBounds:
    """Bounds of the textures of a view, computed when they are first needed.

    Parameters hold ``radii``, ``sigma``, ``guard``, ``mapping`` and the arguments of the estimator. Inputs are depth,
    positions, normals, samples and the image that AO is multiplied into, the guard band included. Later passes read
    ``rendered``, a renderer's textures, or ``reference``, the reference's, where no bounds are known. ``mesh_bounds``
    are bounds of depth and colour from the mesh, ``formats`` the formats of stored textures.
    """

    def __init__(
        self,
        parameters: Parameters,
        inputs: Arrays,
        model: ErrorModel,
        rendered: Arrays | None = None,
        reference: Arrays | None = None,
        mesh_bounds: Mapping[str, Bounds] | None = None,
        formats: Mapping[str, TextureFormat] | None = None,
    ) -> None:
        self._parameters = parameters
        self._inputs = inputs
        self._model = model
        self._rendered = rendered or {}
        self._reference = reference or {}
        self._formats = formats or {}
        self._mesh_bounds = {} if mesh_bounds is None else mesh_bounds  # its length would cast all rays
        self._guard = int(parameters["guard"])
        radii = dict(enumerate(parameters["radii"], start=1))
        self._radii = {f"ao_{k}": radius for k, radius in radii.items()}
        self._bent = {f"bent_{k}": radius for k, radius in radii.items()}
        # Bounds of the occlusion of one radius, by the layer's name, guard band included.
        self._layer_bounds = cache(lambda name: occlusion_bounds(parameters, inputs, self._radii[name], model))

    def find(self, name: str) -> Bounds | PositionBounds | None:
        """Bounds of a texture; None if only equal values are right. InputError if parameters do not match textures."""
        if name == "depth":
            return self._mesh_bounds.get(name) or texture_depth_bounds(self._reference[name], self._model)
        if name == "color":
            depth = self._reference.get("depth")
            return self._mesh_bounds.get(name) or texture_color_bounds(self._reference[name], depth, self._model)
        if name != "positions":
            return self._stage(name)
        if self._model.exact:
            return exact_bounds(self._reference[name])
        depth = self._inputs.get("depth")
        if depth is None:
            return None
        depth_error = self._formats["depth"].half_steps(depth) if "depth" in self._formats else 0.0
        image = described_view(self._parameters).image_z(depth)
        depth_error = depth_error + self._parameters.get("distance_off", 0.0)
        if image is not depth:
            depth_error = depth_error * image.astype(np.float64) ** 2  # as -1 / depth changes
        return PositionBounds(described_mapping(self._parameters), image, self._model, depth_error=depth_error)

    def _stage(self, name: str) -> Bounds | None:
        """Bounds of a texture of the passes after the G-buffer."""
        if name in self._radii:
            layer = self._layer_bounds(name)
            return None if layer is None else layer.crop(self._guard)
        if name in self._bent:
            bent = bent_normal_bounds(self._parameters, self._inputs, self._bent[name], self._model)
            return None if bent is None else bent.crop(self._guard)
        if name == "merged":
            return _merged([self._input_bounds(layer) for layer in self._radii])
        if name == "blurred":
            return self._blurred()
        return self._shaded() if name == "shaded" else None

    def _shaded(self) -> Bounds | None:
        """Bounds of the shading of the image, by occlusion alone or by a light."""
        blurred = self._input_bounds("blurred")
        image = self._inputs.get("image")
        light = self._parameters.get("light")
        normals = None if light is None else self._normals()
        if blurred is None or image is None or (light is not None and normals is None):
            return None
        image_bounds = exact_bounds(image)
        color = self.find("color") if "color" in self._formats else None
        if isinstance(color, Bounds):
            image_bounds = self._formats["color"].before_or_after(color, self._model, image)
        return shade_bounds(image_bounds.crop(self._guard), blurred, self._model, normals, light)

    def _normals(self) -> Bounds | None:
        """Bounds of the normals that shading reads: the renderer's own, before or after they are stored."""
        normals = self._inputs.get("normals")
        if normals is None:
            return None
        bounds = exact_bounds(normals)
        if "normals" in self._formats:
            any_number = np.full_like(normals, np.inf)
            bounds = self._formats["normals"].before_or_after(Bounds(-any_number, any_number), self._model, normals)
        return bounds.crop(self._guard)

    def _blurred(self) -> Bounds | None:
        """Bounds of the blur of the merged texture, or with a guard band of the layers that include it."""
        sigma = self._parameters["sigma"]
        if self._guard == 0:
            merged = self._input_bounds("merged")
            return None if merged is None else blur_bounds(merged, sigma, self._model)
        layers = [self._stored_bounds(layer, self._layer_bounds(layer)) for layer in self._radii]
        whole = self._stored_bounds("merged", _merged(layers))
        if whole is None:
            return exact_bounds(self._reference["blurred"]) if "blurred" in self._reference else None
        rendered = self._rendered.get("merged")
        if rendered is not None and "merged" not in self._formats:
            whole = self._with_guard_band(rendered, whole)
        return blur_bounds(whole, sigma, self._model).crop(self._guard)

    def _with_guard_band(self, rendered: Texture, whole: Bounds) -> Bounds:
        """The renderer's merged texture with the bounds of the guard band around it."""
        inside = (slice(self._guard, -self._guard),) * 2
        wrong = whole.crop(self._guard).outside(rendered).any()
        lower = np.array(whole.lower)
        upper = np.array(whole.upper)
        if wrong:
            lower[:] = 0
            upper[:] = 1
        lower[inside] = upper[inside] = rendered
        return replace(whole, lower=lower, upper=upper)

    def _input_bounds(self, name: str) -> Bounds | None:
        """Bounds of the input of the next pass: the renderer's own texture, or its bounds if it has none."""
        rendered = self._rendered.get(name)
        if rendered is not None and name not in self._formats:
            return exact_bounds(rendered)
        bounds = self._stage(name)
        bounds = exact_bounds(self._reference[name]) if bounds is None and name in self._reference else bounds
        return self._stored_bounds(name, bounds, rendered)

    def _stored_bounds(self, name: str, bounds: Bounds | None, rendered: Texture | None = None) -> Bounds | None:
        """Bounds of a texture before or after it is stored; ``rendered`` is the renderer's own, if there is one."""
        if bounds is None or name not in self._formats:
            return bounds
        return self._formats[name].before_or_after(bounds, self._model, rendered)


def _merged(layers: list[Bounds | None]) -> Bounds | None:
    """Bounds of the maximum of layers; None if one layer's bounds are not known."""
    bounds = [layer for layer in layers if layer is not None]
    return merge_bounds(bounds) if len(bounds) == len(layers) else None
