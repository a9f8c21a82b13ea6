"""A case: a renderer's inputs, the right outputs, and their bounds."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Value
from lfssao.ao.estimators.registry import find_estimator
from lfssao.ao.textures import Buffers, Neighbour
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import KINDS, View, WorldToImage
from lfssao.samples.rotation import texel_turns
from lfssao.summary import Table, arrays_of
from lfssao.verify.bounds.bounds import Bounds

Array = NDArray[Any]
Arrays = Mapping[str, Array]
Parameters = Mapping[str, Any]

# Stages that the kit does not have: a whole view of ``lfssao render``, and images of which only values are known.
VIEW = "view"
IMAGES = "images"

# The kind of rays, in a kit, of an orthographic camera.
ORTHOGRAPHIC = 2


@dataclass(frozen=True, eq=False, repr=False)
class Case(Table):
    """One problem and its solution: a small one of the kit, a view that ``lfssao render`` rendered, or plain images.

    The first output is the result; the others are intermediate steps, which a renderer may leave out. A view has all
    its textures, in the order of the passes. Bounds of outputs hold for a renderer within the error model of shading
    languages; an output without bounds must have equal bits. A view has bounds of depth and colour if its mesh is
    known. Bounds of later textures depend on the renderer's own textures (``lfssao.verify.bounds.view``).

    >>> case = lfssao.testing.make_case("merge_three")
    >>> case.stage, case.inputs["layers"].shape, list(case.outputs)
    ('merge', (3, 12, 16), ['merged'])
    """

    name: str  # in the kit's folder, reports and tests
    stage: str  # the tested stage (``lfssao.verify.kit.stages.STAGES``), 'view', or 'images'
    title: str  # the special feature of the case, in one line
    parameters: Parameters  # of the stage: numbers, strings, and lists and mappings of them
    inputs: Arrays
    outputs: Arrays  # the right results
    bounds: Mapping[str, Bounds] = field(default_factory=dict)  # by the outputs' names

    def _facts(self) -> dict[str, object]:
        head = {"name": self.name, "stage": self.stage, "title": self.title}
        return {**head, "inputs": arrays_of(self.inputs), "outputs": arrays_of(self.outputs)}


def described_turns(parameters: Parameters, inputs: Arrays) -> NDArray[np.float32] | None:
    """The turns of a case's texels: an input, or computed from a view's rotation and size; None without any."""
    if parameters.get("rotation", "none") == "none":
        return inputs.get("turns")
    return _turns(parameters["rotation"], *inputs["depth"].shape, parameters["rotation_seed"])


@lru_cache(maxsize=2)  # modules of a display are all of one size; nobody writes to turns
def _turns(rotation: str, height: int, width: int, seed: int) -> NDArray[np.float32]:
    return texel_turns(rotation, height, width, seed, np.dtype(np.float32))


def described_view(parameters: Parameters) -> View:
    """The view in a case's parameters; numbers of its rays may be null for infinity, as in JSON."""
    numbers = dict(parameters["view"])
    kind = numbers.pop("ray_kind", None)
    lens = np.array([np.inf if number is None else number for number in numbers["lens"]])
    if kind == ORTHOGRAPHIC:
        lens[6] = 1.0
    arrays = ("cast_from_world", "world_from_cast", "screen_to_world")
    numbers |= {name: np.array(numbers[name]) for name in arrays if numbers[name] is not None}
    return View(**{**numbers, "lens": lens}, world_to_image=described_mapping(parameters))


def described_buffers(parameters: Parameters, inputs: Arrays) -> Buffers:
    """The textures of a case's view as estimators read them: depth, positions, and normals and turns if it has them."""
    view = described_view(parameters)
    turns = described_turns(parameters, inputs)
    textures = inputs["depth"], inputs["positions"], inputs.get("normals"), turns
    return Buffers(view, *textures, neighbours=described_neighbours(parameters, inputs) or ())


def described_neighbours(parameters: Parameters, inputs: Arrays) -> list[Neighbour] | None:
    """Mapping and depth texture of each neighbour of a case's module; None if one of them is not known."""
    neighbours = parameters.get("neighbours", ())
    if neighbours is None or any(depth_of(neighbour["name"]) not in inputs for neighbour in neighbours):
        return None
    return [(described_mapping(neighbour), inputs[depth_of(neighbour["name"])]) for neighbour in neighbours]


def depth_of(module: str) -> str:
    """The name of a neighbour's depth texture among the inputs of a case."""
    return f"depth of {module}"


def described_options(parameters: Parameters, radius: float) -> dict[str, Value]:
    """The options of a case's estimator for a radius, lengths in radii; InputError if their unit is unknown."""
    estimator = find_estimator(parameters["estimator"])
    units = parameters.get("units", "radii")
    return estimator.in_radii(parameters["options"], radius, units)


def described_mapping(parameters: Parameters) -> WorldToImage:
    """The mapping in a case's parameters; Algorithm 1 has only a matrix."""
    if "mapping" not in parameters:
        return WorldToImage(MATRIX, np.ravel(parameters["world_to_screen"]))
    mapping = parameters["mapping"]
    return WorldToImage(KINDS.index(mapping["kind"]), np.array(mapping["numbers"]))
