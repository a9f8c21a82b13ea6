"""SAO's spiral, its hash and the score of its turns again, in plain Python's whole numbers and fractions.

Nothing here comes from lfssao.
"""

from fractions import Fraction

from reference.twins import sincospi


def inverse_turn(bits):
    """Floor of 2**bits / (2 pi), from Machin's formula for pi in whole numbers."""
    one = 1 << (bits + 64)

    def arctan_of_inverse(n):
        total, power, k, sign = 0, one // n, 1, 1
        while power:
            total += sign * (power // k)
            power, k, sign = power // (n * n), k + 2, -sign
        return total

    pi = 4 * (4 * arctan_of_inverse(5) - arctan_of_inverse(239))
    return (1 << bits) * one // (2 * pi)


INVERSE_TURN = inverse_turn(128)


def hash_word(x, y, variant):
    word = (30 * x) ^ (y + 10 * x * y) if variant == "paper" else 10 * ((3 * x) ^ (y + x * y))
    return (word + 2**31) % 2**32 - 2**31  # a shader's int


def half_turns(radians):
    turn = abs(radians) * INVERSE_TURN // 2**64 % 2**64  # in units of 2**-64 turns
    if radians < 0:
        turn = -turn % 2**64
    return (turn // 2**11) / 2.0**52


def hash_angle(x, y, variant):
    return half_turns(hash_word(x, y, variant))


def spiral_tap(i, s, tau, angle):
    sine, cosine = sincospi((2 * i + 1) * tau % (2 * s) / s + angle)
    return cosine, sine, (i + 0.5) / s


def discrepancy_squared(s, tau):
    """The mean over sectors, pair by pair, as a fraction."""
    alpha = [Fraction(2 * i + 1, 2 * s) for i in range(s)]
    total = Fraction(1, 9) - Fraction(2, s) * sum((1 - a * a) / 6 for a in alpha)
    for i in range(s):
        for j in range(s):
            d = (alpha[i] - alpha[j]) * tau % 1
            total += (1 - max(alpha[i], alpha[j])) * (Fraction(1, 2) - d * (1 - d)) / s**2
    return total


def sector_error(s, tau, a, start, length):
    """Share of the taps in one sector minus the share that it ought to hold."""
    inside = sum((2 * i + 1) / (2 * s) < a and ((2 * i + 1) * tau / (2 * s) - start) % 1.0 < length for i in range(s))
    return inside / s - a * length
