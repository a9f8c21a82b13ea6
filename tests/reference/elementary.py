"""Elementary functions in binary64: section 4 of the specification.

They take and return Python's floats.
"""

import math

LN2_HIGH, LN2_LOW, INVERSE_LN2 = 0.6931471803691238, 1.9082149292705877e-10, 1.4426950408889634
ROOT_OF_2 = 1.4142135623730951


def nearest(x):
    """The whole number nearest to x; halves round away from zero."""
    return int(x + 0.5) if x >= 0 else -int(0.5 - x)


def sincospi(x):
    q = nearest(x * 2)
    a = 3.141592653589793 * (x - q * 0.5)
    b = a * a
    s = 1 / 355687428096000
    for sign, n in ((-1, 1307674368000), (1, 6227020800), (-1, 39916800), (1, 362880), (-1, 5040), (1, 120), (-1, 6)):
        s = s * b + sign * (1 / n)
    s = ((s * b) * a) + a
    c = 1 / 20922789888000
    for sign, n in ((-1, 87178291200), (1, 479001600), (-1, 3628800), (1, 40320), (-1, 720), (1, 24), (-1, 2), (1, 1)):
        c = c * b + sign * (1 / n)
    return ((s, c), (c, -s), (-s, -c), (-c, s))[q & 3]


def acos(x):
    size = abs(x)
    square = 0.5 * (1 - size) if size > 0.5 else size * size
    y = 1.0
    for n in range(48, 0, -2):
        y = 1 + (y * square) * (((n - 1) * (n - 1)) / (n * (n + 1)))
    angle = (math.sqrt(square) if size > 0.5 else size) * y
    near = 2 * angle if size > 0.5 else 1.5707963267948966 - angle
    return 3.141592653589793 - near if x < 0 else near


def cbrt(t):
    if not (t > 0 and t < math.inf):
        return t
    scale = 1.0
    while t >= 8:
        t, scale = t * 0.125, scale * 2
    while t < 1:
        t, scale = t * 8, scale * 0.5
    y = 0.9 + 0.15 * t
    for _ in range(6):
        y = y - (y * y * y - t) / (3 * y * y)
    return y * scale


def exp(x):
    if x < -745:
        return 0.0
    if x > 710:
        return math.inf
    k = nearest(x * INVERSE_LN2)
    r = (x - k * LN2_HIGH) - k * LN2_LOW
    y = 1.0
    for n in range(13, 0, -1):
        y = (y * r) / n + 1
    for _ in range(abs(k)):
        y = y * 2 if k >= 0 else y * 0.5
    return y


def log(x):
    n = 0
    while x >= ROOT_OF_2:
        x, n = x * 0.5, n + 1
    while x < 0.7071067811865476:
        x, n = x * 2, n - 1
    s = (x - 1) / (x + 1)
    t = s * s
    y = 1 / 23
    for m in range(21, 2, -2):
        y = y * t + 1 / m
    return n * LN2_HIGH + ((2 * s + (2 * s) * (t * y)) + n * LN2_LOW)


def power(w, k):
    if k in (0, 1):
        return w if k == 1 else 1.0
    return exp(k * log(w)) if w > 0 else 0.0


def log2(x):
    if math.isnan(x) or x == math.inf:
        return 1024.0
    x, k = max(x, 2.0**-1022), 0
    while x >= 2:
        x, k = x * 0.5, k + 1
    while x < 1:
        x, k = x * 2, k - 1
    if x > ROOT_OF_2:
        x, k = x * 0.5, k + 1
    s = (x - 1) / (x + 1)
    t = s * s
    y = 1 / 21
    for n in range(19, 2, -2):
        y = y * t + 1 / n
    return k + 2.8853900817779268 * ((y * t) * s + s)


def dot(a, b):
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]


def in_order(numbers):
    """Sum from the first to the last."""
    total = 0.0
    for number in numbers:
        total = total + number
    return total
