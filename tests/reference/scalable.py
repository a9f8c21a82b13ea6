"""The estimators `sao` and `sao-equation-1`: ESTIMATORS.md of the kit.

Each takes the parameters and inputs of a case; arithmetic is that of the depth texture's numbers.
"""

import math

import numpy as np

from reference.elementary import dot, power
from reference.mapping import affine_row, linear_row, rounded
from reference.passes import blur_weights
from reference.spiral import summed, tap_of, turns_of

MODULE, PERSPECTIVE, ORTHOGRAPHIC, TABLE = range(4)
LANDED = {"floor": lambda d: d, "truncate": np.trunc, "nearest": lambda d: np.floor(d + d.dtype.type(0.5))}


@np.errstate(all="ignore")
def linear_depth(depth, ray_kind, near, far):
    """z of a camera's depth; far is None for a plane at infinity."""
    dtype = depth.dtype.type
    if ray_kind == ORTHOGRAPHIC:
        return np.where(depth < np.inf, dtype(near) + depth * dtype(far - near), np.inf)
    c_0, c_1, c_2 = (near, -1.0, 1.0) if far is None else (near * far, near - far, far)
    below = depth * dtype(c_1) + dtype(c_2)
    return np.where((depth < np.inf) & (below > 0), dtype(c_0) / below, np.inf)


def scaled(x, y, z):
    size = max(abs(x), abs(y), abs(z))
    if not size > 0:
        return np.zeros(3, type(x))
    n = np.array([x / size, y / size, z / size])
    return n / np.sqrt(dot(n, n))


def neighbour(k, length, is_seen):
    for other in (k + 1, k - 1) if k % 2 == 0 else (k - 1, k + 1):
        if 0 <= other < length and is_seen(other):
            return other
    return k


class View:
    """A view as the text has it: the lines of its texels; ``lines`` (H, W, 4) for ray kind 3."""

    def __init__(self, view, dtype, lines=None):
        g, self.kind, self.dtype, self.lines = view["lens"], view["ray_kind"], dtype, lines
        self.m = rounded(view["world_from_cast"], dtype)
        columns = ([row[k] for row in view["world_from_cast"]] for k in range(3))
        self.unit = [math.sqrt(dot(column, column)) for column in columns]
        self.origin = {MODULE: g[3], PERSPECTIVE: 0.0, ORTHOGRAPHIC: 0.0, TABLE: g[4]}[self.kind]
        across = down = ()
        if self.kind == MODULE:
            across = g[5], 0.0, 1 / g[4], g[0] / g[1], -1 / (g[4] * g[1])
            down = g[7], 0.0, 1 / g[6], g[2] / g[3], -1 / (g[6] * g[3])
        elif self.kind == PERSPECTIVE:
            across, down = (g[2], 0.0, 0.0, 0.0, 1 / g[0]), (g[3], 0.0, 0.0, 0.0, -1 / g[1])
        elif self.kind == ORTHOGRAPHIC:
            across, down = (g[2], 0.0, 1 / g[0], 0.0, 0.0), (g[3], 0.0, -1 / g[1], 0.0, 0.0)
        self.across, self.down = rounded(across, dtype), rounded(down, dtype)
        self.near, self.far = g[4:6]

    def z(self, depth):
        return (
            linear_depth(depth, self.kind, self.near, self.far) if self.kind in (PERSPECTIVE, ORTHOGRAPHIC) else depth
        )

    def slopes(self, j, i):
        if self.kind == TABLE:
            return self.lines[j, i, 1], self.lines[j, i, 3]
        (u_c, _, _, c_x, d_x), (v_c, _, _, c_y, d_y) = self.across, self.down
        return c_x + d_x * ((self.dtype(i) + 0.5) - u_c), c_y + d_y * ((self.dtype(j) + 0.5) - v_c)

    def point(self, j, i, z):
        """In world space."""
        e_x, e_y = self.slopes(j, i)
        if self.kind == TABLE:
            x, y = self.lines[j, i, 0] + z * e_x, self.lines[j, i, 2] + z * e_y
        else:
            (u_c, a_x, b_x, _, _), (v_c, a_y, b_y, _, _) = self.across, self.down
            x = (a_x + b_x * ((self.dtype(i) + 0.5) - u_c)) + z * e_x
            y = (a_y + b_y * ((self.dtype(j) + 0.5) - v_c)) + z * e_y
        return np.array([affine_row(self.m, row, x, y, z) for row in range(3)])

    def places(self, z):
        made = np.full((*z.shape, 3), np.inf, self.dtype)
        for j, i in np.argwhere(z < np.inf).tolist():
            made[j, i] = self.point(j, i, z[j, i])
        return made

    def normals(self, z, places):
        made, seen, (height, width) = np.zeros_like(places), z < np.inf, z.shape
        for j, i in np.argwhere(seen).tolist():
            right = neighbour(i, width, lambda other, j=j: seen[j, other])
            below = neighbour(j, height, lambda other, i=i: seen[other, i])
            a, b, c = places[j, right] - places[j, i]
            p, q, r = places[below, i] - places[j, i]
            n = scaled(b * r - c * q, c * p - a * r, a * q - b * p)
            slopes = *self.slopes(j, i), self.dtype(1)
            w = np.array([linear_row(self.m, row, *slopes) for row in range(3)])
            away = dot(n, w)
            made[j, i] = -n if away > 0 else n if away < 0 else scaled(*-w)
        return made

    def lengths(self, j, i, z):
        """across and down."""
        if self.kind != TABLE:
            return abs(self.across[2] + z * self.across[4]), abs(self.down[2] + z * self.down[4])
        height, width = self.lines.shape[:2]
        right = i + 1 if i + 1 < width else max(i - 1, 0)
        below = j + 1 if j + 1 < height else max(j - 1, 0)
        return self.gap((j, i), (j, right), z), self.gap((j, i), (below, i), z)

    def gap(self, one, other, z):
        (a, b, c, d), (p, q, r, t) = self.lines[one], self.lines[other]
        x, y = (p - a) + z * (q - b), (r - c) + z * (t - d)
        gaps = [linear_row(self.m, row, x, y, self.dtype(0)) for row in range(3)]
        return np.sqrt(dot(gaps, gaps))

    def radii(self, j, i, z, radius):
        """r_u and r_v: of the ball's image, in texels."""
        reach = [radius if self.kind == TABLE else radius / unit for unit in self.unit[:2]]
        found = [self.dtype(r) / length for r, length in zip(reach, self.lengths(j, i, z), strict=True)]
        return [texels if texels < 1048576 else self.dtype(1048576) for texels in found]


