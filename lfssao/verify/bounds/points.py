"""Bounds of all estimators except ``lf``: the sums of the least and of the largest terms of their formulas.

``point`` and ``hemisphere`` sum decisions about points. VO by points and by lines and ``oriented-hemisphere`` sum
terms, which jump where a look-up falls into another texel whose surface differs. Each term lies between the least and
the largest that the possible texels give (``kernels.sums``). The same holds for the terms of ``alchemy`` and ``sao``
and for the rises of the horizons of ``hbao``. VO merges two radii by functions that increase with either occlusion.

Terms of ``vo-area`` on displays come from filtered textures (``kernels.moment_balls``) and do not jump.
``multiresolution`` sums terms of texels that no arithmetic selects. ``lf-neighbours`` counts decisions, as ``lf``.
"""

from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.registry import find_estimator
from lfssao.ao.formulas import ZENITH
from lfssao.ao.textures import Buffers
from lfssao.core.distinct import distinct
from lfssao.optics.kernels.projection import MATRIX
from lfssao.verify.bounds.bounds import Bounds, FloatArray, down_to_single, up_to_single
from lfssao.verify.bounds.error_model import ErrorModel, find_model
from lfssao.verify.bounds.kernels.ball_view import BallView
from lfssao.verify.bounds.kernels.folds import bound_folds
from lfssao.verify.bounds.kernels.seen import Seen
from lfssao.verify.bounds.kernels.sums import LIMITLESS, NO_STORY, bound_sums, end_sums
from lfssao.verify.bounds.post import merge_bounds, union_ends
from lfssao.verify.bounds.problem import Options, Problem, Weights, to_double, view_of_formulas
from lfssao.verify.bounds.registry import BOUNDS_FILES, has_bounds


def point_bounds(
    name: str,
    buffers: Buffers,
    radius: float,
    points: NDArray[np.floating[Any]] | None,
    weights: Weights,
    options: Options,
    model: str | ErrorModel = "shader",
) -> Bounds | None:
    """Bounds of an estimator's occlusion; None if none are known, or it reads normals and there are none.

    Textures are float32; renderers round the numbers of mapping and view to float32. R is in world units. Points are
    (n, 3) in the unit ball or (n, 2) in the unit disk; VO reads weights, (n,). Options are all of the estimator's
    parameters. InputError if there is no such model; an exact model has no bounds here, as only one value is right.
    """
    if not has_bounds(name) or (find_estimator(name).reads_normals(options) and buffers.normals is None):
        return None
    samples = np.asarray([] if points is None else points, np.float64)
    problem = Problem(buffers, samples, weights, options, find_model(model))
    if name in BOUNDS_FILES:
        module = import_module(f"lfssao.verify.bounds.{BOUNDS_FILES[name]}")
        bounds: Bounds | None = getattr(module, BOUNDS_FILES[name])(problem, radius)
        return bounds
    return _TWO_RADII[name](problem, radius) if name in _TWO_RADII else _formula_bounds(problem, radius, name=name)


def term_tracer(problem: Problem, radius: float, name: str) -> Callable[[int, int], FloatArray]:
    """Return a function of row and column that traces a texel's samples, (n, 6).

    Columns are u, its error, v, its error, texels, and the least and the largest term. The error of u is -infinity
    where a sample has no image point. An estimator that does not sum terms of texels has an empty trace, (0, 6). The
    view is prepared once.
    """
    estimator = find_estimator(name)
    if not estimator.reads_texels:
        return lambda row, column: np.empty((0, 6))
    seen, view, formulas = driver_arguments(problem, radius, name)
    samples = 0 if hasattr(formulas, "steps") else len(formulas.points)

    def trace(row: int, column: int) -> FloatArray:
        table = np.zeros((samples, 6))
        sums = np.zeros((4, *seen.depth.shape))
        table[:, 4] = np.inf
        if samples:
            texel = row * seen.depth.shape[1] + column
            bound_sums.compiled(
                row, row + 1, seen, view, formulas, *_term_properties(name, formulas), sums, texel, table
            )
        return table

    return trace


