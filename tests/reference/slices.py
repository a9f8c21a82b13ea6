"""The estimators by slices: ESTIMATORS.md of the kit."""

import numpy as np

from reference.elementary import acos, dot, power, sincospi
from reference.mapping import rounded
from reference.volumetric import Frame, Scene


class Slices:
    """The common part."""

    def __init__(self, parameters, inputs):
        self.scene, self.options, self.normals = Scene(parameters, inputs), parameters["options"], inputs["normals"]
        self.dtype = dtype = self.scene.dtype
        self.count, self.steps, self.r = self.options["slices"], self.options["steps"], dtype(parameters["radius"])
        self.sides = []
        for k in range(self.count):
            y, x = rounded(sincospi((2 * k + 1) / (2 * self.count)), dtype)
            self.sides += [(x, y), (-x, -y)]
        start, jitter = self.options["start"], self.options["jitter"]
        self.first, self.quarter = dtype(start / 4 if jitter else start), dtype(0.25 if jitter else 0)
        self.squared = self.options["distribution"] == "squared"

    def held(self, x, low, high):
        x = x if x > low else self.dtype(low)
        return x if x < high else self.dtype(high)

    def normal(self, frame, j, i):
        n = self.normals[j, i]
        towards = -dot(n, frame.w)
        return dot(n, frame.e), dot(n, frame.f), towards if towards > 2.0**-20 else self.dtype(2.0**-20)

    def seen(self, frame, side, j, i):
        """Texels that the steps of a side see, and how many are outside."""
        u, v, _, status = self.scene.image(frame.place(*side))
        if status != 0:
            return [], self.steps
        texels, dtype = [], self.dtype
        start = dtype(i) + dtype(0.5), dtype(j) + dtype(0.5)
        for k in range(1, self.steps + 1):
            q = ((dtype(k) - 1) + (self.first + self.quarter * dtype((i + 3 * j) % 4))) / dtype(self.steps)
            part = q * (dtype(not self.squared) + dtype(self.squared) * q)
            at = start[0] + part * (u - start[0]), start[1] + part * (v - start[1])
            texels.append(self.scene.texel((*at, None, 0)))
        there = [texel for texel in texels if texel is not None]
        return [texel for texel in there if texel != (j, i)], self.steps - len(there)

    def angle(self, c):
        if self.options["acos"] == "exact":
            return self.dtype(acos(float(c)))
        size = abs(c)
        near = np.sqrt(self.held(1 - size, 0, 2)) * (self.dtype(1.5707963267948966) + self.dtype(-0.156583) * size)
        return self.dtype(3.141592653589793) - near if c < 0 else near

    def occlusion(self, visibility):
        return 1 - self.dtype(power(float(self.held(visibility, 0, 1)), self.options["power"]))

    def solve(self, total_of):
        """Occlusion and outside; ``total_of`` gives a texel's visibility of its frame, row and column, and outside."""

        def value_of(j, i):
            if not self.r > 0:
                return None
            made, outside = total_of(Frame(self.scene, j, i, self.r), j, i)
            return self.occlusion(made), outside

        return self.scene.solve(value_of)


def gtao(parameters, inputs):
    slices, options = Slices(parameters, inputs), parameters["options"]
    dtype, falloff, cosine = slices.dtype, options["falloff"], options["weighting"] == "cosine"
    slope = dtype(1 / falloff if falloff > 2.0**-40 else 2.0**40)
    stretch = dtype((1 + options["thin"]) ** 2 - 1)

    def horizon_of(frame, low, texels):
        horizon = low
        for texel in texels:
            d = slices.scene.positions[texel] - frame.p
            along, square = dot(d, frame.w), dot(d, d)
            c = -along / np.sqrt(square)
            rho = np.sqrt(square + stretch * (along * along)) / slices.r
            weight = (1 - rho) * slope
            if weight < 1:
                c = low + weight * (c - low)
            if rho < 1 and c > horizon:
                horizon = c
        return slices.held(horizon, -1, 1)

    def total_of(frame, j, i):
        e, f, v = slices.normal(frame, j, i)
        total, outside = dtype(0), 0
        for x, y in slices.sides:
            t = x * e + y * f
            texels, lost = slices.seen(frame, (x, y), j, i)
            c = horizon_of(frame, -t / np.sqrt(v * v + t * t), texels)
            square = slices.held(1 - c * c, 0, 2)
            weighted = dtype(0.5) * (square * v + (slices.angle(c) - c * np.sqrt(square)) * t)
            total, outside = total + (weighted if cosine else dtype(0.5) - dtype(0.5) * c), outside + lost
        return total / dtype(slices.count), outside

    return slices.solve(total_of)


def visibility_bitmask(parameters, inputs):
    slices, options = Slices(parameters, inputs), parameters["options"]
    dtype, uniform, touched = slices.dtype, options["weighting"] == "uniform", options["rule"] == "touched"
    count, thick = dtype(options["sectors"]), dtype(options["thickness"] * parameters["radius"])
    half = dtype(0.5)

    def part_of(c, cn, sn):
        if uniform:
            made = (slices.angle(slices.held(c, -1, 1)) + slices.angle(slices.held(sn, -1, 1))) / dtype(np.pi)
        else:
            sine = np.sqrt(slices.held(1 - c * c, 0, np.inf))
            made = half + half * (sine * cn - c * sn) if c * cn + sine * sn > 0 else dtype(1)
        made = made if made < 1 else dtype(1)
        return made if made > 0 else dtype(0)

    def sectors_of(frame, texel, cn, sn, second):
        d = slices.scene.positions[texel] - frame.p
        b, square = d + thick * frame.w, dot(d, d)
        if not np.sqrt(square) / slices.r < 1:
            return []
        front, back = (part_of(-dot(x, frame.w) / np.sqrt(dot(x, x)), cn, sn) for x in (d, b))
        if second:
            front, back = 1 - back, 1 - front
        low, high = count * front, count * back
        first = np.floor(low if touched else low + half)
        last = first - np.floor(low - high) if touched else np.floor(high + half)
        return range(int(first), int(last if last < count else count))

    def total_of(frame, j, i):
        e, f, v = slices.normal(frame, j, i)
        total, outside, hidden = dtype(0), 0, set()
        for s, (x, y) in enumerate(slices.sides):
            t = x * e + y * f
            length = np.sqrt(v * v + t * t)
            texels, lost = slices.seen(frame, (x, y), j, i)
            hidden = hidden if s % 2 else set()
            for texel in texels:
                hidden |= set(sectors_of(frame, texel, v / length, t / length, s % 2))
            outside += lost
            if s % 2:
                total = total + (1 - dtype(len(hidden)) / count)
        return total / dtype(slices.count), outside

    return slices.solve(total_of)
