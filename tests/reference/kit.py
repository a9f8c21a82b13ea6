"""An implementation of the kit's stages by its SPECIFICATION.md alone: nothing here comes from lfssao.

The files kit_reader_*.py have the stages, by the text's sections; this one reads cases and compares. Run as a program
on a kit's folder it says which cases it meets to the bit.
"""

import json
import sys
from pathlib import Path

import numpy as np

from reference import points as kit_reader_points
from reference import scalable as kit_reader_scalable
from reference import volumetric as kit_reader_volumetric
from reference.elementary import elementary, philox_stage
from reference.mapping import mapping, numbers
from reference.passes import algorithm1, algorithm2, blur, frame, merge, shade
from reference.samples import samples, square


def read_case(folder):
    """Parameters, inputs and outputs of a case; the headers of the .npy files are skipped."""
    case = json.loads((folder / "case.json").read_text())
    assert case["format"] == 1

    def array(entry):
        data = (folder / entry["file"]).read_bytes()[128:]
        return np.frombuffer(data, np.dtype(entry["dtype"]).newbyteorder("<")).reshape(entry["shape"])

    inputs, outputs = ({k: array(entry) for k, entry in case[group].items()} for group in ("inputs", "outputs"))
    return case["stage"], case["parameters"], inputs, outputs


ESTIMATORS = {
    **kit_reader_points.ESTIMATORS,
    **kit_reader_volumetric.ESTIMATORS,
    **kit_reader_scalable.ESTIMATORS,
}


STAGES = {
    "elementary": lambda parameters, inputs: {"y": elementary(parameters, inputs)},
    "philox": lambda parameters, inputs: {"words": philox_stage(parameters, inputs)},
    "samples": lambda parameters, inputs: {
        "samples": samples(parameters, inputs),
        "square": np.array(square(parameters["method"], parameters["n"], int(parameters["seed"]))),
    },
    "numbers": lambda parameters, inputs: {"numbers": np.array(numbers(parameters))},
    "mapping": mapping,
    "algorithm1": algorithm1,
    "algorithm2": algorithm2,
    "merge": lambda parameters, inputs: {"merged": merge(inputs["layers"])},
    "blur": lambda parameters, inputs: blur(parameters["sigma"], inputs["source"]),
    "shade": lambda parameters, inputs: {"shaded": shade(inputs["image"], inputs["occlusion"])},
    "frame": frame,
    "estimator": lambda parameters, inputs: ESTIMATORS[parameters["estimator"]](parameters, inputs),
}


@np.errstate(all="ignore")
def solve(stage, parameters, inputs):
    """All outputs of a case by name."""
    return STAGES[stage](parameters, inputs)


def differing(made, expected):
    """Names of the outputs whose bits differ."""
    return [
        name
        for name, array in expected.items()
        if (made[name].dtype, made[name].shape, made[name].tobytes()) != (array.dtype, array.shape, array.tobytes())
    ]


def main(kit):
    index = json.loads((kit / "kit.json").read_text())
    assert index["format"] == 1
    for entry in index["cases"]:
        if entry["specified"]:
            stage, parameters, inputs, outputs = read_case(kit / entry["folder"])
            wrong = differing(solve(stage, parameters, inputs), outputs)
            print(f"{entry['name']}: {'differs in ' + ', '.join(wrong) if wrong else 'equal bits'}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
