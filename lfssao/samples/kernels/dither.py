"""Angles of texels: tiles of ranks, ordered 4 x 4 and blue noise by void and cluster (Ulichney 1993); hashes; noise.

Angles in radians, of anybody, become half-turns here too.
"""

import numpy as np

from lfssao.core.elementary import PI, exp, sincospi
from lfssao.core.jit import kernel
from lfssao.core.philox import random_below, random_word
from lfssao.samples.kernels.spiral import hash_angle
from lfssao.samples.kernels.square import R2_1, R2_2

_STREAM = 0
_SIGMA = 1.5  # Ulichney's, texels
# 2 pi in three parts: the first two have 23 bits, so that products with whole numbers below 2**30 are exact.
_TURN = 6.2831850051879883, 3.0199157663446385e-07, 2.1561211432632476e-14
_UNIT = 2.0**40  # energies are whole numbers, so that adding and taking away leaves no rounding error


@kernel
def ordered(ranks):
    """Bayer's order of a square whose side is a power of two: a rank's bits are those of x ^ y and y, finest first.

    ranks: (side, side) int64, out: 0 .. side^2 - 1. Ranks that follow each other lie far apart.
    """
    side = ranks.shape[0]
    for y in range(side):
        for x in range(side):
            rank, bit = 0, 1
            while bit < side:
                rank = rank * 4 + (2 if (x ^ y) & bit else 0) + (1 if y & bit else 0)
                bit = bit * 2
            ranks[y, x] = rank


@kernel
def _energies(table):
    """Gaussian of the distance on the torus between texel (0, 0) and each other, in units of 1 / _UNIT."""
    height, width = table.shape
    for y in range(height):
        for x in range(width):
            a, b = min(x, width - x), min(y, height - y)
            table[y, x] = np.int64(exp(-(a * a + b * b) / (2.0 * _SIGMA * _SIGMA)) * _UNIT)


@kernel
def _change(x, y, sign, table, energy):
    """Add or take away the energy of the texel (x, y)."""
    height, width = energy.shape
    for j in range(height):
        for i in range(width):
            energy[j, i] += sign * table[(j - y) % height, (i - x) % width]


@kernel
def _extreme(wanted, sign, ones, energy):
    """The first texel of the wanted kind with the largest sign * energy: tightest cluster (1) or largest void (-1)."""
    height, width = energy.shape
    best, x, y = np.int64(-1) << 62, 0, 0
    for j in range(height):
        for i in range(width):
            if ones[j, i] == wanted and sign * energy[j, i] > best:
                best, x, y = sign * energy[j, i], i, j
    return x, y


@kernel
def void_and_cluster(seed, ranks):
    """Blue noise ranks 0 .. width * height - 1 on a tile that repeats; ranks: (height, width) int64, out.

    The texels below any threshold are spread evenly. A tenth of the texels start as a random set; the tightest cluster
    moves to the largest void until that is the place it came from. The set's own ranks come from taking away tightest
    clusters, all others from filling largest voids. Ulichney's third phase, the tightest cluster of the empty texels,
    picks the same texels as his second, because the energies of set and rest sum to a constant.
    """
    height, width = ranks.shape
    ones = np.zeros((height, width), np.int64)
    energy = np.zeros((height, width), np.int64)
    table = np.empty((height, width), np.int64)
    _energies(table)
    start = max(height * width // 10, 1)
    dart = count = 0
    while count < start:
        place = random_below(seed, _STREAM, dart, height * width)
        dart += 1
        x, y = place % width, place // width
        if ones[y, x] == 0:
            ones[y, x] = 1
            _change(x, y, 1, table, energy)
            count += 1
    while True:
        x, y = _extreme(1, 1, ones, energy)
        ones[y, x] = 0
        _change(x, y, -1, table, energy)
        i, j = _extreme(0, -1, ones, energy)
        ones[j, i] = 1
        _change(i, j, 1, table, energy)
        if i == x and j == y:
            break
    kept, sums = ones.copy(), energy.copy()
    for rank in range(start - 1, -1, -1):
        x, y = _extreme(1, 1, ones, energy)
        ranks[y, x] = rank
        ones[y, x] = 0
        _change(x, y, -1, table, energy)
    for rank in range(start, height * width):
        x, y = _extreme(0, -1, kept, sums)
        ranks[y, x] = rank
        kept[y, x] = 1
        _change(x, y, 1, table, sums)


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
def gradient_noise_angles(angles):
    """Interleaved gradient noise (Jimenez 2014) at the texels' centres; angles: (H, W), half-turns in [0, 2), out."""
    for y in range(angles.shape[0]):
        for x in range(angles.shape[1]):
            slope = 0.06711056 * (x + 0.5) + 0.00583715 * (y + 0.5)
            noise = 52.9829189 * (slope - np.floor(slope))
            angles[y, x] = 2.0 * (noise - np.floor(noise))


@kernel
def recurrence_angles(angles):
    """Fractions of a turn x a + y b modulo 1, of R2's constants; angles: (H, W), half-turns in [0, 2), out.

    In integers modulo 2**64, cut to a multiple of 2**-53 of a turn.
    """
    for y in range(angles.shape[0]):
        for x in range(angles.shape[1]):
            turn = np.uint64(x) * R2_1 + np.uint64(y) * R2_2
            angles[y, x] = np.float64(turn >> np.uint64(11)) * 2.0**-52


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
