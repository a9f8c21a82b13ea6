"""Bounds of the outputs of cases: what a renderer within the error model of shading languages may make of them."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from lfssao.kernels.mapping import MATRIX
from lfssao.kit.case import Arrays, Bounds
from lfssao.kit.stages import described_mapping
from lfssao.oracle import bounds
from lfssao.oracle.points import point_bounds
from lfssao.oracle.texels import Surfaces
from lfssao.view import WorldToImage

MODEL = "shader"  # of lfssao.oracle.error_model

Parameters = Mapping[str, Any]


def _algorithm1(parameters: Parameters, inputs: Arrays) -> dict[str, bounds.Bounds]:
    back, forth = (np.array(parameters[name]) for name in ("screen_to_world", "world_to_screen"))
    to_image = WorldToImage(MATRIX, forth.ravel())
    given = inputs["depth"], None, to_image, inputs["samples"], parameters["radius"]
    return {"occlusion": bounds.ao_bounds(*given, MODEL, back)}


def _algorithm2(parameters: Parameters, inputs: Arrays) -> dict[str, bounds.Bounds]:
    given = inputs["depth"], inputs["positions"], described_mapping(parameters), inputs["samples"], parameters["radius"]
    return {"occlusion": bounds.ao_bounds(*given, MODEL)}


def _blur(parameters: Parameters, inputs: Arrays) -> dict[str, bounds.Bounds]:
    return {"blurred": bounds.blur_bounds(bounds.exactly(inputs["source"]), parameters["sigma"], MODEL)}


def _shade(parameters: Parameters, inputs: Arrays) -> dict[str, bounds.Bounds]:
    return {"shaded": bounds.shade_bounds(inputs["image"], bounds.exactly(inputs["occlusion"]), MODEL)}


def _frame(parameters: Parameters, inputs: Arrays) -> dict[str, bounds.Bounds]:
    layers = [_algorithm2({**parameters, "radius": r}, inputs)["occlusion"] for r in parameters["radii"]]
    merged = bounds.merge_bounds(layers)
    blurred = bounds.blur_bounds(merged, parameters["sigma"], MODEL)
    g = parameters["guard"]
    inner = slice(g, merged.lower.shape[0] - g), slice(g, merged.lower.shape[1] - g)
    cropped = {"merged": merged.crop(g), "blurred": blurred.crop(g)}
    cropped |= {f"ao_{k + 1}": layer.crop(g) for k, layer in enumerate(layers)}
    return {"shaded": bounds.shade_bounds(inputs["image"][inner], cropped["blurred"], MODEL), **cropped}


def _estimator(parameters: Parameters, inputs: Arrays) -> dict[str, bounds.Bounds]:
    axes = np.array(parameters["view"]["cast_from_world"])
    given = Surfaces(
        inputs["depth"], inputs["positions"], described_mapping(parameters), axes, inputs.get("normals"),
        inputs["directions"],
    )  # fmt: skip
    points, weights = inputs.get("points", np.empty((0, 3))), inputs.get("weights")
    name, radius, options = parameters["estimator"], parameters["radius"], parameters["options"]
    found = point_bounds(name, given, radius, points, weights, options, MODEL)
    return {} if found is None else {"occlusion": found}


# A stage that is not listed rounds nothing, or is float64 or integers, which every language has: equal bits are asked.
_BOUNDS: dict[str, Callable[[Parameters, Arrays], dict[str, bounds.Bounds]]] = {
    "algorithm1": _algorithm1,
    "algorithm2": _algorithm2,
    "blur": _blur,
    "shade": _shade,
    "frame": _frame,
    "estimator": _estimator,
}


def case_bounds(stage: str, parameters: Parameters, inputs: Arrays) -> Bounds:
    """Lower and upper bound of the outputs of a case, by their names; empty where the stage has none.

    Parameters
    ----------
    stage, parameters, inputs
        As of ``Case``.
    """
    if stage not in _BOUNDS:
        return {}
    made = _BOUNDS[stage](parameters, inputs)
    return {name: (np.ascontiguousarray(b.lower), np.ascontiguousarray(b.upper)) for name, b in made.items()}
