"""The stages of cases: the outputs of each from its inputs, by the program's own functions, and their bounds."""

from collections.abc import Callable

import numpy as np

from lfssao.ao import post, ssao
from lfssao.ao.estimators.registry import estimate
from lfssao.ao.kernels import post as post_kernels
from lfssao.ao.kernels import ssao as ssao_kernels
from lfssao.ao.ssao import Occlusion
from lfssao.ao.textures import Buffers
from lfssao.core import elementary, philox
from lfssao.optics.display import Display, Module
from lfssao.optics.kernels import display as display_kernels
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.view import without_guard
from lfssao.samples import best_turns, make_samples, square_points, texel_angles, texel_turns
from lfssao.samples.rotation import half_turns
from lfssao.verify.bounds.bounds import Bounds, exact_bounds
from lfssao.verify.bounds.error_model import KIT_MODEL, MODELS
from lfssao.verify.bounds.post import blur_bounds, shade_bounds
from lfssao.verify.bounds.view import ViewBounds, occlusion_bounds
from lfssao.verify.case import Array, Arrays, Parameters, described_mapping, described_view

Outputs = dict[str, Array]
Run = Callable[[Parameters, Arrays], Outputs]


_FUNCTIONS: dict[str, Callable[..., float | tuple[float, float]]] = {
    **{name: getattr(elementary, name) for name in ("sincospi", "acos", "cbrt", "exp", "log", "log2")},
    "reduced": lambda h: float(half_turns(np.array([h]).astype(np.int32))[0]),
    "turns": best_turns,
}


def _elementary(parameters: Parameters, inputs: Arrays) -> Outputs:
    return {"y": np.array([_FUNCTIONS[parameters["function"]](x) for x in inputs["x"]], np.float64)}


def _philox(parameters: Parameters, inputs: Arrays) -> Outputs:
    pairs = zip(inputs["counters"], inputs["keys"], strict=True)
    return {"words": np.array([philox.philox4x32(*counter, *key) for counter, key in pairs], np.uint32)}


def _samples(parameters: Parameters, inputs: Arrays) -> Outputs:
    method = parameters["method"]
    n = parameters["n"]
    seed = int(parameters["seed"])
    return {
        "samples": make_samples(method, n, seed, parameters["r_min"], parameters["r_max"]),
        "square": square_points(method, n, seed),
    }


def _turns(parameters: Parameters, inputs: Arrays) -> Outputs:
    how = parameters["rotation"], parameters["height"], parameters["width"], int(parameters["seed"])
    return {"turns": texel_turns(*how, np.dtype(np.float32)), "angles": texel_angles(*how)}


def _numbers(parameters: Parameters, inputs: Arrays) -> Outputs:
    values = parameters["display"]
    modules = [{**m, "homography": m["homography"] and tuple(m["homography"])} for m in values["modules"]]
    display = Display(**{**values, "modules": tuple(Module(**m) for m in modules)})
    view = display.view(parameters["module"], np.array(parameters["physical_from_world"]), parameters["guard"])
    return {"numbers": view.world_to_image.numbers}


def _offsets(parameters: Parameters, inputs: Arrays) -> Outputs:
    return {"offsets": (parameters["radius"] * inputs["samples"]).astype(np.float32)}


def _map_points(parameters: Parameters, inputs: Arrays) -> Outputs:
    to_image = described_mapping(parameters)
    projection = to_image.as_type(np.float32)
    image = np.zeros(inputs["points"].shape, np.float32)
    statuses = np.zeros(len(inputs["points"]), np.int32)
    # A kernel returns a Python float, and the next one would compute in float64: rows are made of whole columns here.
    rows = range(4 if to_image.kind == mapping.MATRIX else 3)
    sums = [mapping.affine_row(projection.numbers, row, *inputs["points"].T) for row in rows]
    if "offsets" in inputs:
        turns = inputs.get("turns")
        every = slice(None)
        table = ssao_kernels.transform_offsets(inputs["offsets"], projection, turns)
        parts = [ssao_kernels.offset_row(table, every, row, turns, turns, every) for row in rows]
        sums = [a + b for a, b in zip(sums, parts, strict=True)]
    for k, (*physical, q) in enumerate(zip(*sums, *[sums[0]] * (4 - len(rows)), strict=True)):
        u, v, depth, valid = mapping.project(projection, *physical, q)
        if valid:
            image[k] = u, v, depth
        elif to_image.kind == mapping.DISPLAY:
            d = display_kernels.display_module(projection.numbers[12:])
            statuses[k] = display_kernels.physical_to_image(d, *physical)[2]
        else:
            statuses[k] = 1
    return {"image": image, "answers": statuses}


