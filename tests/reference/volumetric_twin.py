"""Volumetric obscurance and horizon-based AO a second time: one texel, one sample at a time, in plain scalars.

Nothing here comes from lfssao. Arithmetic is that of the scalars handed in (np.float32 or np.float64), in the order of
operations that the kernels document, so the bits must agree.
"""

import math

import numpy as np

from reference import textbook as display_twin
from reference import twins

CROSSED_SLITS, MATRIX, DISPLAY = 0, 1, 2
TILE = 4
FAR = 2.0**100


def dot(a, b):
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def linear_rows(rows, vector):
    return [twins.linear_row(rows, k, *vector) for k in range(4)]


def linear_depth(depth, positions, axis):
    out = depth.copy()
    for j, i in np.ndindex(depth.shape):
        if depth[j, i] < np.inf:
            out[j, i] = dot(axis, positions[j, i]) + axis[3]
    return out


class Texel:
    """A texel's point, frame and place in the image; t of the tangent plane at (x, y)."""

    def __init__(self, scene, j, i, radius, turn=(1, 0)):
        self.scene, self.radius, dtype = scene, radius, type(radius)
        self.point = scene.positions[j, i]
        self.rows = [twins.affine_row(scene.rows, k, *self.point) for k in range(4)]
        w, right = scene.directions[j, i], scene.right
        along = dot(right, w)
        across = [r - along * c for r, c in zip(right, w, strict=True)]
        scale = dtype(1) / np.sqrt(dot(across, across))
        e1 = [a * scale for a in across]
        e2 = cross(w, e1)
        c, s = dtype(turn[0]), dtype(turn[1])
        self.e1 = [c * a + s * b for a, b in zip(e1, e2, strict=True)]
        self.e2 = [s * a - c * b for a, b in zip(e1, e2, strict=True)]
        self.w, self.deep = w, twins.linear_row(scene.rows, 3, *w)
        self.seen = bool(scene.depth[j, i] < np.inf and radius * self.deep > 0)
        self.steep = dtype(1) / (radius * self.deep)
        self.normal = scene.normals[j, i]

    def slopes(self):
        towards = max(-dot(self.normal, self.w), type(self.radius)(2.0**-20))
        return dot(self.normal, self.e1) / towards, dot(self.normal, self.e2) / towards

    def disk_place(self, x, y):
        """u, v (None where there is no image) and cast z of P + R (x e1 + y e2)."""
        first = [self.radius * row for row in linear_rows(self.scene.rows, self.e1)]
        second = [self.radius * row for row in linear_rows(self.scene.rows, self.e2)]
        return self.scene.image(*[(p + x * a) + y * b for p, a, b in zip(self.rows, first, second, strict=True)])


class Scene:
    """The textures and the mapping as arrays of one dtype; depth is cast z."""

    def __init__(self, depth, positions, directions, normals, kind, rows, lens, right):
        self.depth, self.positions, self.directions, self.normals = depth, positions, directions, normals
        self.kind, self.rows, self.lens, self.right = kind, rows, lens, right

    def image(self, a, b, q, z):
        if self.kind == CROSSED_SLITS:
            z_module, z_observer, u_0, v_0 = self.lens
            place = u_0 + a / (z_module - z), v_0 + b / (z_observer - z)
            return *(place if z_observer < z < z_module else (None, None)), z
        if self.kind == MATRIX:
            return *((a / q, b / q) if q > 0 else (None, None)), z
        u, v, answer = display_twin.physical_to_image(self.lens, a, b, z)
        return *((u, v) if answer == display_twin.VALID else (None, None)), z

    def texel_at(self, u, v):
        height, width = self.depth.shape
        if u is None or not (0 <= u < width and 0 <= v < height):
            return None
        return math.floor(v), math.floor(u)


def each(scene, value_of):
    """Occlusion and samples outside; ``value_of(j, i)`` gives a texel's total and how many were, or None: not seen."""
    dtype = scene.depth.dtype.type
    occlusion, outside = np.zeros_like(scene.depth), np.zeros(scene.depth.shape[0], np.int64)
    with np.errstate(all="ignore"):
        for j, i in np.ndindex(scene.depth.shape):
            found = value_of(j, i)
            if found is not None:
                occlusion[j, i] = found[0] if found[0] < 1 else dtype(1)
                outside[j] += found[1]
    return occlusion, outside


def tile_vector(table, j, i):
    return table[j % TILE][i % TILE]


