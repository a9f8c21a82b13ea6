"""The part of the kit's reader on numbers, by SPECIFICATION.md alone: elementary functions and random words.

Scalars one at a time, as the text writes them: Python's floats are binary64, np.float32's are binary32.
"""

import math

import numpy as np

F = np.float32


def binary32(numbers):
    return [F(number) for number in np.ravel(numbers).tolist()]


# Section 4


def fraction_away(x, factor):
    return int(x * factor + 0.5) if x >= 0 else -int(0.5 - x * factor)


def sincospi(x):
    q = fraction_away(x, 2.0)
    r = x - float(q) * 0.5
    a = 3.141592653589793 * r
    b = a * a
    s = 1 / 355687428096000
    for sign, n in ((-1, 1307674368000), (1, 6227020800), (-1, 39916800), (1, 362880), (-1, 5040), (1, 120), (-1, 6)):
        s = s * b + sign * (1 / n)
    s = ((s * b) * a) + a
    c = 1 / 20922789888000
    for sign, n in ((-1, 87178291200), (1, 479001600), (-1, 3628800), (1, 40320), (-1, 720), (1, 24), (-1, 2), (1, 1)):
        c = c * b + sign * (1 / n)
    return ((s, c), (c, -s), (-s, -c), (-c, s))[q & 3]


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
    k = fraction_away(x, 1.4426950408889634)
    r = (x - k * 0.6931471803691238) - k * 1.9082149292705877e-10
    y = 1.0
    for n in range(13, 0, -1):
        y = (y * r) / n + 1
    for _ in range(abs(k)):
        y = y * 2 if k >= 0 else y * 0.5
    return y


def elementary(parameters, inputs):
    function = {"sincospi": sincospi, "cbrt": cbrt, "exp": exp}[parameters["function"]]
    return np.array([function(float(x)) for x in inputs["x"]])


# Section 17: powers and turns of its estimators


def log(x):
    n = 0
    while x >= 1.4142135623730951:
        x, n = x * 0.5, n + 1
    while x < 0.7071067811865476:
        x, n = x * 2, n - 1
    s = (x - 1) / (x + 1)
    t = s * s
    y = 1 / 23
    for m in range(21, 2, -2):
        y = y * t + 1 / m
    return n * 0.6931471803691238 + ((2 * s + (2 * s) * (t * y)) + n * 1.9082149292705877e-10)


def power(w, k):
    if k in (0, 1):
        return w if k == 1 else 1.0
    return exp(k * log(w)) if w > 0 else 0.0


def turn_of(i, j, rotation):
    """Sine and cosine, binary32."""
    if rotation == "none":
        return F(0), F(1)
    h = (30 * i) ^ (j + 10 * i * j) if rotation == "paper" else 10 * ((3 * i) ^ (j + i * j))
    h = (h + 2**31) % 2**32 - 2**31
    low = abs(h) * 0x7F09D5F4 + ((abs(h) * 0x7D4D3770) >> 32)
    turn = (abs(h) * 0x28BE60DB9391054A + (low % 2**64 >> 32)) % 2**64
    turn = -turn % 2**64 if h < 0 else turn
    return [F(number) for number in sincospi((turn >> 11) * 2.0**-52)]


# Section 5


def philox(counter, key):
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for _ in range(10):
        p, q = 0xD2511F53 * c0, 0xCD9E8D57 * c2
        c0, c1, c2, c3 = (q >> 32) ^ c1 ^ k0, q & 0xFFFFFFFF, (p >> 32) ^ c3 ^ k1, p & 0xFFFFFFFF
        k0, k1 = (k0 + 0x9E3779B9) % 2**32, (k1 + 0xBB67AE85) % 2**32
    return c0, c1, c2, c3


def philox_stage(parameters, inputs):
    pairs = zip(inputs["counters"].tolist(), inputs["keys"].tolist(), strict=True)
    return np.array([philox(counter, key) for counter, key in pairs], np.uint32)


def word(seed, stream, index):
    return philox((index, stream, 0, 0), (seed % 2**32, seed // 2**32))[0]


def unit(seed, stream, index):
    return (word(seed, stream, index) + 0.5) / 4294967296
