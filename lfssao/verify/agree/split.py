"""The parts of the reference's disagreement: noise of its samples, surface that a view lacks, and the rest.

Let d be the difference of a pair, and e the difference of the same texels with another seed of samples and turns. The
noise of both seeds is independent, so the mean of d e is the common part, and noise is the rest of the mean of d^2.

Let x and y be the differences of the same two seeds if both values are computed at the point itself, with the same
normal and turn, in the depth of one view and of the other. Only the surfaces in the textures then differ. So the mean
of x y is the part of surfaces that one view lacks. The rest of d e is due to the texels' distance from the point.
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
from lfssao.verify.agree.views import RenderedView, occlusion_case
from lfssao.verify.case import Case, described_buffers, described_options
from lfssao.verify.diagnosis.sampling import table_seeds

Samples = NDArray[np.float64]


@dataclass(frozen=True)
class Split:
    """The parts of the mean square of the pairs' differences, which is their sum; each may be negative by chance."""

    noise: float  # of samples
    missing: float | None  # surface that a view lacks; None if unknown, and then part of the rest
    rest: float


def split(
    shared: Shared,
    textures: Sequence[Texture],
    other_textures: Sequence[Texture],
    same_samples: tuple[Values, Values] | None = None,
) -> Split:
    """The parts of the disagreement of textures, (H, W) of each view, with the textures of another seed.

    ``same_samples`` are values of both seeds with the same samples at the same points (``SameSamples``).
    """
    values = shared.read(textures, "the reference")
    other_values = shared.read(other_textures, "the reference with another seed")
    square = disagreement(values).rms ** 2
    shared_mean = _shared_mean(values, other_values)
    if same_samples is None:
        return Split(square - shared_mean, None, shared_mean)
    missing = _shared_mean(*same_samples)
    return Split(square - shared_mean, missing, shared_mean - missing)


def _shared_mean(values: Values, other_values: Values) -> float:
    """The mean product of the differences with two seeds."""
    return (disagreement(values + other_values).rms ** 2 - disagreement(values - other_values).rms ** 2) / 4


def has_seed(rendered: RenderedView) -> bool:
    """Whether a view's occlusion can be computed with another seed: at one radius, with seeded turns or samples."""
    folder = rendered.folder
    names = {layer.name for layer in rendered.layers}
    with reading_manifest(folder.path):
        if folder.settings["estimator"] not in ESTIMATORS or folder.settings["neighbours"]:
            return False
    case, radius = occlusion_case(rendered)
    reads_normals = find_estimator(case.parameters["estimator"]).reads_normals(case.parameters["options"])
    required = {"depth", "normals"} if reads_normals else {"depth"}
    is_seeded = case.parameters["rotation"] == "hash" or other_samples(rendered) is not None
    return radius is not None and required <= names and is_seeded


def other_samples(rendered: RenderedView) -> Samples | None:
    """The estimator's samples with another seed; None if they have no seed."""
    table = _own_samples(occlusion_case(rendered)[0])
    folder = rendered.folder
    if table is None or folder.settings["weights"] is not None:  # weights are of their samples
        return None
    with reading_manifest(folder.path):
        return next(iter(table_seeds(table, folder.manifest["sampling"]).values()), None)


def _own_samples(case: Case) -> Samples | None:
    return case.inputs.get("samples", case.inputs.get("points"))


def estimated(rendered: RenderedView, samples: Samples | None, turn: int) -> Texture:
    """A view's occlusion, (H, W), with samples, None for its own; ``turn`` is added to the seed of the turns."""
    return _estimated(rendered, _buffers(rendered, turn), samples)


def _buffers(rendered: RenderedView, turn: int) -> Buffers:
    """The input textures of a view's occlusion, guard band included; ``turn`` is added to the seed of the turns."""
    case, _ = occlusion_case(rendered)
    parameters = dict(case.parameters)
    inputs = {**case.inputs, **{each.name: each.texture for each in rendered.layers}}
    parameters["rotation_seed"] = (parameters["rotation_seed"] + turn) % 2**64
    return described_buffers(parameters, inputs)


def _estimated(rendered: RenderedView, buffers: Buffers, samples: Samples | None) -> Texture:
    case, radius = occlusion_case(rendered)
    assert radius is not None
    table = _own_samples(case) if samples is None else samples
    options = described_options(case.parameters, radius)
    occlusion = estimate(case.parameters["estimator"], buffers, radius, table, case.inputs.get("weights"), **options)
    return without_guard(occlusion.texture, rendered.view.guard)