def points(scene, radius, mirrors, ball, weights, thickness, tangent):
    dtype = type(radius)

    def value_of(j, i):
        if not scene.depth[j, i] < np.inf:
            return None
        r = [dtype(c) for c in tile_vector(mirrors, j, i)]
        n = scene.normals[j, i] if tangent else [dtype(0)] * 3
        double = radius + radius
        mirrored = [double * row for row in linear_rows(scene.rows, r)]
        lifted = [double * row for row in linear_rows(scene.rows, n)]
        here = [twins.affine_row(scene.rows, k, *scene.positions[j, i]) for k in range(4)]
        reach = np.inf
        if thickness < np.inf:
            reach = (thickness * radius) * twins.linear_row(scene.rows, 3, *scene.directions[j, i])
        total, outside = dtype(0), 0
        for offset, weight in zip(ball, weights, strict=True):
            mirror, above = dot(offset, r), dot(offset, n)
            across = dot(r, n)
            above = above - mirror * (across + across)
            lift = min(above, dtype(0))
            moved = [radius * row for row in linear_rows(scene.rows, offset)]
            rows = [((here[k] + moved[k]) - mirror * mirrored[k]) - lift * lifted[k] for k in range(4)]
            u, v, z = scene.image(*rows)
            texel = scene.texel_at(u, v)
            if texel is None:
                outside += 1
                continue
            before = z - scene.depth[texel]
            if before > 0 and before <= reach:
                total = total + weight
        return total, outside

    return each(scene, value_of)


def lines(scene, radius, turns, disk, half, weights, thickness, tangent):
    dtype = type(radius)

    def value_of(j, i):
        texel = Texel(scene, j, i, radius, tile_vector(turns, j, i))
        if not texel.seen:
            return None
        slopes = texel.slopes() if tangent else None
        total, outside = dtype(0), 0
        for (x, y), z_s, weight in zip(disk, half, weights, strict=True):
            u, v, z = texel.disk_place(x, y)
            place = scene.texel_at(u, v)
            if place is None:
                outside += 1
                continue
            d = (scene.depth[place] - z) * texel.steep
            top = min(z_s, x * slopes[0] + y * slopes[1]) if tangent else z_s
            if np.isnan(d):
                continue
            back = d + thickness
            length = (back if back < top else top) - max(d, -z_s)
            if length > 0:
                total = total + weight * length
        return total, outside

    return each(scene, value_of)


def log2(x):
    """As the kernel of that name: the series of the area hyperbolic tangent, by Horner's rule."""
    if math.isnan(x) or x == math.inf:
        return 1024.0
    m, k = math.frexp(max(x, 2.0**-1022))
    m, k = m * 2, k - 1
    if m > math.sqrt(2):
        m, k = m / 2, k + 1
    s = (m - 1.0) / (m + 1.0)
    y = 1.0 / 21.0
    for n in range(19, 1, -2):
        y = y * (s * s) + 1.0 / n
    y = (y * (s * s)) * s + s
    return k + 2.8853900817779268 * y


def pyramid(depth, blur):
    """Levels of share, mean z and mean z^2, each a dict from (row, column); what is not in it is 0."""
    height, width = depth.shape
    level = {}
    for j, i in np.ndindex(height, width):
        z = float(depth[j, i])
        level[j, i] = (1.0, z, z * z) if z < math.inf else (0.0, 0.0, 0.0)
    levels = [level]
    taps = (0.125, 0.375, 0.375, 0.125) if blur else (0.0, 0.5, 0.5, 0.0)
    nothing = (0.0, 0.0, 0.0)
    while max(height, width) > 1:
        height, width = (height + 1) // 2, (width + 1) // 2
        finer, level = levels[-1], {}
        for j, i in np.ndindex(height, width):
            sums = []
            for m in range(3):
                total = 0.0
                for row in range(4):
                    a, b, c, d = (finer.get((2 * j - 1 + row, 2 * i - 1 + k), nothing)[m] for k in range(4))
                    total = total + taps[row] * (((taps[0] * a + taps[1] * b) + taps[2] * c) + taps[3] * d)
                sums.append(total)
            level[j, i] = tuple(sums)
        levels.append(level)
    return levels


def look_up(level, scale, u, v):
    x, y = float(u) * scale + 0.5, float(v) * scale + 0.5
    i, j = math.floor(x), math.floor(y)
    f, g = x - i, y - j
    out = []
    for m in range(3):
        a, b, c, d = (
            level.get((j - 1 + row, i - 1 + column), (0.0,) * 3)[m] for row in (0, 1) for column in (0, 1)
        )  # fmt: skip
        upper, lower = a + f * (b - a), c + f * (d - c)
        out.append(upper + g * (lower - upper))
    return out


