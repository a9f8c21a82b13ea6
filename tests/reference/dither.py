"""Angles that turn samples from texel to texel: ordered dither, void and cluster, random words, gradient noise."""

from functools import cache
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


def void_and_cluster(seed, height, width):
    """Ulichney's three phases, the third on what is empty; energies are whole numbers, so no sum rounds."""
    b, a = (np.minimum(k, size - k) for k, size in zip(np.indices((height, width)), (height, width), strict=True))
    table = [int(exp(-d / (2.0 * 1.5 * 1.5)) * 2.0**40) for d in (a * a + b * b).ravel().tolist()]
    near = np.array(table, np.int64).reshape(height, width)

    def energy(places):
        """Energy at every texel of a set of places, (H, W)."""
        return sum((np.roll(near, place, (0, 1)) for place in places), np.zeros((height, width), np.int64))

    def first(values):
        return tuple(int(k) for k in np.unravel_index(np.argmax(values), values.shape))

    class Pattern:
        """A set of texels and its energy."""

        def __init__(self, places):
            self.member, self.energy = np.zeros((height, width), bool), energy(places)
            for place in places:
                self.member[place] = True

        def change(self, place):
            self.energy += energy([place]) * (-1 if self.member[place] else 1)
            self.member[place] = ~self.member[place]
            return place

        def tightest(self):
            return first(np.where(self.member, self.energy, -1))

        def emptiest(self):
            return first(np.where(self.member, -(2**62), -self.energy))

    places, dart = [], 0
    while len(places) < max(height * width // 10, 1):
        place = divmod(below(seed, 0, dart, height * width), width)
        places += [] if place in places else [place]
        dart += 1
    pattern = Pattern(places)
    while pattern.change(pattern.tightest()) != pattern.change(pattern.emptiest()):
        pass
    start, ranks = [tuple(place) for place in np.argwhere(pattern.member).tolist()], np.empty((height, width), int)
    for rank in range(len(start) - 1, -1, -1):
        ranks[pattern.change(pattern.tightest())] = rank
    pattern, rank = Pattern(start), len(start)
    while rank < height * width / 2:
        ranks[pattern.change(pattern.emptiest())] = rank
        rank += 1
    zeros = Pattern([tuple(place) for place in np.argwhere(~pattern.member).tolist()])
    for last in range(rank, height * width):
        ranks[zeros.change(zeros.tightest())] = last
    return ranks.tolist()


def gradient_noise(i, j):
    inner = 0.06711056 * (i + 0.5) + 0.00583715 * (j + 0.5)
    outer = 52.9829189 * (inner - floor(inner))
    return outer - floor(outer)


@cache
def blue_noise():
    return void_and_cluster(0, 64, 64)


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
