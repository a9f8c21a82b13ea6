"""What is said of one texture: the verdicts with their exit codes, and the texels that they rest on."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.verify.bounds.bounds import Bounds

Plane = NDArray[Any]
Planes = tuple[Plane, ...]

# As idiff's; 1, warnings only, is what a whole report may have.
SAME, WARNING, FAILED, NOT_COMPARABLE, FILE_ERROR = range(5)


class Verdict(Enum):
    """What is said of a texture, with the exit code that it leads to."""

    EQUAL_BITS = "equal bits", SAME
    EQUAL_VALUES = "equal values", SAME
    INSIDE = "inside the interval", SAME
    OUTSIDE = "outside the interval", FAILED
    DIFFERENT = "different", FAILED
    MISSING = "missing", FAILED
    MISMATCH = "not comparable", NOT_COMPARABLE
    UNREADABLE = "file error", FILE_ERROR

    def __init__(self, title: str, code: int) -> None:
        self.title = title
        self.code = code


def _nothing() -> NDArray[np.bool_]:
    return np.zeros(0, np.bool_)


@dataclass(frozen=True, eq=False)
class Judged:
    """A verdict and the texels that it rests on.

    Attributes
    ----------
    verdict : Verdict
        What is said of the texture.
    detail : str
        Why it was not compared; '' where it was.
    differing : bool array
        Texels that differ in a bit.
    outside : bool array
        Texels outside the bounds; where none are known, texels of another value.
    bounds : Bounds or None
        What the texture was held to; None where its bits are equal or no bounds are known.
    """

    verdict: Verdict
    detail: str = ""
    differing: NDArray[np.bool_] = field(default_factory=_nothing)
    outside: NDArray[np.bool_] = field(default_factory=_nothing)
    bounds: Bounds | None = None


def equal_bits(a: Plane, b: Plane) -> NDArray[np.bool_]:
    """Where two arrays of one type have the same bits."""
    kind = f"u{a.dtype.itemsize}"
    return np.asarray(a.view(kind) == b.view(kind))


def equal_values(a: Plane, b: Plane) -> NDArray[np.bool_]:
    """Where two arrays have equal values: -0 is +0, one NaN is as good as another, +inf is not -inf."""
    return np.asarray((a == b) | (np.isnan(a) & np.isnan(b)))
