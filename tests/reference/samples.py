"""The part of the kit's reader on sample tables and offsets, by SPECIFICATION.md alone (sections 6 and 7)."""

import math

import numpy as np

from reference.elementary import F, cbrt, sincospi, unit, word


def square(method, n, seed):
    def place(cell, cells, u):
        return 2 * ((float(cell) + u) / float(cells)) - 1

    if method == "random":
        return [tuple((word(seed, s, k) + 0.5) / 2147483648 - 1 for s in (0, 1)) for k in range(n)]
    if method == "jittered":
        rows = max(d for d in range(1, n + 1) if n % d == 0 and d * d <= n)
        columns = n // rows
        cells = [(k % columns, k // columns) for k in range(n)]
    else:
        columns = rows = n
        order = list(range(n))
        for k in range(n - 1, 0, -1):
            other = (word(seed, 3, k) * (k + 1)) >> 32
            order[k], order[other] = order[other], order[k]
        cells = [(order[k], k) for k in range(n)]
    return [(place(i, columns, unit(seed, 0, k)), place(j, rows, unit(seed, 1, k))) for k, (i, j) in enumerate(cells)]


def samples(parameters, inputs):
    seed, r_min, r_max = int(parameters["seed"]), parameters["r_min"], parameters["r_max"]
    table = []
    for k, (z, xi2) in enumerate(square(parameters["method"], parameters["n"], seed)):
        sine, cosine = sincospi(xi2)
        w = math.sqrt(max(1 - z * z, 0))
        x, y = w * cosine, w * sine
        if r_max == 0:
            table.append((0.0, 0.0, 0.0))
            continue
        inner = r_min / r_max
        cube = inner * inner * inner
        r = cbrt(cube + unit(seed, 2, k) * (1 - cube)) * r_max
        r = min(max(r, r_min), r_max)
        table.append((r * x, r * y, r * z))
    return np.array(table)


def offsets(parameters, inputs):
    return [[F(parameters["radius"] * c) for c in sample] for sample in inputs["samples"].tolist()]
