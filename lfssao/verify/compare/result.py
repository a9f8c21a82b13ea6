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
    """Limits, as of idiff, within which a wrong texture passes with a warning; InputError if out of range."""

    fail: float = 0.0  # largest difference of a texel from the reference, in the texture's unit or in codes
    percent: float = 0.0  # of a texture's texels, which may differ by more

    def __post_init__(self) -> None:
        for name, option, most in (("fail", "--fail", 1e300), ("percent", "--fail-percent", 100.0)):
            value = getattr(self, name)
            if not 0 <= as_number(value) <= most:
                raise InputError(f"{option}: {shown(value)} is not a number from 0 to {most:g}")
            object.__setattr__(self, name, as_number(value))

    def __bool__(self) -> bool:
        return bool(self.fail > 0 or self.percent > 0)

    def __str__(self) -> str:
        return f", tolerances --fail {self.fail:g} --fail-percent {self.percent:g}" if self else ""

    def judge(self, judgement: Judgement, mine: Planes, reference: Planes) -> tuple[Verdict, int]:
        """The verdict, WITHIN if a wrong texture passes, and the number of its texels that differ by more."""
        outside = texels(judgement.outside)
        beyond = int((outside & (difference(mine, reference) > self.fail) if self.fail > 0 else outside).sum())
        limit = max(0 if judgement.bounds is None else judgement.bounds.outliers, self.percent * outside.size / 100)
        passes = self and judgement.verdict.code == FAILED and beyond <= limit
        return (Verdict.WITHIN if passes else judgement.verdict), beyond

    def fails(self, bounds: Bounds, reference: Planes, texture: Texture) -> bool:
        """Whether a texture would fail within these bounds and tolerances."""
        outside = bounds.outside(texture)
        judgement = Judgement(interval_verdict(outside, bounds.outliers), outside=outside, bounds=bounds)
        return self.judge(judgement, _channel_planes(texture, texels(outside)), reference)[0].code == FAILED


@dataclass(frozen=True)
class Texel:
    """One of the worst texels of a texture."""

    column: int  # from the left of the data window
    row: int  # from its top
    mine: tuple[float, ...]  # channels
    reference: tuple[float, ...]  # after storing in the format of mine
    before: tuple[float, ...] | None  # the reference before storing; None if storing changes nothing
    lower: tuple[float, ...] | None  # ends of the interval; None if none is known
    upper: tuple[float, ...] | None
    outside: bool  # whether it is outside the interval, or differs if no interval is known
    reason: str  # an explanation in one sentence; '' if none is known

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
    detail: str = ""  # the reason if it was not compared, else ''
    metrics: Metrics | None = None  # None if it was not compared
    outside: int = 0  # number of texels outside the interval, or of texels that differ if no interval is known
    beyond: int = 0  # number of texels outside that differ from the reference by more than ``--fail``
    interval: bool = False  # whether an interval is known; False for equal bits, which need none
    worst: tuple[Texel, ...] = ()  # at most ten, the worst first
    diagnosis: "Diagnosis | None" = None  # the change of the reference that explains it; None if right
    # Figures of occlusion that differs, by ``lfssao.verify.compare.agreement.PARTS``; empty if depth is not known.
    agreement: Mapping[str, Agreement] = field(default_factory=dict)
    stored: str = ""  # such as 'stored as unorm8', which widens the interval; '' for float32
    power: Power | None = None  # of a texture that is inside; None for all others, and for positions

    @property
    def place(self) -> str:
        """The module and the layer."""
        return f"{self.module}, {self.layer}" if self.layer else self.module

    @property
    def blamed(self) -> list[Texel]:
        """The worst texels that are outside; all of the worst if none is outside."""
        return [texel for texel in self.worst if texel.outside] or list(self.worst)

    @property
    def sentence(self) -> str:
        """The verdict and the figures in words."""
        metrics = self.metrics
        words = [self.verdict.title]
        if metrics is None:
            return f"{self.verdict.title}: {self.detail}"
        if self.verdict in (Verdict.DIFFERENT, Verdict.WITHIN) and not self.interval:
            words.append(f"{self.outside} of {metrics.texels} texels, and no interval is known")
        elif self.outside:
            words.append(f"{self.outside} of {metrics.texels} texels are outside")
        if self.beyond != self.outside:
            words.append(f"{self.beyond} by more than is tolerated")
        if metrics.differing:
            ulp = "" if metrics.max_ulp is None else f"{metrics.max_ulp} ulp, "
            words.append(f"{metrics.differing} differ in bits by up to {ulp}{metrics.max_error:.3g}")
        if metrics.nan_mismatches:
            words.append(f"{metrics.nan_mismatches} NaN on one side only")
        if metrics.infinity_mismatches:
            words.append(f"{metrics.infinity_mismatches} mismatched infinities")
        return "; ".join([", ".join(words), *([] if self.power is None else [str(self.power)])])


