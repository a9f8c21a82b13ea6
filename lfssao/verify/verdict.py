"""Verdicts on one texture, with their exit codes and the evidence."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.verify.bounds.bounds import Bounds

Plane = NDArray[Any]
Planes = tuple[Plane, ...]
Flags = NDArray[np.bool_]

# As idiff's.
SAME, WARNING, FAILED, NOT_COMPARABLE, FILE_ERROR = range(5)


class Verdict(Enum):
    """A verdict on a texture, with its title and its exit code."""

    EQUAL_BITS = "equal bits", SAME
    EQUAL_VALUES = "equal values", SAME
    INSIDE = "inside the interval", SAME
    INSIDE_WEAKLY = "inside, weakly", WARNING
    WITHIN = "within tolerance", WARNING
    OUTSIDE = "outside the interval", FAILED
    DIFFERENT = "different", FAILED
    MISSING = "missing", FAILED
    MISMATCH = "not comparable", NOT_COMPARABLE
    UNREADABLE = "file error", FILE_ERROR

    def __init__(self, title: str, code: int) -> None:
        self.title = title
        self.code = code

    @property
    def short(self) -> str:
        """The title, short enough for a table."""
        return self.title.partition(" the ")[0]


WRONG = (Verdict.OUTSIDE, Verdict.DIFFERENT)  # verdicts on comparable textures that do not conform


@dataclass(frozen=True, eq=False)
class Judgement:
    """A verdict and its evidence.

    Flags have the texture's shape, or (0,) if it was not compared. ``differing`` marks numbers that differ in a bit,
    ``outside`` numbers outside the bounds or, without bounds, of another value. Bounds are None if bits are equal or no
    bounds are known.
    """

    verdict: Verdict
    detail: str = ""  # why it was not compared
    differing: Flags = field(default_factory=lambda: np.zeros(0, np.bool_))
    outside: Flags = field(default_factory=lambda: np.zeros(0, np.bool_))
    bounds: Bounds | None = None


def interval_verdict(outside: Flags, outliers: int) -> Verdict:
    """INSIDE if at most ``outliers`` texels are outside their bounds, else OUTSIDE."""
    return Verdict.INSIDE if np.count_nonzero(texels(outside)) <= outliers else Verdict.OUTSIDE


def texels(flags: Flags) -> Flags:
    """Flags of texels (H, W) from flags of numbers (H, W, C), (H, W) or (W,): any flag of a texel's numbers counts."""
    return np.any(flags, axis=-1) if flags.ndim == 3 else np.atleast_2d(flags)


def equal_bits(a: Plane, b: Plane) -> Flags:
    """Whether the numbers of two arrays of one type have the same bits."""
    kind = f"u{a.dtype.itemsize}"
    return np.asarray(a.view(kind) == b.view(kind))


def equal_values(a: Plane, b: Plane) -> Flags:
    """Whether the numbers of two arrays have equal values: -0 is +0, NaN is NaN, +inf is not -inf."""
    return np.asarray((a == b) | (np.isnan(a) & np.isnan(b)))
