"""Bounds of the estimators but ``lf``, by the sums of terms that their formulas make.

``point`` and ``hemisphere`` sum decisions about points. VO by points and by lines and ``oriented-hemisphere`` sum
terms, which jump where a look-up falls into another texel, by as much as the surface there differs. Each term lies
between those that any texel gives where the look-up may fall (``kernels.sums``); so do the terms of ``alchemy`` and
``sao`` and the rises of horizons of ``hbao``. Both ways of VO to make one occlusion of two radii grow with each.

Terms of ``vo-area`` on displays are made of filtered textures (``kernels.moment_balls``), and do not jump.
``multiresolution`` sums terms of texels that no arithmetic chooses. ``lf-neighbours`` counts decisions, as ``lf``.
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
from lfssao.verify.bounds.problem import Options, Problem, Weights, held, view_of_formulas
from lfssao.verify.bounds.registry import BOUNDED, has_bounds


def point_bounds(
    name: str,
    seen: Buffers,
    radius: float,
    points: NDArray[np.floating[Any]] | None,
    weights: Weights,
    options: Options,
    model: str | ErrorModel = "shader",
) -> Bounds | None:
    """Bounds of an estimator's occlusion; None if none are known, or it reads normals and there are none.

    Textures are float32; renderers have the numbers of mapping and view rounded to float32. R is in world units; points
    are (n, 3) in the unit ball or (n, 2) in the unit disk, weights (n,), read by VO; options are all of the estimator's
    parameters. InputError if there is no such model; an exact one has one right value and no bounds here.
    """
    if not has_bounds(name) or (find_estimator(name).reads_normals(options) and seen.normals is None):
        return None
    samples = np.asarray([] if points is None else points, np.float64)
    given = Problem(seen, samples, weights, options, find_model(model))
    if name in BOUNDED:
        file = import_module(f"lfssao.verify.bounds.{BOUNDED[name]}")
        found: Bounds | None = getattr(file, BOUNDED[name])(given, radius)
        return found
    return _OF_RADII[name](given, radius) if name in _OF_RADII else _formulas(given, radius, name=name)


def terms_of(given: Problem, radius: float, name: str) -> Callable[[int, int], FloatArray]:
    """Return a function of a texel's row and column that gives the story of its samples, (n, 6).

    That is the image point u, v of each, texels, with their errors, -infinity for u's where it has none, and the least
    and the largest term. An estimator that does not sum terms of texels has none: (0, 6). The view is made once.
    """
    estimator = find_estimator(name)
    if not estimator.reads_texels:
        return lambda row, column: np.empty((0, 6))
    seen, view, made = driven(given, radius, name)
    samples = 0 if hasattr(made, "steps") else len(made.points)

    def told(row: int, column: int) -> FloatArray:
        story, sums = np.zeros((samples, 6)), np.zeros((4, *seen.depth.shape))
        story[:, 4] = np.inf
        if samples:
            texel = row * seen.depth.shape[1] + column
            bound_sums.compiled(row, row + 1, seen, view, made, *_terms(name, made), sums, texel, story)
        return story

    return told


def _hidden_volume(given: Problem, radius: float, *, at: Callable[..., Bounds]) -> Bounds:
    """Bounds of VO, of one radius as ``at`` bounds it, or of two."""
    first, second = at(given, radius), float(given.options["second"])
    if second == 0:
        return first
    other = at(given, second * radius)
    merged = merge_bounds([first, other])
    if given.options["combine"] == "minimum":
        return merged
    ends = [np.stack([each.lower, each.upper]).astype(np.float64) for each in (first, other)]
    lower, upper = union_ends(ends[0], ends[1], given.model)
    return Bounds(up_to_single(lower), down_to_single(upper), merged.undecided)


def _hidden_areas(given: Problem, radius: float) -> Bounds | None:
    """Bounds of ``vo-area``; None on cameras, whose far depths cancel in M2 - M1^2 of float32 until nothing is left."""
    if given.seen.view.world_to_image.kind == MATRIX:
        return None
    return _hidden_volume(given, radius, at=partial(_formulas, name="vo-area"))


def driven(given: Problem, radius: float, name: str) -> tuple[Seen, BallView, Any]:
    """The view and the formulas of an estimator, as drivers take them."""
    estimator = find_estimator(name)
    assert estimator.formulas is not None
    options = estimator.options(**given.options)
    made = distinct(held(estimator.formulas(given.seen, radius, given.points, given.weights, options)))
    seen = given.surface_of(made, radius, options)
    return seen, view_of_formulas(given, seen, made, options), made


def _terms(name: str, made: Any) -> tuple[float, bool, bool | None]:
    """The largest term, whether terms jump, and whether places may be in doubt, as of ``bound_sums``."""
    largest, jumps = _TERMS.get(name, (LIMITLESS, True))
    return largest, jumps, True if "fork" in type(made).place.__code__.co_names else None


def _formulas(given: Problem, radius: float, *, name: str) -> Bounds:
    """Bounds of an estimator that is written as formulas."""
    seen, view, made = driven(given, radius, name)
    sums = np.zeros((4, *seen.depth.shape))
    known = _terms(name, made)
    if hasattr(made, "steps"):  # of estimators that take them
        bound_folds(seen, view, made, known[0], sums)
    else:
        bound_sums(seen, view, made, *known, sums, *NO_STORY)
    end_sums(view, made, sums.reshape(4, -1))
    lower, upper, doubt, _ = sums
    there = seen.depth < np.inf
    lower, upper = np.where(there, lower, 0), np.where(there, upper, 0)
    return Bounds(up_to_single(lower), down_to_single(upper), doubt.astype(np.int32))


# The largest term that is known, and whether terms jump where their texels are sure; others may be of any size, and do.
_TERMS = {
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

# Estimators whose intervals are not those of their formulas at one radius.
_OF_RADII: dict[str, Callable[[Problem, float], Bounds | None]] = {
    **{
        name: partial(_hidden_volume, at=partial(_formulas, name=name))
        for name in ("vo-points", "vo-points-normal", "vo-lines", "vo-lines-normal")
    },
    "vo-area": _hidden_areas,
}
