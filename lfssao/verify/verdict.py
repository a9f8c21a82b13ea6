"""Verdicts on one texture, with their exit codes and the numbers that they rest on."""

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
    """A verdict on a texture, with the exit code that it leads to."""

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
        """The title in as few words as a table has room for."""
        return self.title.partition(" the ")[0]


WRONG = (Verdict.OUTSIDE, Verdict.DIFFERENT)  # verdicts on textures that could be compared, and do not conform


@dataclass(frozen=True, eq=False)
class Judgement:
    """A verdict and the numbers that it rests on.

    Flags have the texture's shape, (0,) where it was not compared: numbers that differ in a bit, and those outside the
    bounds or, where none are known, of another value. Bounds are None where bits are equal or none are known.
    """

    verdict: Verdict
    detail: str = ""  # why it was not compared
    differing: Flags = field(default_factory=lambda: np.zeros(0, np.bool_))
    outside: Flags = field(default_factory=lambda: np.zeros(0, np.bool_))
    bounds: Bounds | None = None


def interval_verdict(outside: Flags, strays: int) -> Verdict:
    """INSIDE if no more texels than may stray are outside their bounds, else OUTSIDE."""
    return Verdict.INSIDE if np.count_nonzero(texels(outside)) <= strays else Verdict.OUTSIDE


def texels(flags: Flags) -> Flags:
    """Flags of texels (H, W) from those of numbers (H, W, C), (H, W) or (W,): whether any of its numbers has one."""
    return np.any(flags, axis=-1) if flags.ndim == 3 else np.atleast_2d(flags)


def equal_bits(a: Plane, b: Plane) -> Flags:
    """Whether the numbers of two arrays of one type have the same bits."""
    kind = f"u{a.dtype.itemsize}"
    return np.asarray(a.view(kind) == b.view(kind))


def equal_values(a: Plane, b: Plane) -> Flags:
    """Whether the numbers of two arrays have equal values: -0 is +0, NaN is NaN, +inf is not -inf."""
    return np.asarray((a == b) | (np.isnan(a) & np.isnan(b)))
