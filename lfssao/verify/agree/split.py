"""The parts of the reference's disagreement: noise of its samples, surface that a view does not have, and the rest.

Let d be the difference of a pair, and e that of the same texels where samples and turns have another seed. The mean of
d e is what all seeds share, as their noise is independent; noise is the rest of the mean of d^2. Let x and y be the
differences of the same two seeds where both values are those of the point itself, of one normal and of one turn of the
samples, looked up in the depth of one view and of the other: what differs is the surface that the textures hold. The
mean of x y is the part of surface that one of the views does not have. The rest of d e is the texels' distance from the
point.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.registry import ESTIMATORS, estimate, find_estimator
from lfssao.ao.formulas import words_of
from lfssao.ao.textures import Buffers, Texture
from lfssao.optics.view import without_guard
from lfssao.rendering.folder import reading_manifest
from lfssao.rendering.points import Places, Values
from lfssao.verify.agree.measure import Shared, disagreement
from lfssao.verify.agree.views import Seen, described
from lfssao.verify.case import Case, described_buffers, described_options
from lfssao.verify.diagnosis.sampling import table_seeds

Samples = NDArray[np.float64]


@dataclass(frozen=True)
class Split:
    """The parts of the mean square of the pairs' differences, which they sum to; each may be below 0 by chance."""

    noise: float  # of samples
    missing: float | None  # surface that a view does not have; None, and part of the rest, where it is not known
    rest: float


def split(
    shared: Shared, own: Sequence[Texture], others: Sequence[Texture], alike: tuple[Values, Values] | None = None
) -> Split:
    """The parts of the disagreement of textures, (H, W) of each view, by those of another seed.

    ``alike``: values of both seeds by the same samples at the same points (``Alike``).
    """
    values, again = shared.read(own, "the reference"), shared.read(others, "the reference with another seed")
    square, common = disagreement(values).rms ** 2, _common(values, again)
    if alike is None:
        return Split(square - common, None, common)
    missing = _common(*alike)
    return Split(square - common, missing, common - missing)


def _common(values: Values, again: Values) -> float:
    """The mean product of the differences of two seeds."""
    return (disagreement(values + again).rms ** 2 - disagreement(values - again).rms ** 2) / 4


def has_seed(seen: Seen) -> bool:
    """Whether a view's occlusion can be made with another seed: of one radius, by turns or samples that have one."""
    folder, there = seen.folder, {layer.name for layer in seen.layers}
    with reading_manifest(folder.path):
        if folder.settings["estimator"] not in ESTIMATORS or folder.settings["neighbours"]:
            return False
    case, radius = described(seen)
    reads_normals = find_estimator(case.parameters["estimator"]).reads_normals(case.parameters["options"])
    needed = {"depth", "normals"} if reads_normals else {"depth"}
    seeds = case.parameters["rotation"] == "hash" or other_samples(seen) is not None
    return radius is not None and needed <= there and seeds


def other_samples(seen: Seen) -> Samples | None:
    """The estimator's samples of another seed; None where they have none."""
    table, folder = _own_samples(described(seen)[0]), seen.folder
    if table is None or folder.settings["weights"] is not None:  # weights are of their samples
        return None
    with reading_manifest(folder.path):
        return next(iter(table_seeds(table, folder.manifest["sampling"]).values()), None)


def _own_samples(case: Case) -> Samples | None:
    return case.inputs.get("samples", case.inputs.get("points"))


def estimated(seen: Seen, samples: Samples | None, turn: int) -> Texture:
    """A view's occlusion, (H, W), by samples, None for its own, and turns whose seed is so much larger."""
    return _estimated(seen, _buffers(seen, turn), samples)


def _buffers(seen: Seen, turn: int) -> Buffers:
    """The textures that a view's occlusion is made of, guard band included, with turns of another seed."""
    case, _ = described(seen)
    parameters, inputs = dict(case.parameters), {**case.inputs, **{each.name: each.texture for each in seen.layers}}
    parameters["rotation_seed"] = (parameters["rotation_seed"] + turn) % 2**64
    return described_buffers(parameters, inputs)


def _estimated(seen: Seen, buffers: Buffers, samples: Samples | None) -> Texture:
    case, radius = described(seen)
    assert radius is not None
    table, options = _own_samples(case) if samples is None else samples, described_options(case.parameters, radius)
    made = estimate(case.parameters["estimator"], buffers, radius, table, case.inputs.get("weights"), **options)
    return without_guard(made.texture, seen.view.guard)