def _occlusion(occlusion: Occlusion) -> Outputs:
    return {"occlusion": occlusion.texture, "outside": np.array([occlusion.outside])}


def _algorithm1(parameters: Parameters, inputs: Arrays) -> Outputs:
    back, forth = (np.array(parameters[name]) for name in ("screen_to_world", "world_to_screen"))
    given = inputs["depth"], back, forth, inputs["samples"], parameters["radius"]
    made = ssao.algorithm1(*given, inputs.get("turns"))
    return {**_occlusion(made), **_offsets(parameters, inputs)}


def _algorithm2(parameters: Parameters, inputs: Arrays) -> Outputs:
    given = inputs["depth"], inputs["positions"], described_mapping(parameters), inputs["samples"]
    made = ssao.algorithm2(*given, parameters["radius"], inputs.get("turns"))
    return {**_occlusion(made), **_offsets(parameters, inputs)}


def _blur(parameters: Parameters, inputs: Arrays) -> Outputs:
    weights = post.blur_weights(parameters["sigma"])
    half = np.empty_like(inputs["source"])
    post_kernels.blur_horizontal(inputs["source"], weights, half)
    blurred = post.blur(inputs["source"], parameters["sigma"])
    gaussian = post.gaussian_kernel(parameters["sigma"])
    return {"blurred": blurred, "weights_float64": gaussian, "weights": weights, "horizontal": half}


def _shaded(inputs: Arrays) -> tuple[Array, Array, Array]:
    return inputs["image"], inputs["occlusion"], inputs["normals"]


def _frame(parameters: Parameters, inputs: Arrays) -> Outputs:
    """From the G-buffer to the shaded picture: every stage on what the one before it made."""
    layers = [_algorithm2({**parameters, "radius": r}, inputs)["occlusion"] for r in parameters["radii"]]
    merged = post.merge(layers)
    blurred = post.blur(merged, parameters["sigma"])
    guard = parameters["guard"]
    made = {f"ao_{k + 1}": without_guard(layer, guard) for k, layer in enumerate(layers)}
    made |= {"merged": without_guard(merged, guard), "blurred": without_guard(blurred, guard)}
    return {"shaded": post.shade(without_guard(inputs["image"], guard), made["blurred"]), **made}


def _estimator(parameters: Parameters, inputs: Arrays) -> Outputs:
    more = inputs.get("normals"), inputs.get("turns")
    buffers = Buffers(described_view(parameters), inputs["depth"], inputs["positions"], *more)
    chosen = parameters["estimator"], buffers, parameters["radius"], inputs.get("points"), inputs.get("weights")
    return _occlusion(estimate(*chosen, **parameters["options"]))


# The outputs of a stage by name, the one that counts first, from parameters and inputs.
STAGES: dict[str, Run] = {
    "elementary": _elementary,
    "philox": _philox,
    "samples": _samples,
    "turns": _turns,
    "numbers": _numbers,
    "mapping": _map_points,
    "algorithm1": _algorithm1,
    "algorithm2": _algorithm2,
    "merge": lambda parameters, inputs: {"merged": post.merge(inputs["layers"])},
    "blur": _blur,
    "shade": lambda parameters, inputs: {"shaded": post.shade(inputs["image"], inputs["occlusion"])},
    "light": lambda parameters, inputs: {"shaded": post.shade(*_shaded(inputs), post.Light(**parameters))},
    "frame": _frame,
    "estimator": _estimator,
}


def stage_bounds(stage: str, parameters: Parameters, inputs: Arrays) -> dict[str, Bounds]:
    """Bounds of a stage's outputs by name, for a renderer within the error model of shading languages.

    Stages without bounds round nothing, or are float64 or integers, which every language has: equal bits are asked.
    Stage, parameters and inputs are those of a ``Case``.
    """
    model = MODELS[KIT_MODEL]
    if stage in ("algorithm1", "algorithm2", "estimator"):
        found = occlusion_bounds(parameters, inputs, parameters["radius"], model)
        return {} if found is None else {"occlusion": found}
    if stage == "blur":
        return {"blurred": blur_bounds(exact_bounds(inputs["source"]), parameters["sigma"], model)}
    if stage == "shade":
        return {"shaded": shade_bounds(inputs["image"], exact_bounds(inputs["occlusion"]), model)}
    if stage == "light":
        image, ao, normals = map(exact_bounds, _shaded(inputs))
        return {"shaded": shade_bounds(image, ao, model, normals, post.Light(**parameters))}
    if stage != "frame":
        return {}
    names = "shaded", "merged", "blurred", *(f"ao_{k + 1}" for k in range(len(parameters["radii"])))
    view = ViewBounds(parameters, inputs, model)
    return {name: bounds for name in names if isinstance(bounds := view.find(name), Bounds)}
