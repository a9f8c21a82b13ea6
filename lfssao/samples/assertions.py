"""Checks of somebody's sampler, and promises as assertions of a test."""

import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np

from lfssao.core.arguments import check_whole
from lfssao.samples.properties import Finding, check_promise


def check_sampler(
    function: Any, n: int, seeds: int | Iterable[int], name: str = "uniform", **options: Any
) -> list[Finding]:
    """Check one of ``PROMISES`` on the sets of n points that a sampler makes of many seeds, as ``check_promise``.

    The function returns the points of (n, seed); seeds are given, or their number. An engine of ``scipy.stats.qmc`` is
    asked for as many sets, one after the other, on the unit square. Options are those of ``check_promise``, by default
    the domain 'ball'.

    >>> from lfssao.samples import make_samples
    >>> found = check_sampler(lambda n, seed: make_samples("latin", n, seed), 8, 100, r_min=0.8)
    >>> all(finding.holds and finding.tells for finding in found)
    True
    """
    engine = hasattr(function, "random")
    n = check_whole("n", n, 1)
    chosen = seeds if isinstance(seeds, Iterable) else range(check_whole("seeds", seeds, 1))
    sets = [np.asarray(function.random(n) if engine else function(n, seed)) for seed in chosen]
    usual: dict[str, Any] = {"domain": "square", "bounds": (0.0, 1.0)} if engine else {"domain": "ball"}
    return check_promise(name, sets, **{**usual, **options})


def assert_promise(name: str, points: Any, domain: str, **options: Any) -> None:
    """Raise AssertionError with all findings in words if a promise is broken; arguments are ``check_promise``'s.

    UserWarning if a statistic cannot tell, as of the few points of one set: give it the sets of many seeds.

    >>> lfssao.testing.assert_promise("latin", [[-0.5, 0.5], [0.5, -0.5]], "square")
    """
    findings = check_promise(name, points, domain, **options)
    words = "\n".join([f"{name} ({domain}):", *map(str, findings)])
    if not all(finding.holds for finding in findings):
        raise AssertionError(words)
    if not all(finding.tells for finding in findings):
        warnings.warn(words, stacklevel=2)
