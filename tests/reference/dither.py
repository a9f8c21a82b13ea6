"""Angles that turn samples from texel to texel: ordered dither, void and cluster, random words, gradient noise."""

from functools import cache
from math import floor

import numpy as np

from reference.elementary import exp
from reference.philox import below, word


def bayer(side):
    """The ordered square built from the one of half the side: four copies, each coarse rank four apart."""
    if side == 1:
        return np.zeros((1, 1), np.int64)
    half = 4 * bayer(side // 2)
    return np.block([[half, half + 2], [half + 3, half + 1]])


def void_and_cluster(seed, height, width):
    """Ulichney's three phases, the third on what is empty, energies summed afresh each time they are looked at."""
    places = [(y, x) for y in range(height) for x in range(width)]

    def near(p, q):
        b, a = ((u - v) % size for u, v, size in zip(p, q, (height, width), strict=True))
        a, b = min(a, width - a), min(b, height - b)
        return int(exp(-(a * a + b * b) / (2.0 * 1.5 * 1.5)) * 2.0**40)

    table = {(p, q): near(p, q) for p in places for q in places}

    def tightest(chosen):
        return max(sorted(chosen), key=lambda p: sum(table[p, q] for q in chosen))

    def emptiest(chosen):
        return min((p for p in places if p not in chosen), key=lambda p: sum(table[p, q] for q in chosen))

    ones, dart = set(), 0
    while len(ones) < max(height * width // 10, 1):
        y, x = divmod(below(seed, 0, dart, height * width), width)
        ones.add((y, x))
        dart += 1
    while True:
        ones.remove(cluster := tightest(ones))
        ones.add(void := emptiest(ones))
        if void == cluster:
            break
    ranks, left = {}, set(ones)
    while left:
        left.remove(cluster := tightest(left))
        ranks[cluster] = len(left)
    while len(ones) < len(places) / 2:
        ranks[void := emptiest(ones)] = len(ones)
        ones.add(void)
    zeros = set(places) - ones
    while zeros:
        ranks[cluster := tightest(zeros)] = len(places) - len(zeros)
        zeros.remove(cluster)
    return [[ranks[y, x] for x in range(width)] for y in range(height)]


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
    }[rotation]
    return [[angle_of(j, i) for i in range(width)] for j in range(height)]
