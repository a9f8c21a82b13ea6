"""SAO's spiral of taps (SAO section 2.3, equations 6 and 7), and random angles of texels.

Angles are in half-turns, so that no multiple of pi is rounded before it is reduced.
"""

from typing import Any

import numpy as np

from lfssao.core.elementary import PI, sincospi
from lfssao.core.jit import formula, kernel
from lfssao.core.philox import random_word

# 2 pi in three parts: the first two have 23 bits, so that products with whole numbers below 2**30 are exact.
TURN = 6.2831850051879883, 3.0199157663446385e-07, 2.1561211432632476e-14


@kernel
def unit_taps(tau, taps):
    """Equations 6 and 7 without phi; taps: (s, 3) float64 or float32, out: u_x, u_y, alpha = h' / r', rounded once.

    theta = 2 pi alpha tau in half-turns: (2 i + 1) tau modulo 2 s, a whole number, over s.
    """
    s = taps.shape[0]
    for i in range(s):
        sine, cosine = sincospi(np.float64(((2 * i + 1) * tau) % (2 * s)) / np.float64(s))
        taps[i, 0], taps[i, 1], taps[i, 2] = cosine, sine, (i + 0.5) / s


@formula
def summed_angle(x: Any, y: Any, angle: Any) -> Any:
    """Sum in float32 of the common hash of texel (x, y), radians, and an angle: both are rounded before. float64."""
    word = np.int32(10 * ((3 * np.int64(x)) ^ (np.int64(y) + np.int64(x) * np.int64(y))))
    return np.float64(np.float32(np.float32(word) + np.float32(angle)))


@formula
def unit_of(radians: Any) -> Any:
    """Sine and cosine, float64, of an angle of up to 2**32 radians, reduced as angles of one's own are."""
    whole = np.floor(radians / (2.0 * PI) + 0.5)
    return sincospi((((radians - whole * TURN[0]) - whole * TURN[1]) - whole * TURN[2]) / PI)


@kernel
def random_angles(seed, angles):
    """Philox's word of (seed, row, column) over 2^31; angles: (H, W) float64, half-turns in [0, 2), out."""
    for y in range(angles.shape[0]):
        for x in range(angles.shape[1]):
            angles[y, x] = np.float64(random_word(seed, y, x)) / 2147483648.0


@kernel
def random_angles_at(seed, rows, columns, angles):
    """``random_angles`` of some texels, (K,) each."""
    for k in range(angles.shape[0]):
        angles[k] = np.float64(random_word(seed, rows[k], columns[k])) / 2147483648.0


@kernel
def turns_of(angles, turns):
    """Cosine and sine of angles, (H, W) half-turns, each rounded to the dtype of turns, (2, H, W), out."""
    for y in range(angles.shape[0]):
        for x in range(angles.shape[1]):
            sine, cosine = sincospi(angles[y, x])
            turns[0, y, x], turns[1, y, x] = cosine, sine
