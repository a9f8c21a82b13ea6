"""Angles that turn samples from texel to texel: ordered dither, void and cluster, random words, gradient noise."""

from functools import cache
from itertools import count
from math import floor

import numpy as np

from reference.elementary import exp
from reference.philox import below, word
from reference.sequences import ROBERTS
from reference.spiral import half_turns, hash_word


def bayer(side):
    """The ordered square built from the one of half the side: four copies, each coarse rank four apart."""
    if side == 1:
        return np.zeros((1, 1), np.int64)
    half = 4 * bayer(side // 2)
    return np.block([[half, half + 2], [half + 3, half + 1]])


@cache
def blue_noise():
    """Ranks of the tile by Ulichney's three phases, the third on what is empty; energies are whole: no sum rounds."""
    n = np.minimum(np.arange(64), 64 - np.arange(64))
    near = [int(exp(-d / (2.0 * 1.5 * 1.5)) * 2.0**40) for d in np.add.outer(n * n, n * n).ravel().tolist()]

    def change(member, energy, place):
        energy += np.roll(np.reshape(near, (64, 64)), place, (0, 1)) * (-1 if member[place] else 1)
        member[place] = ~member[place]
        return place

    def pattern(places):
        """A set of texels and its energy at every texel."""
        made = np.zeros((64, 64), bool), np.zeros((64, 64), np.int64)
        for place in places:
            change(*made, tuple(place))
        return made

    def tightest(member, energy):
        return divmod(int(np.argmax(np.where(member, energy, -1))), 64)

    def emptiest(member, energy):
        return divmod(int(np.argmin(np.where(member, 2**62, energy))), 64)

    darts = (divmod(below(0, 0, dart, 4096), 64) for dart in count())
    ones, ranks = pattern([]), np.empty((64, 64), int)
    while ones[0].sum() < 409:
        place = next(darts)
        if not ones[0][place]:
            change(*ones, place)
    while change(*ones, tightest(*ones)) != change(*ones, emptiest(*ones)):
        pass
    start = np.argwhere(ones[0])
    for rank in range(408, -1, -1):
        ranks[change(*ones, tightest(*ones))] = rank
    ones = pattern(start)
    for rank in range(409, 2048):
        ranks[change(*ones, emptiest(*ones))] = rank
    zeros = pattern(np.argwhere(~ones[0]))
    for rank in range(2048, 4096):
        ranks[change(*zeros, tightest(*zeros))] = rank
    return ranks


def gradient_noise(i, j):
    inner = 0.06711056 * (i + 0.5) + 0.00583715 * (j + 0.5)
    outer = 52.9829189 * (inner - floor(inner))
    return outer - floor(outer)


def angles(rotation, height, width, seed):
    """Half-turns of each texel."""
    angle_of = {
        "hash": lambda j, i: word(seed, j, i) / 2.0**31,
        "tiles": lambda j, i: bayer(4)[j % 4, i % 4] / 8.0,
        "ign": lambda j, i: 2 * gradient_noise(i, j),
        "blue-noise": lambda j, i: (blue_noise()[j % 64][i % 64] + 0.5) / 2048.0,
        "r2": lambda j, i: ((i * ROBERTS[2][0] + j * ROBERTS[2][1]) % 2**64 >> 11) * 2.0**-52,
        "sao-hash": lambda j, i: half_turns(hash_word(i, j, "paper")),
        "common-hash": lambda j, i: half_turns(hash_word(i, j, "common")),
    }[rotation]
    return [[angle_of(j, i) for i in range(width)] for j in range(height)]
