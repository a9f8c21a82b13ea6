"""SAO's spiral of taps (SAO section 2.3, equations 6 and 7), and angles of texels: hashes, random ones, anybody's.

Angles are in half-turns, so that no multiple of pi is rounded before it is reduced. A loop over texels calls
``hash_angle`` and ``sincospi`` once a texel and turns one table of taps (``unit_taps``) by that sine and cosine.
"""

import numpy as np

from lfssao.core.elementary import PI, sincospi
from lfssao.core.jit import kernel
from lfssao.core.philox import random_word

# Equation 8 as C reads it, and the form that other renderers ship.
PAPER, COMMON = 0, 1

# 1 / (2 pi) in units of 2**-64 and the next 64 bits of it, the latter in two halves.
_TURN_HIGH = np.uint64(0x28BE60DB9391054A)
_TURN_MIDDLE = np.uint64(0x7F09D5F4)
_TURN_LOW = np.uint64(0x7D4D3770)
_32 = np.uint64(32)
_11 = np.uint64(11)


@kernel(inline=True)
def hash_word(x, y, variant):
    """Equation 8: the integer, in radians, by which the spiral of texel (x, y) is turned; int64.

    PAPER: (30 x) ^ (y + 10 x y). COMMON: 10 ((3 x) ^ (y + x y)). It wraps to 32 bits, signed, as a shader's int does;
    textures of up to 14,000 texels a side stay below that.
    """
    x = np.int64(x)
    y = np.int64(y)
    word = (30 * x) ^ (y + 10 * x * y) if variant == PAPER else 10 * ((3 * x) ^ (y + x * y))
    return np.int64(np.int32(word))


@kernel(inline=True)
def half_turns(radians):
    """An angle of a whole number of radians, below 2**32 either way, in half-turns: float64 in [0, 2).

    The product with 1 / (2 pi) is taken in 128-bit integers modulo one turn and cut, once, to a multiple of 2**-52.
    """
    size = np.uint64(abs(radians))
    low = size * _TURN_MIDDLE + ((size * _TURN_LOW) >> _32)
    turn = size * _TURN_HIGH + (low >> _32)
    if radians < 0:
        turn = ~turn + np.uint64(1)
    return np.float64(turn >> _11) * 2.0**-52


@kernel(inline=True)
def hash_angle(x, y, variant):
    """Equation 8's phi at texel (x, y), half-turns, float64 in [0, 2); variant: PAPER or COMMON."""
    return half_turns(hash_word(x, y, variant))


@kernel(inline=True)
def spiral_tap(i, s, tau, angle):
    """Equations 6 and 7: tap i of s, unit vector (u_x, u_y) and alpha = h' / r', float64.

    theta = 2 pi alpha tau + phi in half-turns: (2 i + 1) tau modulo 2 s, a whole number, over s, and the angle phi.
    """
    sine, cosine = sincospi(np.float64(((2 * i + 1) * tau) % (2 * s)) / np.float64(s) + angle)
    return cosine, sine, (i + 0.5) / s


@kernel
def unit_taps(tau, taps):
    """All taps at angle 0; taps: (s, 3) float64 or float32, out: u_x, u_y, alpha, rounded once."""
    s = taps.shape[0]
    for i in range(s):
        taps[i, 0], taps[i, 1], taps[i, 2] = spiral_tap(i, s, tau, 0.0)


@kernel(inline=True)
def rotated(x, y, cosine, sine):
    """A vector turned by an angle of that cosine and sine, in the arguments' dtype."""
    return x * cosine - y * sine, x * sine + y * cosine


# 2 pi in three parts: the first two have 23 bits, so that products with whole numbers below 2**30 are exact.
_TURN = 6.2831850051879883, 3.0199157663446385e-07, 2.1561211432632476e-14


@kernel
def hashed_angles(variant, angles):
    """SAO's equation 8 at every texel; angles: (H, W) float64, half-turns in [0, 2), out."""
    for y in range(angles.shape[0]):
        for x in range(angles.shape[1]):
            angles[y, x] = hash_angle(x, y, variant)


@kernel
def random_angles(seed, angles):
    """Philox's word of (seed, row, column) over 2^31; angles: (H, W) float64, half-turns in [0, 2), out."""
    for y in range(angles.shape[0]):
        for x in range(angles.shape[1]):
            angles[y, x] = np.float64(random_word(seed, y, x)) / 2147483648.0


@kernel
def radian_angles(radians, angles):
    """Radians up to 2**32 either way, (H, W), in half-turns of [-1, 1], (H, W) float64, out; off by 3e-16 at most.

    Whole turns are taken off in three parts, the first two exactly.
    """
    for y in range(angles.shape[0]):
        for x in range(angles.shape[1]):
            angle = np.float64(radians[y, x])
            turns = np.floor(angle / (2.0 * PI) + 0.5)
            angles[y, x] = (((angle - turns * _TURN[0]) - turns * _TURN[1]) - turns * _TURN[2]) / PI


@kernel
def turns_of(angles, turns):
    """Cosine and sine of angles, (H, W) half-turns, each rounded to the dtype of turns, (2, H, W), out."""
    for y in range(angles.shape[0]):
        for x in range(angles.shape[1]):
            sine, cosine = sincospi(angles[y, x])
            turns[0, y, x], turns[1, y, x] = cosine, sine
