"""Solve for the samples whose z has the other sign in a wrong texture.

Occlusion that sums samples' terms differs from the reference's by a sum of known differences, one for each such sample.
Least squares find these samples.
"""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.diagnosis.change import Change, plain
from lfssao.verify.verdict import Flags

_MOST = 64  # samples
_TEXELS_PER_SAMPLE = 2  # least ratio of wrong texels to samples
_LISTED = 3  # samples
_EXACT = 1e-4  # largest difference of the sum of terms from the estimator's occlusion
_NEARLY = 0.95  # least share of the texels without a larger difference: others may be clamped


def other_signs(problem: Any, wrong: Flags) -> Iterator[Change]:
    """Yield the change of the samples whose z has the other sign, for a problem that sums samples' terms."""
    count = len(problem.points) if problem.has_ball else 0
    if not 1 < count <= _MOST or np.count_nonzero(wrong) < _TEXELS_PER_SAMPLE * count:
        return
    right = _sample_terms(problem, count)
    other = _sample_terms(_with_signs(problem, -np.ones(count)), count)
    values = problem.values()
    if np.mean(np.abs(right.sum(axis=0) - values) <= _EXACT) < _NEARLY:
        return
    differences = np.where(np.isfinite(problem.mine), problem.mine - values, 0)
    coefficients, *_ = np.linalg.lstsq((other - right).T, differences)
    flipped = np.flatnonzero(coefficients > 0.5)
    if len(flipped):
        listed = ", ".join(map(str, flipped[:_LISTED])) + ", ..." * (len(flipped) > _LISTED)
        reason = ": the kernel is not folded" if (problem.table[:, 2] >= 0).all() else ""
        words = f"z of samples {listed} with the other sign, {len(flipped)} of {count}{reason}"
        yield plain(words, partial(_with_signs, signs=np.where(coefficients > 0.5, -1.0, 1.0)))


def _with_signs(problem: Any, signs: FloatArray) -> Any:
    """The problem with signs of the samples' z, (n,)."""
    return problem.changed(sample_factors=problem.sample_factors * np.where(np.arange(3) == 2, signs[:, None], 1.0))


def _sample_terms(problem: Any, count: int) -> FloatArray:
    """Each sample's part of occlusion, (count, K)."""
    problems = [
        problem.changed(reweighted=(np.arange(count) != k, slice(None)), weight_factor=0.0) for k in range(count)
    ]
    return np.stack([alone.values() for alone in problems])
