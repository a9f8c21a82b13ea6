"""Disagreement of views: the differences between their values of the same point of the surface.

A point is a surface texel of one view. Another view sees it if its surface, at the nearest texel, is near enough. The
values of a point in all views that see it form pairs. The disagreement is the mean square of the differences over all
pairs of all points. Sums are exact and rounded once, so that no order of views or points changes a bit.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import fsum, sqrt

import numpy as np

from lfssao.errors import InputError
from lfssao.rendering.points import Places, Points, Texture, Values, places_of, read_at, spread_points
from lfssao.verify.agree.views import RenderedView

MOST = 20_000  # points, of all views together
LIMIT = 0.1  # a difference beyond this is seen


@dataclass(frozen=True)
class Disagreement:
    """Differences between pairs of values of the same point."""

    rms: float  # root mean square
    above: float  # share of the pairs that differ by more than ``LIMIT``


@dataclass(frozen=True, eq=False)
class Shared:
    """Points of the surface that are seen by several views."""

    views: Sequence[RenderedView]
    tolerance: float  # largest distance of a view's surface from a point that it sees, world units
    candidates: int  # number of points before the search
    points: Points  # (n, 3), world coordinates of the points that two views or more see
    owners: Places  # (n,), numbers of the views of which the points are texels
    places: Sequence[Places]  # (n,) for each view: the texel of each point, -1 if it is not seen

    def read(self, textures: Sequence[Texture], source: str) -> Values:
        """Values of all points in textures, (H, W) of each view: (views, n) float64, NaN for points that are not seen.

        InputError, with ``source`` in its text, if a value of a seen point is not finite.
        """
        values = np.stack([read_at(*both) for both in zip(self.places, textures, strict=True)])
        for rendered, values_of_view, places in zip(self.views, values, self.places, strict=True):
            if not np.isfinite(values_of_view[places >= 0]).all():
                raise InputError(f"{source}: occlusion of {rendered.name} is not finite everywhere on the surface")
        return values

    @property
    def pairs(self) -> int:
        """Number of pairs of values."""
        counts = sum((places >= 0).astype(np.int64) for places in self.places)
        return int(np.sum(counts * (counts - 1) // 2))


def share_points(views: Sequence[RenderedView], tolerance: float | None = None) -> Shared:
    """Points on the surfaces of all views that at least two views see; InputError if there are none.

    By default the tolerance is two texels: 2 / width times the diagonal of all seen points.
    """
    points_of_views = [spread_points(rendered.arrays["positions"], max(1, MOST // len(views))) for rendered in views]
    points = np.concatenate(points_of_views)
    owners = np.repeat(np.arange(len(views)), [len(owned) for owned in points_of_views])
    if tolerance is None:
        x, y, z = (np.ptp(points, axis=0) if len(points) else np.zeros(3)).tolist()
        width = min(rendered.view.width - 2 * rendered.view.guard for rendered in views)
        tolerance = 2 * sqrt((x * x + y * y) + z * z) / width
    places = [places_of(points, rendered.view, rendered.arrays["positions"], tolerance) for rendered in views]
    is_shared = sum((owned >= 0).astype(np.int64) for owned in places) >= 2
    if not np.any(is_shared):
        raise InputError(f"no point of the surface is seen by two views, within {tolerance:.3g}")
    shared_places = [owned[is_shared] for owned in places]
    return Shared(views, tolerance, len(points), points[is_shared], owners[is_shared], shared_places)


def disagreement(values: Values) -> Disagreement:
    """The disagreement of values, (views, n), with NaN for points that a view does not see."""
    square = mean_over_pairs(values, lambda a, b: (a - b) * (a - b))
    above = mean_over_pairs(values, lambda a, b: (np.abs(a - b) > LIMIT).astype(np.float64))
    return Disagreement(sqrt(square), above)


def mean_over_pairs(values: Values, term: Callable[[Values, Values], Values]) -> float:
    """The mean of a symmetric function of two values, over all pairs of all points; at least one pair exists."""
    sums = list[float]()
    count = 0
    for a, b in combinations(values, 2):
        finite = np.isfinite(a) & np.isfinite(b)
        sums.append(fsum(term(a[finite], b[finite]).tolist()))
        count += int(finite.sum())
    return fsum(sums) / count
