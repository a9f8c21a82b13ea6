"""Angles of texels: hashes, random numbers, and anybody's angles in radians, as half-turns."""

import numpy as np

from lfssao.core.elementary import PI, sincospi
from lfssao.core.jit import kernel
from lfssao.core.philox import random_word
from lfssao.samples.kernels.spiral import hash_angle

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
