"""Logarithm and power from IEEE + - * /."""

import numpy as np

from lfssao.core.elementary import exp
from lfssao.core.jit import kernel

_LN2_HIGH = 0.6931471803691238  # ln 2 with its last bits cleared: any exponent times it is exact
_LN2_LOW = 1.9082149292705877e-10


@kernel
def log(x):
    """Natural logarithm of x, float64, within 2 ulp; -infinity for 0, infinity for infinity, NaN below 0.

    x = 2^k m (exact) with m in [0.707, 1.414]; ln m = 2 (s + s^3 / 3 + ... + s^23 / 23), s = (m - 1) / (m + 1);
    then k LN2_HIGH + (ln m + k LN2_LOW).
    """
    if not 0.0 < x < np.inf:
        return -np.inf if x == 0.0 else (np.inf if x > 0.0 else np.nan)
    k = 0
    while x >= 1.4142135623730951:
        x = x * 0.5
        k += 1
    while x < 0.7071067811865476:
        x = x * 2.0
        k -= 1
    s = (x - 1.0) / (x + 1.0)
    s2 = s * s
    total = 1.0 / 23.0
    for n in range(21, 1, -2):
        total = total * s2 + 1.0 / n
    tail = 2.0 * s * (s2 * total)
    return k * _LN2_HIGH + ((2.0 * s + tail) + k * _LN2_LOW)


@kernel
def power(x, k):
    """The number x to the power of k >= 0, x in [0, 1], float64: exp(k ln x); x itself for k = 1; 1 for k = 0."""
    if k == 1.0:
        return x
    if k == 0.0:
        return 1.0
    return exp(k * log(x)) if x > 0.0 else 0.0
