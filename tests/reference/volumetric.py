"""The estimators `vo-...`, `hbao` and `oriented-hemisphere`: ESTIMATORS.md of the kit.

Each takes the parameters and inputs of a case; arithmetic is that of the depth texture's numbers.
"""

import math
from functools import partial

import numpy as np

from reference.elementary import dot, in_order, log2, sincospi
from reference.mapping import affine_row, linear_row, rounded, texel_at, to_image, turn_at, turned_row
from reference.philox import signed
from reference.points import turned_offset
from reference.samples import algorithm3


def cross(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def fractions(weights):
    total = in_order(weights)
    return [weight / total for weight in weights]


@np.errstate(invalid="ignore")
def axis_depth(depth, positions, row):
    """Depth along the axis, from a row of `cast_from_world`."""
    return np.where(depth < np.inf, affine_row(row, 0, *np.moveaxis(positions, -1, 0)), depth)


class Scene:
    """The common part of one case."""

    def __init__(self, parameters, inputs):
        depth, view = inputs["depth"], parameters["view"]
        self.dtype, self.kind = depth.dtype.type, parameters["mapping"]["kind"]
        self.m, axis = rounded(parameters["mapping"]["numbers"], self.dtype), view["cast_from_world"][2]
        self.rows = [*self.m[:8], *self.m[12:16], *rounded(axis, self.dtype)]
        self.right = np.array(rounded([row[0] for row in view["world_from_cast"]], self.dtype))
        self.options, self.positions, self.directions = parameters["options"], inputs["positions"], inputs["directions"]
        self.turns = inputs.get("turns")
        self.z = axis_depth(depth, self.positions, self.rows[12:]) if self.kind == "matrix" else depth

    def affine(self, vector):
        return np.array([affine_row(self.rows, row, *vector) for row in range(4)])

    def linear(self, vector, turn=None):
        if turn is not None:
            return np.array([turned_row(self.rows, row, *vector, *turn) for row in range(4)])
        return np.array([linear_row(self.rows, row, *vector) for row in range(4)])

    def image(self, sums):
        """u, v, something and the status of a place."""
        a, b, q, c = sums
        return to_image(self.kind, self.m, [a, b, c, q] if self.kind == "matrix" else [a, b, c])

    def texel(self, image):
        return texel_at(self.z.shape, image)

    def solve(self, value_of):
        """Occlusion and outside; ``value_of(j, i)`` gives the total and how many were outside, or None: not seen."""
        made, outside = np.zeros_like(self.z), 0
        for j, i in np.argwhere(self.z < np.inf).tolist():
            found = value_of(j, i)
            if found is not None:
                made[j, i] = found[0] if found[0] < 1 else 1
                outside += found[1]
        return made, outside


class Frame:
    def __init__(self, scene, j, i, r):
        self.scene, self.p, self.w = scene, scene.positions[j, i], scene.directions[j, i]
        sine, cosine = scene.dtype(0), scene.dtype(1)
        if scene.options["randomize"]:
            turn = sincospi(signed(scene.options["seed"], 64, 4 * (j % 4) + i % 4))
            sine, cosine = rounded(turn, scene.dtype)
        if scene.turns is not None:
            c, s = turn_at(scene.turns, j, i)
            sine, cosine = sine * c - cosine * s, cosine * c + sine * s
        a = scene.right - dot(scene.right, self.w) * self.w
        a = a * (1 / np.sqrt(dot(a, a)))
        b = cross(self.w, a)
        self.e, self.f = cosine * a + sine * b, sine * a - cosine * b
        self.deep = r * linear_row(scene.rows, 3, *self.w)
        self.steep = 1 / self.deep
        self.sums = scene.affine(self.p), r * scene.linear(self.e), r * scene.linear(self.f)

    def place(self, x, y):
        here, along, across = self.sums
        return (here + x * along) + y * across

    def slopes(self, n):
        t = -dot(n, self.w)
        t = t if t > 2.0**-20 else self.scene.dtype(2.0**-20)
        return dot(n, self.e) / t, dot(n, self.f) / t


def two_radii(parameters, scene, value_of, longest=math.inf):
    """Occlusion and outside of one radius or two: ``value_of(R, T, j, i)`` is that of a texel, see ``Scene.solve``."""
    options, dtype = parameters["options"], scene.dtype

    def at(radius):
        thickness = options["thickness"] / radius if options["thickness"] > 0 and radius > 0 else math.inf
        return scene.solve(partial(value_of, dtype(radius), dtype(min(thickness, longest))))

    one, outside = at(parameters["radius"])
    if options["second"] != 0:
        two, more = at(options["second"] * parameters["radius"])
        one = one + two * (1 - one) if options["combine"] == "product" else np.maximum(one, two)
        outside += more
    return one, outside


def mirror_of(scene, j, i):
    if not scene.options["randomize"]:
        return rounded([0, 0, 0], scene.dtype)
    seed, k = scene.options["seed"], 4 * (j % 4) + i % 4
    return rounded(algorithm3(signed(seed, 65, k), signed(seed, 66, k)), scene.dtype)


def points(parameters, inputs, normal):
    scene = Scene(parameters, inputs)
    dtype, table = scene.dtype, inputs["points"].astype(scene.dtype)
    weights = inputs["weights"].tolist() if "weights" in inputs else [1.0] * len(table)
    samples = list(zip(table, rounded(fractions(weights), dtype), strict=True))

    def value_of(r, t, j, i):
        n = inputs["normals"][j, i] if normal else np.zeros(3, dtype)
        m = mirror_of(scene, j, i)
        reach = (t * r) * linear_row(scene.rows, 3, *scene.directions[j, i]) if t < np.inf else np.inf
        twice = dot(m, n) + dot(m, n)
        here = scene.affine(scene.positions[j, i])
        mirrored, lifted = (r + r) * scene.linear(m), (r + r) * scene.linear(n)
        total, outside = dtype(0), 0
        turn = turn_at(scene.turns, j, i)
        for point, fraction in samples:
            o, sums = turned_offset(point, turn), scene.linear(point, turn)
            mirror = dot(o, m)
            above = dot(o, n) - mirror * twice
            lift = above if above < 0 else dtype(0)
            place = ((here + r * sums) - mirror * mirrored) - lift * lifted
            q = scene.texel(scene.image(place))
            if q is None:
                outside += 1
                continue
            before = place[3] - scene.z[q]
            if before > 0 and before <= reach:
                total = total + fraction
        return total, outside

    return two_radii(parameters, scene, value_of)


def disk_lines(inputs, normal, dtype):
    """(x, y, half, unit, area) of each line, the area binary64, the others rounded."""
    places = inputs["points"].tolist()
    halves = [math.sqrt(max(1 - (x * x + y * y), 0)) for x, y in places]
    weights = inputs["weights"].tolist() if "weights" in inputs else halves
    if any(half > 0 for half in halves):
        made = fractions([weight if half > 0 else 0.0 for weight, half in zip(weights, halves, strict=True)])
        by_length = [fraction / (2 * half) if half > 0 else 0.0 for fraction, half in zip(made, halves, strict=True)]
        areas = [max(area, 2.0**-100) for area in fractions(by_length)]
    else:
        by_length, areas = [0.0] * len(places), [1 / len(places)] * len(places)
    rows = zip(places, halves, by_length, areas, strict=True)
    return [(*rounded([x, y, half, 2 * unit if normal else unit], dtype), area) for (x, y), half, unit, area in rows]


def disk_estimator(parameters, inputs, normal, length_of, start, longest=math.inf):
    """Lines and areas: ``length_of(frame, started, line, top, t, place, image, texel)`` is weighed and added."""
    scene = Scene(parameters, inputs)
    dtype, table = scene.dtype, disk_lines(inputs, normal, scene.dtype)

    def value_of(r, t, j, i):
        frame = Frame(scene, j, i, r)
        if not frame.deep > 0:
            return None
        slope_1, slope_2 = frame.slopes(inputs["normals"][j, i]) if normal else (None, None)
        started, total, outside = start(frame), dtype(0), 0
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
        return total if total > 0 else dtype(0), outside

    return two_radii(parameters, scene, value_of, longest)


def lines(parameters, inputs, normal):
    def length_of(frame, started, line, top, t, place, image, texel):
        _, _, half, unit, _ = line
        d = (frame.scene.z[texel] - place[3]) * frame.steep
        back = d + t
        back = back if back < top else top
        front = -half if d < -half else d
        return unit * (back - front) if back - front > 0 else 0

    return disk_estimator(parameters, inputs, normal, length_of, lambda frame: None)


def pyramid(z, prefilter):
    """Levels, each a dict from (row, column); what is not in it is beyond the border."""
    height, width = z.shape
    nothing = 0.0, 0.0, 0.0
    levels = [{(j, i): (1.0, d, d * d) if d < math.inf else nothing
               for j, row in enumerate(z.tolist()) for i, d in enumerate(row)}]  # fmt: skip
    taps = (0.125, 0.375, 0.375, 0.125) if prefilter else (0.0, 0.5, 0.5, 0.0)
    while max(height, width) > 1:
        height, width, finer = (height + 1) // 2, (width + 1) // 2, levels[-1]

        def half(j, i, number, finer=finer):
            total = 0.0
            for q in range(4):
                a, b, c, d = (finer.get((2 * j - 1 + q, 2 * i - 1 + k), nothing)[number] for k in range(4))
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
    """Filled fraction, low and high; 0 where there is nothing."""
    level, dtype = min(max(level, 0.0), len(levels) - 1.0), frame.scene.dtype
    whole, part = int(level), level - int(level)
    filled, first, second = look(levels, whole, *image[:2])
    if part > 0:
        coarse = look(levels, whole + 1, *image[:2])
        filled, first, second = (a + part * (b - a) for a, b in zip((filled, first, second), coarse, strict=True))
    if not filled > 0:
        return 0, None, None
    mean = first / filled
    variance = second / filled - mean * mean
    sigma = math.sqrt(variance) if variance > 0 else 0.0
    middle, reach = (mean - float(depth)) * float(frame.steep), (half_width * sigma) * float(frame.steep)
    low, high = middle - reach, middle + reach
    if math.isnan(low) or math.isnan(high):
        return 0, None, None
    return filled, *(dtype(min(max(edge, -(2.0**100)), 2.0**100)) for edge in (low, high))


def hidden(low, high, bottom, top):
    start, end = (bottom if edge < bottom else edge for edge in (low, high))
    start, end = (edge if edge < top else top for edge in (start, end))

    def behind(t):
        if t <= low:
            return 0
        return (t - low) / (high - low) if t < high else 1

    return (top - end) + (end - start) * (type(low)(0.5) * (behind(start) + behind(end)))


def areas(parameters, inputs, normal):
    options, dtype = parameters["options"], inputs["depth"].dtype.type
    levels = pyramid(Scene(parameters, inputs).z, options["prefilter"])

    def detail_of(frame):
        images = [frame.scene.image(frame.place(dtype(x), dtype(y))) for x, y in ((0, 0), (1, 0), (0, 1))]
        if any(status != 0 for *_, status in images):
            return dtype(512)
        (u_0, v_0), (u_1, v_1), (u_2, v_2) = (image[:2] for image in images)
        parallelogram = (u_1 - u_0) * (v_2 - v_0) - (v_1 - v_0) * (u_2 - u_0)
        return dtype(0.5 * log2(3.141592653589793 * abs(float(parallelogram))))

    def length_of(frame, detail, line, top, t, place, image, texel):
        _, _, half, unit, area = line
        level = float(detail) + 0.5 * log2(area)
        filled, low, high = surface_box(levels, frame, level, image, place[3], options["half_width"])
        if not filled > 0 or not top > -half:
            return 0
        length = hidden(low, high, -half, top) - hidden(low + t, high + t, -half, top)
        return (unit * dtype(filled)) * length

    return disk_estimator(parameters, inputs, normal, length_of, detail_of, 2.0**102)


def hbao(parameters, inputs):
    scene, options = Scene(parameters, inputs), parameters["options"]
    dtype, count, steps = scene.dtype, options["directions"], options["steps"]
    around = [rounded(sincospi((2 * s + 1) / count), dtype) for s in range(count)]
    sine_bias, cosine_bias = rounded(sincospi(options["bias"] / 180), dtype)
    linear, quadratic = (dtype(options["attenuation"] == name) for name in ("linear", "quadratic"))
    r = dtype(parameters["radius"])

    def first_horizon(tau):
        cosine = 1 / np.sqrt(1 + tau * tau)
        sine = -tau * cosine
        horizon = sine * cosine_bias + cosine * sine_bias
        return horizon if cosine * cosine_bias - sine * sine_bias > 0 else dtype(1)

    def march(frame, horizon, start, way, total):
        """The total with a direction's part, and how many of its steps are outside."""
        outside = 0
        for step in range(1, steps + 1):
            part = dtype(step) / dtype(steps)
            texel = scene.texel((start[0] + part * way[0], start[1] + part * way[1], None, 0))
            if texel is None:
                outside += 1
                continue
            d = scene.positions[texel] - frame.p
            length = np.sqrt(dot(d, d))
            up, rho = -dot(d, frame.w) / length, length / r
            if rho < 1 and up > horizon:
                total = total + (1 - (linear * rho + quadratic * (rho * rho))) * (up - horizon)
                horizon = up
        return total, outside

    def value_of(j, i):
        frame = Frame(scene, j, i, r)
        if not frame.deep > 0:
            return None
        slope_1, slope_2 = frame.slopes(inputs["normals"][j, i])
        start, total, outside = (dtype(i) + dtype(0.5), dtype(j) + dtype(0.5)), dtype(0), 0
        for y, x in around:
            u, v, _, status = scene.image(frame.place(x, y))
            if status != 0:
                outside += steps
                continue
            horizon = first_horizon(x * slope_1 + y * slope_2)
            total, lost = march(frame, horizon, start, (u - start[0], v - start[1]), total)
            outside += lost
        return total / dtype(count), outside

    return scene.solve(value_of)


def oriented_hemisphere(parameters, inputs):
    scene, view, options = Scene(parameters, inputs), parameters["view"], parameters["options"]
    dtype, (a, b, c, _) = scene.dtype, view["cast_from_world"][2]
    far = parameters["radius"] * math.sqrt((a * a + b * b) + c * c)
    r, reach, bias = rounded([parameters["radius"], far, options["bias"] * far], dtype)
    up, table = np.array(rounded([row[1] for row in view["world_from_cast"]], dtype)), inputs["points"].astype(dtype)

    def weight(z, z_q):
        d = abs(z - z_q)
        if options["range_check"] == "none":
            return dtype(1)
        if options["range_check"] == "distance":
            return dtype(d < reach)
        x = reach / d if d > reach else dtype(1)
        return (x * x) * (3 - (x + x))

    def value_of(j, i):
        n, (c, s) = inputs["normals"][j, i], (1, 0) if scene.turns is None else turn_at(scene.turns, j, i)
        side = c * scene.right + s * up
        t = side - dot(n, side) * n
        t = t * (1 / np.sqrt(dot(t, t)))
        here, axes = scene.affine(scene.positions[j, i]), [r * scene.linear(axis) for axis in (t, cross(n, t), n)]
        total, outside = dtype(0), 0
        for x, y, z in table:
            place = ((here + x * axes[0]) + y * axes[1]) + abs(z) * axes[2]
            q = scene.texel(scene.image(place))
            outside += q is None
            if q is None:
                continue
            if scene.z[q] == np.inf:
                total = total + dtype(options["background"] == "occludes" and options["range_check"] == "none")
            elif place[3] - scene.z[q] >= bias:
                total = total + weight(here[3], scene.z[q])
        return total / dtype(len(table)), outside

    return scene.solve(value_of)
