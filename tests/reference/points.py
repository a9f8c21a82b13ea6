"""The part of the kit's reader on `point`, `hemisphere` and `alchemy`, by SPECIFICATION.md alone (section 17)."""

import numpy as np

from reference.elementary import F, binary32, power, turn_of
from reference.mapping import sum_a, sum_l, to_image
from reference.samples import offsets


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
