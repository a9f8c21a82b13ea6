"""Exponents of the error over the number of samples, measured and by theory.

The variance of a mean of n points in two dimensions is V S / n in the limit: V is the integrand's variance and S the
power of the point sets at low frequencies, of random points 1 (Pilleboue et al. 2015, *Variance Analysis for Monte
Carlo Integration*, equation 9). Sets whose S vanishes at frequency 0, like jittered ones, are steeper than -1/2.

Poisson disk sets have a small S(0) > 0, so that -1/2 is their limit too; before it the rims of the square and of the
integrand make the slope steeper, near -0.6 up to some thousand points.

The variance of an Owen-scrambled net on a smooth integrand is of the order log(n) / n^3 (Owen 1997, *Scrambled Net
Variance for Integrals of Smooth Functions*), whose root has the slope -1.5 + 1 / (2 log n): -1.4 at a few hundred.
"""

from collections.abc import Sequence

import numpy as np

# log RMSE against log N in two dimensions, in the limit: (indicator of a half plane, smooth integrand).
THEORY: dict[str, tuple[float, float]] = {
    "random": (-0.5, -0.5),
    "rejection": (-0.5, -0.5),
    "jittered": (-0.75, -1.0),
    "latin": (-0.5, -0.5),
    "poisson": (-0.5, -0.5),
    "sobol": (-0.75, -1.5),
}

# Slopes that differ at the numbers of samples in use, for the reasons above.
BEFORE_THE_LIMIT = {"poisson": "near -0.6 before", "sobol": "smooth near -1.4 before"}


def fitted_slope(counts: Sequence[int], errors: Sequence[float]) -> tuple[float, float] | None:
    """Least squares slope of log error against log count, with its standard error; None for fewer than 3."""
    pairs = [(n, e) for n, e in zip(counts, errors, strict=True) if e > 0]
    if len(pairs) < 3:
        return None
    n, e = np.log(pairs).T
    (slope, _), covariance = np.polyfit(n, e, 1, cov=True)
    return float(slope), float(np.sqrt(covariance[0, 0]))
