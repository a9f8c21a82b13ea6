"""Causes: changes of the reference that explain wrong textures, each reported once for all stages and modules."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import isclose

from lfssao.verify.compare.result import Result
from lfssao.verify.diagnosis.change import Candidate, advice, one_of, percent, share_of, without

_EQUAL = 1e-3  # relative difference of values that are one


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
    hint: str = ""  # an option that makes the textures right


def causes_of(results: Sequence[Result]) -> tuple[Cause, ...]:
    """The fewest changes that explain all explained textures, the change of the most textures first.

    A number of the view comes first among changes of as many textures. A change may explain a texture with another best
    change, if it is among the texture's candidates.
    """
    unexplained = [r for r in results if r.diagnosis is not None and r.diagnosis.fits and r.diagnosis.candidates]
    causes = []
    while unexplained:
        candidates = [c for r in unexplained if r.diagnosis is not None for c in r.diagnosis.candidates]
        best = max(candidates, key=partial(_reach, unexplained))
        explained = [r for r in unexplained if _own_candidate(r, best) is not None]
        unexplained = [r for r in unexplained if r not in explained]
        causes.append(_cause(best, explained))
    return tuple(causes)


def _reach(results: Sequence[Result], candidate: Candidate) -> tuple[int, bool]:
    """How many textures a change explains, and whether it is one of the view."""
    return sum(_own_candidate(r, candidate) is not None for r in results), candidate.shared


def _own_candidate(result: Result, candidate: Candidate) -> Candidate | None:
    """The candidate of a texture that is the same change with the same values."""
    assert result.diagnosis is not None
    return _same_candidate(result.diagnosis.candidates, candidate)


def _same_candidate(candidates: Sequence[Candidate], candidate: Candidate) -> Candidate | None:
    """The first of the candidates that is the same change with the same values; a background is in place of one."""
    for own in candidates:
        if own.kind == "background" and own.in_all != candidate.in_all:
            continue
        if own.kind == candidate.kind and len(own.values) == len(candidate.values):
            pairs = zip(own.values, candidate.values, strict=True)
            if all(isclose(a, b, rel_tol=_EQUAL) for a, b in pairs):
                return own
    return None


def _cause(best: Candidate, results: Sequence[Result]) -> Cause:
    modules = dict.fromkeys(r.module for r in results)
    layers = list(dict.fromkeys(r.layer for r in results))
    names = list(dict.fromkeys("AO" if layer.startswith("ao_") and len(layers) > 1 else layer for layer in layers))
    layer_names = " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
    module_names = next(iter(modules)) if len(modules) == 1 else f"{len(modules)} modules"
    others = _equal_candidates(best, results)
    if best.kind == "background":
        own_words = {own.words for r in results if (own := _own_candidate(r, best))}
        words = f"{best.words if len(own_words) == 1 else best.in_all} in {layer_names} of {module_names}"
    else:
        words = f"{one_of([best, *others])} explains {layer_names} of {module_names} ({_shares(best, results)})"
    places = tuple(r.place for r in results)
    equal = tuple(other.kind for other in others)
    words += advice(best.hint)
    return Cause(best.kind, equal, best.values, words, tuple(modules), tuple(layers), places, best.hint)


def _shares(best: Candidate, results: Sequence[Result]) -> str:
    """The shares of all textures' wrong texels that a change explains and decides, in words."""
    found = [(own, r.diagnosis) for r in results if r.diagnosis and (own := _own_candidate(r, best))]
    wrong = sum(diagnosis.wrong for _, diagnosis in found)
    explained = sum(own.explained * diagnosis.wrong for own, diagnosis in found) / (wrong or 1)
    decided = sum(own.decided * diagnosis.wrong for own, diagnosis in found) / (wrong or 1)
    left_out = sum(diagnosis.left_out for _, diagnosis in found)
    words = f"{percent(explained)} of {wrong} wrong texels, {share_of(decided)} decided"
    return ", ".join(filter(None, [words, without(left_out)]))


def _equal_candidates(best: Candidate, results: Sequence[Result]) -> list[Candidate]:
    """Changes that explain all of the textures as well as the best change does."""
    diagnosis = results[0].diagnosis
    equal = () if diagnosis is None else diagnosis.candidates[: diagnosis.equal]
    if _same_candidate(equal, best) is None:
        return []
    return [
        candidate
        for candidate in equal
        if candidate.kind != best.kind and all(_own_candidate(r, candidate) is not None for r in results)
    ]