def _two_radii_bounds(problem: Problem, radius: float, *, bounds_at: Callable[..., Bounds]) -> Bounds:
    """Bounds of VO at one radius, or merged from two; ``bounds_at`` returns those of one radius."""
    first = bounds_at(problem, radius)
    second = float(problem.options["second"])
    if second == 0:
        return first
    other = bounds_at(problem, second * radius)
    merged = merge_bounds([first, other])
    if problem.options["combine"] == "minimum":
        return merged
    ends = [np.stack([bounds.lower, bounds.upper]).astype(np.float64) for bounds in (first, other)]
    lower, upper = union_ends(ends[0], ends[1], problem.model)
    return Bounds(up_to_single(lower), down_to_single(upper), merged.undecided)


def _area_bounds(problem: Problem, radius: float) -> Bounds | None:
    """Bounds of ``vo-area``; None on cameras, as M2 - M1^2 of far depths cancels entirely in float32."""
    if problem.buffers.view.world_to_image.kind == MATRIX:
        return None
    return _two_radii_bounds(problem, radius, bounds_at=partial(_formula_bounds, name="vo-area"))


def driver_arguments(problem: Problem, radius: float, name: str) -> tuple[Seen, BallView, Any]:
    """The view, its balls and the formulas of an estimator, as drivers take them."""
    estimator = find_estimator(name)
    assert estimator.formulas is not None
    options = estimator.options(**problem.options)
    formulas = distinct(
        to_double(estimator.formulas(problem.buffers, radius, problem.points, problem.weights, options))
    )
    seen = problem.surface_of(formulas, radius, options)
    return seen, view_of_formulas(problem, seen, formulas, options), formulas


def _term_properties(name: str, formulas: Any) -> tuple[float, bool, bool | None]:
    """The largest term, whether terms jump, and whether places may be in doubt, as ``bound_sums`` takes them."""
    largest, jumps = _TERM_PROPERTIES.get(name, (LIMITLESS, True))
    return largest, jumps, True if "fork" in type(formulas).place.__code__.co_names else None


def _formula_bounds(problem: Problem, radius: float, *, name: str) -> Bounds:
    """Bounds of an estimator that has formulas."""
    seen, view, formulas = driver_arguments(problem, radius, name)
    sums = np.zeros((4, *seen.depth.shape))
    properties = _term_properties(name, formulas)
    if hasattr(formulas, "steps"):  # of estimators that take them
        bound_folds(seen, view, formulas, properties[0], sums)
    else:
        bound_sums(seen, view, formulas, *properties, sums, *NO_STORY)
    end_sums(view, formulas, sums.reshape(4, -1))
    lower, upper, undecided, _ = sums
    has_surface = seen.depth < np.inf
    lower = np.where(has_surface, lower, 0)
    upper = np.where(has_surface, upper, 0)
    return Bounds(up_to_single(lower), down_to_single(upper), undecided.astype(np.int32))


# The largest term, and whether terms jump where their texels are certain. Other estimators' terms have any size and
# jump.
_TERM_PROPERTIES = {
    "point": (1.0, True),
    "hemisphere": (1.0, True),
    "vo-points": (1.0, True),
    "vo-points-normal": (1.0, True),
    "vo-lines": (1.0, False),
    "vo-lines-normal": (1.0, False),
    "vo-area": (1.0, False),
    "alchemy": (LIMITLESS, False),
    "oriented-hemisphere": (1.0, True),
    "hbao": (2 * ZENITH, True),
    "gtao": (0.0, True),  # steps add nothing
    "visibility-bitmask": (0.0, True),
}

# Estimators that merge two radii.
_TWO_RADII: dict[str, Callable[[Problem, float], Bounds | None]] = {
    **{
        name: partial(_two_radii_bounds, bounds_at=partial(_formula_bounds, name=name))
        for name in ("vo-points", "vo-points-normal", "vo-lines", "vo-lines-normal")
    },
    "vo-area": _area_bounds,
}
