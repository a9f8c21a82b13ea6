"""Numbers known up to an error: the value that exact arithmetic gives, float64, and a bound on how far float32 is off.

A pair (x, e) stands for any number of [x - e, x + e]. Each function returns the pair of an operation on pairs: what
the operands' errors make of the exact result, plus the operation's own rounding, at most r times the size of what it
rounds, plus ``FLUSHED`` where that may be flushed to zero:

    (x + e)(y + f) = x y + (x f + y e + e f)
    (x + e) / (y + f) = x / y + (e - (x / y) f) / (y + f)
    sqrt(x + e) = sqrt(x) + e / (sqrt(x + e) + sqrt(x))

These are computed in float64, whose own rounding is 2^-29 of float32's; ``SAFETY`` times an error, applied once where
it is used, outweighs the rounding of a thousand such operations.
"""

import numpy as np

from lfssao.kernels.jit import kernel

FLUSHED = 2.0**-124  # four flushed numbers: an operation's operands and its result, and one to spare
SAFETY = 1.0 + 2.0**-20


@kernel(inline=True)
def add(x, e, y, f, r):
    """Sum x + y of pairs."""
    s = x + y
    g = e + f
    return s, g + r * (abs(s) + g) + FLUSHED


@kernel(inline=True)
def multiply(x, e, y, f, r):
    """Product x y of pairs."""
    p = x * y
    g = (abs(x) * f + abs(y) * e) + e * f
    return p, g + r * (abs(p) + g) + FLUSHED * (1.0 + abs(x) + abs(y))


@kernel(inline=True)
def divide(x, e, y, f, r):
    """Quotient x / y of pairs; the error is infinite where y may be 0."""
    q = x / y
    room = abs(y) - f
    if not room > FLUSHED:
        return q, np.inf
    g = (e + abs(q) * f) / room
    return q, g + r * (abs(q) + g) + FLUSHED * (1.0 + 1.0 / room)


@kernel(inline=True)
def root(x, e, r):
    """Square root of a pair; the error is infinite where x may be negative."""
    if not x - e >= 0.0:
        return 0.0, np.inf
    s = np.sqrt(x)
    g = e / (np.sqrt(x - e) + s) if s > 0.0 else np.sqrt(e)
    return s, g + r * (s + g) + FLUSHED
