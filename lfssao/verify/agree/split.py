"""The part of the reference's disagreement that is noise of its samples.

Let d be the difference of a pair, and e that of the same texels where samples and turns have another seed. The mean of
d e is what all seeds share, as their noise is independent: what one view sees and the other does not, and where the
nearest texels lie. Noise is the rest of the mean of d^2.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.registry import ESTIMATORS, estimate, find_estimator
from lfssao.ao.textures import Texture
from lfssao.optics.view import without_guard
from lfssao.rendering.folder import reading_manifest
from lfssao.verify.agree.measure import Shared, disagreement
from lfssao.verify.agree.views import Seen, described
from lfssao.verify.case import Case, described_buffers, described_options
from lfssao.verify.diagnosis.sampling import table_seeds


@dataclass(frozen=True)
class Split:
    """The parts of the mean square of the pairs' differences; each may be below 0 by chance."""

    noise: float  # of samples
    rest: float


def split(shared: Shared, own: Sequence[Texture], others: Sequence[Texture]) -> Split:
    """The parts of the disagreement of textures, (H, W) of each view, by those of another seed."""
    values, again = shared.read(own, "the reference"), shared.read(others, "the reference with another seed")
    common = (disagreement(values + again).rms ** 2 - disagreement(values - again).rms ** 2) / 4
    return Split(disagreement(values).rms ** 2 - common, common)


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


def other_samples(seen: Seen) -> NDArray[np.float64] | None:
    """The estimator's samples of another seed; None where they have none."""
    table, folder = _own_samples(described(seen)[0]), seen.folder
    if table is None or folder.settings["weights"] is not None:  # weights are of their samples
        return None
    with reading_manifest(folder.path):
        return next(iter(table_seeds(table, folder.manifest["sampling"]).values()), None)


def _own_samples(case: Case) -> NDArray[np.float64] | None:
    return case.inputs.get("samples", case.inputs.get("points"))


def estimated(seen: Seen, samples: NDArray[np.float64] | None, turn: int) -> Texture:
    """A view's occlusion, (H, W), by samples, None for its own, and turns whose seed is so much larger."""
    case, radius = described(seen)
    assert radius is not None
    parameters, inputs = dict(case.parameters), {**case.inputs, **{each.name: each.texture for each in seen.layers}}
    parameters["rotation_seed"] = (parameters["rotation_seed"] + turn) % 2**64
    table = _own_samples(case) if samples is None else samples
    buffers, options = described_buffers(parameters, inputs), described_options(parameters, radius)
    made = estimate(parameters["estimator"], buffers, radius, table, case.inputs.get("weights"), **options)
    return without_guard(made.texture, seen.view.guard)
