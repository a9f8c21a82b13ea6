"""SAO's spiral of taps and the hash that turns it from texel to texel: ESTIMATORS.md of the kit."""

import math
from fractions import Fraction

import numpy as np

from reference.elementary import sincospi

TURNS = (
    1, 1, 1, 1, 2, 1, 2, 3, 2, 3, 3, 5, 5, 3, 4, 7, 5, 5, 7, 9, 8, 5, 7, 7, 7,
    7, 8, 5, 12, 11, 12, 7, 10, 13, 8, 11, 10, 9, 16, 11, 12, 13, 12, 13, 19, 17, 13, 11, 18, 19,
    11, 11, 23, 17, 21, 17, 13, 17, 18, 13, 17, 23, 17, 19, 19, 25, 18, 19, 19, 29, 21, 19, 27, 31, 29,
    21, 18, 17, 29, 31, 31, 23, 30, 19, 23, 25, 19, 19, 34, 17, 27, 21, 25, 39, 39, 29, 35, 27, 29,
)  # fmt: skip


def hash_word(i, j, variant):
    """A shader's int."""
    return wrapped((30 * i) ^ (j + 10 * i * j) if variant == "paper" else 10 * ((3 * i) ^ (j + i * j)))


def wrapped(h):
    return (h + 2**31) % 2**32 - 2**31


def half_turns(h):
    """Whole radians as an angle for sincospi."""
    low = (abs(h) * 0x7F09D5F4 + ((abs(h) * 0x7D4D3770) >> 32)) % 2**64
    turn = (abs(h) * 0x28BE60DB9391054A + (low >> 32)) % 2**64
    if h < 0:
        turn = -turn % 2**64
    return (turn >> 11) * 2.0**-52


def turns_of(s):
    """Tau of s taps."""
    if s <= 99:
        return TURNS[s - 1]
    middle = round(s * 0.3819660112501051)
    return min((n for n in range(1, s) if math.gcd(n, s) == 1), key=lambda n: (abs(n - middle), n))


def tap_of(t, s, tau, full_turn="exact"):
    """Cosine, sine and alpha."""
    if full_turn == "6.28":
        angle = (3.14 * (((2 * t + 1) * tau) / s)) / 3.141592653589793
    else:
        angle = (((2 * t + 1) * tau) % (2 * s)) / s
    sine, cosine = sincospi(angle)
    return cosine, sine, (t + 0.5) / s


def summed(i, j, theta):
    """Cosine and sine of the common hash and a tap's angle, added in binary32."""
    p = float(np.float32(hash_word(i, j, "common")) + np.float32(theta))
    q = math.floor(p / 6.283185307179586 + 0.5)
    p = ((p - q * 6.2831850051879883) - q * 3.0199157663446385e-07) - q * 2.1561211432632476e-14
    sine, cosine = sincospi(p / 3.141592653589793)
    return cosine, sine


def discrepancy_squared(s, tau):
    """The mean over sectors, pair by pair, as a fraction."""
    alpha = [Fraction(2 * i + 1, 2 * s) for i in range(s)]
    total = Fraction(1, 9) - Fraction(2, s) * sum((1 - a * a) / 6 for a in alpha)
    for i in range(s):
        for j in range(s):
            d = (alpha[i] - alpha[j]) * tau % 1
            total += (1 - max(alpha[i], alpha[j])) * (Fraction(1, 2) - d * (1 - d)) / s**2
    return total
