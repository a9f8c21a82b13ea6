"""Scalable Ambient Obscurance again, as one reads the paper: one texel and one tap at a time, in plain scalars.

Nothing here comes from lfssao. Arithmetic is that of the scalars handed in, in the order that the kernels document.
"""

import math
import sys

import numpy as np

from reference import twins
from reference.alchemy_twin import power
from reference.spiral import hash_angle, spiral_tap

SEPARABLE, TABLE = 0, 1
FAR = 2.0**20


@np.errstate(all="ignore")
def linear_depth(depth, perspective, c):
    """Equation 2."""
    out = np.full_like(depth, np.inf)
    for place in np.ndindex(depth.shape):
        d = depth[place]
        if not d < np.inf:
            continue
        if not perspective:
            out[place] = c[0] + d * c[1]
        elif d * c[1] + c[2] > 0:
            out[place] = c[0] / (d * c[1] + c[2])
    return out


# A texel's line, and equations 3 and 4


def on_line(kind, lines, table, width, i, j, z):
    """Cast space x and y of texel (i, j) at z."""
    if kind == TABLE:
        a, b, c, d = table[:, j * width + i]
        return a + z * b, c + z * d
    half = type(z)(0.5)
    out = []
    for (centre, a, b, c, d), place in zip((lines[:5], lines[5:]), (i, j), strict=True):
        at = (type(z)(place) + half) - centre
        out.append((a + b * at) + z * (c + d * at))
    return out


def slope(kind, lines, table, width, i, j):
    if kind == TABLE:
        return table[1, j * width + i], table[3, j * width + i]
    half = lines.dtype.type(0.5)
    return [
        c + d * ((lines.dtype.type(place) + half) - centre)
        for (centre, _, _, c, d), place in zip((lines[:5], lines[5:]), (i, j), strict=True)
    ]


@np.errstate(all="ignore")
def rebuild_positions(z, kind, lines, table, m):
    height, width = z.shape
    out = np.full((height, width, 3), np.inf, z.dtype)
    for j in range(height):
        for i in range(width):
            if z[j, i] < np.inf:
                x, y = on_line(kind, lines, table, width, i, j, z[j, i])
                out[j, i] = [twins.affine_row(m, row, x, y, z[j, i]) for row in range(3)]
    return out


def unit(v):
    size = max(abs(x) for x in v)
    if not size > 0:
        return [type(x)(0) for x in v]
    v = [x / size for x in v]
    length = np.sqrt((v[0] * v[0] + v[1] * v[1]) + v[2] * v[2])
    return [x / length for x in v]


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@np.errstate(all="ignore")
def face_normals(z, positions, kind, lines, table, m):
    height, width = z.shape
    out = np.zeros_like(positions)
    for j in range(height):
        for i in range(width):
            if not z[j, i] < np.inf:
                continue
            # The other texel of the pair, then the one on the other side, else no difference.
            across = [n for n in (i ^ 1, 2 * i - (i ^ 1)) if 0 <= n < width and z[j, n] < np.inf]
            down = [n for n in (j ^ 1, 2 * j - (j ^ 1)) if 0 <= n < height and z[n, i] < np.inf]
            a = positions[j, across[0] if across else i] - positions[j, i]
            b = positions[down[0] if down else j, i] - positions[j, i]
            n = unit(cross(a, b))
            dx, dy = slope(kind, lines, table, width, i, j)
            away = [twins.linear_row(m, row, dx, dy, z.dtype.type(1)) for row in range(3)]
            side = (n[0] * away[0] + n[1] * away[1]) + n[2] * away[2]
            if side > 0:
                n = [-x for x in n]
            elif not side < 0:
                n = unit([-x for x in away])
            out[j, i] = n
    return out


# The hierarchy, table 1