def hidden_by_box(low, high, bottom, top):
    """By cases: the share hidden at t is 0 before the box, 1 behind it, a line in between."""
    start, end = min(max(low, bottom), top), min(max(high, bottom), top)

    def share(t):
        return type(low)(0) if t <= low else (t - low) / (high - low) if t < high else type(low)(1)

    return (top - end) + (end - start) * (type(low)(0.5) * (share(start) + share(end)))


def areas(scene, radius, turns, disk, half, weights, finer, blur, half_width, thickness, tangent):
    dtype = type(radius)
    levels = pyramid(scene.depth, blur)

    def detail(texel):
        places = [texel.disk_place(dtype(x), dtype(y))[:2] for x, y in ((0, 0), (1, 0), (0, 1))]
        if any(u is None for u, _ in places):
            return dtype(512)
        (u, v), (u1, v1), (u2, v2) = places
        return dtype(0.5 * log2(math.pi * abs(float((u1 - u) * (v2 - v) - (v1 - v) * (u2 - u)))))

    def value_of(j, i):
        texel = Texel(scene, j, i, radius, tile_vector(turns, j, i))
        if not texel.seen:
            return None
        slopes, lod = texel.slopes() if tangent else None, float(detail(texel))
        total, outside = dtype(0), 0
        for (x, y), z_s, weight, less in zip(disk, half, weights, finer, strict=True):
            u, v, z = texel.disk_place(x, y)
            if scene.texel_at(u, v) is None:
                outside += 1
                continue
            level = min(max(lod + float(less), 0.0), float(len(levels) - 1))
            fine = int(level)
            share, first, second = look_up(levels[fine], 0.5**fine, u, v)
            if level > fine:
                coarse = look_up(levels[fine + 1], 0.5 ** (fine + 1), u, v)
                mixed = zip((share, first, second), coarse, strict=True)
                share, first, second = (a + (level - fine) * (b - a) for a, b in mixed)
            if not share > 0:
                continue
            mean = first / share
            sigma = math.sqrt(max(second / share - mean * mean, 0.0))
            middle, reach = (
                (np.float64(mean) - np.float64(z)) * np.float64(texel.steep),
                (np.float64(half_width) * sigma) * np.float64(texel.steep),
            )
            if np.isnan(middle - reach) or np.isnan(middle + reach):
                continue
            low, high = (dtype(min(max(edge, -FAR), FAR)) for edge in (middle - reach, middle + reach))
            top = min(z_s, x * slopes[0] + y * slopes[1]) if tangent else z_s
            if top > -z_s:
                whole = hidden_by_box(low, high, -z_s, top)
                length = whole - hidden_by_box(low + thickness, high + thickness, -z_s, top)
                total = total + (weight * dtype(share)) * length
        return max(total, dtype(0)), outside

    return each(scene, value_of)


def horizons(scene, radius, turns, around, steps, bias, attenuation):
    """``bias``: sine and cosine; ``attenuation``: W = 1 - (linear r + quadratic r^2)."""
    dtype = type(radius)
    one, half = dtype(1), dtype(0.5)

    def value_of(j, i):
        texel = Texel(scene, j, i, radius, tile_vector(turns, j, i))
        if not texel.seen:
            return None
        slopes = texel.slopes()
        total, outside = dtype(0), 0
        u_0, v_0 = dtype(i) + half, dtype(j) + half
        for x, y in around:
            u_1, v_1, _ = texel.disk_place(x, y)
            if u_1 is None:
                outside += steps
                continue
            tau = x * slopes[0] + y * slopes[1]
            cosine = one / np.sqrt(one + tau * tau)
            sine = -tau * cosine
            horizon = sine * bias[1] + cosine * bias[0]
            if not cosine * bias[1] - sine * bias[0] > 0:
                horizon = one
            for step in range(1, steps + 1):
                part = dtype(step) / dtype(steps)
                place = scene.texel_at(u_0 + part * (u_1 - u_0), v_0 + part * (v_1 - v_0))
                if place is None:
                    outside += 1
                    continue
                away = scene.positions[place] - texel.point
                length = np.sqrt(dot(away, away))
                sine, r = -dot(away, texel.w) / length, length / radius
                if r < 1 and sine > horizon:
                    weight = one - (attenuation[0] * r + attenuation[1] * (r * r))
                    total = total + weight * (sine - horizon)
                    horizon = sine
        return total / dtype(len(around)), outside

    return each(scene, value_of)
