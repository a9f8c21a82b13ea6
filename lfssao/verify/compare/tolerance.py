"""Tolerances as idiff has them: what is beyond its interval and still passes, with a warning."""

from dataclasses import dataclass

from lfssao.errors import InputError
from lfssao.verify.compare.metrics import difference
from lfssao.verify.verdict import FAILED, Judgement, Planes, Verdict, texels


@dataclass(frozen=True)
class Tolerance:
    """Limits of what passes beyond its interval; InputError if they are out of range."""

    fail: float = 0.0  # difference from the reference that a texel may have, in the texture's unit or in codes
    percent: float = 0.0  # of a texture's texels that may differ by more

    def __post_init__(self) -> None:
        for name, value, most in (("--fail", self.fail, 1e300), ("--fail-percent", self.percent, 100.0)):
            if not 0 <= value <= most:
                raise InputError(f"{name}: {value:g} is not a number from 0 to {most:g}")

    def __bool__(self) -> bool:
        return self.fail > 0 or self.percent > 0

    def __str__(self) -> str:
        return f", tolerances --fail {self.fail:g} --fail-percent {self.percent:g}" if self else ""

    def judge(self, judged: Judgement, mine: Planes, reference: Planes) -> tuple[Verdict, int]:
        """The verdict, WITHIN where a wrong texture passes; the number of its texels that differ by more."""
        outside = texels(judged.outside)
        beyond = int((outside & (difference(mine, reference) > self.fail) if self.fail > 0 else outside).sum())
        most = max(0 if judged.bounds is None else judged.bounds.strays, self.percent * outside.size / 100)
        passes = self and judged.verdict.code == FAILED and beyond <= most
        return (Verdict.WITHIN if passes else judged.verdict), beyond
