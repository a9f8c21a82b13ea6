"""Judge a renderer's textures, each against the renderer's own textures of earlier passes.

An error is reported once, at the stage where it begins: the blur of a wrong merge is right if it is the blur of that
merge. If a renderer has no texture of a stage, or one with NaN, later stages read the reference's depth, positions and
colour, and any occlusion within its bounds (``lfssao.verify.bounds.view``).
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from lfssao.verify.bounds.bounds import Bounds, exact_bounds
from lfssao.verify.bounds.depth import PositionBounds
from lfssao.verify.bounds.error_model import ErrorModel, find_model
from lfssao.verify.bounds.stored import TextureFormat
from lfssao.verify.case import VIEW, Array, Arrays, Case
from lfssao.verify.verdict import Judgement, Verdict, equal_bits, equal_values, interval_verdict

if TYPE_CHECKING:
    from lfssao.verify.bounds.view import ViewBounds

BoundsFinder = Callable[[str], Bounds | PositionBounds | None]


def judge(
    mine: Arrays,
    case: Case,
    model: str | ErrorModel = "shader",
    names: Collection[str] | None = None,
    stored: Mapping[str, TextureFormat] | None = None,
) -> dict[str, Judgement]:
    """Judge outputs of a case: equal bits are right; others are judged by bounds or, without bounds, by values.

    ``mine`` are the renderer's textures by the names of the outputs, ``names`` the outputs to judge, all by default.
    ``stored`` are the formats of textures that are not float32; ``mine`` holds their values after reading. The model is
    for views; a case of the kit has its bounds. Judgements come in the order of the passes, intermediate steps before
    the result. InputError if the model or the case's parameters are wrong.
    """
    return dict(judgements(mine, case, model, names, stored))


def judgements(
    mine: Arrays,
    case: Case,
    model: str | ErrorModel = "shader",
    names: Collection[str] | None = None,
    stored: Mapping[str, TextureFormat] | None = None,
) -> Iterator[tuple[str, Judgement]]:
    """Yield the judgements of ``judge``, each with its output's name."""
    error_model = find_model(model)
    formats = stored or {}
    main, *steps = case.outputs
    order = list(case.outputs) if case.stage == VIEW else [*steps, main]

    @cache
    def view_bounds() -> "ViewBounds":
        return _view_bounds(mine, case, error_model, formats)

    def allowed_bounds(name: str) -> Bounds | PositionBounds | None:
        bounds = view_bounds().find(name) if case.stage == VIEW else case.bounds.get(name)
        if name not in formats or isinstance(bounds, PositionBounds):
            return bounds
        return formats[name].bounds(bounds or exact_bounds(case.outputs[name]), error_model)

    for name in order:
        if names is None or name in names:
            yield name, _judge_output(name, mine, case, allowed_bounds)


def _view_bounds(mine: Arrays, case: Case, model: ErrorModel, stored: Mapping[str, TextureFormat]) -> "ViewBounds":
    from lfssao.verify.bounds.view import ViewBounds  # late: textures of equal bits need no intervals

    known = _usable_textures(mine, case), case.outputs, case.bounds, stored
    return ViewBounds(case.parameters, stage_inputs(mine, case), model, *known)


def stage_inputs(mine: Arrays, case: Case) -> dict[str, Array]:
    """The inputs of a view's stages: the case's, and textures, the renderer's own where they are usable."""
    inputs = {**case.inputs, **case.outputs, **_usable_textures(mine, case)}
    if "color" in inputs:
        inputs["image"] = inputs["color"]
    elif "depth" in inputs and not case.parameters.get("colored", False):  # a mesh without colour is white
        inputs["image"] = np.repeat(np.isfinite(inputs["depth"]).astype(np.float32)[..., None], 3, axis=2)
    return inputs


def _usable_textures(mine: Arrays, case: Case) -> dict[str, Array]:
    """The renderer's textures that later stages may read: float32, of the right shape, without NaN."""
    same_shape = {
        name: texture
        for name, texture in mine.items()
        if name in case.outputs and texture.shape == case.outputs[name].shape
    }
    return {
        name: texture
        for name, texture in same_shape.items()
        if texture.dtype == np.float32 and not np.isnan(texture).any()
    }


def _judge_output(name: str, mine: Arrays, case: Case, find: BoundsFinder) -> Judgement:
    if name not in mine:
        return Judgement(Verdict.MISSING)
    array = mine[name]
    reference = case.outputs[name]
    if (array.shape, array.dtype) != (reference.shape, reference.dtype):
        detail = f"it is {array.shape} of {array.dtype}, expected {reference.shape} of {reference.dtype}"
        return Judgement(Verdict.MISMATCH, detail)
    differing = ~equal_bits(array, reference)
    if not differing.any():
        return Judgement(Verdict.EQUAL_BITS, "", differing, differing)
    bounds = find(name)
    if bounds is None:
        outside = ~equal_values(array, reference)
        return Judgement(Verdict.DIFFERENT if outside.any() else Verdict.EQUAL_VALUES, "", differing, outside)
    outside = bounds.outside(array)
    interval = bounds if isinstance(bounds, Bounds) else None
    return Judgement(interval_verdict(outside, bounds.outliers), "", differing, outside, interval)
