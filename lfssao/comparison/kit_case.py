"""A case of a kit as a reference: its outputs as layers, its bounds as intervals."""

import numpy as np

from lfssao.comparison.layers import Layer
from lfssao.comparison.metrics import Planes
from lfssao.image_file import part_of
from lfssao.kit.case import Case
from lfssao.oracle.bounds import Bounds
from lfssao.oracle.judge import INSIDE, OUTSIDE, StageVerdict


class CaseOracle:
    """What is right of a case's outputs.

    Parameters
    ----------
    case : Case
        The case.
    mine : mapping of Layer
        What the other renderer made of it.
    """

    def __init__(self, case: Case, mine: dict[str, Layer]) -> None:
        self._bounds = case.bounds
        self._mine = mine

    def verdict(self, name: str) -> StageVerdict | None:
        """Whether an output is inside its bounds; None where it has none."""
        if name not in self._bounds:
            return None
        lower, upper = (part_of(side).planes for side in self._bounds[name])
        planes: Planes = self._mine[name].planes
        wrong = [~((p >= a) & (p <= b)) for p, a, b in zip(planes, lower, upper, strict=True)]
        outside = np.logical_or.reduce(wrong)
        ends = Bounds(*(np.squeeze(np.stack(side, axis=-1), -1) if len(side) == 1 else np.stack(side, axis=-1)
                        for side in (lower, upper)))  # fmt: skip
        return StageVerdict(name, OUTSIDE if outside.any() else INSIDE, outside, ends)

    def reason(self, name: str, texel: tuple[int, int]) -> str:
        """Nothing: a case says how to compute an output, not why."""
        return ""


def case_layers(case: Case) -> tuple[list[Layer], set[str]]:
    """The outputs of a case as layers, steps on the way first, and the names of those that may be left out."""
    main, *steps = case.outputs
    layers = []
    for name in (*steps, main):
        part = part_of(case.outputs[name])
        layers.append(Layer(name, part.channels, part.planes, None))
    return layers, set(steps)
