"""Filament's SAO and GTAO texel by texel, from what shaders compute: view space looks along -z, rows begin below."""

import math

import numpy as np


class Frame:
    """A camera's textures, rows from below: distances along its axis, infinite without a surface, and normals."""

    def __init__(self, depth, normals, lens):
        f_u, f_v, c_u, c_v = lens
        self.lens = f_u, f_v, c_u, len(depth) - c_v
        self.levels, self.normals = [np.asarray(depth, float)[::-1]], np.asarray(normals, float)[::-1]
        while max(self.levels[-1].shape) > 1 and min(self.levels[-1].shape) % 2 == 0:
            last = self.levels[-1]
            y, x = np.indices((last.shape[0] // 2, last.shape[1] // 2))
            self.levels.append(last[2 * y + (x & 1), 2 * x + (y & 1)])

    def point(self, u, v, z):
        f_u, f_v, c_u, c_v = self.lens
        return np.array([(u - c_u) / f_u * z, (v - c_v) / f_v * z, -z])

    def seen(self, u, v, far, most):
        """The point seen at an image point that is so many texels away; None without a surface."""
        height, width = self.levels[0].shape
        texture = self.levels[min(max(math.floor(math.log2(far)) - 3, 0), most)]
        place = [min(max(math.floor(x / size * k), 0), k - 1)
                 for x, size, k in zip((v, u), (height, width), texture.shape, strict=True)]  # fmt: skip
        return None if texture[tuple(place)] == np.inf else self.point(u, v, texture[tuple(place)])


def filament(frame, noise, radius, row, column, o):
    """Occlusion of a texel, row from below; o: the options by name."""
    z = frame.levels[0][row, column]
    n = frame.normals[row, column]
    p = frame.point(column + 0.5, row + 0.5, z)
    total = 0.0
    turn = 2 * math.pi / (o["taps"] - 0.5) * o["turns"]
    for i in range(o["taps"]):
        angle = 2 * math.pi * 2.4 * noise + i * turn
        alpha = (i + noise + 0.5) / (o["taps"] - 0.5)
        far = max(1.0, alpha * alpha * radius * min(frame.lens[:2]) / z)
        u = column + 0.5 + far * math.cos(angle)
        v = row + 0.5 + far * math.sin(angle)
        seen = frame.seen(u, v, far, o["max_level"])
        if seen is None:
            continue
        away = seen - p
        square = away @ away
        above = away @ n
        if above * above >= square * math.sin(math.radians(o["horizon"])) ** 2:
            weight = max(0.0, 1 - square / radius**2) ** 2
            total += weight * max(0.0, above + p[2] * o["bias"]) / (square + (0.1 * radius) ** 2)
    obscured = math.sqrt(total * 2 * math.pi * 0.1 * radius * o["intensity"] / o["taps"])
    return 1 - min(max(1 - obscured, 0.0), 1.0) ** (2 * o["power"])


def angle(cosine):
    near = (1.570796 - 0.1565827 * abs(cosine)) * math.sqrt(max(0.0, 1 - abs(cosine)))
    return near if cosine >= 0 else math.pi - near


def filament_gtao(frame, noise, radius, row, column, o):
    """Occlusion of a texel by slices, row from below; noise: two numbers from 0 to 1."""
    z = frame.levels[0][row, column]
    n = frame.normals[row, column]
    p = frame.point(column + 0.5, row + 0.5, z)
    total = 0.0
    v = -p / np.linalg.norm(p)
    between = radius * min(frame.lens[:2]) / z / (o["steps"] + 1)
    for i in range(o["slices"]):
        phi = math.pi * (i + noise[0]) / o["slices"]
        d = np.array([math.cos(phi), math.sin(phi), 0])
        across = np.cross(d, v) / np.linalg.norm(np.cross(d, v))
        part = n - (n @ across) * across
        length = np.linalg.norm(part)
        tilt = np.sign((d - (d @ v) * v) @ part) * angle(min(max(part @ v / length, 0.0), 1.0))
        for side in (1, -1):
            horizon = -1.0
            for j in range(o["steps"]):
                far = max((j + noise[1]) * between, j + 1)
                seen = frame.seen(column + 0.5 + side * far * d[0], row + 0.5 + side * far * d[1], far, o["max_level"])
                if seen is None:
                    continue
                square = (seen - p) @ (seen - p)
                cosine = (seen - p) @ v / np.linalg.norm(seen - p)
                share = 1 - min(2 * square / radius**2, 1) if cosine > horizon else o["thickness"]
                horizon += share * (cosine - horizon)
            h = tilt + min(max(side * angle(horizon) - tilt, -math.pi / 2), math.pi / 2)
            total += length * (math.cos(tilt) + 2 * h * math.sin(tilt) - math.cos(2 * h - tilt)) / 4
    return o["intensity"] * (1 - min(max(total / o["slices"], 0.0), 1.0) ** o["power"])
