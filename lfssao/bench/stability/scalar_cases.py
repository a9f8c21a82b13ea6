"""Stiff cases of single numbers: the blur, counts past float32's whole numbers, moments, slivers."""

from collections.abc import Sequence
from dataclasses import replace
from decimal import Decimal, localcontext
from fractions import Fraction
from itertools import product
from statistics import pvariance
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao import post
from lfssao.ao.estimators.vo.area import mean_and_deviation
from lfssao.ao.kernels import ssao
from lfssao.ao.kernels.moments import filtered_moments
from lfssao.ao.moments import moment_pyramid
from lfssao.bench.stability.inputs import lattice
from lfssao.bench.stability.measure import Measured, error_of
from lfssao.gbuffer.kernels import triangle

_TEXELS = 8


def blurred(sigma: float, path: str) -> Measured:
    """Measure the blur of a row of 8 texels in a column of equals against the Gaussian to 40 digits.

    Weights and texels are positive, so each rounding is a relative error of the sum. A pass has n + 1 of them, and
    n + 20 in float64: exp (2 ulp), its argument (up to 4.5, so that 3 roundings are 13.5 of the value) and the division
    by the sum. Weights in fixed point are off by n units in all, and no texel is above 8 times the smallest; their sum
    is 1, so the column of equals loses nothing by them.
    """
    dtype = np.dtype(path)
    texels = ((np.arange(_TEXELS) * 5 % _TEXELS + 1) / 8).astype(dtype)
    ours = post.blur(texels[None, :], sigma)[0]
    taps = len(post.gaussian_kernel(sigma))
    unit = float(np.finfo(dtype).epsneg)
    double = 2.0**-53
    relative = (2 * (taps + 1) + 8 * taps) * unit + 2 * (taps + 20) * double
    return _compared(ours, _gaussian(texels.astype(np.float64), sigma, taps // 2), relative)


def _compared(ours: Any, exact: Sequence[Fraction], relative: float) -> Measured:
    """Return errors of positive numbers whose bound is a relative error of the computed values."""
    errors, ulps = zip(*(error_of(a, b, ours.dtype, 0.0) for a, b in zip(ours, exact, strict=True)), strict=True)
    bounds = [relative / (1 - relative) * float(b) if relative < 1 else np.inf for b in exact]
    exceeded = sum(not error <= bound for error, bound in zip(errors, bounds, strict=True))
    return Measured(1.0, max(ulps), max(errors), max(bounds), exceeded, 0, 0, len(ours))


def _gaussian(texels: NDArray[np.float64], sigma: float, radius: int) -> list[Fraction]:
    """Return the blurred row to 40 digits, borders repeated."""
    with localcontext(prec=60):
        weights = [(-(Decimal(k) ** 2) / (2 * Decimal(sigma) ** 2)).exp() for k in range(-radius, radius + 1)]
        row = np.pad([Decimal(t) for t in texels.tolist()], radius, mode="edge")
        return [Fraction(value / sum(weights)) for value in np.convolve(row, weights, "valid")]


def counted(samples: int, path: str) -> Measured:
    """Measure k / n for counts k about 2^24 and at n: k, n and the quotient are rounded once each."""
    dtype = np.dtype(path)
    counts = np.array([1, 2**24 - 1, 2**24, 2**24 + 1, samples // 2 + 1, samples - 1, samples], np.int32)
    depth = np.zeros(len(counts), dtype)
    ao = np.empty(len(counts), dtype)
    ssao.finish_run.py_func(depth, 0, 0, len(counts), samples, counts, ao)
    return _compared(ao, [Fraction(int(k), samples) for k in counts], 3 * float(np.finfo(dtype).epsneg))


def spread(relief: float, path: str) -> Measured:
    """Measure sigma = sqrt(M2 - M1^2) of 8 x 8 depths from 1 to 1 + relief, a power of 2, in units of the relief.

    On both paths in float64. M1 and M2 have 23 roundings at most, so the variance is off by 70 units of the largest
    z^2, and sigma by no more of itself than the variance of itself.
    """
    depth = (1 + relief * (lattice()[..., 1] + 1) / 2).astype(path)
    moments = filtered_moments(moment_pyramid(depth, False), 3.0, 4.0, 4.0)
    ours = mean_and_deviation(*map(np.float64, moments))[1]
    exact = [Fraction(float(z)) for z in depth.ravel()]
    variance = pvariance(exact) / Fraction(relief) ** 2
    with localcontext(prec=60):
        sigma = Fraction((Decimal(variance.numerator) / Decimal(variance.denominator)).sqrt())
    condition = float(max(exact)) ** 2 / float(variance) / relief**2
    return replace(_compared(np.array([ours / relief]), [sigma], 70 * 2.0**-53 * condition), condition=condition)


def slivers(path: str) -> Measured:
    """Measure the sign of a b - c d, the side of a triangle's edge that a ray passes on, for triangles a few ulp wide.

    Rays are cast in float64 on every path. 'flipped' are wrong signs; the condition number is the difference's.
    """
    del path
    wrong = 0
    conditions = []
    edges = list(product(range(1, 33), range(-2, 3), range(-2, 3)))
    for k, i, j in edges:
        a = 1.0 + k * 2.0**-20
        b = 1.0 - k * 2.0**-21
        c = a + i * 2.0**-52
        d = b + j * 2.0**-53
        exact = Fraction(a) * Fraction(b) - Fraction(c) * Fraction(d)
        wrong += int(np.sign(triangle.exact_difference(a, b, c, d))) != (exact > 0) - (exact < 0)
        if exact:
            conditions.append(float(2 * Fraction(a) * Fraction(b) / abs(exact)))
    return Measured(max(conditions), 0.0, 0.0, 0.0, wrong, wrong, 0, len(edges))
