"""What is said of one texture of one module: a verdict, its figures, its worst texels."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from lfssao.comparison.layers import Layer
from lfssao.comparison.metrics import Metrics, Planes, equal_bits, equal_values, measure
from lfssao.oracle.judge import StageVerdict

# As idiff's; 1, warnings only, is what a whole report may have.
SAME, WARNING, FAILED, NOT_COMPARABLE, FILE_ERROR = range(5)

WORST = 10


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


@dataclass(frozen=True)
class Texel:
    """One of the worst texels.

    Attributes
    ----------
    column, row : int
        From the top left of the data window.
    mine, reference : tuple of float
        Its channels.
    lower, upper : tuple of float, or None
        Ends of the interval; None where none is known.
    outside : bool
        Whether it is outside the interval, or, where none is known, differs.
    reason : str
        Why, in one sentence; '' where nothing is known.
    """

    column: int
    row: int
    mine: tuple[float, ...]
    reference: tuple[float, ...]
    lower: tuple[float, ...] | None
    upper: tuple[float, ...] | None
    outside: bool
    reason: str


@dataclass(frozen=True)
class Result:
    """What is said of one texture of one module.

    Attributes
    ----------
    module, layer : str
        Which.
    verdict : Verdict
        The sum of it.
    detail : str
        What stood against comparing it; '' where it was compared.
    metrics : Metrics or None
        None where it was not compared.
    outside : int
        Texels outside the interval; where none is known, that differ.
    interval : bool
        Whether one is known; of equal bits it is not asked for.
    worst : tuple of Texel
        The worst, at most ten, the worst first.
    """

    module: str
    layer: str
    verdict: Verdict
    detail: str = ""
    metrics: Metrics | None = None
    outside: int = 0
    interval: bool = False
    worst: tuple[Texel, ...] = ()


@dataclass(frozen=True, eq=False)
class Judged:
    """A result with where it holds, for a picture.

    Attributes
    ----------
    result : Result
        The result.
    differing, outside : (H, W) bool
        Texels that differ in a bit; that are outside the interval or, where none is known, have other values.
    """

    result: Result
    differing: NDArray[np.bool_]
    outside: NDArray[np.bool_]


def judge(
    module: str,
    mine: Layer,
    reference: Layer,
    ask: Callable[[], StageVerdict | None],
    reason: Callable[[tuple[int, int]], str],
) -> Judged:
    """Compare two textures of one type and size.

    Parameters
    ----------
    module : str
        Which module they belong to.
    mine, reference : Layer
        The textures.
    ask : callable
        What the oracle says of the stage; called where bits differ.
    reason : callable
        Asked why a texel, (column, row), is what it is.
    """
    pairs = list(zip(mine.planes, reference.planes, strict=True))
    differing = ~np.logical_and.reduce([equal_bits(a, b) for a, b in pairs])
    metrics = measure(mine.planes, reference.planes)
    if not differing.any():
        return Judged(Result(module, reference.name, Verdict.EQUAL_BITS, metrics=metrics), differing, differing)
    said = ask()
    if said is None or said.wrong is None:
        said = None
        outside = ~np.logical_and.reduce([equal_values(a, b) for a, b in pairs])
        verdict = Verdict.DIFFERENT if outside.any() else Verdict.EQUAL_VALUES
    else:
        outside = said.wrong
        verdict = Verdict.INSIDE if said.accepted else Verdict.OUTSIDE
    ends = _Ends.of(said)
    places = _worst_places(mine.planes, reference.planes, ends, differing, outside)
    worst = tuple(_texel(place, mine.planes, reference.planes, ends, outside, reason) for place in places)
    count = int(outside.sum())
    return Judged(
        Result(module, reference.name, verdict, "", metrics, count, said is not None, worst), differing, outside
    )


@dataclass(frozen=True, eq=False)
class _Ends:
    """Lower and upper ends of a stage's interval, channel by channel; empty where it has no such ends."""

    lower: Planes = ()
    upper: Planes = ()

    @classmethod
    def of(cls, said: StageVerdict | None) -> "_Ends":
        if said is None or said.bounds is None:
            return cls()
        lower, upper = said.bounds.lower, said.bounds.upper
        if lower.ndim == 2:
            return cls((lower,), (upper,))
        return cls(tuple(np.moveaxis(lower, -1, 0)), tuple(np.moveaxis(upper, -1, 0)))


def _worst_places(
    mine: Planes, reference: Planes, ends: _Ends, differing: NDArray[np.bool_], outside: NDArray[np.bool_]
) -> list[tuple[int, int]]:
    """Columns and rows: those outside first, then by how far off they are, NaN and infinity before all; row by row."""
    off = np.zeros(differing.shape)
    lower, upper = ends.lower or reference, ends.upper or reference
    with np.errstate(all="ignore"):  # infinity less infinity is not a number, and counts as infinitely far
        for a, b, low, high in zip(mine, reference, lower, upper, strict=True):
            x, y = a.astype(np.float64), b.astype(np.float64)
            beyond = np.maximum(low.astype(np.float64) - x, x - high.astype(np.float64))
            distance = np.where(outside, np.maximum(beyond, 0), np.abs(x - y))
            distance[equal_values(a, b)] = 0
            off = np.maximum(off, np.where(np.isnan(distance), np.inf, distance))
    places = np.flatnonzero(differing | outside)
    order = np.lexsort((places, -off.ravel()[places], ~outside.ravel()[places]))[:WORST]
    width = differing.shape[1]
    return [(int(place) % width, int(place) // width) for place in places[order]]


def _texel(
    place: tuple[int, int],
    mine: Planes,
    reference: Planes,
    ends: _Ends,
    outside: NDArray[np.bool_],
    reason: Callable[[tuple[int, int]], str],
) -> Texel:
    i, j = place

    def values(planes: Planes) -> tuple[float, ...]:
        return tuple(plane[j, i].item() for plane in planes)

    lower, upper = (values(ends.lower), values(ends.upper)) if ends.lower else (None, None)
    return Texel(i, j, values(mine), values(reference), lower, upper, bool(outside[j, i]), reason(place))