def result_of(
    module: str,
    mine: Layer,
    reference: Layer,
    judgement: Judgement,
    tolerance: Tolerance,
    reason: Reason | None = None,
    parts: Callable[[], Mapping[str, Flags]] = dict,
    power: Power | None = None,
) -> Result:
    """The result of a judged texture; ``reason`` explains a texel, (column, row), ``parts`` flags those of surfaces."""
    metrics = measure(mine.planes, reference.planes)
    stored = str(mine.stored or "")
    if judgement.verdict is Verdict.EQUAL_BITS:
        return Result(module, reference.name, judgement.verdict, metrics=metrics, stored=stored)
    outside = texels(judgement.outside)
    ends: tuple[Planes, Planes] | None = None
    if judgement.bounds is not None:
        ends = _channel_planes(judgement.bounds.lower, outside), _channel_planes(judgement.bounds.upper, outside)
    sides = mine.planes, stored_as(mine, reference), reference.planes, *(ends or ())
    worst = []
    reason_at = reason or (lambda _: "")
    for i, j in _worst_texels(mine.planes, reference.planes, ends, judgement):
        rendered, expected, before, *interval = (tuple(plane[j, i].item() for plane in planes) for planes in sides)
        lower, upper = interval or (None, None)
        unstored = None if before == expected or mine.stored is None else before
        worst.append(Texel(i, j, rendered, expected, unstored, lower, upper, bool(outside[j, i]), reason_at((i, j))))
    verdict, beyond = tolerance.judge(judgement, mine.planes, reference.planes)
    if verdict is Verdict.INSIDE and power is not None and power.weak:
        verdict = Verdict.INSIDE_WEAKLY
    return Result(
        module,
        reference.name,
        verdict,
        metrics=metrics,
        outside=int(outside.sum()),
        beyond=beyond,
        interval=judgement.verdict in (Verdict.INSIDE, Verdict.OUTSIDE),
        worst=tuple(worst),
        agreement=agreements(mine.planes[0], reference.planes[0], parts() if is_occlusion(reference.name) else {}),
        stored=stored,
        power=power if judgement.verdict is Verdict.INSIDE else None,
    )


def stored_as(mine: Layer, reference: Layer) -> Planes:
    """The reference's channels after storing in the renderer's format: the interval holds them."""
    return tuple(plane if mine.stored is None else mine.stored.round_trip(plane) for plane in reference.planes)


def _channel_planes(texture: np.ndarray, like: Flags) -> Planes:
    """The channels of a texture, each as large as ``like``."""
    return tuple(np.moveaxis(texture.reshape(*like.shape, -1), -1, 0))


def _worst_texels(
    mine: Planes, reference: Planes, ends: tuple[Planes, Planes] | None, judgement: Judgement
) -> list[tuple[int, int]]:
    """Columns and rows of the worst texels: outside first, then the largest error; NaN and infinity are the largest."""
    outside = texels(judgement.outside)
    differing = texels(judgement.differing)
    error = difference(mine, reference)
    if ends is not None:  # the error is the distance from the interval; that of NaN is infinite
        clipped = np.fmin(np.fmax(np.stack(mine), np.stack(ends[0])), np.stack(ends[1]))
        error = np.where(outside, difference(mine, tuple(clipped)), error)
    places = np.flatnonzero(differing | outside)
    order = np.lexsort((places, -error.ravel()[places], ~outside.ravel()[places]))[:WORST]
    rows, columns = np.unravel_index(places[order], outside.shape)
    return list(zip(columns.tolist(), rows.tolist(), strict=True))
