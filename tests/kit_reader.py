"""An implementation of the kit's stages by its SPECIFICATION.md alone: nothing here comes from lfssao.

Scalars one at a time, as the text writes them: Python's floats are binary64, np.float32's are binary32. Run as a
program on a kit's folder it says which cases it meets to the bit.
"""

import json
import math
import sys
from pathlib import Path

import numpy as np

F = np.float32


# Section 2


def read_case(folder):
    """Parameters, inputs and outputs of a case; the headers of the .npy files are skipped."""
    case = json.loads((folder / "case.json").read_text())
    assert case["format"] == 1

    def array(entry):
        data = (folder / entry["file"]).read_bytes()[128:]
        return np.frombuffer(data, np.dtype(entry["dtype"]).newbyteorder("<")).reshape(entry["shape"])

    inputs, outputs = ({k: array(entry) for k, entry in case[group].items()} for group in ("inputs", "outputs"))
    return case["stage"], case["parameters"], inputs, outputs


# Section 4


def fraction_away(x, factor):
    return int(x * factor + 0.5) if x >= 0 else -int(0.5 - x * factor)


def sincospi(x):
    q = fraction_away(x, 2.0)
    r = x - float(q) * 0.5
    a = 3.141592653589793 * r
    b = a * a
    s = 1 / 355687428096000
    for sign, n in ((-1, 1307674368000), (1, 6227020800), (-1, 39916800), (1, 362880), (-1, 5040), (1, 120), (-1, 6)):
        s = s * b + sign * (1 / n)
    s = ((s * b) * a) + a
    c = 1 / 20922789888000
    for sign, n in ((-1, 87178291200), (1, 479001600), (-1, 3628800), (1, 40320), (-1, 720), (1, 24), (-1, 2), (1, 1)):
        c = c * b + sign * (1 / n)
    return ((s, c), (c, -s), (-s, -c), (-c, s))[q & 3]


def cbrt(t):
    if not (t > 0 and t < math.inf):
        return t
    scale = 1.0
    while t >= 8:
        t, scale = t * 0.125, scale * 2
    while t < 1:
        t, scale = t * 8, scale * 0.5
    y = 0.9 + 0.15 * t
    for _ in range(6):
        y = y - (y * y * y - t) / (3 * y * y)
    return y * scale


def exp(x):
    if x < -745:
        return 0.0
    if x > 710:
        return math.inf
    k = fraction_away(x, 1.4426950408889634)
    r = (x - k * 0.6931471803691238) - k * 1.9082149292705877e-10
    y = 1.0
    for n in range(13, 0, -1):
        y = (y * r) / n + 1
    for _ in range(abs(k)):
        y = y * 2 if k >= 0 else y * 0.5
    return y


def elementary(parameters, inputs):
    function = {"sincospi": sincospi, "cbrt": cbrt, "exp": exp}[parameters["function"]]
    return np.array([function(float(x)) for x in inputs["x"]])


# Section 5


def philox(counter, key):
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for _ in range(10):
        p, q = 0xD2511F53 * c0, 0xCD9E8D57 * c2
        c0, c1, c2, c3 = (q >> 32) ^ c1 ^ k0, q & 0xFFFFFFFF, (p >> 32) ^ c3 ^ k1, p & 0xFFFFFFFF
        k0, k1 = (k0 + 0x9E3779B9) % 2**32, (k1 + 0xBB67AE85) % 2**32
    return c0, c1, c2, c3


def philox_stage(parameters, inputs):
    pairs = zip(inputs["counters"].tolist(), inputs["keys"].tolist(), strict=True)
    return np.array([philox(counter, key) for counter, key in pairs], np.uint32)


