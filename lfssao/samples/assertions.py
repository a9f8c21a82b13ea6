"""Checks of a user's sampler, and promises as assertions of a test."""

import inspect
import warnings
from collections.abc import Iterable, Sequence
from typing import Any

from numpy.typing import NDArray

from lfssao.core.arguments import as_numbers, check_whole
from lfssao.errors import InputError, shown
from lfssao.samples.properties import Findings, check_promise

CHECKED = "inside", "distinct", "uniform"


def check_sampler(function: Any, n: int, seeds: int | Iterable[int], name: str = "uniform", **options: Any) -> Findings:
    """Check one of ``PROMISES`` on the sets of n points that a sampler makes of many seeds, as ``check_promise``.

    The function returns the points of (n, seed); seeds are given, or their number. An engine of ``scipy.stats.qmc`` is
    asked for as many sets, one after the other, on the unit square. Options are those of ``check_promise``, by default
    the domain 'ball'. Findings are true where the sampler was found to be right; ``assert_sampler`` asserts that.

    >>> from lfssao.samples import make_samples
    >>> bool(check_sampler(lambda n, seed: make_samples("latin", n, seed), 8, 100, r_min=0.8))
    True
    """
    return check_promise(name, _sets_of(function, n, seeds), **{**_usual(function), **options})


def _usual(function: Any) -> dict[str, Any]:
    """Return options of a sampler that are not given."""
    return {"domain": "square", "bounds": (0.0, 1.0)} if hasattr(function, "random") else {"domain": "ball"}


def _sets_of(function: Any, n: int, seeds: int | Iterable[int]) -> list[NDArray[Any]]:
    """Return the sets that a sampler makes; InputError if it takes no (n, seed), and for n or seeds that are none."""
    engine = hasattr(function, "random")
    n = check_whole("n", n, 1)
    chosen = seeds if isinstance(seeds, Iterable) else range(check_whole("seeds", seeds, 1))
    if not engine:
        _check_signature(function)
    sets = []
    for seed in chosen:
        points = as_numbers(f"the set of seed {seed}", function.random(n) if engine else function(n, seed))
        if points.shape[:1] != (n,):
            raise InputError(f"the set of seed {seed} has shape {points.shape}, expected {n} points")
        sets.append(points)
    return sets


def _check_signature(function: Any) -> None:
    """Refuse all that cannot be called by (n, seed), as far as it says what it takes."""
    try:
        inspect.signature(function).bind(1, 0)
    except TypeError as error:  # of another signature, or nothing that can be called
        wanted = f"it must take (n, seed), or be an engine of scipy.stats.qmc ({error})"
        raise InputError(f"the sampler is {shown(function)}, {wanted}") from None
    except ValueError:  # some built-in functions do not say it
        pass


def assert_sampler(
    function: Any,
    n: int = 64,
    seeds: int | Iterable[int] = 200,
    domain: str | None = None,
    *,
    promises: Sequence[str] = CHECKED,
    **options: Any,
) -> None:
    """Assert that a sampler keeps promises, and that sets of this size and number of seeds are enough to show it.

    Parameters
    ----------
    function : callable, or engine of ``scipy.stats.qmc``
        As of ``check_sampler``: returns the points, (n, d), of (n, seed).
    n : int
        Points of a set.
    seeds : int or iterable of int
        The seeds, or their number.
    domain : str, optional
        'square', 'sphere', 'ball' or 'disk'; by default 'ball', 'square' of an engine.
    promises : sequence of str
        Names of ``PROMISES``.
    options : keywords
        Others of ``check_promise``: ``r_min`` and ``r_max`` of a shell, ``bounds=(0, 1)`` of points in [0, 1], ...

    Raises
    ------
    AssertionError
        If a promise is broken, with all its findings in words.
    InputError
        If the sets are too small to tell, or an argument is wrong.

    Examples
    --------
    >>> def sampler(n, seed):
    ...     return lfssao.make_samples("latin", n, seed, r_min=0.0)
    >>> lfssao.testing.assert_sampler(sampler)
    >>> lfssao.testing.assert_sampler(lambda n, seed: 0.5 * sampler(n, seed))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    AssertionError: uniform (ball):
    ...
    """
    __tracebackhide__ = True
    if isinstance(promises, str) or len(promises) == 0:
        raise InputError(f"promises is {shown(promises)}, it must be a list of names, such as {list(CHECKED)}")
    sets = _sets_of(function, n, seeds)
    chosen = {**_usual(function), **({} if domain is None else {"domain": domain}), **options}
    found = {name: check_promise(name, sets, **chosen) for name in promises}
    wrong = [f"{name} ({chosen['domain']}):\n{each}" for name, each in found.items() if not each.holds]
    if wrong:
        raise AssertionError("\n".join(wrong))
    for name, each in found.items():
        unsure = [str(finding) for finding in each if not finding.tells]
        if unsure:
            many = f"{len(sets)} set{'s' * (len(sets) > 1)} of {n} points cannot tell whether {name} holds"
            raise InputError(f"{many}: give more seeds or points ({unsure[0]})")


def assert_promise(name: str, points: Any, domain: str, **options: Any) -> None:
    """Raise AssertionError with all findings in words if a promise is broken; arguments are ``check_promise``'s.

    UserWarning if a statistic cannot tell, as of the few points of one set: give it the sets of many seeds.

    >>> lfssao.testing.assert_promise("latin", [[-0.5, 0.5], [0.5, -0.5]], "square")
    """
    findings = check_promise(name, points, domain, **options)
    words = f"{name} ({domain}):\n{findings}"
    if not findings.holds:
        raise AssertionError(words)
    if not findings.tells:
        warnings.warn(words, stacklevel=2)
