"""Rows of the stability table, and the two things that give them: stiff cases and refused inputs."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product

from lfssao.bench.stability.inputs import Inputs
from lfssao.bench.stability.measure import FINE, PATHS, Measured
from lfssao.errors import InputError

WITHIN = "within bound"
DEGRADED = "degraded as stated"
REFUSED = "refused"
BROKEN = "broken"


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    case: str
    stiff: str  # the difficulty in it
    input: str
    path: str  # 'float32' or 'float64'
    measured: Measured | None  # errors and decisions; None if the input is refused
    verdict: str  # WITHIN, DEGRADED, REFUSED, or BROKEN if it is not what the case states
    reason: str = ""  # the degradation, or the sentence of the refusal


@dataclass(frozen=True)
class Case:
    """Inputs of one kind of stiffness, whose image is compared with the exact one."""

    name: str
    stiff: str  # the difficulty in it
    inputs: Callable[[], Inputs]  # yields pairs of a text and a function that measures a path
    # Path to the sentence about its degradation; a path that is not in it stays within 2^-8 texel
    degraded: Mapping[str, str]

    def rows(self) -> Iterator[Row]:
        """Measure all inputs on both paths."""
        for (text, run), path in product(self.inputs(), PATHS):
            measured = run(path)
            verdict = DEGRADED if measured.bound > FINE or measured.flipped else WITHIN
            if measured.exceeded or (verdict == DEGRADED and path not in self.degraded):
                verdict = BROKEN
            reason = self.degraded[path] if verdict == DEGRADED else ""
            yield Row(self.name, self.stiff, text, path, measured, verdict, reason)


@dataclass(frozen=True)
class Refusal:
    """An input that is refused before the work starts."""

    name: str
    stiff: str  # the difficulty in it
    text: str  # the input
    attempt: Callable[[], object]  # tries it
    says: str  # part of the sentence that refuses it

    def rows(self) -> Iterator[Row]:
        """One row: BROKEN unless the attempt is refused, in these words."""
        verdict, sentence = BROKEN, "it was served"
        try:
            self.attempt()
        except InputError as error:
            sentence = str(error)
            verdict = REFUSED if self.says in sentence else BROKEN
        yield Row(self.name, self.stiff, self.text, "both", None, verdict, sentence)
