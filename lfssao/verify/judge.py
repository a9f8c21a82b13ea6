"""Judge a renderer's textures, each by what the renderer itself made before it.

An error is named once, at the stage where it began: the blur of a wrong merge is right if it is the blur of that merge.
If a renderer wrote no texture of a stage, or one with NaN, depth, positions and colour are the reference's, and any
occlusion within its bounds will do (``lfssao.verify.bounds.view``).
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache, partial
from typing import TYPE_CHECKING, cast

import numpy as np

from lfssao.verify.bounds.bounds import Bounds, exactly
from lfssao.verify.bounds.depth import PositionBounds
from lfssao.verify.bounds.error_model import ErrorModel, find_model
from lfssao.verify.bounds.stored import Stored
from lfssao.verify.case import VIEW, Array, Arrays, Case
from lfssao.verify.verdict import Judgement, Verdict, equal_bits, equal_values, judge_within

if TYPE_CHECKING:
    from lfssao.verify.bounds.view import ViewBounds

Find = Callable[[str], Bounds | PositionBounds | None]


def judge(
    mine: Arrays,
    case: Case,
    model: str | ErrorModel = "shader",
    names: Collection[str] | None = None,
    stored: Mapping[str, Stored] | None = None,
) -> dict[str, Judgement]:
    """Judge outputs of a case: equal bits are right; others by bounds or, where none are known, by values.

    ``mine`` are the renderer's textures by the names of the outputs, ``names`` the outputs to judge, all by default.
    ``stored`` are the formats of those that are not float32; ``mine`` has what is read of them. The model is for views;
    the bounds of a case of the kit are part of it. Judgements come in the order of the passes:
    steps on the way before the output that they lead to. InputError if the model or the case's parameters are wrong.
    """
    return dict(judging(mine, case, model, names, stored))


def judging(
    mine: Arrays,
    case: Case,
    model: str | ErrorModel = "shader",
    names: Collection[str] | None = None,
    stored: Mapping[str, Stored] | None = None,
) -> Iterator[tuple[str, Judgement]]:
    """The judgements of ``judge``, each with its output's name, one after the other."""
    chosen, stored = find_model(model), stored or {}
    main, *steps = case.outputs
    order, find = [*steps, main], cast(Find, case.bounds.get)
    if case.stage == VIEW:
        bounds = cache(partial(_bounds_of, mine, case, chosen, stored))
        order, find = list(case.outputs), lambda name: bounds().find(name)

    def found(name: str) -> Bounds | PositionBounds | None:
        allowed = find(name)
        if name not in stored or isinstance(allowed, PositionBounds):
            return allowed
        return stored[name].bounds(allowed or exactly(case.outputs[name]), chosen)

    for name in order:
        if names is None or name in names:
            yield name, _judge_output(name, mine, case, found)


def _bounds_of(mine: Arrays, case: Case, model: ErrorModel, stored: Mapping[str, Stored]) -> "ViewBounds":
    from lfssao.verify.bounds.view import ViewBounds  # late: textures of equal bits need no intervals

    known = _own(mine, case), case.outputs, case.bounds, stored
    return ViewBounds(case.parameters, inputs_of(mine, case), model, *known)


def inputs_of(mine: Arrays, case: Case) -> dict[str, Array]:
    """The inputs of a view's stages: those of the case, and textures, the renderer's own where they can be used."""
    inputs = {**case.inputs, **case.outputs, **_own(mine, case)}
    if "color" in inputs:
        inputs["image"] = inputs["color"]
    elif "depth" in inputs and not case.parameters.get("colored", False):  # a mesh without colour is white
        inputs["image"] = np.repeat(np.isfinite(inputs["depth"]).astype(np.float32)[..., None], 3, axis=2)
    return inputs


def _own(mine: Arrays, case: Case) -> dict[str, Array]:
    """The renderer's textures that later stages can be made of."""
    like = {name: t for name, t in mine.items() if name in case.outputs and t.shape == case.outputs[name].shape}
    return {name: t for name, t in like.items() if t.dtype == np.float32 and not np.isnan(t).any()}


def _judge_output(name: str, mine: Arrays, case: Case, find: Find) -> Judgement:
    if name not in mine:
        return Judgement(Verdict.MISSING)
    array, right = mine[name], case.outputs[name]
    if (array.shape, array.dtype) != (right.shape, right.dtype):
        detail = f"it is {array.shape} of {array.dtype}, expected {right.shape} of {right.dtype}"
        return Judgement(Verdict.MISMATCH, detail)
    differing = ~equal_bits(array, right)
    if not differing.any():
        return Judgement(Verdict.EQUAL_BITS, "", differing, differing)
    allowed = find(name)
    if allowed is None:
        outside = ~equal_values(array, right)
        return Judgement(Verdict.DIFFERENT if outside.any() else Verdict.EQUAL_VALUES, "", differing, outside)
    outside = allowed.outside(array)
    bounds = allowed if isinstance(allowed, Bounds) else None
    return Judgement(judge_within(outside, allowed.strays), "", differing, outside, bounds)
