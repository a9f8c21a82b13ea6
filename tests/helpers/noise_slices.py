"""XeGTAO and Bevy's bitmask texel by texel, from what shaders compute.

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
            x = column
            y = row
            place = 0
            half = side // 2
            while half:
                right = int(x & half > 0)
                down = int(y & half > 0)
                place += half * half * (3 * right ^ down)
                if not down:
                    if right:
                        x = side - 1 - x
                        y = side - 1 - y
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

    def inverse(self, u, v):
        """1 / z between the centres of texels, held inside the texture; 1e-12 without a surface."""
        (top, y), (left, x) = (divmod(each - 0.5, 1.0) for each in (v, u))
        rows, columns = (np.clip([int(k), int(k) + 1], 0, n - 1) for k, n in zip((top, left), self.size, strict=True))
        four = np.maximum(1 / self.depth[np.ix_(rows, columns)], 1e-12)
        return np.array([1 - y, y]) @ four @ np.array([1 - x, x])


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
    bits = o["root"] == "bits"
    n = frame.normals[row, column]
    z = o["nearer"] * frame.depth[row, column]
    p = frame.point(column + 0.5, row + 0.5, z)
    v = unit(-p)
    reach = o["multiplier"] * radius
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
            x = s * in_texels * math.cos(phi)
            y = -s * in_texels * math.sin(phi)
            if o["snap"]:
                x = math.floor(x + 0.5)
                y = math.floor(y + 0.5)
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


def polynomial(cosine):
    size = min(abs(cosine), 1.0)
    made = (-0.156583 * size + math.pi / 2) * math.sqrt(1.0 - size)
    return made if cosine >= 0 else math.pi - made


def bevy(frame, noise, radius, row, column, near, o):
    """Occlusion of a texel as of Bevy's visibility bitmask; near: the near plane of its reversed, infinite depth."""
    n = frame.normals[row, column]
    sectors = 2 * o["steps"]
    height, width = frame.size
    z = near / (near / frame.depth[row, column] + o["nearer"])
    p = frame.point(column + 0.5, row + 0.5, z)
    v = unit(-p)
    hidden = 0
    scale = 0.5 * radius * (2 * frame.lens[0] / width) / z  # of coordinates from 0 to 1
    for i in range(o["slices"]):
        phi = math.pi / o["slices"] * (i + noise[0])
        d = np.array([math.cos(phi), math.sin(phi), 0.0])
        axis = np.cross(d, v)
        part = n - (unit(axis) if o["unit"] else axis) * (n @ (unit(axis) if o["unit"] else axis))
        tilt = np.sign((d - (d @ v) * v) @ part) * polynomial(min(max(part @ v / np.linalg.norm(part), 0.0), 1.0))
        bits = 0
        for k in range(o["steps"]):
            s = ((k + (noise[1] + (i + k * o["steps"]) * GOLDEN) % 1.0) / o["steps"]) ** 2 * scale
            x = s * math.cos(phi) * width
            y = -s * math.sin(phi) * (width if o["square"] else height)
            for sign in (1, -1):
                u = column + 0.5 + sign * x
                w = row + 0.5 + sign * y
                away = frame.point(u, w, 1 / frame.inverse(u, w)) - p
                ends = [polynomial(unit(each) @ v) / math.pi for each in (away, away - o["thickness"] * radius * v)]
                ends = sorted(min(max(0.5 - tilt / math.pi + sign * each, 0.0), 1.0) for each in ends)
                first = math.floor(ends[0] * sectors)
                count = math.ceil((ends[1] - ends[0]) * sectors)
                bits |= ((1 << count) - 1) << first
        hidden += bits.bit_count()
    return 1 - min(max(1 - hidden / (o["slices"] * sectors), 0.03), 1.0)
