"""The arguments that bounds of an estimator are made of: textures and mapping, samples, options and the error model."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Value, turns_of
from lfssao.ao.formulas import float_view
from lfssao.ao.textures import Buffers
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.kernels.ball_view import BallView
from lfssao.verify.bounds.kernels.seen import CAST, NOTHING, Seen
from lfssao.verify.bounds.ssao import image_depth, seen_by, single, with_depths

Options = Mapping[str, Value]
Weights = NDArray[np.floating[Any]] | None
Ends = tuple[FloatArray, FloatArray]


class Problem(NamedTuple):
    """The arguments of ``point_bounds``, checked, but for the radius."""

    seen: Buffers  # float32
    points: FloatArray
    weights: Weights
    options: Options
    model: ErrorModel

    def surface(self, radius: float, directions: bool = True, kind: int = CAST, background: float = np.inf) -> Seen:
        """The view as kernels take it, with depths of that kind (``with_depths``)."""
        seen, view = self.seen, self.seen.view
        depth, room = image_depth(view, seen.depth, self.model)
        made = seen_by(depth, seen.positions, view.world_to_image, radius, None, seen.turns, room)
        made = made._replace(
            normals=NOTHING if seen.normals is None else np.ascontiguousarray(seen.normals),
            directions=np.ascontiguousarray(seen.directions) if directions else NOTHING,
            axis=single(view.cast_from_world[2]),
            right=single(view.world_from_cast[:, 0]),
        )
        return with_depths(made, self.model, kind, background)

    def sums(self, kernel: Callable[..., None], *given: Any) -> tuple[Ends, NDArray[np.int32]]:
        """Least and largest sum of each texel's terms, by a kernel, and the number of terms in doubt."""
        sums = np.zeros((3, *self.seen.depth.shape))
        kernel(*given, self.model.errors, sums)
        return (sums[0], sums[1]), sums[2].astype(np.int32)


def ball_view(buffers: Buffers, seen: Seen, model: ErrorModel) -> BallView:
    """Return a view's textures and mapping as formulas of balls read them."""
    floats = held(float_view(buffers, ()))
    return BallView(
        **{name: getattr(floats, name) for name in ("kind", "rows", "lens", "axes", "width")},
        depth=seen.depth.ravel(),
        positions=seen.positions.ravel(),
        normals=seen.normals.ravel(),
        directions=seen.directions.ravel(),
        turns=turns_of(buffers),
        low=seen.low.ravel(),
        high=seen.high.ravel(),
        by=model.errors,
        turned=buffers.turns is not None,
    )


def held(samples: Any) -> Any:
    """A tuple of float32 numbers and arrays, held as float64; whole numbers stay."""
    return type(samples)(*(np.float64(x) if isinstance(x, np.ndarray | np.floating) else x for x in samples))
