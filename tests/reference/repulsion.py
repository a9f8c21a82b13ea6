"""VO's tables of samples: darts to begin with, the energy of charges, and the cells' weights."""

import math

import numpy as np

from reference.elementary import in_order
from reference.philox import signed


def darts(seed, n, d):
    """Darts that keep a distance, which shrinks by a tenth after 64 misses in a row; shrunk by a twentieth."""
    points, apart, dart, missed = [], 4.0, 0, 0
    while len(points) < n:
        place = [signed(seed, a, dart) for a in range(d)]
        dart += 1
        if in_order(x * x for x in place) > 1.0:
            continue
        place = [0.95 * x for x in place]
        if all(in_order((a - b) * (a - b) for a, b in zip(p, place, strict=True)) >= apart for p in points):
            points.append(place)
            missed = 0
        elif (missed := missed + 1) == 64:
            missed, apart = 0, apart * 0.9
    return points


GAUSS = np.polynomial.legendre.leggauss(120)


def energy(points, charge, ring=2048):
    """The energy of all charges, the boundary's by summing over many on it: the sphere's over a fine product grid."""
    n, d = points.shape
    total = sum(1 / (3 * math.dist(points[i], points[k]) ** 3) for i in range(n) for k in range(i))
    angle = (np.arange(ring) + 0.5) * (2 * np.pi / ring)
    for p in points:
        if d == 2:
            gap = (p[0] - np.cos(angle)) ** 2 + (p[1] - np.sin(angle)) ** 2
            total += charge * np.mean(1 / (3 * gap**1.5))
        else:
            (z, weight), square = GAUSS, np.sum(p**2)
            total += charge * np.sum(weight / 2 / (3 * (1 + square - 2 * math.sqrt(square) * z) ** 1.5))
    return total


def voronoi(points, cells):
    """Weights and centroids of the cells, one grid point after the other."""
    n, d = points.shape
    weights, sums = [0.0] * n, [[0.0] * d for _ in range(n)]
    middles = [((2 * k + 1) - cells) / cells for k in range(cells)]
    for z in middles if d == 3 else [0.0]:
        for y in middles:
            for x in middles:
                inside = 1.0 - ((x * x + y * y) + z * z)
                if inside <= 0.0:
                    continue
                part = 1.0 if d == 3 else math.sqrt(inside)
                gaps = []
                for p in points.tolist():
                    gap = (p[0] - x) * (p[0] - x) + (p[1] - y) * (p[1] - y)
                    gaps.append(gap + (p[2] - z) * (p[2] - z) if d == 3 else gap)
                k = gaps.index(min(gaps))
                weights[k] += part
                for a, c in enumerate((x, y, z)[:d]):
                    sums[k][a] += part * c
    total = in_order(weights)
    centroids = [[c / w for c in s] if w > 0 else p for s, w, p in zip(sums, weights, points.tolist(), strict=True)]
    return [weight / total for weight in weights], centroids
