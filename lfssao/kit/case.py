"""What a conformance case is."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Arrays = Mapping[str, NDArray[Any]]
Bounds = Mapping[str, tuple[NDArray[np.float32], NDArray[np.float32]]]


@dataclass(frozen=True, eq=False)
class Case:
    """One small problem of one stage, and its solution.

    Attributes
    ----------
    name : str
        What the kit's folder and the tests call it.
    stage : str
        The stage that it tests (``lfssao.kit.stages.STAGES``).
    title : str
        One line on what is special about it.
    parameters : mapping
        The stage's parameters: numbers, strings, and lists and mappings of them.
    inputs, outputs : mapping of arrays
        What the stage is given and must return; the first output is the one that counts, those behind it are steps on
        the way and can be left out.
    bounds : mapping of pairs of arrays
        Lower and upper bound of outputs by their names, for a renderer within the error model of shading languages; an
        output without bounds must be met to the bit by everybody.
    specified : bool
        Whether SPECIFICATION.md says how to compute it.
    """

    name: str
    stage: str
    title: str
    parameters: Mapping[str, Any]
    inputs: Arrays
    outputs: Arrays
    bounds: Bounds = field(default_factory=dict)
    specified: bool = True