def word(seed, stream, index):
    return philox((index, stream, 0, 0), (seed % 2**32, seed // 2**32))[0]


def unit(seed, stream, index):
    return (word(seed, stream, index) + 0.5) / 4294967296


# Section 6


def square(method, n, seed):
    def place(cell, cells, u):
        return 2 * ((float(cell) + u) / float(cells)) - 1

    if method == "random":
        return [tuple((word(seed, s, k) + 0.5) / 2147483648 - 1 for s in (0, 1)) for k in range(n)]
    if method == "jittered":
        rows = max(d for d in range(1, n + 1) if n % d == 0 and d * d <= n)
        columns = n // rows
        cells = [(k % columns, k // columns) for k in range(n)]
    else:
        columns = rows = n
        order = list(range(n))
        for k in range(n - 1, 0, -1):
            other = (word(seed, 3, k) * (k + 1)) >> 32
            order[k], order[other] = order[other], order[k]
        cells = [(order[k], k) for k in range(n)]
    return [(place(i, columns, unit(seed, 0, k)), place(j, rows, unit(seed, 1, k))) for k, (i, j) in enumerate(cells)]


def samples(parameters, inputs):
    seed, r_min, r_max = int(parameters["seed"]), parameters["r_min"], parameters["r_max"]
    table = []
    for k, (z, xi2) in enumerate(square(parameters["method"], parameters["n"], seed)):
        sine, cosine = sincospi(xi2)
        w = math.sqrt(max(1 - z * z, 0))
        x, y = w * cosine, w * sine
        if r_max == 0:
            table.append((0.0, 0.0, 0.0))
            continue
        inner = r_min / r_max
        cube = inner * inner * inner
        r = cbrt(cube + unit(seed, 2, k) * (1 - cube)) * r_max
        r = min(max(r, r_min), r_max)
        table.append((r * x, r * y, r * z))
    return np.array(table)


# Section 7


def binary32(numbers):
    return [F(number) for number in np.ravel(numbers).tolist()]


def offsets(parameters, inputs):
    return [[F(parameters["radius"] * c) for c in sample] for sample in inputs["samples"].tolist()]


# Section 8


def sum_l(m, row, x, y, z):
    return (m[4 * row] * x + m[4 * row + 1] * y) + m[4 * row + 2] * z


def sum_a(m, row, x, y, z):
    return ((m[4 * row] * x + m[4 * row + 1] * y) + m[4 * row + 2] * z) + m[4 * row + 3]


def to_image(kind, m, sums):
    """u, v, image z, answer."""
    if kind == "crossed slits":
        a, b, c = sums
        z_m, z_o, u_0, v_0 = m[12:]
        return u_0 + a / (z_m - c), v_0 + b / (z_o - c), c, 0 if c < z_m and c > z_o else 1
    if kind == "matrix":
        a, b, c, q = sums
        return a / q, b / q, c / q, 0 if q > 0 else 1
    return display(m[12:], *sums)


def crossing(curvature, x, z, dx, dz):
    a = curvature * (dx * dx + dz * dz)
    b = curvature * (x * dx + z * dz) - dz
    c = curvature * (x * x + z * z) - (z + z)
    d = b * b - a * c
    root = np.sqrt(d) if d > 0 else F(0)
    return -c / (b + root), d


def screen_point(d, x, y, z):
    """s_x, s_y, s_z, answer."""

    def no(answer):
        return F(0), F(0), F(0), answer

    one = F(1)
    m_x, m_y, m_z, y_o, z_o = d[:5]
    t_s, d_s = crossing(d[5], m_x, m_z, x - m_x, z - m_z)
    t_v, d_v = crossing(d[6], m_x, m_z - z_o, x - m_x, z - m_z)
    if not z < m_z:
        return no(1)
    if d_v < 0 or not t_v > 1:
        return no(2)
    if d_s < 0 or not (t_s > 0 and t_s < t_v):
        return no(3)
    s_y = y_o + (y - y_o) * ((t_v - t_s) / (t_v - one))
    if d[7] == 0:
        s_z = m_z + t_s * (z - m_z) if d[5] != 0 else F(0)
        s_x = m_x + t_s * (x - m_x)
    else:
        h_m = np.sqrt((s_y - m_y) * (s_y - m_y) + m_z * m_z)
        h_e = np.sqrt((s_y - y_o) * (s_y - y_o) + z_o * z_o)
        k = (z / z_o) * (h_e / h_m)
        if not one + k > 0:
            return no(1)
        s_x, s_z = (x + m_x * k) / (one + k), F(0)
    return s_x, s_y, s_z, 0


def display(d, x, y, z):
    """u, v, image z, answer."""

    def no(answer):
        return F(0), F(0), F(0), answer

    m_x, m_y, m_z = d[:3]
    s_x, s_y, s_z, answer = screen_point(d, x, y, z)
    if answer != 0:
        return no(answer)
    if s_z != 0:
        g = m_z / (m_z - s_z)
        s_x = m_x + (s_x - m_x) * g
        s_y = m_y + (s_y - m_y) * g
        if not g > 0:
            return no(3)
    h = d[8:17]
    w = (h[6] * s_x + h[7] * s_y) + h[8]
    u = ((h[0] * s_x + h[1] * s_y) + h[2]) / w
    v = ((h[3] * s_x + h[4] * s_y) + h[5]) / w
    if not w > 0:
        return no(4)
    c_u, c_v, f, k1, k2, fold = d[17:23]
    if k1 != 0 or k2 != 0:
        p, q = (u - c_u) / f, (v - c_v) / f
        r = p * p + q * q
        if not r < fold:
            return no(4)
        e = F(1) + r * (k1 + r * k2)
        u, v = c_u + f * (p * e), c_v + f * (q * e)
    return u, v, z, 0


def mapping(parameters, inputs):
    kind, m = parameters["mapping"]["kind"], binary32(parameters["mapping"]["numbers"])
    rows = range(4 if kind == "matrix" else 3)
    image, answers = [], []
    for point in inputs["points"]:
        *place, answer = to_image(kind, m, [sum_a(m, row, *point) for row in rows])
        image.append(place if answer == 0 else [F(0)] * 3)
        answers.append(answer)
    return {"image": np.array(image, F), "answers": np.array(answers, np.int32)}


# Sections 9 and 10; answers: how often each occurred, 5 for a point outside the texture


def occlusion(kind, m, depth, point_of, table, answers):
    height, width = depth.shape
    rows = range(4 if kind == "matrix" else 3)
    linear = [[sum_l(m, row, *offset) for row in rows] for offset in table]
    made = np.zeros((height, width), F)
    for j in range(height):
        for i in range(width):
            if not depth[j, i] < np.inf:
                continue
            point = point_of(j, i)
            affine = [sum_a(m, row, *point) for row in rows]
            count = 0
            for offset in linear:
                u, v, z, answer = to_image(kind, m, [p + o for p, o in zip(affine, offset, strict=True)])
                if answer == 0 and not (u >= 0 and u < width and v >= 0 and v < height):
                    answer = 5
                if answer == 0 and depth[int(v), int(u)] < z:
                    count += 1
                answers[answer] += 1
            made[j, i] = F(count) / F(len(table))
    return made


def occlusion_outputs(kind, m, inputs, point_of, parameters):
    table, answers = offsets(parameters, inputs), [0] * 6
    made = occlusion(kind, m, inputs["depth"], point_of, table, answers)
    outside = np.array([sum(answers[1:])], np.int64)
    return {"occlusion": made, "outside": outside, "offsets": np.array(table, F), "answers": answers}


def algorithm1(parameters, inputs):
    back, forth = binary32(parameters["screen_to_world"]), binary32(parameters["world_to_screen"])

    def point_of(j, i):
        place = F(i) + F(0.5), F(j) + F(0.5), inputs["depth"][j, i]
        w = sum_a(back, 3, *place)
        return [sum_a(back, row, *place) / w for row in range(3)]

    return occlusion_outputs("matrix", forth, inputs, point_of, parameters)


def algorithm2(parameters, inputs):
    kind, m = parameters["mapping"]["kind"], binary32(parameters["mapping"]["numbers"])
    return occlusion_outputs(kind, m, inputs, lambda j, i: inputs["positions"][j, i], parameters)


# Sections 11 to 14


def merge(layers):
    merged = layers[0].copy()
    for layer in layers[1:]:
        for place in np.ndindex(merged.shape):
            merged[place] = max(merged[place], layer[place])
    return merged


def blur_weights(sigma, radius=None):
    """The kernel in binary64."""
    radius = math.ceil(3 * sigma) if radius is None else radius
    if radius == 0:
        return [1.0]
    weights = [exp(-0.5 * (((tap - radius) / sigma) * ((tap - radius) / sigma))) for tap in range(2 * radius + 1)]
    total = 0.0
    for weight in weights:
        total = total + weight
    return [weight / total for weight in weights]


def blur(sigma, source):
    exact = blur_weights(sigma)
    weights = [F(weight) for weight in exact]
    radius = len(weights) // 2

    def clamp(k, last):
        return min(max(k, 0), last)

    height, width = source.shape
    half, whole = source.copy(), source.copy()
    for source_, target, down in ((source, half, 0), (half, whole, 1)) if radius > 0 else ():
        for j in range(height):
            for i in range(width):
                total = F(0)
                for tap, weight in enumerate(weights):
                    k = tap - radius
                    place = (clamp(j + k, height - 1), i) if down else (j, clamp(i + k, width - 1))
                    total = total + weight * source_[place]
                target[j, i] = total
    return {"blurred": whole, "weights_float64": np.array(exact), "weights": np.array(weights, F), "horizontal": half}


def shade(image, occluded):
    out = np.empty_like(image)
    for j, i, k in np.ndindex(image.shape):
        out[j, i, k] = image[j, i, k] * (F(1) - occluded[j, i])
    return out


def frame(parameters, inputs):
    layers = [algorithm2({**parameters, "radius": r}, inputs)["occlusion"] for r in parameters["radii"]]
    merged = merge(layers)
    g = parameters["guard"]

    def crop(texture):
        return texture[g : texture.shape[0] - g, g : texture.shape[1] - g]

    blurred = crop(blur(parameters["sigma"], merged)["blurred"])
    made = {f"ao_{k + 1}": crop(layer) for k, layer in enumerate(layers)}
    shaded = shade(np.ascontiguousarray(crop(inputs["image"])), blurred)
    return {"shaded": shaded, "merged": crop(merged), "blurred": blurred, **made}


# Section 16


def projector(module):
    w, h = float(module["width"]), float(module["height"])
    s, c = sincospi(module["field_of_view"] / 360)
    focal = ((0.5 * w) * c) / s
    (sy, cy), (sp, cp), (sr, cr) = (sincospi(module[angle] / 180) for angle in ("yaw", "pitch", "roll"))
    forward = (sy * cp, sp, -(cy * cp))
    pairs = list(zip((cy, 0.0, sy), (-(sy * sp), cp, cy * sp), strict=True))
    rows = (
        [focal * (cr * r + sr * u) + (0.5 * w) * f for (r, u), f in zip(pairs, forward, strict=True)],
        [(-focal) * (cr * u - sr * r) + (0.5 * h) * f for (r, u), f in zip(pairs, forward, strict=True)],
        forward,
    )
    x, y, z = module["x"], module["y"], module["z"]
    return [number for p, q, r in rows for number in (p, q, -((p * x + q * y) + r * z))]


def fold_of(k1, k2):
    a, b = 5 * k2, 3 * k1
    found = math.inf
    if a == 0:
        found = -1 / b if b < 0 else math.inf
    elif b * b - 4 * a >= 0:
        root = math.sqrt(b * b - 4 * a)
        q = -0.5 * (b + root) if b >= 0 else -0.5 * (b - root)
        found = min([f for f in (q / a, 1 / q if q != 0 else math.inf) if f > 0], default=math.inf)
    return found if found < 3e38 else 3e38


def numbers(parameters):
    screen, g = parameters["display"], float(parameters["guard"])
    module = screen["modules"][parameters["module"]]
    rows = [list(row) for row in parameters["physical_from_world"]]
    wide, high, (w, h) = (
        float(module["width"]),
        float(module["height"]),
        (screen["screen_width"], screen["screen_height"]),
    )
    x, y, z, y_o, z_o = module["x"], module["y"], module["z"], screen["observer_height"], screen["observer_z"]
    c_u, c_v, k1, k2 = wide / 2 + g, high / 2 + g, module["k1"], module["k2"]
    curvatures = [screen["screen_curvature"], screen["observer_curvature"]]
    plain = module["field_of_view"] is None and module["homography"] is None and k1 == k2 == 0
    if plain and screen["diffuser"] == "linear" and curvatures == [0, 0]:
        a, b = wide / w, -high / h
        rows[0][3] -= x
        rows[1][3] -= y_o
        rows[0], rows[1] = [r * (a * z) for r in rows[0]], [r * (b * z_o) for r in rows[1]]
        return [*rows[0], *rows[1], *rows[2], z, z_o, c_u + a * x, c_v + b * y_o]
    if module["homography"] is not None:
        sign = -1.0 if module["homography"][8] < 0 else 1.0
        matrix = [sign * number for number in module["homography"]]
    elif module["field_of_view"] is not None:
        matrix = projector(module)
    else:
        matrix = [wide / w, 0.0, wide / 2, 0.0, -high / h, high / 2, 0.0, 0.0, 1.0]
    a, b, c, d, e, f, p, q, r = [matrix[k] + g * matrix[6 + k % 3] for k in range(6)] + matrix[6:]
    adjugate = [e * r - f * q, c * q - b * r, b * f - c * e, f * p - d * r, a * r - c * p, c * d - a * f,
                d * q - e * p, b * p - a * q, a * e - b * d]  # fmt: skip
    determinant = (a * adjugate[0] + b * adjugate[3]) + c * adjugate[6]
    conical = 1.0 if screen["diffuser"] == "conical" else 0.0
    return [
        *rows[0], *rows[1], *rows[2], x, y, z, y_o, z_o, *curvatures, conical,
        a, b, c, d, e, f, p, q, r, c_u, c_v, wide / 2, k1, k2, fold_of(k1, k2),
        *[entry / determinant for entry in adjugate],
    ]  # fmt: skip


# Section 17


def point_estimator(parameters, inputs, hemisphere=False):
    kind, m = parameters["mapping"]["kind"], binary32(parameters["mapping"]["numbers"])
    options, depth, places = parameters["options"], inputs["depth"], inputs["positions"]
    table = offsets(parameters, {"samples": inputs["points"]})
    height, width = depth.shape
    rows = range(4 if kind == "matrix" else 3)
    reach = F(parameters["radius"] * parameters["radius"]) if options["range_check"] else None

    def surface(row, column):
        if options["surface"] == "depth":
            return depth[row, column]
        z = sum_a(m, 2, *places[row, column])
        if kind != "matrix":
            return z
        q = sum_a(m, 3, *places[row, column])
        return z / q if q > 0 else F(np.inf)

    def near(row, column, point):
        if reach is None:
            return True
        dx, dy, dz = (a - b for a, b in zip(places[row, column], point, strict=True))
        return ((dx * dx + dy * dy) + dz * dz) <= reach

    def occluded(row, column, z, point):
        return depth[row, column] < np.inf and surface(row, column) < z and near(row, column, point)

    made, outside = np.zeros((height, width), F), 0
    for j, i in np.argwhere(depth < np.inf):
        point = places[j, i]
        affine, count = [sum_a(m, row, *point) for row in rows], 0
        for ox, oy, oz in table:
            t = F(1)
            if hemisphere:
                nx, ny, nz = inputs["normals"][j, i]
                t = F(-1) if (ox * nx + oy * ny) + oz * nz < 0 else F(1)
            u, v, z, answer = to_image(kind, m, [affine[row] + t * sum_l(m, row, ox, oy, oz) for row in rows])
            if answer != 0 or not (u >= 0 and u < width and v >= 0 and v < height):
                outside += 1
            elif occluded(int(v), int(u), z, point):
                count += 1
        share = F(count) / F(len(table))
        made[j, i] = F(2) * max(F(0), share - F(0.5)) if options.get("remap") else share
    return {"occlusion": made, "outside": np.array([outside])}


def log(x):
    n = 0
    while x >= 1.4142135623730951:
        x, n = x * 0.5, n + 1
    while x < 0.7071067811865476:
        x, n = x * 2, n - 1
    s = (x - 1) / (x + 1)
    t = s * s
    y = 1 / 23
    for m in range(21, 2, -2):
        y = y * t + 1 / m
    return n * 0.6931471803691238 + ((2 * s + (2 * s) * (t * y)) + n * 1.9082149292705877e-10)


def power(w, k):
    if k in (0, 1):
        return w if k == 1 else 1.0
    return exp(k * log(w)) if w > 0 else 0.0


def turn_of(i, j, rotation):
    """Sine and cosine, binary32."""
    if rotation == "none":
        return F(0), F(1)
    h = (30 * i) ^ (j + 10 * i * j) if rotation == "paper" else 10 * ((3 * i) ^ (j + i * j))
    h = (h + 2**31) % 2**32 - 2**31
    low = abs(h) * 0x7F09D5F4 + ((abs(h) * 0x7D4D3770) >> 32)
    turn = (abs(h) * 0x28BE60DB9391054A + (low % 2**64 >> 32)) % 2**64
    turn = -turn % 2**64 if h < 0 else turn
    return [F(number) for number in sincospi((turn >> 11) * 2.0**-52)]


def disk(direction, radius):
    """Two axes."""
    p, q, r = direction
    g = F(1) if r >= 0 else F(-1)
    a = F(-1) / (g + r)
    b = (p * q) * a
    axes = (F(1) + ((g * p) * p) * a, g * b, -g * p), (b, g + (q * q) * a, -q)
    return [[radius * number for number in axis] for axis in axes]


def alchemy(parameters, inputs):
    kind, m = parameters["mapping"]["kind"], binary32(parameters["mapping"]["numbers"])
    options, depth, places = parameters["options"], inputs["depth"], inputs["positions"]
    height, width = depth.shape
    taps = inputs["points"].astype(F)
    d0, d1, d2, d3 = binary32(parameters["viewer_distance"])
    epsilon = F((options["epsilon"] * parameters["radius"]) * parameters["radius"])
    scale = F(((2 * options["sigma"]) * parameters["radius"]) / len(taps))
    rows = range(4 if kind == "matrix" else 3)
    made, outside = np.zeros((height, width), F), 0
    for j, i in np.argwhere(depth < np.inf).tolist():
        x, y, z = places[j, i]
        e, f = disk(inputs["directions"][j, i], F(parameters["radius"]))
        sums = [(sum_a(m, row, x, y, z), sum_l(m, row, *e), sum_l(m, row, *f)) for row in rows]
        bias = F(options["beta"]) * max(((d0 * x + d1 * y) + d2 * z) + d3, F(0))
        sine, cosine = turn_of(i, j, options["rotation"])
        total = F(0)
        for t_x, t_y in taps:
            v_x, v_y = t_x * cosine - t_y * sine, t_x * sine + t_y * cosine
            u, v, _, answer = to_image(kind, m, [a + (v_x * along + v_y * across) for a, along, across in sums])
            if answer != 0 or not (u >= 0 and u < width and v >= 0 and v < height):
                outside += 1
                continue
            n_x, n_y, n_z = inputs["normals"][j, i]
            w_x, w_y, w_z = places[int(v), int(u)] - places[j, i]
            above = ((w_x * n_x + w_y * n_y) + w_z * n_z) - bias
            square = ((w_x * w_x + w_y * w_y) + w_z * w_z) + epsilon
            if depth[int(v), int(u)] < np.inf and above > 0 and square > 0 and square < np.inf:
                total = total + above / square
        w = F(1) - scale * total
        made[j, i] = F(1) - F(power(float(max(w, F(0))), options["k"]))
    return {"occlusion": made, "outside": np.array([outside])}


ESTIMATORS = {
    "alchemy": alchemy,
    "point": point_estimator,
    "hemisphere": lambda parameters, inputs: point_estimator(parameters, inputs, hemisphere=True),
}


def estimator(parameters, inputs):
    from kit_reader_scalable import ESTIMATORS as SCALABLE  # which themselves read this file
    from kit_reader_volumetric import ESTIMATORS as VOLUMETRIC

    return {**ESTIMATORS, **VOLUMETRIC, **SCALABLE}[parameters["estimator"]](parameters, inputs)


STAGES = {
    "elementary": lambda parameters, inputs: {"y": elementary(parameters, inputs)},
    "philox": lambda parameters, inputs: {"words": philox_stage(parameters, inputs)},
    "samples": lambda parameters, inputs: {
        "samples": samples(parameters, inputs),
        "square": np.array(square(parameters["method"], parameters["n"], int(parameters["seed"]))),
    },
    "numbers": lambda parameters, inputs: {"numbers": np.array(numbers(parameters))},
    "mapping": mapping,
    "algorithm1": algorithm1,
    "algorithm2": algorithm2,
    "merge": lambda parameters, inputs: {"merged": merge(inputs["layers"])},
    "blur": lambda parameters, inputs: blur(parameters["sigma"], inputs["source"]),
    "shade": lambda parameters, inputs: {"shaded": shade(inputs["image"], inputs["occlusion"])},
    "frame": frame,
    "estimator": estimator,
}


@np.errstate(all="ignore")
def solve(stage, parameters, inputs):
    """All outputs of a case by name."""
    return STAGES[stage](parameters, inputs)


def differing(made, expected):
    """Names of the outputs whose bits differ."""
    return [
        name
        for name, array in expected.items()
        if (made[name].dtype, made[name].shape, made[name].tobytes()) != (array.dtype, array.shape, array.tobytes())
    ]


def main(kit):
    index = json.loads((kit / "kit.json").read_text())
    assert index["format"] == 1
    for entry in index["cases"]:
        if entry["specified"]:
            stage, parameters, inputs, outputs = read_case(kit / entry["folder"])
            wrong = differing(solve(stage, parameters, inputs), outputs)
            print(f"{entry['name']}: {'differs in ' + ', '.join(wrong) if wrong else 'equal bits'}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
