"""The arguments of an estimator's bounds: textures and mapping, samples, options and the error model."""

from collections.abc import Container, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators import estimator
from lfssao.ao.estimators.estimator import Value, turns_of
from lfssao.ao.estimators.look_ups import cleared_z, with_cleared
from lfssao.ao.formulas import float_view, levels_of_z, words_of
from lfssao.ao.kernels.look_up import Look
from lfssao.ao.moments import filtered
from lfssao.ao.textures import Buffers
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.kernels.ball_view import BallLevels, BallView
from lfssao.verify.bounds.kernels.moment_balls import BallPyramid
from lfssao.verify.bounds.kernels.seen import CAST, IMAGE, NOTHING, Seen
from lfssao.verify.bounds.ssao import checked_view, image_depth, rounded_to_single, with_depth_ends

Options = Mapping[str, Value]
Weights = NDArray[np.floating[Any]] | None
Ends = tuple[FloatArray, FloatArray]


class Problem(NamedTuple):
    """The arguments of ``point_bounds``, checked, but for the radius."""

    buffers: Buffers  # float32
    points: FloatArray
    weights: Weights
    options: Options
    model: ErrorModel

    def surface(self, radius: float, directions: bool = True, kind: int = CAST) -> Seen:
        """The view as kernels take it, with depths of kind ``kind`` (``with_depth_ends``)."""
        buffers = self.buffers
        view = self.buffers.view
        depth, depth_error = image_depth(view, buffers.depth, self.model)
        turns = None if buffers.turns is None else buffers.turns[:2]
        surface = checked_view(depth, buffers.positions, view.world_to_image, radius, None, turns, depth_error)
        surface = surface._replace(
            normals=NOTHING if buffers.normals is None else np.ascontiguousarray(buffers.normals),
            directions=np.ascontiguousarray(buffers.directions) if directions else NOTHING,
            axis=rounded_to_single(view.cast_from_world[2]),
        )
        return with_depth_ends(surface, self.model, kind)

    def surface_of(self, formulas: Any, radius: float, options: estimator.Options) -> Seen:
        """The view as kernels take it, with the depths that the formulas compare."""
        kind = IMAGE if "image_z" in words_of(formulas) else CAST
        cleared = cleared_z(options)
        surface = self._replace(buffers=with_cleared(self.buffers, cleared)).surface(radius, kind=kind)
        surface = surface._replace(depth=np.ascontiguousarray(self.buffers.depth))
        if cleared is not None and kind == CAST:
            for ends in (surface.low, surface.high):
                ends[~(surface.depth < np.inf)] = cleared
        return surface


def ball_view(
    buffers: Buffers, seen: Seen, model: ErrorModel, words: Container[str], options: estimator.Options
) -> BallView:
    """Return the textures and the mapping that formulas of balls read; ``words`` are the names in the formulas."""
    floats = float_view(buffers, words, options)
    numbers = to_double(floats)
    extra = floats.depth.size - seen.depth.size
    background = np.full(extra, np.inf) if floats.surfaces is None else floats.surfaces[seen.depth.size :]
    shared = "kind", "rows", "lens", "axes", "width", "divides", "third"
    return BallView(
        **{name: getattr(numbers, name) for name in shared},
        depth=floats.depth,
        positions=floats.positions,
        normals=seen.normals.ravel(),
        directions=seen.directions.ravel(),
        turns=turns_of(buffers),
        low=np.append(seen.low, background),
        high=np.append(seen.high, background),
        by=model.errors,
        turned=buffers.turns is not None,
        look=floats.look or Look(),
        rays=None if floats.rays is None else to_double(floats.rays),
        remade=floats.rays is not None and buffers.view.screen_to_world is not None,
    )


def view_of_formulas(problem: Problem, seen: Seen, formulas: Any, options: estimator.Options) -> BallView:
    """Return a view as an estimator's formulas read it; if they read moments, its depth is filtered."""
    words = words_of(formulas)
    view = ball_view(problem.buffers, seen, problem.model, words, options)
    if "coarse_z" in words:
        low, high = (levels_of_z(end, options) for end in (seen.low, seen.high))
        view = view._replace(levels=BallLevels(low.z, high.z, low.first))
    if "moments" not in words:
        return view
    return view._replace(moments_of=moment_balls(seen, bool(problem.options["prefilter"]), problem.model))


def moment_balls(seen: Seen, prefilter: bool, model: ErrorModel) -> BallPyramid:
    """Return balls of the moments of a view's depth, from the ends of each surface's depth."""
    has_surface = seen.depth < np.inf
    low, high = (np.where(has_surface, end, 0.0) for end in (seen.low, seen.high))
    z = 0.5 * (low + high)
    error = 0.5 * (high - low)
    size = np.abs(z)
    square_error = (2 * size + error) * error + 2 * model.operation * size * size
    values = filtered(np.stack([has_surface.astype(np.float64), z, z * z], axis=-1), prefilter)
    errors = filtered(np.stack([size, error, square_error], axis=-1), prefilter)
    return BallPyramid(values, errors, 18.0 if prefilter else 4.0)


def to_double(numbers: Any) -> Any:
    """The tuple with float32 numbers and arrays as float64; integers stay."""
    return type(numbers)(*(np.float64(x) if isinstance(x, np.ndarray | np.floating) else x for x in numbers))
