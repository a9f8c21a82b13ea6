"""A report's result on one texture of one module: its verdict, its figures, its worst texels."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lfssao.verify.compare.layers import Layer
from lfssao.verify.compare.metrics import Metrics, difference, measure
from lfssao.verify.compare.tolerance import Tolerance
from lfssao.verify.diagnosis.diagnose import Diagnosis
from lfssao.verify.verdict import Flags, Judgement, Planes, Verdict, texels

WORST = 10
Reason = Callable[[tuple[int, int]], str]


@dataclass(frozen=True)
class Texel:
    """One of the worst texels of a texture.

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
    """The result on one texture of one module.

    Attributes
    ----------
    module, layer : str
        Names of the module and of the texture.
    verdict : Verdict
        The verdict on it.
    detail : str
        Why it was not compared; '' where it was.
    metrics : Metrics or None
        None where it was not compared.
    outside : int
        Number of texels outside the interval; where none is known, of those that differ.
    beyond : int
        Number of those that differ from the reference by more than ``--fail``.
    interval : bool
        Whether one is known; it is not asked for where bits are equal.
    worst : tuple of Texel
        The worst, at most ten, the worst first.
    diagnosis : Diagnosis or None
        Which change of the reference explains it; None where it is right, or no diagnosis was made.
    stored : str
        How it was stored, such as 'stored as unorm8', by which the interval is wider; '' for float32.
    """

    module: str
    layer: str
    verdict: Verdict
    detail: str = ""
    metrics: Metrics | None = None
    outside: int = 0
    beyond: int = 0
    interval: bool = False
    worst: tuple[Texel, ...] = ()
    diagnosis: Diagnosis | None = None
    stored: str = ""


def result_of(
    module: str, mine: Layer, reference: Layer, judged: Judgement, tolerance: Tolerance, reason: Reason
) -> Result:
    """The result of a texture that was judged; ``reason`` says why a texel, (column, row), is what it is."""
    metrics = measure(mine.planes, reference.planes)
    if judged.verdict is Verdict.EQUAL_BITS:
        return Result(module, reference.name, judged.verdict, metrics=metrics)
    outside, known = texels(judged.outside), judged.verdict in (Verdict.INSIDE, Verdict.OUTSIDE)
    ends: tuple[Planes, Planes] | None = None
    if judged.bounds is not None:
        ends = _planes(judged.bounds.lower, outside), _planes(judged.bounds.upper, outside)
    worst = []
    for i, j in _worst_places(mine.planes, reference.planes, ends, judged):
        own, right, *interval = (
            tuple(plane[j, i].item() for plane in planes) for planes in (mine.planes, reference.planes, *(ends or ()))
        )
        lower, upper = interval or (None, None)
        worst.append(Texel(i, j, own, right, lower, upper, bool(outside[j, i]), reason((i, j))))
    verdict, beyond = tolerance.judge(judged, mine.planes, reference.planes)
    return Result(module, reference.name, verdict, "", metrics, int(outside.sum()), beyond, known, tuple(worst))


def _planes(texture: np.ndarray, like: Flags) -> Planes:
    """The channels of a texture, each as large as ``like``."""
    return tuple(np.moveaxis(texture.reshape(*like.shape, -1), -1, 0))


def _worst_places(
    mine: Planes, reference: Planes, ends: tuple[Planes, Planes] | None, judged: Judgement
) -> list[tuple[int, int]]:
    """Columns and rows: those outside first, then by how far off they are, NaN and infinity before all; row by row."""
    outside, differing = texels(judged.outside), texels(judged.differing)
    off = difference(mine, reference)
    if ends is not None:  # how far beyond the interval; NaN is infinitely far
        held = np.fmin(np.fmax(np.stack(mine), np.stack(ends[0])), np.stack(ends[1]))
        off = np.where(outside, difference(mine, tuple(held)), off)
    places = np.flatnonzero(differing | outside)
    order = np.lexsort((places, -off.ravel()[places], ~outside.ravel()[places]))[:WORST]
    width = outside.shape[1]
    return [(int(place) % width, int(place) // width) for place in places[order]]
