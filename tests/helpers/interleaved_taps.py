"""Godot 4's SSAO at quality 'low' texel by texel, from what its shader computes: z away from the eye, y up."""

import math

import numpy as np

PLACES = np.array([[0.78488064, 0.56661671], [0.26022232, -0.29575172], [0.10459357, 0.08372527]])
WEIGHTS = 1.5, 1.5, 1.11


def mirrored(k, n):
    """A texel inside, by mirrored repeat."""
    k %= 2 * n
    return min(k, 2 * n - 1 - k)


def godot(depth, normals, lens, radius, row, column, o):
    """Occlusion of a texel; depth: along the axis; normals: in view space with z away; o: the options by name."""
    height, width = depth.shape
    f_u, f_v, c_u, c_v = lens
    passed = depth[row % 2 :: 2, column % 2 :: 2]
    x = column // 2
    y = row // 2
    n = normals[row, column] / np.linalg.norm(normals[row, column])

    def point(i, j, z):
        """A point at a column and a row of a pass."""
        return np.array([(2 * i + 1.5 - c_u) / f_u * z, (c_v - 2 * j - 1.5) / f_v * z, z])

    p = point(x, y, passed[y, x])
    limit = 1.2 * 1.5 * radius / (height / 2 / f_v)
    r = radius * (0.8 * min(np.linalg.norm(p) / limit, 1) + 0.2)
    reach = 0.85 * r / (point(x + 1, y, p[2]) - p)[0]
    a = row % 2 * 2 + column % 2
    b = (0, 1, 4, 3, 2)[(2 * y + x) % 5]
    turn = (a + b / 5) * math.pi / 2
    scale = (1 + (a - 1.5 + (b - 2) / 5) * 0.07) * reach
    matrix = np.array([[math.cos(turn), -math.sin(turn)], [-math.sin(turn), -math.cos(turn)]]) * scale
    p[2] *= 0.99
    total = 0.0
    for place, weight in zip(PLACES, WEIGHTS, strict=True):
        i, j = np.floor(matrix @ place + 0.5).astype(int)
        for side in (1, -1):
            z = passed[mirrored(y + side * j, height // 2), mirrored(x + side * i, width // 2)]
            if z == np.inf:
                continue
            away = point(x + side * i, y + side * j, z) - p
            fall = max(0, 1 - away @ away / r**2)
            total += weight * max(0, n @ away / np.linalg.norm(away) - o["horizon"]) * fall
    fade = o["fade_from"] / (o["fade_to"] - o["fade_from"]) + 1 - p[2] / radius / (o["fade_to"] - o["fade_from"])
    hidden = min(o["intensity"] * total / (2 * sum(WEIGHTS)), 0.98) * min(max(fade, 0), 1)
    return 1 - (1 - hidden) ** o["power"]
