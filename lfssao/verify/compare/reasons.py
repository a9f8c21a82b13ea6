"""Reasons of verdicts: one sentence that explains a texel's value."""

from collections.abc import Callable
from functools import cache

import numpy as np

from lfssao.samples.rotation import float32_rounding
from lfssao.verify.bounds.bounds import Bounds, FloatArray
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.explain import Sample, Term, explainer, sorted_terms
from lfssao.verify.bounds.points import term_tracer
from lfssao.verify.bounds.ssao import image_depth
from lfssao.verify.bounds.view import described_problem
from lfssao.verify.case import VIEW, Arrays, Case, described_mapping, described_turns, described_view
from lfssao.verify.compare.result import Reason
from lfssao.verify.judge import stage_inputs

Place = tuple[int, int]  # column and row
Explain = Callable[[Place], list[Sample] | list[Term]]

_LEAST_NOISE = 5e-4  # radians: half of float32's spacing at the angle
_REASONS = {
    "depth": "expected: a depth between this texel's and a neighbour's in the reference (no mesh given)",
    "positions": "expected: the point of the texel's ray at the depth of the depth texture",
    "color": "expected: a colour between those of this texel and its neighbours",
    "blurred": "expected: the blur of the renderer's own merged texture",
    "shaded": "expected: the image times 1 - blurred, or lit by normals too, all the renderer's own",
}


def reason_of(name: str, mine: Arrays, case: Case, bounds: Bounds | None, model: ErrorModel) -> Reason:
    """Return a function of (column, row) that explains a texel's value in a sentence; '' if no reason is known."""
    if case.stage != VIEW or (model.exact and name in ("depth", "color")):  # only the reference's numbers are right
        return lambda _: ""
    layers = [f"ao_{k + 1}" for k in range(len(case.parameters["radii"]))]
    if name in layers:
        return _occlusion_reason(layers.index(name), mine, case, bounds, model)
    if name == "merged":
        textures = [mine.get(layer, case.outputs.get(layer)) for layer in layers]
        known = [texture for texture in textures if texture is not None]
        return lambda texel: ("the radii have " + ", ".join(f"{t[texel[::-1]]:.7g}" for t in known)) if known else ""
    if name in ("depth", "color") and bounds is not None and name in case.bounds and bounds.ranges is None:
        rays = f"nine rays into the mesh, within {model.centre:.2g} texel of the texel's centre, see"

        def seen(texel: tuple[int, int]) -> str:
            missed = name == "depth" and bounds.lower[texel[::-1]] == np.inf
            return f"{rays} {'nothing' if missed else f'this interval of {name}'}"

        return seen
    return lambda _: _REASONS.get(name, "")


def turn_noise_note(case: Case) -> str:
    """A sentence on samples that turn by a large hash, which float32 rounds to noise; '' for other samples."""
    rotation = case.parameters.get("rotation", "none")
    if case.stage != VIEW or "depth" not in case.outputs:
        return ""
    rounding = float32_rounding(rotation, *case.outputs["depth"].shape)
    if not rounding > _LEAST_NOISE:
        return ""
    sao = case.parameters["estimator"].startswith("sao") and rotation == "common-hash"
    option = "--parameter angle_sum=float32" if sao else "--rotate ANGLES.npy, the renderer's own"
    return (
        f"samples turn by '{rotation}': a renderer that adds it to a sample's angle in float32 rounds by up to "
        f"{rounding:.2g} rad, so that it is noise of its own arithmetic: render the reference with {option}"
    )


def _occlusion_reason(k: int, mine: Arrays, case: Case, bounds: Bounds | None, model: ErrorModel) -> Reason:
    """Explain a texel by its sample nearest to another outcome, at radius k; by undecided samples if not of ``lf``."""
    parameters = case.parameters
    if parameters["estimator"] != "lf":
        return _undecided_reason(k, mine, case, bounds, model)
    guard = parameters["guard"]
    explain = _sample_explainer(k, mine, case, model)
    if explain is None:
        return lambda _: ""

    def reason(texel: Place) -> str:
        samples = explain((texel[0] + guard, texel[1] + guard))
        return str(samples[0]) if samples else "no surface is seen there"

    return reason


