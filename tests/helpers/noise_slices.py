"""XeGTAO texel by texel, from what its shader computes.

View space has z away from the eye and y up; rows begin above.
"""

import math
import struct

import numpy as np

GOLDEN = 0.6180339887498948


def hilbert_noise(side=64):
    """The noise of XeGTAO and Bevy: R2 at the place of a texel along Hilbert's curve, (side, side, 2), rows of x."""
    made = np.zeros((side, side, 2))
    for row in range(side):
        for column in range(side):
            x, y, place, half = column, row, 0, side // 2
            while half:
                right, down = int(x & half > 0), int(y & half > 0)
                place += half * half * (3 * right ^ down)
                if not down:
                    if right:
                        x, y = side - 1 - x, side - 1 - y
                    x, y = y, x
                half //= 2
            made[row, column] = np.modf(0.5 + place * np.array([0.7548776662466927, 0.5698402909980532]))[0]
    return made.astype(np.float32)


class Frame:
    """A camera's textures: distances along its axis, infinite without a surface, and normals in view space."""

    def __init__(self, depth, normals, lens):
        self.depth, self.normals, self.lens = np.asarray(depth, float), np.asarray(normals, float), lens
        self.size = self.depth.shape

    def point(self, u, v, z):
        f_u, f_v, c_u, c_v = self.lens
        return np.array([(u - c_u) / f_u * z, (c_v - v) / f_v * z, z])

    def seen(self, u, v):
        """The point seen at an image point: depth of its texel, held inside the texture; None without a surface."""
        row, column = (min(max(math.floor(x), 0), n - 1) for x, n in zip((v, u), self.size, strict=True))
        z = self.depth[row, column]
        return self.point(u, v, z) if z < np.inf else None


def unit(v):
    return v / np.linalg.norm(v)


def root(x, bits):
    if not bits:
        return math.sqrt(x)
    (whole,) = struct.unpack("<i", struct.pack("<f", x))
    return struct.unpack("<f", struct.pack("<i", 0x1FBD1DF5 + (whole >> 1)))[0]


def angle(cosine, bits):
    size = min(abs(cosine), 1.0)
    made = (-0.156583 * size + 1.570796) * root(1.0 - size, bits)
    return made if cosine >= 0 else 3.141593 - made


def slice_angles(n, d, v, axis, bits):
    """The projected normal's angle, its cosine and its length in a slice."""
    part = n - axis * (n @ axis)
    length = np.linalg.norm(part)
    cosine = min(max(part @ v / length, 0.0), 1.0)
    return np.sign((d - (d @ v) * v) @ part) * angle(cosine, bits), cosine, length


def xegtao(frame, noise, radius, row, column, o):
    """1 - visibility of a texel; o: the options by name."""
    bits, n = o["root"] == "bits", frame.normals[row, column]
    z = o["nearer"] * frame.depth[row, column]
    p = frame.point(column + 0.5, row + 0.5, z)
    v, reach = unit(-p), o["multiplier"] * radius
    in_texels = reach * frame.lens[0] / z
    visibility = min(max((10 - in_texels) / 100, 0.0), 1.0) * 0.5
    for i in range(o["slices"]):
        phi = (i + noise[0]) / o["slices"] * math.pi
        d = np.array([math.cos(phi), math.sin(phi), 0.0])
        axis = unit(np.cross(d - (d @ v) * v, v))
        tilt, cosine, length = slice_angles(n, d, v, axis, bits)
        low = [math.cos(tilt + math.pi / 2), math.cos(tilt - math.pi / 2)]
        horizons = list(low)
        for k in range(o["steps"]):
            moved = (noise[1] + (i + k * o["steps"]) * GOLDEN) % 1.0
            s = ((k + moved) / o["steps"]) ** (1 + o["squared"]) + o["nearest"] / in_texels
            x, y = s * in_texels * math.cos(phi), -s * in_texels * math.sin(phi)
            if o["snap"]:
                x, y = math.floor(x + 0.5), math.floor(y + 0.5)
            for side, sign in enumerate((1, -1)):
                seen = frame.seen(column + 0.5 + sign * x, row + 0.5 + sign * y)
                if seen is None:
                    continue
                away = seen - p
                far = np.linalg.norm(away * [1, 1, 1 + o["thin"]])
                weight = min(max((1 - o["falloff"] - far / reach) / o["falloff"] + 1, 0.0), 1.0)
                cosine_of = unit(away) @ v
                horizons[side] = max(horizons[side], low[side] + weight * (cosine_of - low[side]))
        drawn = length + o["longer"] * (1 - length)
        for h in (-angle(horizons[1], bits), angle(horizons[0], bits)):
            visibility += drawn * (cosine + 2 * h * math.sin(tilt) - math.cos(2 * h - tilt)) / 4
    return 1 - max(0.03, max(visibility / o["slices"], 0.0) ** o["power"])
