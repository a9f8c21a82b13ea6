"""The estimator `multiresolution`: ESTIMATORS.md of the kit.

A level is its size, and by the places of its texels the texels of the textures that they stand for.
"""

import numpy as np

from reference.elementary import dot


def next_level(depth, size, level):
    height, width = (size[0] + 1) // 2, (size[1] + 1) // 2
    made = {}
    for j, i in np.ndindex(height, width):
        places = ((2 * j, 2 * i), (2 * j, 2 * i + 1), (2 * j + 1, 2 * i), (2 * j + 1, 2 * i + 1))
        found = sorted((level[place] for place in places if place in level), key=lambda texel: depth[texel])
        if found:
            made[j, i] = found[(len(found) - 1) // 2]
    return (height, width), made


def multiresolution(parameters, inputs):
    options, depth = parameters["options"], inputs["depth"]
    n, m, positions, normals = options["levels"], options["kernel"], inputs["positions"], inputs["normals"]
    dtype, radius = depth.dtype.type, parameters["radius"]
    zero, one, r, square = dtype(0), dtype(1), dtype(radius), dtype(radius * radius)
    levels = [(depth.shape, {place: place for place in np.ndindex(depth.shape) if depth[place] < np.inf})]
    while len(levels) < n:
        levels.append(next_level(depth, *levels[-1]))
    around = [(y, x) for y in range(-m, m + 1) for x in range(-m, m + 1)]

    def taken(texel, other):
        v = positions[other] - positions[texel]
        d, above = dot(v, v), dot(v, normals[texel])
        return (one - d / square) * (above / np.sqrt(d)) if d > 0 and d < square and above > 0 else zero

    def weight(texel, other):
        s = abs(dot(positions[other] - positions[texel], normals[texel]))
        a = dtype(0.5) * (one + dot(normals[texel], normals[other]))
        for _ in range(3):
            a = a * a
        b = r / (r + s) if r + s > 0 and r + s < np.inf else zero
        for _ in range(4):
            b = b * b
        return a * b if a * b < np.inf else zero

    def own(size, level, j, i):
        """Occlusion of a level's texel by itself, and taps outside."""
        total, outside = zero, 0
        for y, x in around:
            if not (0 <= j + y < size[0] and 0 <= i + x < size[1]):
                outside += 1
            elif (y, x) != (0, 0) and (j + y, i + x) in level:
                total = total + taken(level[j, i], level[j + y, i + x])
        return total / dtype(len(around) - 1), outside

    def with_coarse(texel, j, i, most, coarse, carried):
        """Most and sum of a texel from its own and those of the coarse texels around it."""
        weights = high = mean = zero
        rows, columns = ((k // 2, k // 2 + (1 if k % 2 else -1)) for k in (j, i))
        for part, place in zip((9, 3, 3, 1), [(y, x) for y in rows for x in columns], strict=True):
            if place in coarse:
                w = dtype(part) * weight(texel, coarse[place])
                weights, high, mean = weights + w, high + w * carried[place][0], mean + w * carried[place][1]
        if not weights > 0:
            return most, most
        return max(most, high / weights), most + mean / weights

    carried, coarse, outside = {}, {}, 0
    for size, level in reversed(levels):
        found = {}
        for (j, i), texel in level.items():
            most, beyond = own(size, level, j, i)
            outside += beyond
            found[j, i] = with_coarse(texel, j, i, most, coarse, carried)
        carried, coarse = found, level

    made = np.zeros_like(depth)
    for place, (most, total) in carried.items():
        mean = total / dtype(n)
        both = one - (one - most) * (one - mean)
        value = {"maximum": most, "average": mean, "both": both}[options["combine"]]
        made[place] = min(value if value > zero else zero, one)
    return made, outside