def coarser(level, mip, o):
    height, width = level.shape
    dtype = level.dtype.type
    made = np.empty(((height + 1) // 2, (width + 1) // 2), dtype)
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
                made[y, x] = 1 / ((((1 / e + 1 / f) + 1 / g) + 1 / h) * dtype(0.25)) + o
            else:
                made[y, x] = (((four[0] + four[1]) + four[2]) + four[3]) * dtype(0.25)
    return made


@np.errstate(all="ignore")
def levels_of(z, mip, max_level, o):
    levels = [z]
    while mip != "none" and len(levels) - 1 < max_level and levels[-1].size > 1:
        levels.append(coarser(levels[-1], mip, o))
    return levels


def sample(view, z, places, options, radius, constants, turns, buffer):
    """A and outside."""
    dtype, (height, width) = view.dtype, z.shape
    scale, bias, depth_bias, falloff = constants
    inverse, epsilon, o = dtype(1 / radius), dtype(options["epsilon"]), dtype(view.origin)
    levels = levels_of(z, options["mip"], options["max_level"], o)
    normals = buffer if options["normals"] == "buffer" else view.normals(z, places)
    landed = LANDED[options["landing"]]
    s, tau = options["taps"], options["turns"]
    tau, turn = tau if tau != 0 else turns_of(s), options["full_turn"]
    table = [rounded(tap_of(t, s, tau, full_turn=turn), dtype) for t in range(s)]
    half = 3.14 if turn == "6.28" else 3.141592653589793
    angles = [half * (((2 * t + 1) * tau) / s) for t in range(s)]
    made, outside = np.ones_like(z), 0

    def term_of(j, i, row, column, h, less):
        level = min(max(int(h).bit_length() - 1 - options["log_q"], 0), len(levels) - 1)
        d = levels[level][row >> level, column >> level]
        if not d < np.inf:
            return 0
        u = (view.point(row, column, d) - places[j, i]) * inverse
        square = dot(u, u)
        above = dot(u, normals[j, i]) - less
        left = 1 - falloff * square
        term = ((left * left) * left) * (above / (square + epsilon))
        return term if above > 0 and left > 0 and term > 0 else 0

    for j, i in np.argwhere(z < np.inf).tolist():
        r_u, r_v = view.radii(j, i, z[j, i], options["reach"] * radius)
        cosine, sine = (dtype(1), dtype(0)) if turns is None else turns[:, j, i]
        less = bias + depth_bias * (z[j, i] - o)
        total = dtype(0)
        for (tap_x, tap_y, alpha), theta in zip(table, angles, strict=True):
            h_u, h_v = r_u * alpha, r_v * alpha
            u, v = tap_x * cosine - tap_y * sine, tap_x * sine + tap_y * cosine
            u, v = rounded(summed(i, j, theta), dtype) if options["angle_sum"] == "float32" else (u, v)
            x, y = dtype(i) + landed(h_u * u), dtype(j) + landed(h_v * v)
            if options["sine"] == "up":
                y = dtype(j) - (np.floor if options["landing"] == "floor" else landed)(h_v * v)
            if not (x >= 0 and x < width and y >= 0 and y < height):
                outside += 1
            elif (int(y), int(x)) != (j, i):
                total = total + term_of(j, i, int(y), int(x), max(h_u, h_v), less)
        a = 1 - scale * total
        made[j, i] = a if a > 0 else 0
    return made, outside


@np.errstate(all="ignore")
def average(a, z, edge):
    """The 2 x 2 average; columns are averaged as rows of the transposed texture."""
    made = a.copy()
    for values, depths in ((made, z), (made.T, z.T)):
        for j in range(depths.shape[0]):
            for i in range(0, depths.shape[1] - 1, 2):
                if abs(depths[j, i] - depths[j, i + 1]) < edge:
                    values[j, i] = values[j, i + 1] = (values[j, i] + values[j, i + 1]) * a.dtype.type(0.5)
    return made


@np.errstate(all="ignore")
def keys_of(z, o, factor):
    keys = (z - o) * factor
    return np.where(z < np.inf, np.where(keys > 0, np.minimum(keys, 1), 0), np.inf)


def pack(a, keys):
    """Three bytes a texel."""
    made = np.full((*a.shape, 3), 255, np.uint8)
    for place in np.ndindex(a.shape):
        key = keys[place]
        made[place][0] = int(a[place] * 255 + keys.dtype.type(0.5))
        if key < np.inf:
            green = min(int(key * 256), 255)
            blue = min(int((key * 256 - green) * 255 + keys.dtype.type(0.5)), 254 if green == 255 else 255)
            made[place][1:] = green, blue
    return made


def unpack(rgb, dtype):
    a, keys = np.empty(rgb.shape[:2], dtype), np.full(rgb.shape[:2], np.inf, dtype)
    for place in np.ndindex(a.shape):
        red, green, blue = (dtype(byte) for byte in rgb[place])
        a[place] = red / 255
        if not green == blue == 255:
            keys[place] = (green + blue / 255) * dtype(0.00390625)
    return a, keys


@np.errstate(all="ignore")
def bilateral(a, keys, weights, stride, sharpness):
    """The pass along the rows."""
    made, dtype = np.ones_like(a), a.dtype.type
    height, width = a.shape
    for j, i in np.ndindex(height, width):
        total = weight = dtype(0)
        for tap, gauss in enumerate(weights):
            k = i + stride * (tap - len(weights) // 2)
            if 0 <= k < width:
                near = 1 - sharpness * abs(keys[j, k] - keys[j, i])
                w = gauss * (near if near > 0 else dtype(0))
                total, weight = total + w * a[j, k], weight + w
        if weight > 0:
            made[j, i] = total / weight
    return made


def bilateral_columns(a, keys, weights, stride, sharpness):
    return np.ascontiguousarray(bilateral(a.T, keys.T, weights, stride, sharpness).T)


def reconstructed(view, z, a, options):
    dtype, seen, far = view.dtype, z < np.inf, options["z_min"]
    if far == 0 and seen.any():
        far = float(z[seen].max()) - view.origin
    keys = keys_of(z, dtype(view.origin), dtype(1 / far if far > 0 and math.isfinite(1 / far) else 1))
    weights = rounded(blur_weights(options["gauss"], 3), dtype)
    for along in (bilateral, bilateral_columns):
        if options["packed"]:
            a, keys = unpack(pack(a, keys), dtype)
        a = along(a, keys, weights, 3, dtype(options["sharpness"]))
    return a


def scalable(parameters, inputs, falloff):
    options, radius, depth = parameters["options"], parameters["radius"], inputs["depth"]
    dtype, made = depth.dtype.type, np.zeros_like(depth)
    if radius == 0:
        return made, 0
    view = View(parameters["view"], dtype, inputs.get("lines"))
    z = view.z(depth)
    places = inputs["positions"] if view.kind in (MODULE, TABLE) else view.places(z)
    if falloff:
        constants = (5 * options["intensity"]) / options["taps"], options["beta"], 0, 1
    else:
        constants = (2 * options["sigma"]) / options["taps"], 0, (options["beta"] * view.unit[2]) / radius, 0
    a, outside = sample(
        view, z, places, options, radius, rounded(constants, dtype), inputs.get("turns"), inputs.get("normals")
    )
    a = average(a, z, dtype((options["quad_edge"] * radius) / view.unit[2]))
    if options["gauss"] > 0:
        a = reconstructed(view, z, a, options)
    for j, i in np.argwhere(z < np.inf):
        made[j, i] = 1 - dtype(power(float(a[j, i]), options.get("k", 1.0)))
    return made, outside
