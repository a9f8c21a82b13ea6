"""The stages of the conformance kit by its specification: cases are read, solved and compared."""

import json
from functools import partial

import numpy as np

from reference import dither, elementary, mapping, passes, points, samples, scalable, slices, spiral, volumetric
from reference.elementary import sincospi
from reference.mapping import offsets, rounded
from reference.multiresolution import multiresolution
from reference.philox import philox4x32


def read_case(folder):
    """Parameters, inputs and outputs of a case; the headers of the .npy files are skipped."""
    case = json.loads((folder / "case.json").read_text())
    assert case["format"] == 3

    def array(entry):
        data = (folder / entry["file"]).read_bytes()[128:]
        return np.frombuffer(data, np.dtype(entry["dtype"]).newbyteorder("<")).reshape(entry["shape"])

    inputs, outputs = ({k: array(entry) for k, entry in case[group].items()} for group in ("inputs", "outputs"))
    return case["stage"], case["parameters"], inputs, outputs


def elementary_stage(parameters, inputs):
    tables = {"reduced": lambda h: spiral.half_turns(spiral.wrapped(h)), "turns": lambda s: float(spiral.turns_of(s))}
    function = tables.get(parameters["function"]) or getattr(elementary, parameters["function"])
    return {"y": np.array([function(x) for x in inputs["x"].tolist()])}


def philox_stage(parameters, inputs):
    pairs = zip(inputs["counters"].tolist(), inputs["keys"].tolist(), strict=True)
    return {"words": np.array([philox4x32(counter, key) for counter, key in pairs], np.uint32)}


def samples_stage(parameters, inputs):
    chosen = parameters["method"], parameters["n"], int(parameters["seed"])
    table = samples.samples(*chosen, parameters["r_min"], parameters["r_max"])
    return {"samples": table, "square": np.array(samples.square(*chosen))}


def turns_stage(parameters, inputs):
    angles = dither.angles(parameters["rotation"], parameters["height"], parameters["width"], int(parameters["seed"]))
    pairs = [sincospi(angle)[::-1] for angle in np.ravel(angles).tolist()]
    return {"turns": np.array(pairs).T.reshape(2, *np.shape(angles)).astype(np.float32), "angles": np.array(angles)}


def numbers_stage(parameters, inputs):
    described = (parameters[key] for key in ("display", "module", "guard", "physical_from_world"))
    return {"numbers": np.array(mapping.numbers(*described))}


def mapping_of(parameters):
    return parameters["mapping"]["kind"], rounded(parameters["mapping"]["numbers"])


def mapping_stage(parameters, inputs):
    kind, m = mapping_of(parameters)
    nothing = [None] * len(inputs["points"])
    offsets, turns = inputs.get("offsets", nothing), np.transpose(inputs["turns"]) if "turns" in inputs else nothing
    images = []
    for point, offset, turn in zip(inputs["points"], offsets, turns, strict=True):
        sums = mapping.affine_rows(kind, m, point)
        if offset is not None:
            sums = [a + b for a, b in zip(sums, mapping.linear_rows(kind, m, offset, turn), strict=True)]
        images.append(mapping.to_image(kind, m, sums))
    statuses = [status for *_, status in images]
    places = [place if status == 0 else [0, 0, 0] for *place, status in images]
    return {"image": np.array(places, np.float32), "answers": np.array(statuses, np.int32)}


def occlusion_stage(parameters, inputs):
    table, turns = offsets(parameters["radius"], inputs["samples"]), inputs.get("turns")
    if "world_to_screen" in parameters:
        matrices = (rounded(parameters[name]) for name in ("screen_to_world", "world_to_screen"))
        occlusion, statuses = passes.algorithm1(inputs["depth"], table, *matrices, turns)
    else:
        textures = inputs["depth"], inputs["positions"]
        occlusion, statuses = passes.algorithm2(*textures, table, *mapping_of(parameters), turns)
    counts = statuses.sum(axis=0)
    outside = np.array([counts[1:].sum()])
    return {"occlusion": occlusion, "outside": outside, "offsets": np.array(table), "statuses": counts.tolist()}


def blur_stage(parameters, inputs):
    exact, weights = (make(parameters["sigma"]) for make in (passes.blur_weights, passes.blur_table))
    half = passes.blur_rows(inputs["source"], weights)
    whole = passes.blur_columns(half, weights)
    return {"blurred": whole, "weights_float64": np.array(exact), "weights": weights, "horizontal": half}


def inputs_of_light(inputs):
    return {"image": inputs["image"], "occluded": inputs["occlusion"], "normals": inputs["normals"]}


def frame_stage(parameters, inputs):
    tables = [offsets(radius, inputs["samples"]) for radius in parameters["radii"]]
    textures = (inputs[name] for name in ("depth", "positions", "image"))
    return passes.frame(
        *textures, tables, *mapping_of(parameters), parameters["sigma"], parameters["guard"], inputs.get("turns")
    )


ESTIMATORS = {
    "point": points.point, "hemisphere": partial(points.point, hemisphere=True), "alchemy": points.alchemy,
    "sao": partial(scalable.scalable, falloff=True), "sao-equation-1": partial(scalable.scalable, falloff=False),
    "multiresolution": multiresolution, "hbao": volumetric.hbao,
    "gtao": slices.gtao, "visibility-bitmask": slices.visibility_bitmask,
    "oriented-hemisphere": volumetric.oriented_hemisphere,
}  # fmt: skip
for name, function in (("points", volumetric.points), ("lines", volumetric.lines), ("area", volumetric.areas)):
    ESTIMATORS |= {f"vo-{name}": partial(function, normal=False), f"vo-{name}-normal": partial(function, normal=True)}


def estimator_stage(parameters, inputs):
    occlusion, outside = ESTIMATORS[parameters["estimator"]](parameters, inputs)
    return {"occlusion": occlusion, "outside": np.array([outside])}


STAGES = {
    "elementary": elementary_stage,
    "philox": philox_stage,
    "samples": samples_stage,
    "turns": turns_stage,
    "numbers": numbers_stage,
    "mapping": mapping_stage,
    "algorithm1": occlusion_stage,
    "algorithm2": occlusion_stage,
    "merge": lambda parameters, inputs: {"merged": passes.merge(inputs["layers"])},
    "blur": blur_stage,
    "shade": lambda parameters, inputs: {"shaded": passes.shade(inputs["image"], inputs["occlusion"])},
    "light": lambda parameters, inputs: {"shaded": passes.light(**inputs_of_light(inputs), **parameters)},
    "frame": frame_stage,
    "estimator": estimator_stage,
}


@np.errstate(all="ignore")
def solve(stage, parameters, inputs):
    return STAGES[stage](parameters, inputs)


def differing(made, expected):
    return [
        name
        for name, array in expected.items()
        if (made[name].dtype, made[name].shape, made[name].tobytes()) != (array.dtype, array.shape, array.tobytes())
    ]
