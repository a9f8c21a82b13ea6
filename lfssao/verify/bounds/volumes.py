"""Bounds of ``vo-points`` and ``vo-points-normal``: sums of weighted points of each texel's ball that are hidden.

VO's offset is made of a point by two reflections; no term of it, taken through them and a row in either order, is
rounded more than ``_ROUNDINGS`` times, so a coordinate is off by that times the sizes of its terms.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Value
from lfssao.ao.estimators.vo.kernels.local_frame import TILE
from lfssao.ao.estimators.vo.local_frame import ball_mirrors
from lfssao.core.sums import sum_in_order
from lfssao.verify.bounds.bounds import Bounds, FloatArray, down_to_single, merge_bounds, up_to_single
from lfssao.verify.bounds.kernels.pairs import FLUSHED, SAFETY
from lfssao.verify.bounds.texels import Bools, Numbers, Texels, dot, flat

_ROUNDINGS = 24  # of a term of a reflected offset, rows included; 16 if they are counted


def hidden_volume(
    texels: Texels,
    radius: float,
    points: FloatArray,
    weights: NDArray[np.floating[Any]] | None,
    options: Mapping[str, Value],
    tangent: bool,
) -> Bounds:
    """Bounds of ``vo-points``, or with ``tangent`` of ``vo-points-normal``, of one radius or two.

    Parameters
    ----------
    texels : Texels
        The texels that see a surface.
    radius : float
        R, world units.
    points : (n, 3)
        Points of the unit ball.
    weights : (n,) or None
        Their weights.
    options : mapping
        All of the estimator's parameters.
    tangent : bool
        Whether the ball is reflected by the tangent plane.
    """
    volume = _Volume(texels, points, weights, options, tangent)
    first, second = volume.at(radius), float(options["second"])
    if second == 0:
        return first
    other = volume.at(second * radius)
    if options["combine"] == "minimum":
        return merge_bounds([first, other])
    # a + b (1 - a), or 1 - (1 - a) (1 - b): of numbers up to 1, rounded four times. Of zeros it is zero.
    ends = []
    for one, two, sign in ((first.lower, other.lower, -1), (first.upper, other.upper, 1)):
        a = one.astype(np.float64)
        both = a + two.astype(np.float64) * (1 - a)
        ends.append(np.maximum(both + sign * 4 * texels.model.operation * SAFETY * (both > 0), 0))
    assert first.undecided is not None
    assert other.undecided is not None
    return Bounds(up_to_single(ends[0]), down_to_single(ends[1]), first.undecided + other.undecided)


class _Volume:
    """The hidden fraction of the ball around each texel's place, by weighted points."""

    def __init__(
        self,
        texels: Texels,
        points: FloatArray,
        weights: NDArray[np.floating[Any]] | None,
        options: Mapping[str, Value],
        tangent: bool,
    ) -> None:
        self._texels, self._points = texels, points.astype(np.float32).astype(np.float64)
        given = np.ones(len(points)) if weights is None else np.asarray(weights, np.float64)
        self._fractions = (given / sum_in_order(given.tolist())).astype(np.float32).astype(np.float64)
        mirrors = ball_mirrors(bool(options["randomize"]), int(options["seed"]), np.dtype(np.float32))
        row, column = np.divmod(texels.at, texels.given.depth.shape[1])
        self._mirrors = mirrors[:, row % TILE, column % TILE].T.astype(np.float64)
        self._normals = np.zeros_like(texels.places)
        if tangent:
            self._normals = flat(texels.given.normals)[texels.at].astype(np.float64)
        self._thickness = float(options["thickness"])
        depth = texels.given.depth.ravel().astype(np.float64)
        self._low, self._high = depth.copy(), depth.copy()
        if texels.is_camera:
            z, error = texels.axis_depth(texels.places, np.zeros_like(texels.places))
            self._low[texels.at], self._high[texels.at] = z - error, z + error

    def at(self, radius: float) -> Bounds:
        """Bounds at one radius; weights are added in any order, and what is above 1 is 1."""
        texels, n, r = self._texels, len(self._fractions), self._texels.model.operation
        fewest, most = np.zeros(len(texels.at)), np.zeros(len(texels.at))
        undecided = np.zeros(len(texels.at), np.int32)
        for point, fraction in zip(self._points, self._fractions, strict=True):
            may, must = self._hidden(point, radius)
            fewest += np.where(must, fraction, 0.0)
            most += np.where(may, fraction, 0.0)
            undecided += (may & ~must).astype(np.int32)
        relative = (n + 4) * r * (1 + n * r)
        low = up_to_single(np.minimum(fewest * (1 - relative), 1))
        high = down_to_single(np.minimum(most * (1 + relative), 1))
        return texels.bounds(low, high, undecided)

    def _hidden(self, point: FloatArray, radius: float) -> tuple[Bools, Bools]:
        """Whether one point of each texel's ball may be, and is for sure, hidden."""
        texels = self._texels
        offset, sizes = self._reflected(point)
        k = _ROUNDINGS * texels.model.operation
        off = k * (1 + k) * (np.abs(texels.places) + radius * sizes) + FLUSHED * (1 + radius)
        places = texels.places + radius * offset
        image = texels.project(places, off)
        z, error = texels.axis_depth(places, off) if texels.is_camera else (image.z, image.error[:, 2])
        reach, reach_error = self._reach()

        def hides(which: Numbers, texel: Numbers) -> tuple[Bools, Bools]:
            nearest = z[which] - error[which] - self._high[texel]
            farthest = z[which] + error[which] - self._low[texel]
            may, must = farthest > 0, nearest > 2 * texels.model.smallest
            if reach is not None:
                slack = reach_error[which] + texels.model.operation * np.abs(farthest)
                may &= nearest <= reach[which] + slack
                must &= farthest <= reach[which] - slack
            return may, must

        return texels.decide(image, hides)

    def _reflected(self, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The offset of each texel after both reflections, unit ball, and the sizes of its coordinates' terms."""
        m, n = self._mirrors, self._normals
        offset = point - 2 * dot(m, point)[:, None] * m
        sizes = np.abs(point) + 2 * dot(np.abs(m), np.abs(point))[:, None] * np.abs(m)
        above, size = dot(offset, n), dot(sizes, np.abs(n))
        k = _ROUNDINGS * self._texels.model.operation
        lifted = above < k * (1 + k) * size
        lift, size = np.where(lifted, np.minimum(above, 0), 0), np.where(lifted, size, 0)
        return offset - 2 * lift[:, None] * n, sizes + 2 * size[:, None] * np.abs(n)

    def _reach(self) -> tuple[FloatArray | None, FloatArray]:
        """How far behind its depth a surface hides, cast z, and by how much that is off; None: without end."""
        if not self._thickness > 0:
            return None, np.empty(0)
        w = flat(self._texels.given.directions)[self._texels.at].astype(np.float64)
        axis, model = self._texels.axis[:3], self._texels.model
        steep, size = dot(w, axis), dot(np.abs(w), np.abs(axis))
        error = (self._thickness * size) * (8 * model.operation + model.quotient) * SAFETY
        return self._thickness * steep, error + FLUSHED * (1 + self._thickness)
