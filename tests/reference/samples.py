"""Sample tables: section 6 of the specification, and LF's Algorithms 3 and 4."""

import math

import numpy as np

from reference.elementary import cbrt, sincospi
from reference.philox import below, signed, unit

RADIUS, SHUFFLE = 2, 3  # streams of the generator


def square(method, n, seed):
    """The points of the square of 'random', 'jittered' and 'latin'."""

    def place(cell, cells, u):
        return 2 * ((float(cell) + u) / float(cells)) - 1

    if method == "random":
        return [(signed(seed, 0, k), signed(seed, 1, k)) for k in range(n)]
    if method == "jittered":
        rows = max(d for d in range(1, n + 1) if n % d == 0 and d * d <= n)
        columns = n // rows
        cells = [(k % columns, k // columns) for k in range(n)]
    else:
        columns = rows = n
        order = list(range(n))
        for k in range(n - 1, 0, -1):  # Fisher and Yates
            other = below(seed, SHUFFLE, k, k + 1)
            order[k], order[other] = order[other], order[k]
        cells = [(order[k], k) for k in range(n)]
    return [(place(i, columns, unit(seed, 0, k)), place(j, rows, unit(seed, 1, k))) for k, (i, j) in enumerate(cells)]


def algorithm3(xi1, xi2):
    """Square to sphere."""
    z = xi1
    sine, cosine = sincospi(xi2)
    w = math.sqrt(max(1 - z * z, 0))
    return w * cosine, w * sine, z


def algorithm4(x, y, z, fraction, r_min, r_max):
    """Sphere to shell."""
    if r_max == 0:
        return 0.0, 0.0, 0.0
    inner = r_min / r_max
    cube = inner * inner * inner
    r = cbrt(cube + fraction * (1 - cube)) * r_max
    r = min(max(r, r_min), r_max)
    return r * x, r * y, r * z


def samples(method, n, seed, r_min, r_max):
    points = enumerate(square(method, n, seed))
    return np.array([algorithm4(*algorithm3(*xi), unit(seed, RADIUS, k), r_min, r_max) for k, xi in points])
