"""Ambient occlusion at several resolutions, coarse to fine, with joint bilateral upsampling (after Hoang and Low).

A level is a texture of texel numbers: which texel of the full textures each of its texels stands for, -1 for none. So
every position and normal that is read is one that the G-buffer holds.

Positions and normals of a level's texels are read over and over: each band copies those that it reads, one array a
coordinate.
"""

import numpy as np

from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import alternatives, as_float, by_squaring, is_finite, plain, select
from lfssao.core.vectors import Vector, dot


@kernel(rows="depth")
def first_level(begin, stop, depth, level):
    """The finest level, every texel for itself; depth: (H, W), level: (H, W) int32, out."""
    width = depth.shape[1]
    for j in range(begin, stop):
        for i in range(width):
            number = np.int32(j * width + i)
            level[j, i] = number if depth[j, i] < np.inf else np.int32(-1)


@formula
def depth_at(surface, texel):
    """Depth of a texel number, +infinity of -1."""
    there = texel >= np.int32(0)
    depth = surface[np.uint32(texel if there else np.int32(0)) & np.uint32(0x7FFFFFFF)]
    return depth if there else surface.dtype.type(np.inf)


@formula
def lower_median(surface, a, b, c, d):
    """Lower median by depth of up to four texel numbers, by how many come before each; -1 is none, and comes last."""
    at_a, at_b, at_c, at_d = depth_at(surface, a), depth_at(surface, b), depth_at(surface, c), depth_at(surface, d)
    ba, ca, da = np.int32(at_b < at_a), np.int32(at_c < at_a), np.int32(at_d < at_a)
    cb, db, dc = np.int32(at_c < at_b), np.int32(at_d < at_b), np.int32(at_d < at_c)
    none = np.int32(0)
    seen = np.int32(a >= none) + np.int32(b >= none) + np.int32(c >= none) + np.int32(d >= none)
    rank = np.int32(seen > 2)
    found = c if cb + ca + rank == 2 + dc else d
    found = b if cb + db + 1 == ba + rank else found
    return a if ba + ca + da == rank else found


