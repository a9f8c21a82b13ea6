"""A report's result on one texture of one module: its verdict within tolerances, its figures, its worst texels."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from lfssao.core.arguments import as_number
from lfssao.errors import InputError, shown
from lfssao.verify.bounds.bounds import Bounds, Texture
from lfssao.verify.compare.agreement import Agreement, agreements
from lfssao.verify.compare.layers import Layer, is_occlusion
from lfssao.verify.compare.metrics import Metrics, difference, measure
from lfssao.verify.compare.power import Power
from lfssao.verify.verdict import FAILED, Flags, Judgement, Planes, Verdict, interval_verdict, texels

if TYPE_CHECKING:
    from lfssao.verify.diagnosis.diagnose import Diagnosis

WORST = 10
Reason = Callable[[tuple[int, int]], str]


@dataclass(frozen=True)
class Tolerance:
    """Limits, as idiff has them, of what passes beyond its interval with a warning; InputError if out of range."""

    fail: float = 0.0  # difference from the reference that a texel may have, in the texture's unit or in codes
    percent: float = 0.0  # of a texture's texels that may differ by more

    def __post_init__(self) -> None:
        for name, option, most in (("fail", "--fail", 1e300), ("percent", "--fail-percent", 100.0)):
            given = getattr(self, name)
            if not 0 <= as_number(given) <= most:
                raise InputError(f"{option}: {shown(given)} is not a number from 0 to {most:g}")
            object.__setattr__(self, name, as_number(given))

    def __bool__(self) -> bool:
        return bool(self.fail > 0 or self.percent > 0)

    def __str__(self) -> str:
        return f", tolerances --fail {self.fail:g} --fail-percent {self.percent:g}" if self else ""

    def judge(self, judged: Judgement, mine: Planes, reference: Planes) -> tuple[Verdict, int]:
        """The verdict, WITHIN where a wrong texture passes; the number of its texels that differ by more."""
        outside = texels(judged.outside)
        beyond = int((outside & (difference(mine, reference) > self.fail) if self.fail > 0 else outside).sum())
        most = max(0 if judged.bounds is None else judged.bounds.outliers, self.percent * outside.size / 100)
        passes = self and judged.verdict.code == FAILED and beyond <= most
        return (Verdict.WITHIN if passes else judged.verdict), beyond

    def fails(self, bounds: Bounds, reference: Planes, texture: Texture) -> bool:
        """Whether a texture would fail that is judged by bounds in place of a renderer's."""
        outside = bounds.outside(texture)
        judged = Judgement(interval_verdict(outside, bounds.outliers), outside=outside, bounds=bounds)
        return self.judge(judged, _planes(texture, texels(outside)), reference)[0].code == FAILED


@dataclass(frozen=True)
class Texel:
    """One of the worst texels of a texture."""

    column: int  # from the left of the data window
    row: int  # from its top
    mine: tuple[float, ...]  # channels
    reference: tuple[float, ...]  # as it would be read if it were stored as mine is
    before: tuple[float, ...] | None  # the reference itself; None where storing changes nothing
    lower: tuple[float, ...] | None  # ends of the interval; None where none is known
    upper: tuple[float, ...] | None
    outside: bool  # whether it is outside the interval, or, where none is known, differs
    reason: str  # why, in one sentence; '' where nothing is known

    def __str__(self) -> str:
        line = f"({self.column}, {self.row}) {_values(self.mine)}, reference {_values(self.reference)}"
        if self.before is not None:
            line += f" ({_values(self.before)} before it is stored)"
        if self.lower is not None and self.upper is not None:
            line += f", interval {_values(self.lower)} to {_values(self.upper)}"
        return line + (f": {self.reason}" if self.reason else "")


def _values(values: tuple[float, ...]) -> str:
    text = " ".join(f"{v:.9g}" for v in values)
    return text if len(values) == 1 else f"({text})"


