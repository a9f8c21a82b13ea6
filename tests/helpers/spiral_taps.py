"""Filament's SAO texel by texel, from what its shader computes: view space looks along -z, rows begin below."""

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


def filament(frame, noise, radius, row, column, o):
    """Occlusion of a texel, row from below; o: the options by name."""
    height, width = frame.levels[0].shape
    z, n = frame.levels[0][row, column], frame.normals[row, column]
    p, total, turn = frame.point(column + 0.5, row + 0.5, z), 0.0, 2 * math.pi / (o["taps"] - 0.5) * o["turns"]
    for i in range(o["taps"]):
        angle = 2 * math.pi * 2.4 * noise + i * turn
        alpha = (i + noise + 0.5) / (o["taps"] - 0.5)
        far = max(1.0, alpha * alpha * radius * min(frame.lens[:2]) / z)
        u, v = column + 0.5 + far * math.cos(angle), row + 0.5 + far * math.sin(angle)
        level = min(max(math.floor(math.log2(far)) - 3, 0), o["max_level"])
        texture = frame.levels[level]
        place = [min(max(math.floor(x / size * k), 0), k - 1)
                 for x, size, k in zip((v, u), (height, width), texture.shape, strict=True)]  # fmt: skip
        if texture[tuple(place)] == np.inf:
            continue
        away = frame.point(u, v, texture[tuple(place)]) - p
        square, above = away @ away, away @ n
        if above * above >= square * math.sin(math.radians(o["horizon"])) ** 2:
            weight = max(0.0, 1 - square / radius**2) ** 2
            total += weight * max(0.0, above + p[2] * o["bias"]) / (square + (0.1 * radius) ** 2)
    obscured = math.sqrt(total * 2 * math.pi * 0.1 * radius * o["intensity"] / o["taps"])
    return 1 - min(max(1 - obscured, 0.0), 1.0) ** (2 * o["power"])
