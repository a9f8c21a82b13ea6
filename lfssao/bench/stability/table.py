"""Rows of the stability table, and what gives them: stiff cases, estimators without exact values, refused inputs."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import inf

from lfssao.bench.stability.measure import FINE, PATHS, Measured
from lfssao.errors import InputError

Run = Callable[[str], Measured | None]  # measures a path, or an estimator by name; None if it cannot be run
Inputs = Iterator[tuple[str, str, Run]]  # the name of the case and a text of each
# By path or estimator, '' for all others: the largest RMS error, infinity where error analysis has bounds, and why.
Stated = Mapping[str, tuple[float, str]]

WITHIN = "within bound"
DEGRADED = "degraded as stated"
NOT_EXACT = "no exact value"
REFUSED = "refused"
BROKEN = "broken"


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    case: str
    stiff: str  # the difficulty in it
    input: str
    path: str  # 'float32' or 'float64', or the estimator whose float32 is compared with its float64
    measured: Measured | None  # errors and decisions; None if the input is refused, or there is no exact value
    verdict: str  # WITHIN, DEGRADED, NOT_EXACT, REFUSED, or BROKEN if it is not what the case states
    reason: str = ""  # the degradation or the lack, or the sentence of the refusal


@dataclass(frozen=True)
class Case:
    """Inputs of one kind of stiffness; what is computed stays within ``FINE`` of what is right, or as stated."""

    name: str
    stiff: str  # the difficulty in it
    inputs: Sequence[tuple[str, Run]]
    stated: Stated
    paths: Sequence[str] = PATHS

    def rows(self) -> Iterator[Row]:
        """Measure all inputs on all paths."""
        for (text, run), path in product(self.inputs, self.paths):
            measured = run(path)
            if measured is None:
                continue
            limit, reason = self.stated.get(path, self.stated.get("", (0.0, "")))
            verdict = DEGRADED if measured.bound > FINE or measured.flipped else WITHIN
            if measured.exceeded or (verdict == DEGRADED and not (measured.rms or 0.0) <= limit):
                verdict = BROKEN
            reason = f"{reason}: rms up to {limit:.2g}" if limit < inf else reason
            yield Row(self.name, self.stiff, text, path, measured, verdict, reason if verdict == DEGRADED else "")


@dataclass(frozen=True)
class NotExact:
    """An estimator without exact values."""

    name: str
    path: str  # the estimator
    why: str

    def rows(self) -> Iterator[Row]:
        """One row."""
        yield Row(self.name, "what cannot be computed in exact numbers", "all", self.path, None, NOT_EXACT, self.why)


@dataclass(frozen=True)
class Refusal:
    """An input that is refused before the work starts."""

    name: str
    text: str  # the input
    attempt: Callable[[], object]  # tries it
    says: str  # part of the sentence that refuses it

    def rows(self) -> Iterator[Row]:
        """One row: BROKEN unless the attempt is refused, in these words."""
        verdict = BROKEN
        sentence = "it was served"
        try:
            self.attempt()
        except InputError as error:
            sentence = str(error)
            verdict = REFUSED if self.says in sentence else BROKEN
        yield Row(self.name, "what cannot be served", self.text, "both", None, verdict, sentence)
