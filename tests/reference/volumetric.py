"""The part of the kit's reader on the estimators `vo-...` and `hbao`, by SPECIFICATION.md alone (section 17)."""

import math

import numpy as np

from reference.elementary import F, binary32, sincospi, word
from reference.mapping import sum_a, sum_l, to_image


def dot(a, b):
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]


def cross(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def signed(seed, stream, index):
    return (word(seed, stream, index) + 0.5) / 2147483648 - 1


def shares(weights):
    total = 0.0
    for weight in weights:
        total = total + weight
    return [weight / total for weight in weights]


def log2(x):
    if math.isnan(x) or x == math.inf:
        return 1024.0
    x, k = max(x, 2.0**-1022), 0
    while x >= 2:
        x, k = x * 0.5, k + 1
    while x < 1:
        x, k = x * 2, k - 1
    if x > 1.4142135623730951:
        x, k = x * 0.5, k + 1
    s = (x - 1) / (x + 1)
    t = s * s
    y = 1 / 21
    for n in range(19, 2, -2):
        y = y * t + 1 / n
    return k + 2.8853900817779268 * ((y * t) * s + s)


class Scene:
    """What the parts share, of one case."""

    def __init__(self, parameters, inputs):
        self.kind, self.m = parameters["mapping"]["kind"], binary32(parameters["mapping"]["numbers"])
        view = parameters["view"]
        self.rows = [*self.m[:8], *self.m[12:16], *binary32(view["cast_from_world"][2])]
        self.right = np.array(binary32([row[0] for row in view["world_from_cast"]]))
        self.options, self.inputs = parameters["options"], inputs
        self.positions, self.directions = inputs["positions"], inputs["directions"]
        self.z = inputs["depth"].copy()
        self.height, self.width = self.z.shape
        if self.kind == "matrix":
            for j, i in np.argwhere(self.z < np.inf):
                self.z[j, i] = sum_a(self.rows, 3, *self.positions[j, i])

    def affine(self, vector):
        return np.array([sum_a(self.rows, row, *vector) for row in range(4)])

    def linear(self, vector):
        return np.array([sum_l(self.rows, row, *vector) for row in range(4)])

    def image(self, sums):
        """u and v, None where the answer is not 0."""
        a, b, q, c = sums
        u, v, _, answer = to_image(self.kind, self.m, [a, b, c, q] if self.kind == "matrix" else [a, b, c])
        return (u, v) if answer == 0 else None

    def texel(self, image):
        """Row and column of the texel, None where a place is outside."""
        if image is None or not (image[0] >= 0 and image[0] < self.width and image[1] >= 0 and image[1] < self.height):
            return None
        return int(image[1]), int(image[0])

    def solve(self, value_of):
        """Occlusion and outside; ``value_of(j, i)`` gives the total and how many were outside, or None: not seen."""
        made, outside = np.zeros((self.height, self.width), F), 0
        for j, i in np.ndindex(made.shape):
            found = value_of(j, i) if self.z[j, i] < np.inf else None
            if found is not None:
                made[j, i] = found[0] if found[0] < 1 else F(1)
                outside += found[1]
        return made, outside


class Frame:
    """The frame of a texel."""

    def __init__(self, scene, j, i, r):
        self.scene, self.p, self.w = scene, scene.positions[j, i], scene.directions[j, i]
        sine, cosine = F(0), F(1)
        if scene.options["randomize"]:
            sine, cosine = binary32(sincospi(signed(scene.options["seed"], 64, 4 * (j % 4) + i % 4)))
        a = scene.right - dot(scene.right, self.w) * self.w
        a = a * (F(1) / np.sqrt(dot(a, a)))
        b = cross(self.w, a)
        self.e, self.f = cosine * a + sine * b, sine * a - cosine * b
        self.deep = r * sum_l(scene.rows, 3, *self.w)
        self.steep = F(1) / self.deep
        self.sums = scene.affine(self.p), r * scene.linear(self.e), r * scene.linear(self.f)

    def place(self, x, y):
        here, along, across = self.sums
        return (here + x * along) + y * across

    def slopes(self, n):
        t = -dot(n, self.w)
        t = t if t > 2.0**-20 else F(2.0**-20)
        return dot(n, self.e) / t, dot(n, self.f) / t


def two_radii(parameters, once):
    """``once(R, T)`` gives occlusion and outside; T is binary64."""
    options = parameters["options"]

    def at(radius):
        return once(radius, options["thickness"] / radius if options["thickness"] > 0 and radius > 0 else math.inf)

    one, outside = at(parameters["radius"])
    if options["second"] != 0:
        two, more = at(options["second"] * parameters["radius"])
        one = one + two * (F(1) - one) if options["combine"] == "product" else np.maximum(one, two)
        outside += more
    return {"occlusion": one, "outside": np.array([outside])}


def mirror_of(options, k):
    if not options["randomize"]:
        return [F(0)] * 3
    z = signed(options["seed"], 65, k)
    sine, cosine = sincospi(signed(options["seed"], 66, k))
    h = math.sqrt(max(1 - z * z, 0))
    return binary32([h * cosine, h * sine, z])


def points(parameters, inputs, normal):
    scene = Scene(parameters, inputs)
    table = inputs["points"].astype(F)
    weights = binary32(shares(inputs["weights"].tolist() if "weights" in inputs else [1.0] * len(table)))
    moved = [scene.linear(o) for o in table]

    def once(radius, thickness):
        r, t = F(radius), F(thickness)

        def value_of(j, i):
            n = inputs["normals"][j, i] if normal else np.zeros(3, F)
            m = mirror_of(scene.options, 4 * (j % 4) + i % 4)
            reach = (t * r) * sum_l(scene.rows, 3, *scene.directions[j, i]) if t < np.inf else F(np.inf)
            twice = dot(m, n) + dot(m, n)
            here, mirrored, lifted = (
                scene.affine(scene.positions[j, i]), (r + r) * scene.linear(m), (r + r) * scene.linear(n)
            )  # fmt: skip
            total, outside = F(0), 0
            for o, share, sums in zip(table, weights, moved, strict=True):
                mirror = dot(o, m)
                above = dot(o, n) - mirror * twice
                lift = above if above < 0 else F(0)
                place = ((here + r * sums) - mirror * mirrored) - lift * lifted
                q = scene.texel(scene.image(place))
                if q is None:
                    outside += 1
                    continue
                before = place[3] - scene.z[q]
                if before > 0 and before <= reach:
                    total = total + share
            return total, outside

        return scene.solve(value_of)

    return two_radii(parameters, once)


def disk_lines(inputs, normal):
    """(x, y, half, unit, area) of each line, the area binary64, the others binary32."""
    places = inputs["points"].tolist()
    halves = [math.sqrt(max(1 - (x * x + y * y), 0)) for x, y in places]
    weights = inputs["weights"].tolist() if "weights" in inputs else halves
    if any(half > 0 for half in halves):
        made = shares([weight if half > 0 else 0.0 for weight, half in zip(weights, halves, strict=True)])
        by_length = [share / (2 * half) if half > 0 else 0.0 for share, half in zip(made, halves, strict=True)]
        areas = [max(area, 2.0**-100) for area in shares(by_length)]
    else:
        by_length, areas = [0.0] * len(places), [1 / len(places)] * len(places)
    units = [2 * length if normal else length for length in by_length]
    rows = zip(places, halves, units, areas, strict=True)
    return [(F(x), F(y), F(half), F(unit), area) for (x, y), half, unit, area in rows]


def disk_estimator(parameters, inputs, normal, length_of, start, longest=math.inf):
    """Of lines and areas: ``length_of(frame, started, line, top, t, place, image, texel)`` is weighed and added."""
    scene, table = Scene(parameters, inputs), disk_lines(inputs, normal)

    def once(radius, thickness):
        r, t = F(radius), F(min(thickness, longest))

        def value_of(j, i):
            frame = Frame(scene, j, i, r)
            if not frame.deep > 0:
                return None
            slope_1, slope_2 = frame.slopes(inputs["normals"][j, i]) if normal else (None, None)
            started, total, outside = start(frame), F(0), 0
            for line in table:
                x, y, half, *_ = line
                place = frame.place(x, y)
                image = scene.image(place)
                texel = scene.texel(image)
                if texel is None:
                    outside += 1
                    continue
                plane = x * slope_1 + y * slope_2 if normal else half
                top = plane if plane < half else half
                total = total + length_of(frame, started, line, top, t, place, image, texel)
            return total if total > 0 else F(0), outside

        return scene.solve(value_of)

    return two_radii(parameters, once)


def lines(parameters, inputs, normal):
    def length_of(frame, started, line, top, t, place, image, texel):
        _, _, half, unit, _ = line
        d = (frame.scene.z[texel] - place[3]) * frame.steep
        back = d + t
        back = back if back < top else top
        front = -half if d < -half else d
        return unit * (back - front) if back - front > 0 else F(0)

    return disk_estimator(parameters, inputs, normal, length_of, lambda frame: None)


def pyramid(z, prefilter):
    """Levels, each a dict from (row, column); what is not in it is beyond the border."""
    height, width = z.shape
    levels = [{(j, i): (1.0, d, d * d) if d < math.inf else (0.0,) * 3
               for j, row in enumerate(z.tolist()) for i, d in enumerate(row)}]  # fmt: skip
    taps = (0.125, 0.375, 0.375, 0.125) if prefilter else (0.0, 0.5, 0.5, 0.0)
    while max(height, width) > 1:
        height, width, finer = (height + 1) // 2, (width + 1) // 2, levels[-1]

        def half(j, i, number, finer=finer):
            total = 0.0
            for q in range(4):
                a, b, c, d = (finer.get((2 * j - 1 + q, 2 * i - 1 + k), (0.0,) * 3)[number] for k in range(4))
                total = total + taps[q] * (((taps[0] * a + taps[1] * b) + taps[2] * c) + taps[3] * d)
            return total

        levels.append({place: tuple(half(*place, number) for number in range(3))
                       for place in np.ndindex(height, width)})  # fmt: skip
    return levels


def look(levels, level, u, v):
    x, y = float(u) * 2.0**-level + 0.5, float(v) * 2.0**-level + 0.5
    i, j = int(x), int(y)
    f, g = x - i, y - j
    corners = [levels[level].get((j - 1 + row, i - 1 + k), (0.0,) * 3) for row in (0, 1) for k in (0, 1)]

    def between(a, b, c, d):
        upper, lower = a + f * (b - a), c + f * (d - c)
        return upper + g * (lower - upper)

    return [between(*numbers) for numbers in zip(*corners, strict=True)]


def surface_box(levels, frame, level, image, depth, half_width):
    """Share, low and high; share 0 where there is nothing."""
    level = min(max(level, 0.0), len(levels) - 1.0)
    whole, part = int(level), level - int(level)
    share, first, second = look(levels, whole, *image)
    if part > 0:
        coarse = look(levels, whole + 1, *image)
        share, first, second = (a + part * (b - a) for a, b in zip((share, first, second), coarse, strict=True))
    if not share > 0:
        return F(0), None, None
    mean = first / share
    variance = second / share - mean * mean
    sigma = math.sqrt(variance) if variance > 0 else 0.0
    middle, reach = (mean - float(depth)) * float(frame.steep), (half_width * sigma) * float(frame.steep)
    edges = middle - reach, middle + reach
    if math.isnan(edges[0]) or math.isnan(edges[1]):
        return F(0), None, None
    return share, *(F(min(max(edge, -(2.0**100)), 2.0**100)) for edge in edges)


def hidden(low, high, bottom, top):
    start, end = (bottom if edge < bottom else edge for edge in (low, high))
    start, end = (edge if edge < top else top for edge in (start, end))

    def behind(t):
        if t <= low:
            return F(0)
        return (t - low) / (high - low) if t < high else F(1)

    return (top - end) + (end - start) * (F(0.5) * (behind(start) + behind(end)))


def areas(parameters, inputs, normal):
    options = parameters["options"]
    levels = pyramid(Scene(parameters, inputs).z, options["prefilter"])

    def detail_of(frame):
        images = [frame.scene.image(frame.place(F(x), F(y))) for x, y in ((0, 0), (1, 0), (0, 1))]
        if None in images:
            return F(512)
        (u_0, v_0), (u_1, v_1), (u_2, v_2) = images
        parallelogram = (u_1 - u_0) * (v_2 - v_0) - (v_1 - v_0) * (u_2 - u_0)
        return F(0.5 * log2(3.141592653589793 * abs(float(parallelogram))))

    def length_of(frame, detail, line, top, t, place, image, texel):
        _, _, half, unit, area = line
        level = float(detail) + 0.5 * log2(area)
        share, low, high = surface_box(levels, frame, level, image, place[3], options["half_width"])
        if not share > 0 or not top > -half:
            return F(0)
        length = hidden(low, high, -half, top) - hidden(low + t, high + t, -half, top)
        return (unit * F(share)) * length

    return disk_estimator(parameters, inputs, normal, length_of, detail_of, 2.0**102)


def hbao(parameters, inputs):
    scene, options = Scene(parameters, inputs), parameters["options"]
    r, count, steps = F(parameters["radius"]), options["directions"], options["steps"]
    around = [binary32(sincospi((2 * s + 1) / count)) for s in range(count)]
    sine_bias, cosine_bias = binary32(sincospi(options["bias"] / 180))
    linear, quadratic = (F(options["attenuation"] == name) for name in ("linear", "quadratic"))
    one, half = F(1), F(0.5)

    def first_horizon(tau):
        cosine = one / np.sqrt(one + tau * tau)
        sine = -tau * cosine
        horizon = sine * cosine_bias + cosine * sine_bias
        return horizon if cosine * cosine_bias - sine * sine_bias > 0 else one

    def march(frame, horizon, start, way):
        """What a direction adds to the total so far, as a list of summands; how many steps are outside."""
        added, outside = [], 0
        for step in range(1, steps + 1):
            part = F(step) / F(steps)
            texel = scene.texel((start[0] + part * way[0], start[1] + part * way[1]))
            if texel is None:
                outside += 1
                continue
            d = scene.positions[texel] - frame.p
            length = np.sqrt(dot(d, d))
            up, rho = -dot(d, frame.w) / length, length / r
            if rho < 1 and up > horizon:
                added.append((one - (linear * rho + quadratic * (rho * rho))) * (up - horizon))
                horizon = up
        return added, outside

    def value_of(j, i):
        frame = Frame(scene, j, i, r)
        if not frame.deep > 0:
            return None
        slope_1, slope_2 = frame.slopes(inputs["normals"][j, i])
        start, total, outside = (F(i) + half, F(j) + half), F(0), 0
        for y, x in around:
            image = scene.image(frame.place(x, y))
            if image is None:
                outside += steps
                continue
            horizon = first_horizon(x * slope_1 + y * slope_2)
            added, lost = march(frame, horizon, start, (image[0] - start[0], image[1] - start[1]))
            for summand in added:
                total = total + summand
            outside += lost
        return total / F(count), outside

    made, outside = scene.solve(value_of)
    return {"occlusion": made, "outside": np.array([outside])}


def _pair(name, function):
    return {
        name: lambda parameters, inputs: function(parameters, inputs, False),
        f"{name}-normal": lambda parameters, inputs: function(parameters, inputs, True),
    }


ESTIMATORS = {**_pair("vo-points", points), **_pair("vo-lines", lines), **_pair("vo-area", areas), "hbao": hbao}
