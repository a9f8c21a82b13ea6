"""Changes of Algorithms 1 and 2, and of ``point`` and ``hemisphere``, at some texels of one radius.

The image point of each sample is a box, and its depth a range, as in ``lfssao.verify.bounds``: a sample is occluded for
sure, may be, or is clear. Changes of the look-up leave the image points as they are; those of the samples do not.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from math import cos, radians, sin
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import Matrix
from lfssao.samples.kernels import spiral
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.ssao import project_positions
from lfssao.verify.diagnosis.change import (
    INSIDE,
    Axis,
    Change,
    Function,
    Places,
    Problem,
    fixed,
    hold,
    late,
    plain,
    scaled,
)
from lfssao.verify.diagnosis.look_ups import OCCLUDED, beyond_occluded, moved, of_borders, of_places, of_shifts
from lfssao.verify.diagnosis.post import half, of_texture
from lfssao.verify.diagnosis.sampling import other_tables, other_turns, table_seeds, turn_seeds
from lfssao.verify.diagnosis.views import CORNERS, Sight, view_changes
from lfssao.verify.verdict import Flags

_MOST_SAMPLES = 256  # of which other tables are made, and each left out in turn
_MOST_LENGTHS = 32  # samples of which each is scaled in turn

# Fields on which the image points of the samples, and the decisions about them, do not depend.
_LATE = frozenset({"counts", "divisor", "remap", "value", "store"})
_LOOK_UP = _LATE | {"image", "place", "border", "relation", "depth", "reach"}


class Landed(NamedTuple):
    """Image points of samples, (K, n) each, with the errors of u or v and of z."""

    u: FloatArray
    v: FloatArray
    z: FloatArray
    error: FloatArray
    error_z: FloatArray
    may: Flags  # lie in the mapping's domain
    must: Flags


@dataclass(frozen=True, eq=False, kw_only=True)
class Occlusion(Problem):
    """The samples of K texels' surfaces, decided by a renderer's own earlier textures; places include a guard band."""

    depth: NDArray[Any]  # (H, W), which samples are compared with
    points: FloatArray  # (K, 3), world coordinates of the surfaces
    errors: FloatArray  # (K, 3), how far each coordinate is off
    sight: Sight  # the view that samples are mapped by
    samples: FloatArray  # (n, 3), in the unit ball
    radius: float
    model: ErrorModel
    cast_from_world: Matrix
    others: Mapping[str, Sight]  # of other modules, by name
    centre: FloatArray | None  # of the region of interest, metres
    sampling: Mapping[str, Any]  # method and seed of the samples; empty where they are not known
    rotation: str  # the reference's, and its seed
    seed: int
    turns: FloatArray | None = None  # (2, K), cosine and sine by which samples turn
    way: int = 1  # in which they do, or -1, the other
    normals: FloatArray | None = None  # (K, 3), of the half ball
    side: int = 1  # of the normals on which it is, or -1, the other
    face_normals: FloatArray | None = None  # (K, 3), made from positions
    corners: FloatArray | None = None  # (K, 3), points of Algorithm 1 that texels' corners make
    positions: NDArray[Any] | None = None  # (H, W, 3)
    reach: float | None = None  # largest distance of a surface that hides a sample, of the range check
    offset: Function = np.asarray  # applied to the samples' offsets
    image: FloatArray = field(default_factory=lambda: np.eye(3))  # applied to (u, v, 1)
    place: Function | None = None  # applied to u and v before they are looked up
    border: str = "open"  # a rule of ``INSIDE``, or what beyond the border is: open or occluded
    relation: str = "<"  # of the surface's depth and the sample's
    counts: FloatArray | None = None  # (n,), how often each sample counts; once by default
    divisor: float | None = None  # n by default
    remap: bool = False  # to 2 max(0, ao - 1/2)

    kept: ClassVar = {"landed": _LOOK_UP, "decided": _LATE}

    @cached_property
    def landed(self) -> Landed:
        """Image points of the samples."""
        own = self.radius * self.samples
        offsets, sizes = np.broadcast_to(own, (len(self.points), *own.shape)), np.abs(own)
        if self.turns is not None:
            (c, s), (x, y, z) = self.turns[..., None], offsets.transpose(2, 0, 1)
            s = self.way * s
            offsets = np.stack([c * x - s * y, s * x + c * y, z], axis=-1)
            sizes = 4 * np.linalg.norm(own, axis=1, keepdims=True)  # products exceed their sum
        if self.normals is not None:
            below = self.side * np.einsum("ksc,kc->ks", offsets, self.normals) < 0
            offsets = np.where(below[..., None], -offsets, offsets)
        off = self.errors[:, None] + self.model.offset * sizes
        at = self.points[:, None] + self.offset(offsets)
        places, error, must = project_positions(at, off, self.sight.mapping, self.model)
        u, v, z = np.ascontiguousarray(places.transpose(2, 0, 1))
        largest = np.maximum(error[..., 0], error[..., 1])
        return Landed(u, v, z, largest, error[..., 2], error[..., 0] > -np.inf, must)

    @cached_property
    def decided(self) -> tuple[FloatArray, FloatArray]:
        """Whether each sample is for sure and may be occluded, (K, n) of 0 and 1."""
        at = self.landed
        (a, b, c), (d, e, f), _ = self.image
        u, v = (np.fmax(np.fmin(x, 1e6), -1e6) for x in (a * at.u + b * at.v + c, d * at.u + e * at.v + f))
        error = np.where(at.may & np.isfinite(at.error), at.error, 0.0)
        looked = (u - error, u + error, v - error, v + error)
        ends = [np.floor(x if self.place is None else self.place(x)).astype(np.int64) for x in looked]
        surely, maybe = self._compared(ends[0], ends[2], at.z, at.error_z, self.points[:, None])
        k, s = np.nonzero((ends[0] != ends[1]) | (ends[2] != ends[3]))  # few; all else reads one texel
        columns, rows = (np.stack([ends[end][k, s] for end in corners]) for corners in ((1, 0, 1), (2, 3, 3)))
        here, there = self._compared(columns, rows, at.z[k, s], at.error_z[k, s], self.points[k])
        surely[k, s] &= here.all(axis=0)
        maybe[k, s] |= there.any(axis=0)
        return (surely & at.must & at.may).astype(np.float64), (maybe & at.may).astype(np.float64)

    def _compared(
        self, column: Places, row: Places, z: FloatArray, error: FloatArray, points: FloatArray
    ) -> tuple[Flags, Flags]:
        """Whether samples that read such a column and row are occluded for sure, and may be; points: their texels'."""
        height, width = self.depth.shape
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        surface = self.depth[hold(row, height, self.border), hold(column, width, self.border)].astype(np.float64)
        if self.border not in INSIDE:
            surface = np.where(inside, surface, -np.inf if self.border == OCCLUDED else np.inf)
        low, high, near = z - error, z + error, np.True_
        if self.reach is not None and self.positions is not None:
            there = self.positions[hold(row, height, "clamp"), hold(column, width, "clamp")].astype(np.float64)
            near = (((there - points) ** 2).sum(axis=-1) <= self.reach * self.reach) | ~inside
        if self.relation == ">":
            return (surface > high) & inside & near, (surface > low) & inside & near
        ties = (surface == z.astype(np.float32)) & (self.relation == "<=")
        return ((surface < low) | ties) & near, ((surface < high) | ties) & near

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Fewest and most occluded samples over their number, rounded as renderers may."""
        n = len(self.samples)
        counts, divisor = np.ones(n) if self.counts is None else self.counts, self.divisor or n
        room = self.model.quotient + n * self.model.operation
        fewest, most = (decided @ counts / divisor for decided in self.decided)
        low, high = fewest * (1 - room), most * (1 + room)
        return (2 * np.maximum(low - 0.5, 0), 2 * np.maximum(high - 0.5, 0)) if self.remap else (low, high)

    def leaves(self) -> Flags:
        """Whether a sample of each texel lies outside the texture, or may."""
        at, (height, width) = self.landed, self.depth.shape
        e = np.where(np.isfinite(at.error), at.error, 0.0)
        out = (at.u - e < 0) | (at.u + e >= width) | (at.v - e < 0) | (at.v + e >= height)
        return np.asarray(np.any(out & at.may, axis=1))

    def seen_by(self, sight: Sight) -> "Occlusion | None":
        """Occlusion by another sight."""
        if sight.middle != self.sight.middle:  # positions are given: a sample's texel is the one around its middle
            by = self.sight.middle - sight.middle
            shifted: Occlusion = moved(self, [[1, 0, by], [0, 1, by], [0, 0, 1]])
            return shifted
        made = self.changed(sight=sight, depth=sight.deepened(self.depth))
        if self.corners is None:
            return made
        own = self.sight.depth_of(self.depth[self.rows, self.columns])
        return made.changed(points=sight.points(self.columns, self.rows, own))

    def changes(self) -> list[Change]:
        """All changes that are tried, those without values first."""
        n = len(self.samples)
        made = [*of_texture(self), *_of_look_ups(*self.depth.shape), *self._of_turns(), *self._of_range()]
        if self.remap:
            made.append(fixed("flat surfaces hide themselves, ao in place of 2 max(0, ao - 1/2)", remap=False))
        else:
            made.append(fixed("2 max(0, ao - 1/2) in place of ao", remap=True))
        for divisor in [d for d in range(1, 3 * n) if d != n][:_MOST_SAMPLES]:
            made.append(fixed(f"count divided by {divisor} in place of {n}", divisor=divisor))
        if n <= _MOST_SAMPLES:
            made += _of_counts(n)
            made += [fixed(words, samples=table) for words, table in other_tables(self.samples)]
            seeds = table_seeds(self.samples, self.sampling)
            made += [late(fixed(words, samples=table)) for words, table in seeds.items()]
        made += [
            change
            for change in view_changes(self.sight, self.centre, self.others)
            if change.kind != CORNERS or self.corners is None
        ]
        linear, shift = self.cast_from_world[:, :3].T, self.cast_from_world[:, 3]
        made += [
            plain("positions in physical space", lambda p: p.changed(points=p.points @ linear + shift)),
            plain("positions of half precision", lambda p: p.changed(points=half(p.points))),
            fixed("offsets of half precision", offset=half),
            fixed("u and v of half precision", place=half),
            fixed("offsets with x and y exchanged", offset=lambda offsets: offsets[..., [1, 0, 2]]),
        ]
        if self.corners is not None:
            made.append(plain(CORNERS, lambda p: p.changed(points=p.corners)))
        if self.normals is not None:
            made += [
                fixed("samples not turned to the normal's side", normals=None),
                fixed("normals with the other sign", side=-1),
                plain("normals made from positions", lambda p: p.changed(normals=p.face_normals)),
            ]
        return [*made, *self._with_values()]

    def _of_range(self) -> Iterator[Change]:
        """The range check, with and without."""
        if self.reach is not None:
            yield fixed("no range check", reach=None)
        elif self.positions is not None:
            yield plain("a range check", lambda p: p.changed(reach=p.radius))

    def _of_turns(self) -> Iterator[Change]:
        """Samples that turn from texel to texel otherwise, or not."""
        if self.turns is not None:
            yield fixed("samples are not turned", turns=None)
            yield fixed("samples turned the other way", way=-1)
        for words, make in other_turns(self.rotation, self.seed, *self.depth.shape):
            yield plain(words, partial(_turned_by, make))
        for words, number in turn_seeds(self.rotation, self.seed):
            yield late(plain(words, partial(_turned_by_seed, number)))

    def _with_values(self) -> list[Change]:
        at = self.landed
        deepest, nearest = (end(at.z, axis=1, where=at.may, initial=0.0) for end in (np.max, np.min))
        reach = (float(np.median(deepest - nearest)) if len(at.z) else 0.0) / 2 or 1.0
        finite = self.depth[np.isfinite(self.depth)]
        size = float(np.median(np.abs(finite))) if finite.size else 1.0
        most = min(max(2 * reach / size, 1e-3), 2.0) if size else 1.0

        def turn(p: Occlusion, degrees: float) -> Occlusion:
            c, s = cos(radians(degrees)), sin(radians(degrees))
            return p.changed(samples=p.samples @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))

        turned, bias = (
            Axis(0.005, 181.0, more=tuple(np.arange(11.3, 180.0, 11.3)), signed=False),
            Axis(1e-5 * reach, 2 * reach),
        )
        return [
            scaled("radius", lambda p, f: p.changed(radius=p.radius * f)),
            *of_shifts(),
            scaled("depth bias", lambda p, b: p.changed(depth=p.depth + b), bias, "depth {}"),
            scaled(
                "depth scale", lambda p, s: p.changed(depth=p.depth * s), Axis(1e-5 * most, most, True), "depth x {}"
            ),
            scaled("turned samples", turn, turned, "samples turned by {} degrees about z"),
            *map(_of_length, range(len(self.samples) if len(self.samples) <= _MOST_LENGTHS else 0)),
        ]


def _of_look_ups(height: int, width: int) -> list[Change]:
    return [
        *of_places(height, width),
        beyond_occluded(),
        *of_borders(),
        fixed("surDepth <= smp.z in place of <", relation="<="),
        fixed("surDepth > smp.z in place of <", relation=">"),
        plain("depth with the other sign", lambda p: p.changed(depth=-p.depth)),
        plain(
            "background counted as occluder",
            lambda p: p.changed(depth=np.where(np.isposinf(p.depth), -np.inf, p.depth)),
        ),
        plain("depth of half precision", lambda p: p.changed(depth=half(p.depth))),
    ]


def _of_counts(n: int) -> Iterator[Change]:
    """Samples that are missing or count twice; their number stays, or changes with them."""
    for k in range(n):
        at = (np.arange(n) == k).astype(np.float64)
        for words, counts, total in (("dropped", 1 - at, n - 1), ("doubled", 1 + at, n + 1)):
            for divisor in (n, total) if total else (n,):
                yield fixed(f"sample {k} {words}, count divided by {divisor}", counts=counts, divisor=divisor)
    for m in range(1, n - 1):
        for divisor in (n, m):
            first = (np.arange(n) < m).astype(np.float64)
            words = f"the first {m} samples alone, count divided by {divisor}"
            yield fixed(words, counts=first, divisor=divisor)


def _of_length(k: int) -> Change:
    """Sample k as much longer."""

    def scale(problem: Occlusion, factor: float) -> Occlusion:
        alone = np.arange(len(problem.samples)) == k
        return problem.changed(samples=problem.samples * np.where(alone, factor, 1.0)[:, None])

    return scaled(f"length of sample {k}", scale, Axis(1e-5, 0.7, factor=True, number=6), f"sample {k} x {{}}")


def _turned_by(make: Callable[[], NDArray[Any]], problem: Occlusion) -> Occlusion:
    return problem.changed(turns=make()[:, problem.rows, problem.columns].astype(np.float64))


def _turned_by_seed(seed: int, problem: Occlusion) -> Occlusion:
    angles, turns = np.empty((1, len(problem.rows))), np.empty((2, 1, len(problem.rows)), np.float32)
    spiral.random_angles_at(np.uint64(seed), problem.rows, problem.columns, angles[0])
    spiral.turns_of(angles, turns)
    return problem.changed(turns=turns[:, 0].astype(np.float64))
