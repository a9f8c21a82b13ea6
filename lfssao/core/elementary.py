"""Sine, cosine, arc cosine, cube root, exponential, logarithm and power of basic operations.

The C library's differ between machines. All in float64. The errors stated are against mpmath and are held by tests.
"""

from typing import Any

import numpy as np

from lfssao.core.jit import formula, kernel

PI = 3.141592653589793

# ln 2 in two parts: the first has 21 trailing zero bits, so that its product with a small integer is exact.
_LN2_HIGH = 0.6931471803691238
_LN2_LOW = 1.9082149292705877e-10
_INV_LN2 = 1.4426950408889634

_TWO_OVER_LN2 = 2.8853900817779268
_SQRT2 = 1.4142135623730951
_LEAST_NORMAL = 2.0**-1022


@kernel
def sincospi(x):
    """Sine and cosine of pi x, float64, each within 2 ulp of 1 (4.5e-16) for abs(x) <= 2**50.

    x is reduced to r in [-1/4, 1/4] exactly; then Taylor's polynomials in pi r, highest power first (Horner).
    """
    quadrant = int(x * 2.0 + 0.5) if x >= 0.0 else -int(0.5 - x * 2.0)
    r = x - quadrant * 0.5
    a = PI * r
    a2 = a * a
    s = 1.0 / 355687428096000.0
    s = s * a2 - 1.0 / 1307674368000.0
    s = s * a2 + 1.0 / 6227020800.0
    s = s * a2 - 1.0 / 39916800.0
    s = s * a2 + 1.0 / 362880.0
    s = s * a2 - 1.0 / 5040.0
    s = s * a2 + 1.0 / 120.0
    s = s * a2 - 1.0 / 6.0
    s = s * a2 * a + a
    c = 1.0 / 20922789888000.0
    c = c * a2 - 1.0 / 87178291200.0
    c = c * a2 + 1.0 / 479001600.0
    c = c * a2 - 1.0 / 3628800.0
    c = c * a2 + 1.0 / 40320.0
    c = c * a2 - 1.0 / 720.0
    c = c * a2 + 1.0 / 24.0
    c = c * a2 - 0.5
    c = c * a2 + 1.0
    odd, turn = quadrant & 1, quadrant & 3
    sine, cosine = c if odd else s, s if odd else c  # selects, no branches: loops become vectors
    return -sine if turn >= 2 else sine, -cosine if (turn == 1) | (turn == 2) else cosine


@formula
def acos(x):
    """The angle from 0 to pi whose cosine is x, -1 <= x <= 1, float64, within 2 ulp; NaN beyond.

    asin t = t (1 + t^2 / 6 + 3 t^4 / 40 + ...) to t^49, highest power first, of t = x where abs(x) <= 1/2, else of
    sqrt((1 - abs(x)) / 2), the sine of half the angle. Without branches, so that loops become vectors.
    """
    size = abs(x)
    large = size > 0.5
    square = 0.5 * (1.0 - size) if large else size * size
    sine = np.sqrt(square) if large else size
    y = 1.0
    for n in range(48, 0, -2):
        y = 1.0 + y * square * ((n - 1.0) * (n - 1.0) / (n * (n + 1.0)))
    angle = sine * y
    near = 2.0 * angle if large else 0.5 * PI - angle  # of abs(x)
    return PI - near if x < 0.0 else near


@formula
def root_of_bits(x):
    """The square root of x >= 0 by half of the bits of its float32, within 3.5 %: XeGTAO's; 8e-20 for 0.

    Drobot 2014, 'Low Level Optimizations for GCN': exponent and digits are halved as one number.
    """
    return np.float64(np.int32(np.int32(0x1FBD1DF5) + (np.float32(x).view(np.int32) >> np.int32(1))).view(np.float32))


@kernel
def cbrt(t):
    """Cube root of t >= 0, float64, within 1 ulp; 0 for 0, infinity for infinity.

    t is scaled by powers of 8 (exact) into [1, 8); six Newton steps from a straight line reach the last bit.
    """
    if not 0.0 < t < np.inf:
        return t
    scale = 1.0
    while t >= 8.0:
        t = t * 0.125
        scale = scale * 2.0
    while t < 1.0:
        t = t * 8.0
        scale = scale * 0.5
    y = 0.9 + 0.15 * t
    for _ in range(6):
        y = y - (y * y * y - t) / (3.0 * y * y)
    return y * scale


@kernel
def exp(x):
    """E to the power of x, float64, within 2 ulp for x in [-700, 700]; 0 below -745, infinity above 710.

    x = k ln 2 + r with abs(r) <= 0.35; Taylor's polynomial of degree 13 in r; then k exact doublings or halvings.
    """
    if x < -745.0:
        return 0.0
    if not x <= 710.0:
        return x + np.inf  # NaN stays what it is
    k = int(x * _INV_LN2 + 0.5) if x >= 0.0 else -int(0.5 - x * _INV_LN2)
    r = (x - k * _LN2_HIGH) - k * _LN2_LOW
    y = 1.0
    for n in range(13, 0, -1):
        y = y * r / n + 1.0
    if k >= 0:
        for _ in range(k):
            y = y * 2.0
    else:
        for _ in range(-k):
            y = y * 0.5
    return y


@formula
def log2(x: Any) -> Any:
    """Binary logarithm of x, float64, within 4 ulp; -1022 below the normal numbers, 1024 for infinity.

    x = 2^k m with m in [sqrt(1/2), sqrt(2)], from its bits; k + 2 / ln 2 (s + s^3 / 3 + ... + s^21 / 21) with s =
    (m - 1) / (m + 1), highest power first. Without branches, so that loops become vectors. NaN is taken as infinity.
    """
    held = x if x > _LEAST_NORMAL else _LEAST_NORMAL
    held = held if x < np.inf else np.inf
    bits = np.float64(held).view(np.int64)
    k = (bits >> np.int64(52)) - np.int64(1023)
    m = np.int64((bits & np.int64(0xFFFFFFFFFFFFF)) | np.int64(0x3FF0000000000000)).view(np.float64)
    large = m > _SQRT2
    m = 0.5 * m if large else m
    k = k + np.int64(1) if large else k
    s = (m - 1.0) / (m + 1.0)
    s2 = s * s
    y = 1.0 / 21.0
    for n in range(19, 1, -2):
        y = y * s2 + 1.0 / n
    y = (y * s2) * s + s
    return k + _TWO_OVER_LN2 * y


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
