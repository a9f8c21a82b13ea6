"""The part of the kit's reader on `sao`, `sao-equation-1` and `multiresolution`, by SPECIFICATION.md alone."""

import math

import numpy as np

from reference.elementary import F, binary32, power, sincospi, turn_of
from reference.mapping import sum_a, sum_l
from reference.passes import blur_weights

HALF, ONE, NONE = F(0.5), F(1), F(np.inf)

TURNS = (
    1, 1, 1, 1, 2, 1, 2, 3, 2, 3, 3, 5, 5, 3, 4, 7, 5, 5, 7, 9, 8, 5, 7, 7, 7,
    7, 8, 5, 12, 11, 12, 7, 10, 13, 8, 11, 10, 9, 16, 11, 12, 13, 12, 13, 19, 17, 13, 11, 18, 19,
    11, 11, 23, 17, 21, 17, 13, 17, 18, 13, 17, 23, 17, 19, 19, 25, 18, 19, 19, 29, 21, 19, 27, 31, 29,
    21, 18, 17, 29, 31, 31, 23, 30, 19, 23, 25, 19, 19, 34, 17, 27, 21, 25, 39, 39, 29, 35, 27, 29,
)  # fmt: skip


def dot(a, b):
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]


class View:
    """What `sao` says of a view, of one case."""

    def __init__(self, parameters, inputs):
        view, depth = parameters["view"], inputs["depth"]
        g, self.kind = view["lens"], view["ray_kind"]
        self.m, self.lines = binary32(view["world_from_cast"]), inputs.get("lines")
        columns = ([row[k] for row in view["world_from_cast"]] for k in range(3))
        self.unit = [math.sqrt(dot(column, column)) for column in columns]
        self.origin = {0: g[3], 1: 0.0, 2: 0.0, 3: g[4]}[self.kind]
        if self.kind == 0:
            numbers = (g[5], 0.0, 1 / g[4], g[0] / g[1], -1 / (g[4] * g[1])), (
                g[7], 0.0, 1 / g[6], g[2] / g[3], -1 / (g[6] * g[3]))  # fmt: skip
        elif self.kind == 1:
            numbers = (g[2], 0.0, 0.0, 0.0, 1 / g[0]), (g[3], 0.0, 0.0, 0.0, -1 / g[1])
        elif self.kind == 2:
            numbers = (g[2], 0.0, 1 / g[0], 0.0, 0.0), (g[3], 0.0, -1 / g[1], 0.0, 0.0)
        else:
            numbers = (), ()
        self.across, self.down = map(binary32, numbers)
        self.height, self.width = depth.shape
        self.z = self.linear(depth, g) if self.kind in (1, 2) else depth
        self.seen = self.z < np.inf
        self.places = inputs["positions"] if self.kind in (0, 3) else self.rebuilt()
        self.normals = np.zeros((*depth.shape, 3), F)
        for j, i in self.texels():
            self.normals[j, i] = self.normal(j, i)

    def texels(self):
        return np.argwhere(self.seen).tolist()

    def linear(self, depth, g):
        near, far = g[4], g[5]
        c_0, c_1, c_2 = (near, -1.0, 1.0) if far is None else (near * far, near - far, far)
        z = np.full_like(depth, NONE)
        for j, i in np.argwhere(depth < np.inf):
            if self.kind == 1:
                below = depth[j, i] * F(c_1) + F(c_2)
                z[j, i] = F(c_0) / below if below > 0 else NONE
            else:
                z[j, i] = F(near) + depth[j, i] * F(far - near)
        return z

    def slopes(self, j, i):
        if self.kind == 3:
            return self.lines[j, i, 1], self.lines[j, i, 3]
        (u_c, _, _, c_x, d_x), (v_c, _, _, c_y, d_y) = self.across, self.down
        return c_x + d_x * ((F(i) + HALF) - u_c), c_y + d_y * ((F(j) + HALF) - v_c)

    def point(self, j, i, z):
        """In world space."""
        e_x, e_y = self.slopes(j, i)
        if self.kind == 3:
            x, y = self.lines[j, i, 0] + z * e_x, self.lines[j, i, 2] + z * e_y
        else:
            p, q = (F(i) + HALF) - self.across[0], (F(j) + HALF) - self.down[0]
            x = (self.across[1] + self.across[2] * p) + z * e_x
            y = (self.down[1] + self.down[2] * q) + z * e_y
        return np.array([sum_a(self.m, row, x, y, z) for row in range(3)])

    def rebuilt(self):
        places = np.full((*self.z.shape, 3), NONE)
        for j, i in self.texels():
            places[j, i] = self.point(j, i, self.z[j, i])
        return places

    def neighbour(self, k, length, is_seen):
        for other in (k + 1, k - 1) if k % 2 == 0 else (k - 1, k + 1):
            if 0 <= other < length and is_seen(other):
                return other
        return k

    def normal(self, j, i):
        beside = self.neighbour(i, self.width, lambda other: self.seen[j, other])
        below = self.neighbour(j, self.height, lambda other: self.seen[other, i])
        a, b, c = self.places[j, beside] - self.places[j, i]
        p, q, r = self.places[below, i] - self.places[j, i]
        n = scaled(b * r - c * q, c * p - a * r, a * q - b * p)
        w = np.array([sum_l(self.m, row, *self.slopes(j, i), ONE) for row in range(3)])
        away = dot(n, w)
        if away > 0:
            return -n
        return n if away < 0 else scaled(*-w)

    def lengths(self, j, i):
        """across and down."""
        z = self.z[j, i]
        if self.kind != 3:
            return abs(self.across[2] + z * self.across[4]), abs(self.down[2] + z * self.down[4])
        beside = i + 1 if i + 1 < self.width else max(i - 1, 0)
        below = j + 1 if j + 1 < self.height else max(j - 1, 0)
        return self.gap(self.lines[j, i], self.lines[j, beside], z), self.gap(self.lines[j, i], self.lines[below, i], z)

    def gap(self, one, other, z):
        (a, b, c, d), (p, q, r, t) = one, other
        x, y = (p - a) + z * (q - b), (r - c) + z * (t - d)
        gaps = [sum_l(self.m, row, x, y, F(0)) for row in range(3)]
        return np.sqrt(dot(gaps, gaps))