@kernel(rows="coarse")
def halve(begin, stop, depth, fine, coarse):
    """The next coarser level, out, (ceil(h / 2), ceil(w / 2)): of each 2 x 2 texels the lower median by depth."""
    height, width = fine.shape
    surface, numbers, chosen = depth.reshape(-1), fine.reshape(-1), coarse.reshape(-1)
    wide, none = (width + 1) // 2, np.int32(-1)
    for j in range(begin, stop):
        two = 2 * j + 1 < height
        top, bottom = 2 * j * width, (2 * j + 1 if two else 2 * j) * width
        for i in range(width // 2):
            upper, lower = np.uint64(top + 2 * i), np.uint64(bottom + 2 * i)
            c, d = numbers[lower], numbers[lower + np.uint64(1)]
            chosen[np.uint64(j * wide + i)] = lower_median(
                surface, numbers[upper], numbers[upper + np.uint64(1)], c if two else none, d if two else none
            )
        if width & 1:
            c = numbers[bottom + width - 1] if two else none
            chosen[j * wide + wide - 1] = lower_median(surface, numbers[top + width - 1], none, c, none)


@formula
def obscured(v, n, radius, squared):
    """Occlusion by a point at v from a point of normal n: (1 - v.v / R^2) max(0, v.n) / sqrt(v.v) inside R, else 0.

    squared: R squared. A renderer may take the length of v instead, and divide v by it first.
    """
    d, above = dot(v, v), dot(v, n)
    length = np.sqrt(d)
    part, cosine = length / radius, above / length
    falloff = 1 - alternatives(d / squared, part * part)
    term = falloff * alternatives(cosine, dot((1 / length) * v, n))
    return select((d > 0) & alternatives(d < squared, length < radius) & (above > 0), term, 0)


@formula
def vector(x, y, z, at):
    """Vector of a place of three arrays."""
    return Vector(as_float(x[at]), as_float(y[at]), as_float(z[at]))


@formula
def gather(numbers, texture, start, n, step, x, y, z, first):
    """Vectors of n texels, the numbers from place ``start`` on, every ``step``-th; NaN where there is none.

    numbers: (h * w,) int32; texture: (H * W, 3); x, y, z: from place ``first`` on, out.
    """
    nothing = texture.dtype.type(np.nan)
    for i in range(n):
        texel = numbers[np.uint64(start + step * i)]
        there = texel >= np.int32(0)
        at = np.uint32(texel if there else np.int32(0)) & np.uint32(0x7FFFFFFF)
        a, b, c = texture[at, 0], texture[at, 1], texture[at, 2]
        place = np.uint64(first + i)
        x[place], y[place], z[place] = a if there else nothing, b if there else nothing, c if there else nothing


@formula
def level_span(numbers, start, width):
    """Columns from the first texel of a row that sees a surface to the last, (first, one past the last)."""
    first, last = 0, width
    while first < width and numbers[np.uint64(start + first)] < np.int32(0):
        first += 1
    while last > first and numbers[np.uint64(start + last - 1)] < np.int32(0):
        last -= 1
    return first, last


@formula
def taps_beyond(numbers, j, width, height, reach):
    """How many taps of the texels of row j that see a surface lie outside the texture."""
    edge = 2 * reach + 1
    rows = min(j + reach, height - 1) - max(j - reach, 0) + 1
    beyond = 0
    for i in range(width):
        columns = min(i + reach, width - 1) - max(i - reach, 0) + 1
        beyond += edge * edge - rows * columns if numbers[np.uint64(j * width + i)] >= np.int32(0) else 0
    return beyond


@kernel(rows="level")
def level_occlusion(begin, stop, level, places, facing, reach, radius, squared, occlusion, outside):
    """Occlusion of one level, (h, w), out, from the square of texels around each; outside: (h,) int64, out.

    places, facing: (H * W, 3), positions and unit normals of the full textures. The square's (2 reach + 1)^2 - 1 taps
    are added row by row; occlusion is their sum over their number. radius, squared: R and R squared, world units.
    outside: taps of each row that lie outside the texture; they count 0.
    """
    height, width = level.shape
    numbers, out, dtype = level.reshape(-1), occlusion.reshape(-1), occlusion.dtype.type
    zero, number, kind = dtype(0), dtype((2 * reach + 1) * (2 * reach + 1) - 1), places.dtype
    top = max(begin - reach, 0)  # the first row that is read, and how many texels from there on
    n = (min(stop + reach, height) - top) * width
    x, y, z = np.empty(n, kind), np.empty(n, kind), np.empty(n, kind)
    gather(numbers, places, top * width, n, 1, x, y, z, 0)
    nx, ny, nz, total = np.empty(width, kind), np.empty(width, kind), np.empty(width, kind), np.empty(width, kind)
    for j in range(begin, stop):
        total[:] = 0
        gather(numbers, facing, j * width, width, 1, nx, ny, nz, 0)
        left, right = level_span(numbers, j * width, width)
        for line in range(max(j - reach, 0), min(j + reach, height - 1) + 1):
            for shift in range(-reach, reach + 1):
                first, last = max(left, -shift), min(right, width - shift)
                here, tap = (j - top) * width + first, (line - top) * width + first + shift
                for i in range(last - first):
                    p, q, place = np.uint64(here + i), np.uint64(tap + i), np.uint64(first + i)
                    v, facing_there = vector(x, y, z, q) - vector(x, y, z, p), vector(nx, ny, nz, place)
                    total[place] += plain(obscured(v, facing_there, as_float(radius), as_float(squared)))
        for i in range(width):
            there = numbers[np.uint64(j * width + i)] >= np.int32(0)
            out[np.uint64(j * width + i)] = total[i] / number if there else zero
        outside[j] = taps_beyond(numbers, j, width, height, reach)


@formula
def upsampling_weight(v, n, m, radius):
    """((1 + n.m) / 2)^8 (R / (R + s))^16, s the distance of v from the tangent plane; 0 of no texel.

    v: the coarse texel's point less the fine one's; n and m: normals of the fine one and of the coarse one.
    """
    s = abs(dot(v, n))
    a, b = 0.5 * (1 + dot(n, m)), radius / (radius + s)
    w = by_squaring(a, 3) * by_squaring(select((radius + s > 0) & is_finite(radius + s), b, 0), 4)
    return select(is_finite(w), w, 0)  # NaN is not


@kernel(rows="fine")
def refine(begin, stop, fine, coarse, places, facing, radius, coarse_most, coarse_sum, most, total):
    """Carry the maximum and the sum over levels from a coarse level to the next finer one, where it has been estimated.

    fine, coarse: the levels, (h, w) and (ceil(h / 2), ceil(w / 2)) int32. coarse_most, coarse_sum: maximum and sum over
    the coarser levels. most, total, (h, w): in, the fine level's own occlusion; out, the maximum and the sum with those
    of the four coarse texels around, weighed by 9, 3, 3 or 1 times ``upsampling_weight``.
    """
    width = fine.shape[1]
    high, wide = coarse.shape
    dtype, kind = most.dtype.type, most.dtype
    numbers, coarser, largest, sums = fine.reshape(-1), coarse.reshape(-1), most.reshape(-1), total.reshape(-1)
    top = max(begin // 2 - 1, 0)  # the first coarse row that is read, and how many texels from there on
    size = (min((stop - 1) // 2 + 2, high) - top) * wide
    carried_most, carried_sum = coarse_most.reshape(-1)[top * wide :], coarse_sum.reshape(-1)[top * wide :]
    qx, qy, qz = np.empty(size, kind), np.empty(size, kind), np.empty(size, kind)
    mx, my, mz = np.empty(size, kind), np.empty(size, kind), np.empty(size, kind)
    gather(coarser, places, top * wide, size, 1, qx, qy, qz, 0)
    gather(coarser, facing, top * wide, size, 1, mx, my, mz, 0)
    px, py, pz = np.empty(wide, kind), np.empty(wide, kind), np.empty(wide, kind)
    nx, ny, nz = np.empty(wide, kind), np.empty(wide, kind), np.empty(wide, kind)
    weights, peak, mean = np.empty(wide, kind), np.empty(wide, kind), np.empty(wide, kind)
    zero = dtype(0)
    for j in range(begin, stop):
        left, right = level_span(numbers, j * width, width)
        for odd in range(2):  # columns: those of one parity have their coarse neighbours on the same side
            skipped = left // 2
            start, n = j * width + odd + 2 * skipped, max((right - odd + 1) // 2 - skipped, 0)
            gather(numbers, places, start, n, 2, px, py, pz, 0)
            gather(numbers, facing, start, n, 2, nx, ny, nz, 0)
            for i in range(n):
                weights[i], peak[i], mean[i] = zero, zero, zero
            for k in range(4):
                # Row k // 2 = 0 is the texel's own coarse row, 1 the next on the side that the texel lies on.
                row = j // 2 + (k // 2) * (2 * (j % 2) - 1)
                shift = (k % 2) * (2 * odd - 1)
                if not 0 <= row < high:
                    continue
                near = dtype((3 - 2 * (k // 2)) * (3 - 2 * (k % 2)))
                first, coarse_start = max(0, -shift - skipped), (row - top) * wide + skipped + shift
                for i in range(min(n, wide - shift - skipped) - first):
                    c, f = np.uint64(coarse_start + first + i), np.uint64(first + i)
                    v, n_f = vector(qx, qy, qz, c) - vector(px, py, pz, f), vector(nx, ny, nz, f)
                    w = near * plain(upsampling_weight(v, n_f, vector(mx, my, mz, c), as_float(radius)))
                    weights[f] += w
                    peak[f] += w * carried_most[c]
                    mean[f] += w * carried_sum[c]
            for i in range(n):
                there = weights[i] > zero  # only where the fine texel sees a surface
                peak[i], mean[i] = peak[i] / weights[i], mean[i] / weights[i]
                peak[i], mean[i] = peak[i] if there else zero, mean[i] if there else zero
            for i in range(n):
                place = np.uint64(start + 2 * i)
                largest[place] = max(largest[place], peak[i])
                sums[place] = sums[place] + mean[i]