@np.errstate(all="ignore")
def next_level(source, how, origin):
    height, width = source.shape
    target = np.empty(((height + 1) // 2, (width + 1) // 2), source.dtype)
    number = source.dtype.type

    def z(x, y):
        return source[min(y, height - 1), min(x, width - 1)]

    for y, x in np.ndindex(target.shape):
        four = [z(2 * x + i, 2 * y + j) for j in (0, 1) for i in (0, 1)]
        mean = (((four[0] + four[1]) + four[2]) + four[3]) * number(0.25)
        away = [a - origin for a in four]
        inverse = [number(1) / a for a in away]
        target[y, x] = {
            "rotated": z(2 * x + (y & 1 ^ 1), 2 * y + (x & 1 ^ 1)),
            "arithmetic": mean,
            "harmonic": number(1) / ((((inverse[0] + inverse[1]) + inverse[2]) + inverse[3]) * number(0.25)) + origin
            if all(a > 0 for a in away)
            else mean,
            "min": max(four),  # the smallest of negative z
            "max": min(four),
        }[how]
    return target


def hierarchy(z, how, max_level, origin):
    levels = [z]
    while how != "none" and len(levels) <= max_level and levels[-1].size > 1:
        levels.append(next_level(levels[-1], how, origin))
    return levels


# The sampling pass


def rotation(i, j, hashed, number):
    sine, cosine = twins.sincospi(hash_angle(i, j, hashed))
    return number(cosine), number(sine)


def screen_radii(z, kind, lines, table, m, reach, width, height, i, j):
    """Equation 5: half-axes of the ball's image."""
    number = type(z)
    if kind == SEPARABLE:
        lengths = [abs(n[2] + z * n[4]) for n in (lines[:5], lines[5:])]
    else:
        lengths = []
        for di, dj in ((1, 0), (0, 1)):
            x, y = i + di, j + dj
            if x >= width or y >= height:
                x, y = max(i - di, 0), max(j - dj, 0)
            one, two = table[:, j * width + i], table[:, y * width + x]
            gap = [(two[0] - one[0]) + z * (two[1] - one[1]), (two[2] - one[2]) + z * (two[3] - one[3]), number(0)]
            a, b, c = (twins.linear_row(m, row, *gap) for row in range(3))
            lengths.append(np.sqrt((a * a + b * b) + c * c))
    radii = [r / length for r, length in zip(reach, lengths, strict=True)]
    return [r if r < FAR else number(FAR) for r in radii]


@np.errstate(all="ignore")
def sample(z, levels, positions, normals, hashed, taps, turns, kind, lines, table, m, reach, inverse, log_q, share,
           bias, depth_bias, origin, epsilon, scale):  # fmt: skip
    """A of every texel, and how many taps of each row fell outside."""
    height, width = z.shape
    number = z.dtype.type
    visibility, outside = np.ones_like(z), np.zeros(height, np.int64)
    spiral = [[number(value) for value in spiral_tap(i, taps, turns, 0.0)] for i in range(taps)]
    for j in range(height):
        for i in range(width):
            if not z[j, i] < np.inf:
                continue
            cosine, sine = rotation(i, j, hashed, number)
            r_u, r_v = screen_radii(z[j, i], kind, lines, table, m, reach, width, height, i, j)
            less = bias + depth_bias * (z[j, i] - origin)
            total = number(0)
            for tap_x, tap_y, alpha in spiral:
                h_u, h_v = r_u * alpha, r_v * alpha
                x = number(i) + h_u * (tap_x * cosine - tap_y * sine)
                y = number(j) + h_v * (tap_x * sine + tap_y * cosine)
                if not (0 <= x < width and 0 <= y < height):
                    outside[j] += 1
                    continue
                x, y = math.floor(x), math.floor(y)
                if (x, y) == (i, j):
                    continue
                level = min(max(int(max(h_u, h_v)).bit_length() - 1 - log_q, 0), len(levels) - 1)  # findMSB
                z_i = levels[level][y >> level, x >> level]
                if not z_i < np.inf:
                    continue
                q_x, q_y = on_line(kind, lines, table, width, x, y, z_i)
                q = [twins.affine_row(m, row, q_x, q_y, z_i) for row in range(3)]
                u = [(q[axis] - positions[j, i, axis]) * inverse for axis in range(3)]
                square = (u[0] * u[0] + u[1] * u[1]) + u[2] * u[2]
                above = ((u[0] * normals[j, i, 0] + u[1] * normals[j, i, 1]) + u[2] * normals[j, i, 2]) - less
                left = number(1) - share * square
                term = ((left * left) * left) * (above / (square + epsilon))
                if above > 0 and left > 0 and term > 0:
                    total = total + term
            a = number(1) - scale * total
            visibility[j, i] = a if a > 0 else 0
    return visibility, outside


# 2x2 average


@np.errstate(all="ignore")
def average_quads(visibility, z, edge):
    half = visibility.dtype.type(0.5)
    rows = visibility.copy()
    for j, i in np.ndindex(z.shape):
        if i ^ 1 < z.shape[1] and abs(z[j, i] - z[j, i ^ 1]) < edge:
            rows[j, i] = (visibility[j, i] + visibility[j, i ^ 1]) * half
    out = rows.copy()
    for j, i in np.ndindex(z.shape):
        if j ^ 1 < z.shape[0] and abs(z[j, i] - z[j ^ 1, i]) < edge:
            out[j, i] = (rows[j, i] + rows[j ^ 1, i]) * half
    return out


# Packing


@np.errstate(all="ignore")
def keys(z, origin, scale):
    number = z.dtype.type
    out = np.full_like(z, np.inf)
    for place in np.ndindex(z.shape):
        if z[place] < np.inf:
            out[place] = min(max(number(0), (z[place] - origin) * scale), number(1))
    return out


def pack(visibility, key):
    number = key.dtype.type
    out = np.full((*key.shape, 3), 255, np.uint8)
    for place in np.ndindex(key.shape):
        out[place][0] = math.floor(visibility[place] * number(255) + number(0.5))
        if key[place] < np.inf:
            scaled = key[place] * number(256)
            high = min(math.floor(scaled), 255)
            low = min(math.floor((scaled - number(high)) * number(255) + number(0.5)), 254 if high == 255 else 255)
            out[place][1:] = high, low
    return out


def unpack(rgb, number):
    visibility, key = np.empty(rgb.shape[:2], number), np.empty(rgb.shape[:2], number)
    for place in np.ndindex(key.shape):
        r, g, b = (int(x) for x in rgb[place])
        visibility[place] = number(r) / number(255)
        key[place] = np.inf if g == b == 255 else (number(g) + number(b) / number(255)) * number(1 / 256)
    return visibility, key


# The bilateral passes


@np.errstate(all="ignore")
def bilateral_horizontal(values, key, weights, stride, sharpness):
    number = key.dtype.type
    height, width = key.shape
    out = np.ones_like(values)
    for j in range(height):
        for i in range(width):
            total = weight = number(0)
            for k, gauss in enumerate(weights):
                x = i + (k - len(weights) // 2) * stride
                if 0 <= x < width:
                    near = number(1) - sharpness * abs(key[j, x] - key[j, i])
                    w = gauss * (near if near > 0 else number(0))
                    total, weight = total + w * values[j, x], weight + w
            if weight > 0:
                out[j, i] = total / weight
    return out


def bilateral_vertical(values, key, weights, stride, sharpness):
    return np.ascontiguousarray(bilateral_horizontal(values.T, key.T, weights, stride, sharpness).T)


# All of it


@np.errstate(all="ignore")
def occlusion(z, positions, lines, radius, parameters, falloff):
    """1 - A, and the taps outside: ``lines`` has kind, numbers, table, world, units and origin; z is linear."""
    number, p = z.dtype.type, parameters
    if radius == 0:
        return np.zeros_like(z), 0
    normals = face_normals(z, positions, lines.kind, lines.numbers, lines.table, lines.world)
    levels = hierarchy(z, p["mip"], p["max_level"], number(lines.origin))
    reach = [number(radius / unit) for unit in (lines.units[:2] if lines.kind == SEPARABLE else (1.0, 1.0))]
    inverse = number(1 / radius)
    bias, depth_bias = (
        (number(p["beta"]), number(0)) if falloff else (number(0), number(p["beta"] * float(lines.units[2]) / radius))
    )
    strength = 5 * p["intensity"] if falloff else 2 * p["sigma"]
    visibility, outside = sample(
        z, levels, positions, normals, p["hashed"], p["taps"], p["turns"], lines.kind, lines.numbers, lines.table,
        lines.world, reach, inverse, p["log_q"], number(falloff), bias, depth_bias, number(lines.origin),
        number(p["epsilon"]), number(strength / p["taps"]),
    )  # fmt: skip
    visibility = average_quads(visibility, z, number(p["quad_edge"] * radius / float(lines.units[2])))
    if p["gauss"] > 0:
        seen = z[z < np.inf]
        span = p["z_min"] or float(max(seen, default=-np.inf)) - lines.origin
        key = keys(z, number(lines.origin), number(1 / span if span > 0 and 1 / span <= sys.float_info.max else 1.0))
        weights = twins.gaussian_weights(p["gauss"], 3).astype(z.dtype)
        for one_pass in (bilateral_horizontal, bilateral_vertical):
            if p["packed"]:
                visibility, key = unpack(pack(visibility, key), number)
            visibility = one_pass(visibility, key, weights, 3, number(p["sharpness"]))
    out = np.zeros_like(z)
    for place in np.ndindex(z.shape):
        if z[place] < np.inf:
            out[place] = number(1) - number(power(float(visibility[place]), p.get("k", 1.0)))
    return out, int(outside.sum())
