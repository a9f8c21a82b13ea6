"""Changes of occlusion that is a share of samples: of Algorithms 1 and 2, ``point`` and ``hemisphere``.

The formulas of ``point`` evaluate ``lf``. If the view has an inverse, the points are those that Algorithm 1
reconstructs from depth.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import cos, radians, sin
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lfssao.optics.view import View
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.diagnosis.buffers import with_view
from lfssao.verify.diagnosis.change import Axis, Change, fixed, plain, scaled
from lfssao.verify.diagnosis.estimated import REMAPPED, Estimated, with_buffers
from lfssao.verify.diagnosis.formulated import NEAREST, Formulated
from lfssao.verify.diagnosis.post import half
from lfssao.verify.diagnosis.views import Sight

_MOST_LENGTHS = 32  # largest number of samples that are scaled in turn
_TURNS = Axis(0.005, 181.0, more=tuple(np.arange(11.3, 180.0, 11.3)), signed=False)


@dataclass(frozen=True, eq=False, kw_only=True)
class Counted(Formulated):
    """K texels of a share of samples; rows and columns include a guard band."""

    points: FloatArray  # of equal weight
    unprojected: bool = False  # whether surfaces' points are reconstructed from depth

    counts: ClassVar[bool] = True
    fewest: ClassVar[int] = 4
    total: ClassVar[str] = "count"
    as_before: ClassVar[str] = ", count divided by {count}"
    anew: ClassVar[str] = ", count divided by {rest}"

    def _numbers(self, radius: float) -> Any:
        """The formulas at a radius, of one type with and without a range check, so that one kernel is compiled."""
        return super()._numbers(radius)._replace(positions=True)

    def _bounds(self) -> None:
        """No bounds: values differ by whole samples, and few samples are undecided."""

    def with_sight(self, sight: Sight) -> Estimated | None:
        """Occlusion with another sight."""
        if not self.unprojected:
            return super().with_sight(sight)
        depth = self.buffers.depth[self.rows, self.columns].astype(np.float64)
        surface_points = sight.points(self.columns, self.rows, depth)
        return self.changed(sight=sight, buffers=with_view(self.buffers, sight.view), surface_points=surface_points)

    def changes(self) -> list[Change]:
        """All changes to try, changes without values first."""
        changes = [*super().changes(), *self._matrix_changes()]
        changes.append(fixed("offsets of half precision", points=half(self.radius * self.points) / self.radius))
        for change in [change for change in changes if change.kind == "samples turned the other way"]:
            changes.append(plain("offsets with x and y exchanged", partial(_with_exchanged_offsets, change)))
        if "remap" not in self.options:
            changes.append(plain(REMAPPED, lambda p: p.then(lambda x: 2 * np.maximum(x - 0.5, 0))))
        if self.estimator.normals:
            words = "samples not turned to the normal's side"
            changes.append(with_buffers(words, normals=lambda b: np.zeros_like(b.normals)))
        changes.append(scaled("turned samples", _turned_samples, _TURNS, "samples turned by {} degrees about z"))
        return [*changes, *map(_length_change, range(len(self.points) if len(self.points) <= _MOST_LENGTHS else 0))]

    def _matrix_changes(self) -> Iterator[Change]:
        """Yield one of the two matrices of Algorithm 1 from another view, or points of another view's depth."""
        for view, sight in self.others.items() if self.unprojected else ():
            with_matrix = partial(_with_matrix, view=sight.view)
            yield plain(f"the matrix world to image of {view}, the inverse of its own", with_matrix)
            yield plain(f"the inverse matrix of {view}, world to image of its own", partial(_with_inverse, sight=sight))
        for view, depth in self.textures("depth").items() if self.unprojected else ():
            yield plain(f"the depth of {view}, and points of it", partial(_with_depth, depth=depth))

    def _tie_changes(self) -> Iterator[Change]:
        """Yield other comparisons of the surface's depth with the sample's."""
        yield fixed("surDepth <= smp.z in place of <", ties=-1)
        yield fixed("surDepth > smp.z in place of <", sign=-1, background=NEAREST)


def _with_matrix(problem: Counted, view: View) -> Counted:
    """The problem with points of its own depth, and another view's mapping of samples."""
    return problem.changed(buffers=with_view(problem.buffers, view))


def _with_depth(problem: Counted, depth: NDArray[Any]) -> Counted:
    """The problem with points and look-ups in another depth texture."""
    made = problem.changed(buffers=replace(problem.buffers, depth=depth))
    return _with_inverse(made, made.sight)


def _with_inverse(problem: Counted, sight: Sight) -> Counted:
    """The problem with points that another sight reconstructs from its depth."""
    depth = problem.buffers.depth[problem.rows, problem.columns].astype(np.float64)
    return problem.changed(surface_points=sight.points(problem.columns, problem.rows, depth))


def _with_exchanged_offsets(other: Change, problem: Counted) -> Any:
    """The problem with x and y of turned offsets exchanged: exchanged samples that turn the other way."""
    return other.apply(problem.changed(points=problem.points[:, [1, 0, 2]]), ())


def _turned_samples(problem: Counted, degrees: float) -> Counted:
    c = cos(radians(degrees))
    s = sin(radians(degrees))
    return problem.changed(points=problem.points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))


def _length_change(k: int) -> Change:
    """The change of sample k by a factor."""

    def scale(problem: Counted, factor: float) -> Counted:
        alone = np.arange(len(problem.points)) == k
        return problem.changed(points=problem.points * np.where(alone, factor, 1.0)[:, None])

    return scaled(f"length of sample {k}", scale, Axis(1e-5, 0.7, factor=True, number=6), f"sample {k} x {{}}")