@dataclass(frozen=True)
class Result:
    """The result on one texture of one module."""

    module: str
    layer: str
    verdict: Verdict
    detail: str = ""  # why it was not compared; '' where it was
    metrics: Metrics | None = None  # None where it was not compared
    outside: int = 0  # number of texels outside the interval; where none is known, of those that differ
    beyond: int = 0  # number of those that differ from the reference by more than ``--fail``
    interval: bool = False  # whether one is known; it is not asked for where bits are equal
    worst: tuple[Texel, ...] = ()  # at most ten, the worst first
    diagnosis: "Diagnosis | None" = None  # which change of the reference explains it; None if right or not diagnosed
    # Figures of occlusion that differs, by ``lfssao.verify.compare.agreement.PARTS``; empty if depth is not known.
    agreement: Mapping[str, Agreement] = field(default_factory=dict)
    stored: str = ""  # such as 'stored as unorm8', by which the interval is wider; '' for float32
    power: Power | None = None  # of a texture that is inside; None for all others, and for positions

    @property
    def place(self) -> str:
        """The module and the layer."""
        return f"{self.module}, {self.layer}" if self.layer else self.module

    @property
    def blamed(self) -> list[Texel]:
        """The worst texels that are outside; all of the worst where none is."""
        return [texel for texel in self.worst if texel.outside] or list(self.worst)

    @property
    def sentence(self) -> str:
        """The verdict and the figures in words."""
        m, words = self.metrics, [self.verdict.title]
        if m is None:
            return f"{self.verdict.title}: {self.detail}"
        if self.verdict in (Verdict.DIFFERENT, Verdict.WITHIN) and not self.interval:
            words.append(f"{self.outside} of {m.texels} texels, and no interval is known")
        elif self.outside:
            words.append(f"{self.outside} of {m.texels} texels are outside")
        if self.beyond != self.outside:
            words.append(f"{self.beyond} by more than is tolerated")
        if m.differing:
            ulp = "" if m.max_ulp is None else f"{m.max_ulp} ulp, "
            words.append(f"{m.differing} differ in bits by up to {ulp}{m.max_error:.3g}")
        if m.nan_mismatches:
            words.append(f"{m.nan_mismatches} NaN on one side only")
        if m.infinity_mismatches:
            words.append(f"{m.infinity_mismatches} mismatched infinities")
        return "; ".join([", ".join(words), *([] if self.power is None else [str(self.power)])])


def result_of(
    module: str,
    mine: Layer,
    reference: Layer,
    judged: Judgement,
    tolerance: Tolerance,
    reason: Reason | None = None,
    parts: Callable[[], Mapping[str, Flags]] = dict,
    power: Power | None = None,
) -> Result:
    """The result of a judged texture; ``reason`` says why a texel, (column, row), ``parts`` which are of surfaces."""
    metrics, stored = measure(mine.planes, reference.planes), str(mine.stored or "")
    if judged.verdict is Verdict.EQUAL_BITS:
        return Result(module, reference.name, judged.verdict, metrics=metrics, stored=stored)
    outside = texels(judged.outside)
    ends: tuple[Planes, Planes] | None = None
    if judged.bounds is not None:
        ends = _planes(judged.bounds.lower, outside), _planes(judged.bounds.upper, outside)
    sides = mine.planes, stored_as(mine, reference), reference.planes, *(ends or ())
    worst, told = [], reason or (lambda _: "")
    for i, j in _worst_places(mine.planes, reference.planes, ends, judged):
        own, right, before, *interval = (tuple(plane[j, i].item() for plane in planes) for planes in sides)
        lower, upper = interval or (None, None)
        changed = None if before == right or mine.stored is None else before
        worst.append(Texel(i, j, own, right, changed, lower, upper, bool(outside[j, i]), told((i, j))))
    verdict, beyond = tolerance.judge(judged, mine.planes, reference.planes)
    if verdict is Verdict.INSIDE and power is not None and power.weak:
        verdict = Verdict.INSIDE_WEAKLY
    return Result(
        module,
        reference.name,
        verdict,
        metrics=metrics,
        outside=int(outside.sum()),
        beyond=beyond,
        interval=judged.verdict in (Verdict.INSIDE, Verdict.OUTSIDE),
        worst=tuple(worst),
        agreement=agreements(mine.planes[0], reference.planes[0], parts() if is_occlusion(reference.name) else {}),
        stored=stored,
        power=power if judged.verdict is Verdict.INSIDE else None,
    )


def stored_as(mine: Layer, reference: Layer) -> Planes:
    """The reference's channels as they would be read if they were stored as the renderer's: an interval holds them."""
    return tuple(plane if mine.stored is None else mine.stored.round_trip(plane) for plane in reference.planes)


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
    rows, columns = np.unravel_index(places[order], outside.shape)
    return list(zip(columns.tolist(), rows.tolist(), strict=True))