class SameSamples:
    """Values of points with the same samples in every view: those of the texel from which a point comes.

    In each view's textures, points replace its texels, with the normals and turns of their original texels. Points that
    fall into different texels are computed at once. Estimators that reconstruct points from depth are not supported.
    """

    def __init__(self, shared: Shared) -> None:
        self._shared = shared

    @property
    def is_known(self) -> bool:
        """Whether the views' estimator reads positions of texels."""
        rendered = self._shared.views[0]
        case, radius = occlusion_case(rendered)
        estimator = find_estimator(case.parameters["estimator"])
        if estimator.formulas is None or radius is None:
            return estimator.name == "lf"
        options = estimator.options(**described_options(case.parameters, radius))
        samples = _own_samples(case), case.inputs.get("weights")
        numbers = estimator.formulas(
            _buffers(rendered, 0), radius, *(estimator.default_samples() if samples[0] is None else samples), options
        )
        return "position" in words_of(numbers)

    def values(self, textures: Sequence[Texture], samples: Samples | None, turn: int) -> Values:
        """Values of all points, (views, n), NaN if a point is not seen, with samples and turns as in ``estimated``.

        ``textures`` are the views' textures with these samples, (H, W), which hold the values of their own points.
        """
        values = self._shared.read(textures, "the reference")
        buffers = [_with_positions(rendered, _buffers(rendered, turn)) for rendered in self._shared.views]
        points = self._origins(buffers)
        for k, (rendered, places) in enumerate(zip(self._shared.views, self._shared.places, strict=True)):
            remaining = np.flatnonzero((places >= 0) & (self._shared.owners != k))
            while len(remaining):
                _, first = np.unique(places[remaining], return_index=True)
                chosen = remaining[first]
                remaining = np.delete(remaining, first)
                texels = _padded_texels(rendered, places[chosen])
                moved = _with_texels(buffers[k], texels, [origin[chosen] for origin in points])
                values[k, chosen] = _estimated(rendered, moved, samples).reshape(-1)[places[chosen]]
        return values

    def _origins(self, buffers: Sequence[Buffers]) -> list[Texture]:
        """Position, normal and turn, if there are any, of the original texel of each point, (n, 2 or 3)."""
        origins = [np.empty((len(self._shared.owners), each.shape[1]), each.dtype) for each in _texel_rows(buffers[0])]
        for k, (rendered, places) in enumerate(zip(self._shared.views, self._shared.places, strict=True)):
            owned = self._shared.owners == k
            for points, texture in zip(origins, _texel_rows(buffers[k]), strict=True):
                points[owned] = texture[_padded_texels(rendered, places[owned])]
        return origins


def _with_positions(rendered: RenderedView, buffers: Buffers) -> Buffers:
    """The buffers of a view whose positions ``lf`` reads, as on displays; it does not reconstruct them from depth."""
    if occlusion_case(rendered)[0].parameters["estimator"] != "lf":
        return buffers
    view = buffers.view
    depth = buffers.view.image_z(buffers.depth)
    return replace(buffers, depth=np.ascontiguousarray(depth), view=replace(view, screen_to_world=None))


def _texel_rows(buffers: Buffers) -> list[Texture]:
    """Positions, and normals and turns if there are any, one row for each texel."""
    turns = None if buffers.turns is None else np.moveaxis(buffers.turns, 0, 2)
    textures = (buffers.positions, buffers.normals, turns)
    return [texture.reshape(buffers.depth.size, -1) for texture in textures if texture is not None]


def _with_texels(buffers: Buffers, texels: Places, points: Sequence[Texture]) -> Buffers:
    """The textures with other positions, normals and turns at ``texels``."""
    planes = [np.array(plane) for plane in _texel_rows(buffers)]
    shape = buffers.depth.shape
    for plane, values in zip(planes, points, strict=True):
        plane[texels] = values
    positions, *others = (plane.reshape(*shape, -1) for plane in planes)
    normals = None if buffers.normals is None else others.pop(0)
    turns = None if buffers.turns is None else np.ascontiguousarray(np.moveaxis(others.pop(0), 2, 0))
    return replace(buffers, positions=positions, normals=normals, turns=turns)


def _padded_texels(rendered: RenderedView, places: Places) -> Places:
    """Indices of texels with the guard band, from indices without it."""
    rows, columns = np.divmod(places, rendered.view.width - 2 * rendered.view.guard)
    return np.asarray((rows + rendered.view.guard) * rendered.view.width + columns + rendered.view.guard)