def texel_explainer(name: str, mine: Arrays, case: Case, model: ErrorModel) -> Explain | None:
    """Return a function of (column, row) that lists the samples of a texel in the depth texture that they read.

    None unless the texture is the occlusion of one radius and its samples are known. A sample's texel counts the
    guard band; the function's argument does not.
    """
    layers = [f"ao_{k + 1}" for k in range(len(case.parameters.get("radii", ())))]
    if case.stage != VIEW or name not in layers:
        return None
    guard = case.parameters["guard"]
    make_explainer = _sample_explainer if case.parameters["estimator"] == "lf" else _term_explainer
    explain = make_explainer(layers.index(name), mine, case, model)
    return None if explain is None else lambda texel: explain((texel[0] + guard, texel[1] + guard))


def _sample_explainer(k: int, mine: Arrays, case: Case, model: ErrorModel) -> Callable[[Place], list[Sample]] | None:
    """A function that lists a texel's samples at radius k, of (column, row) with the guard band.

    None without depth, or without both positions and the inverse mapping.
    """
    parameters = case.parameters
    inverse = parameters["screen_to_world"]
    inputs = stage_inputs(mine, case)
    depth = inputs.get("depth")
    positions = inputs.get("positions")
    if depth is None or (positions is None and inverse is None):
        return None
    turns = described_turns(parameters, inputs)
    samples = inputs["samples"]
    radius = parameters["radii"][k]
    image, depth_error = image_depth(described_view(parameters), depth, model)

    @cache
    def make_explainer() -> Callable[[Place], list[Sample]]:  # made when the first texel asks
        return explainer(
            image, positions, described_mapping(parameters), samples, radius, model, inverse, turns, depth_error
        )

    def explain(texel: Place) -> list[Sample]:
        return make_explainer()(texel)

    return explain


def _undecided_reason(k: int, mine: Arrays, case: Case, bounds: Bounds | None, model: ErrorModel) -> Reason:
    """Explain a texel by the number of undecided samples and the one nearest to another outcome; '' without bounds."""
    undecided = None if bounds is None else bounds.undecided
    if undecided is None:
        return lambda _: ""
    points = case.inputs.get("points")
    depth = stage_inputs(mine, case).get("depth")
    guard = case.parameters["guard"]
    sample_kind = "taps" if points is None else f"of {len(points)} points"
    nearest_term = _terms_reason(k, mine, case, model)

    def reason(texel: tuple[int, int]) -> str:
        column, row = texel
        if depth is not None and not depth[row + guard, column + guard] < np.inf:
            return "no surface is seen there"
        return f"{undecided[row, column]} {sample_kind} are undecided{nearest_term(texel)}"

    return reason


def _terms_reason(k: int, mine: Arrays, case: Case, model: ErrorModel) -> Reason:
    """Explain a texel by its term nearest to another outcome; '' for estimators that do not sum terms."""
    guard = case.parameters["guard"]
    explain = _term_explainer(k, mine, case, model)
    if explain is None:
        return lambda _: ""

    def reason(texel: Place) -> str:
        nearest = explain((texel[0] + guard, texel[1] + guard))
        return f"; {nearest[0]}" if nearest else ""

    return reason


def _term_explainer(k: int, mine: Arrays, case: Case, model: ErrorModel) -> Callable[[Place], list[Term]] | None:
    """A function that lists a texel's terms at radius k, of (column, row) with the guard band.

    None without depth or positions, or under an exact model.
    """
    parameters = case.parameters
    inputs = stage_inputs(mine, case)
    if model.exact or "depth" not in inputs or "positions" not in inputs:
        return None
    name = parameters["estimator"]
    radius = parameters["radii"][k]

    @cache
    def make_tracer() -> Callable[[int, int], FloatArray]:  # made when the first texel asks
        return term_tracer(described_problem(parameters, inputs, radius, model), radius, name)

    return lambda texel: sorted_terms(make_tracer()(texel[1], texel[0]), inputs["depth"].shape)