def scaled(x, y, z):
    size = max(abs(x), abs(y), abs(z))
    if not size > 0:
        return np.zeros(3, F)
    n = np.array([x / size, y / size, z / size])
    return n / np.sqrt(dot(n, n))


def coarser(level, mip, o):
    height, width = level.shape
    made = np.empty(((height + 1) // 2, (width + 1) // 2), F)
    for y, x in np.ndindex(made.shape):
        left, right, top, bottom = 2 * x, min(2 * x + 1, width - 1), 2 * y, min(2 * y + 1, height - 1)
        four = [level[row, column] for row in (top, bottom) for column in (left, right)]
        if mip == "rotated":
            made[y, x] = level[bottom if x % 2 == 0 else top, right if y % 2 == 0 else left]
        elif mip in ("min", "max"):
            made[y, x] = max(four) if mip == "min" else min(four)
        else:
            e, f, g, h = (z - o for z in four)
            if mip == "harmonic" and min(e, f, g, h) > 0:
                made[y, x] = ONE / ((((ONE / e + ONE / f) + ONE / g) + ONE / h) * F(0.25)) + o
            else:
                made[y, x] = (((four[0] + four[1]) + four[2]) + four[3]) * F(0.25)
    return made


def taps_of(s, turns):
    tau = turns
    if turns == 0 and s <= 99:
        tau = TURNS[s - 1]
    elif turns == 0:
        middle = round(s * 0.3819660112501051)
        tau = min((n for n in range(1, s) if math.gcd(n, s) == 1), key=lambda n: (abs(n - middle), n))
    table = []
    for t in range(s):
        sine, cosine = sincospi((((2 * t + 1) * tau) % (2 * s)) / s)
        table.append(binary32([cosine, sine, (t + 0.5) / s]))
    return table


def sample(view, options, radius, constants):
    """A and outside."""
    scale, bias, depth_bias, share = constants
    inverse, epsilon, o = F(1 / radius), F(options["epsilon"]), F(view.origin)
    reach = (F(radius), F(radius)) if view.kind == 3 else (F(radius / view.unit[0]), F(radius / view.unit[1]))
    levels = [view.z]
    while options["mip"] != "none" and len(levels) - 1 < options["max_level"] and levels[-1].size > 1:
        levels.append(coarser(levels[-1], options["mip"], o))
    table = taps_of(options["taps"], options["turns"])
    made, outside = np.ones_like(view.z), 0

    def radius_of(reach, length):
        texels = reach / length
        return texels if texels < 1048576 else F(1048576)

    def term_of(j, i, row, column, h, less):
        number = int(h)
        level = min(max(number.bit_length() - 1 - options["log_q"], 0), len(levels) - 1) if number > 0 else 0
        d = levels[level][row >> level, column >> level]
        if not d < np.inf:
            return F(0)
        u = (view.point(row, column, d) - view.places[j, i]) * inverse
        square = dot(u, u)
        above = dot(u, view.normals[j, i]) - less
        left = ONE - share * square
        term = ((left * left) * left) * (above / (square + epsilon))
        return term if above > 0 and left > 0 and term > 0 else F(0)

    for j, i in view.texels():
        r_u, r_v = map(radius_of, reach, view.lengths(j, i))
        sine, cosine = turn_of(i, j, options["hashed"])
        less = bias + depth_bias * (view.z[j, i] - o)
        total = F(0)
        for tap_x, tap_y, alpha in table:
            h_u, h_v = r_u * alpha, r_v * alpha
            x = F(i) + h_u * (tap_x * cosine - tap_y * sine)
            y = F(j) + h_v * (tap_x * sine + tap_y * cosine)
            if not (x >= 0 and x < view.width and y >= 0 and y < view.height):
                outside += 1
            elif (int(y), int(x)) != (j, i):
                total = total + term_of(j, i, int(y), int(x), max(h_u, h_v), less)
        a = ONE - scale * total
        made[j, i] = a if a > 0 else F(0)
    return made, outside


def average(a, z, edge):
    """Columns are averaged as rows of the transposed texture."""
    for values, depths in ((a, z), (a.T, z.T)):
        for j in range(depths.shape[0]):
            for i in range(0, depths.shape[1] - 1, 2):
                if abs(depths[j, i] - depths[j, i + 1]) < edge:
                    values[j, i] = values[j, i + 1] = (values[j, i] + values[j, i + 1]) * HALF


def through_bytes(a, keys):
    for place in np.ndindex(a.shape):
        key = keys[place]
        red, green, blue = int(a[place] * F(255) + HALF), 255, 255
        if key < np.inf:
            scaled_key = key * F(256)
            green = min(int(scaled_key), 255)
            blue = min(int((scaled_key - F(green)) * F(255) + HALF), 254 if green == 255 else 255)
        a[place] = F(red) / F(255)
        unseen = green == blue == 255
        keys[place] = NONE if unseen else (F(green) + F(blue) / F(255)) * F(0.00390625)


def bilateral(a, keys, weights, sharpness):
    """Along the rows."""
    made = np.ones_like(a)
    height, width = a.shape
    for j, i in np.ndindex(height, width):
        total = weight = F(0)
        for tap in range(7):
            k = i + 3 * (tap - 3)
            if 0 <= k < width:
                near = ONE - sharpness * abs(keys[j, k] - keys[j, i])
                w = weights[tap] * (near if near > 0 else F(0))
                total, weight = total + w * a[j, k], weight + w
        if weight > 0:
            made[j, i] = total / weight
    return made


def reconstructed(view, a, options):
    far = options["z_min"]
    if far == 0 and view.seen.any():
        far = float(view.z[view.seen].max()) - view.origin
    factor = F(1 / far) if far > 0 and math.isfinite(1 / far) else ONE
    keys = np.full_like(view.z, NONE)
    for j, i in view.texels():
        key = (view.z[j, i] - F(view.origin)) * factor
        keys[j, i] = min(max(key, F(0)), ONE)
    weights = binary32(blur_weights(options["gauss"], 3))
    for turned in (False, True):
        if options["packed"]:
            through_bytes(a, keys)
        values, depths = (a.T, keys.T) if turned else (a, keys)
        made = bilateral(values, depths, weights, F(options["sharpness"]))
        a = made.T if turned else made
    return np.ascontiguousarray(a)


def scalable(parameters, inputs, falloff):
    options, radius = parameters["options"], parameters["radius"]
    made = np.zeros_like(inputs["depth"])
    if radius == 0:
        return {"occlusion": made, "outside": np.array([0])}
    view = View(parameters, inputs)
    if falloff:
        constants = F((5 * options["intensity"]) / options["taps"]), F(options["beta"]), F(0), ONE
    else:
        depth_bias = F((options["beta"] * view.unit[2]) / radius) if options["beta"] > 0 else F(0)
        constants = F((2 * options["sigma"]) / options["taps"]), F(0), depth_bias, F(0)
    a, outside = sample(view, options, radius, constants)
    average(a, view.z, F((options["quad_edge"] * radius) / view.unit[2]))
    if options["gauss"] > 0:
        a = reconstructed(view, a, options)
    for j, i in view.texels():
        made[j, i] = ONE - F(power(float(a[j, i]), options.get("k", 1.0)))
    return {"occlusion": made, "outside": np.array([outside])}


# multiresolution: a level is its size and the texels that its texels stand for, by their places


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
    r, square = F(parameters["radius"]), F(parameters["radius"] * parameters["radius"])
    levels = [(depth.shape, {place: place for place in np.ndindex(depth.shape) if depth[place] < np.inf})]
    while len(levels) < n:
        levels.append(next_level(depth, *levels[-1]))
    around = [(y, x) for y in range(-m, m + 1) for x in range(-m, m + 1)]

    def taken(texel, other):
        v = positions[other] - positions[texel]
        d, above = dot(v, v), dot(v, normals[texel])
        return (ONE - d / square) * (above / np.sqrt(d)) if d > 0 and d < square and above > 0 else F(0)

    def weight(texel, other):
        s = abs(dot(positions[other] - positions[texel], normals[texel]))
        a = HALF * (ONE + dot(normals[texel], normals[other]))
        for _ in range(3):
            a = a * a
        b = r / (r + s) if r + s > 0 and r + s < np.inf else F(0)
        for _ in range(4):
            b = b * b
        return a * b if a * b < np.inf else F(0)

    def own(size, level, j, i):
        """Occlusion of a level's texel by itself, and taps outside."""
        total, outside = F(0), 0
        for y, x in around:
            if not (0 <= j + y < size[0] and 0 <= i + x < size[1]):
                outside += 1
            elif (y, x) != (0, 0) and (j + y, i + x) in level:
                total = total + taken(level[j, i], level[j + y, i + x])
        return total / F(len(around) - 1), outside

    def with_coarse(texel, j, i, most, total, coarse, carried):
        weights = high = mean = F(0)
        rows, columns = ((k // 2, k // 2 + (1 if k % 2 else -1)) for k in (j, i))
        for part, place in zip((9, 3, 3, 1), [(y, x) for y in rows for x in columns], strict=True):
            if place in coarse:
                w = F(part) * weight(texel, coarse[place])
                weights, high, mean = weights + w, high + w * carried[place][0], mean + w * carried[place][1]
        if not weights > 0:
            return most, total
        return max(most, high / weights), total + mean / weights

    carried, coarse, outside = {}, {}, 0
    for size, level in reversed(levels):
        found = {}
        for (j, i), texel in level.items():
            most, beyond = own(size, level, j, i)
            outside += beyond
            found[j, i] = with_coarse(texel, j, i, most, most, coarse, carried)
        carried, coarse = found, level

    made = np.zeros_like(depth)
    for place, (most, total) in carried.items():
        mean = total / F(n)
        both = ONE - (ONE - most) * (ONE - mean)
        value = {"maximum": most, "average": mean, "both": both}[options["combine"]]
        made[place] = min(max(value, F(0)), ONE)
    return {"occlusion": made, "outside": np.array([outside])}


ESTIMATORS = {
    "sao": lambda parameters, inputs: scalable(parameters, inputs, True),
    "sao-equation-1": lambda parameters, inputs: scalable(parameters, inputs, False),
    "multiresolution": multiresolution,
}
