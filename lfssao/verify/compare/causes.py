"""Causes: each change that explains textures, told once for all stages and modules."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isclose

from lfssao.verify.compare.result import Result
from lfssao.verify.diagnosis.change import Candidate, percent

_ALIKE = 1e-3  # relative difference of values that are one


@dataclass(frozen=True)
class Cause:
    """A change of the reference that explains textures."""

    kind: str
    equal: tuple[str, ...]  # names of changes that explain them as well
    values: tuple[float, ...]
    words: str  # a sentence
    modules: tuple[str, ...]
    layers: tuple[str, ...]
    places: tuple[str, ...]  # of all these textures (``Result.place``)


def causes_of(results: Sequence[Result]) -> tuple[Cause, ...]:
    """The fewest changes that explain all textures that have an explanation, those of the most textures first.

    A change may explain a texture whose own best change is another one, if it is among those that fit as well.
    """
    left = [r for r in results if r.diagnosis is not None and r.diagnosis.fits and r.diagnosis.candidates]
    made = []
    while left:
        candidates = [c for r in left if r.diagnosis is not None for c in r.diagnosis.candidates]
        best = max(candidates, key=lambda candidate: sum(_of(r, candidate) is not None for r in left))
        of = [r for r in left if _of(r, best) is not None]
        left = [r for r in left if r not in of]
        made.append(_told(best, of))
    return tuple(made)


def _of(result: Result, candidate: Candidate) -> Candidate | None:
    """A texture's own candidate that is the same change with the same values."""
    assert result.diagnosis is not None
    return _among(result.diagnosis.candidates, candidate)


def _among(candidates: Sequence[Candidate], candidate: Candidate) -> Candidate | None:
    """The one of some candidates that is the same change with the same values."""
    for own in candidates:
        if own.kind == candidate.kind and len(own.values) == len(candidate.values):
            pairs = zip(own.values, candidate.values, strict=True)
            if all(isclose(a, b, rel_tol=_ALIKE) for a, b in pairs):
                return own
    return None


def _told(best: Candidate, of: Sequence[Result]) -> Cause:
    modules, layers = dict.fromkeys(r.module for r in of), list(dict.fromkeys(r.layer for r in of))
    names = list(dict.fromkeys("AO" if layer.startswith("ao_") and len(layers) > 1 else layer for layer in layers))
    what = " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
    where = next(iter(modules)) if len(modules) == 1 else f"{len(modules)} modules"
    wrong = sum(r.diagnosis.wrong for r in of if r.diagnosis is not None)
    shares = [(own.explained, r.diagnosis.wrong) for r in of if r.diagnosis and (own := _of(r, best))]
    explained = sum(share * number for share, number in shares) / (wrong or 1)
    hint = best.hint and f": {best.hint}"
    others = _equal(best, of)
    if best.kind == "background":
        words = f"{best.words} in {what} of {where}"
    else:
        which = best.words + "".join(f", or {other.words}," for other in others)
        words = f"{which} explains {what} of {where} ({percent(explained)} of {wrong} wrong texels)"
    places, equal = tuple(r.place for r in of), tuple(other.kind for other in others)
    return Cause(best.kind, equal, best.values, words + hint, tuple(modules), tuple(layers), places)


def _equal(best: Candidate, of: Sequence[Result]) -> list[Candidate]:
    """Changes that explain all of these textures as well as the best does."""
    found = of[0].diagnosis
    equal = () if found is None else found.candidates[: found.equal]
    if _among(equal, best) is None:
        return []
    return [each for each in equal if each.kind != best.kind and all(_of(r, each) is not None for r in of)]
