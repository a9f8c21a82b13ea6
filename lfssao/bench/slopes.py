"""Exponents of the error over the number of samples: what is measured beside what theory says."""

from collections.abc import Sequence

import numpy as np

# log RMSE against log N in two dimensions: (indicator of a half plane, smooth integrand).
THEORY: dict[str, tuple[float, float]] = {
    "random": (-0.5, -0.5),
    "rejection": (-0.5, -0.5),
    "jittered": (-0.75, -1.0),
    "latin": (-0.5, -0.5),
    "poisson": (-0.5, -0.5),
    "sobol": (-0.75, -1.5),
}


def fitted_slope(counts: Sequence[int], errors: Sequence[float]) -> float | None:
    """Least squares slope of log error against log count; None of fewer than three errors above 0."""
    pairs = [(n, e) for n, e in zip(counts, errors, strict=True) if e > 0]
    if len(pairs) < 3:
        return None
    n, e = np.log(np.array(pairs)).T
    n, e = n - n.mean(), e - e.mean()
    return float((n * e).sum() / (n * n).sum())
