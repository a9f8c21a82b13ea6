"""lfssao.kernels.multiresolution a second time, with lists and dictionaries. Nothing here comes from lfssao."""

import math

import numpy as np


def coarser(depth, level):
    """The next level: {(j, i): texel of the full texture}, from all 2 x 2 by the lower median of depth."""
    blocks = {}
    for (j, i), texel in sorted(level.items()):
        blocks.setdefault((j // 2, i // 2), []).append(texel)
    chosen = {}
    for place, texels in blocks.items():
        order = sorted(range(len(texels)), key=lambda k: (depth[texels[k]], k))
        chosen[place] = texels[order[(len(texels) - 1) // 2]]
    return chosen


def dot(a, b):
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]


def obscured(v, n, squared):
    one = type(v[0])(1)
    d, above = dot(v, v), dot(v, n)
    if not (0 < d < squared and above > 0):
        return one - one
    return (one - d / squared) * (above / np.sqrt(d))


def weight(positions, normals, p, q, radius):
    one, n = type(radius)(1), normals[p]
    s = abs(dot(positions[q] - positions[p], n))
    a = type(radius)(0.5) * (one + dot(n, normals[q]))
    a = math.prod([a * a] * 2)
    a = a * a
    b = radius / (radius + s) if 0 < radius + s < np.inf else one - one
    for _ in range(4):
        b = b * b
    return a * b if a * b < np.inf else one - one


@np.errstate(all="ignore")
def multiresolution(depth, positions, normals, radius, squared, levels, reach, combine):
    """Occlusion and the number of taps outside."""
    dtype = depth.dtype.type
    sizes = [depth.shape]
    pyramid = [{place: place for place in np.ndindex(depth.shape) if depth[place] < np.inf}]
    for _ in range(levels - 1):
        sizes.append(tuple(-(-n // 2) for n in sizes[-1]))
        pyramid.append(coarser(depth, pyramid[-1]))
    offsets = [(y, x) for y in range(-reach, reach + 1) for x in range(-reach, reach + 1)]
    outside, most, total = 0, {}, {}
    for level, (height, width) in zip(reversed(pyramid), reversed(sizes), strict=True):
        coarse_most, coarse_total, most, total = most, total, {}, {}
        for (j, i), p in level.items():
            value = dtype(0)
            for y, x in offsets:
                if not (0 <= j + y < height and 0 <= i + x < width):
                    outside += 1
                elif (j + y, i + x) in level and (y, x) != (0, 0):
                    value = value + obscured(positions[level[j + y, i + x]] - positions[p], normals[p], squared)
            most[j, i] = total[j, i] = value / dtype(len(offsets) - 1)
            weights = high = mean = dtype(0)
            # The own coarse texel, then beside it, then above or below it, then both.
            for k, share in enumerate((9, 3, 3, 1)):
                y, x = j // 2 + (k // 2) * (1 if j % 2 else -1), i // 2 + (k % 2) * (1 if i % 2 else -1)
                if (y, x) in coarse_most:
                    w = dtype(share) * weight(positions, normals, p, coarse_of(pyramid, level)[y, x], radius)
                    weights, high = weights + w, high + w * coarse_most[y, x]
                    mean = mean + w * coarse_total[y, x]
            if weights > 0:
                most[j, i] = max(most[j, i], high / weights)
                total[j, i] = total[j, i] + mean / weights
    out = np.zeros_like(depth)
    for place, high in most.items():
        average = total[place] / dtype(levels)
        both = dtype(1) - (dtype(1) - high) * (dtype(1) - average)
        value = {"both": both, "maximum": high, "average": average}[combine]
        out[place] = min(max(value, dtype(0)), dtype(1))
    return out, outside


def coarse_of(pyramid, level):
    return pyramid[next(k for k, other in enumerate(pyramid) if other is level) + 1]