class Alike:
    """Values of points by the same samples in every view that sees them: those of the texel that a point comes from.

    Each view's texture is given the points in the places of its texels, with the normals and the turns of the texels
    that they come from, as many at once as fall into texels of their own. None of estimators that make points of depth.
    """

    def __init__(self, shared: Shared) -> None:
        self._shared = shared

    @property
    def known(self) -> bool:
        """Whether the views' estimator reads the points of texels."""
        seen = self._shared.views[0]
        case, radius = described(seen)
        estimator = find_estimator(case.parameters["estimator"])
        if estimator.formulas is None or radius is None:
            return estimator.name == "lf"
        options = estimator.options(**described_options(case.parameters, radius))
        samples = _own_samples(case), case.inputs.get("weights")
        numbers = estimator.formulas(
            _buffers(seen, 0), radius, *(estimator.default_samples() if samples[0] is None else samples), options
        )
        return "position" in words_of(numbers)

    def values(self, own: Sequence[Texture], samples: Samples | None, turn: int) -> Values:
        """Values of all points, (views, n), NaN where one is not seen, by samples and turns as of ``estimated``.

        ``own`` are the views' own textures of these, (H, W), which hold the values of their own points.
        """
        made = self._shared.read(own, "the reference")
        buffers = [_movable(seen, _buffers(seen, turn)) for seen in self._shared.views]
        points = self._origins(buffers)
        for k, (seen, places) in enumerate(zip(self._shared.views, self._shared.places, strict=True)):
            left = np.flatnonzero((places >= 0) & (self._shared.owners != k))
            while len(left):
                _, first = np.unique(places[left], return_index=True)
                chosen, left = left[first], np.delete(left, first)
                moved = _with(buffers[k], _texels(seen, places[chosen]), [own[chosen] for own in points])
                made[k, chosen] = _estimated(seen, moved, samples).reshape(-1)[places[chosen]]
        return made

    def _origins(self, buffers: Sequence[Buffers]) -> list[Texture]:
        """Position, normal and turn, as far as there are any, of the texel that each point comes from, (n, 2 or 3)."""
        made = [np.empty((len(self._shared.owners), each.shape[1]), each.dtype) for each in _planes(buffers[0])]
        for k, (seen, places) in enumerate(zip(self._shared.views, self._shared.places, strict=True)):
            own = self._shared.owners == k
            for points, texture in zip(made, _planes(buffers[k]), strict=True):
                points[own] = texture[_texels(seen, places[own])]
        return made


def _movable(seen: Seen, buffers: Buffers) -> Buffers:
    """The same with points that ``lf``, too, takes from the positions texture, as it does on displays."""
    if described(seen)[0].parameters["estimator"] != "lf":
        return buffers
    view, depth = buffers.view, buffers.view.image_z(buffers.depth)
    return replace(buffers, depth=np.ascontiguousarray(depth), view=replace(view, screen_to_world=None))


def _planes(buffers: Buffers) -> list[Texture]:
    """Positions, and normals and turns as far as there are any, one row a texel."""
    turns = None if buffers.turns is None else np.moveaxis(buffers.turns, 0, 2)
    textures = (buffers.positions, buffers.normals, turns)
    return [texture.reshape(buffers.depth.size, -1) for texture in textures if texture is not None]


def _with(buffers: Buffers, texels: Places, points: Sequence[Texture]) -> Buffers:
    """The textures with other positions, normals and turns of some texels."""
    planes, shape = [np.array(plane) for plane in _planes(buffers)], buffers.depth.shape
    for plane, values in zip(planes, points, strict=True):
        plane[texels] = values
    positions, *more = (plane.reshape(*shape, -1) for plane in planes)
    normals = None if buffers.normals is None else more.pop(0)
    turns = None if buffers.turns is None else np.ascontiguousarray(np.moveaxis(more.pop(0), 2, 0))
    return replace(buffers, positions=positions, normals=normals, turns=turns)


def _texels(seen: Seen, places: Places) -> Places:
    """Texels of the textures with the guard band, by those without."""
    rows, columns = np.divmod(places, seen.view.width - 2 * seen.view.guard)
    return np.asarray((rows + seen.view.guard) * seen.view.width + columns + seen.view.guard)
