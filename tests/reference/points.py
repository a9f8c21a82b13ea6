"""The estimators `point`, `hemisphere` and `alchemy`: ESTIMATORS.md of the kit.

Each takes the parameters and inputs of a case; arithmetic is that of the depth texture's numbers.
"""

import numpy as np

from reference.elementary import dot, power
from reference.mapping import (
    affine_row,
    affine_rows,
    images,
    linear_rows,
    offsets,
    rounded,
    texel_at,
    to_image,
    turn_at,
)


def point(parameters, inputs, hemisphere=False):
    depth, positions, options = inputs["depth"], inputs["positions"], parameters["options"]
    dtype, kind, radius = depth.dtype.type, parameters["mapping"]["kind"], parameters["radius"]
    m, table = rounded(parameters["mapping"]["numbers"], dtype), offsets(radius, inputs["points"], dtype)
    reach = dtype(radius * radius) if options["range_check"] else None

    def surface(texel):
        if options["surface"] == "depth":
            return depth[texel]
        z = affine_row(m, 2, *positions[texel])
        if kind != "matrix":
            return z
        q = affine_row(m, 3, *positions[texel])
        return z / q if q > 0 else dtype(np.inf)

    def occluded(texel, z, here):
        if not depth[texel] < np.inf:
            return options["background"] == "occludes" and reach is None
        if not surface(texel) < z:
            return False
        d = positions[texel] - here
        return reach is None or dot(d, d) <= reach

    made, outside = np.zeros_like(depth), 0
    for j, i in np.argwhere(depth < np.inf).tolist():
        here = positions[j, i]
        turn, samples, count = turn_at(inputs.get("turns"), j, i), [], 0
        for offset in table:
            below = hemisphere and dot(turned_offset(offset, turn), inputs["normals"][j, i]) < 0
            samples.append([dtype(-1 if below else 1) * row for row in linear_rows(kind, m, offset, turn)])
        for image in images(kind, m, here, samples):
            texel = texel_at(depth.shape, image)
            if texel is None:
                outside += 1
            else:
                count += occluded(texel, image[2], here)
        fraction = dtype(count) / dtype(len(table))
        made[j, i] = 2 * max(dtype(0), fraction - dtype(0.5)) if options.get("remap") else fraction
    return made, outside


def turned_offset(offset, turn):
    if turn is None:
        return offset
    (x, y, z), (cosine, sine) = offset, turn
    return x * cosine - y * sine, x * sine + y * cosine, z


def axes_across(direction):
    """Two unit axes at right angles to a unit direction."""
    p, q, r = direction
    g = type(r)(1) if r >= 0 else -type(r)(1)
    a = -1 / (g + r)
    b = (p * q) * a
    return (1 + ((g * p) * p) * a, g * b, -g * p), (b, g + (q * q) * a, -q)


def alchemy(parameters, inputs):
    depth, positions, options = inputs["depth"], inputs["positions"], parameters["options"]
    dtype, kind, radius = depth.dtype.type, parameters["mapping"]["kind"], parameters["radius"]
    m, taps = rounded(parameters["mapping"]["numbers"], dtype), [rounded(tap, dtype) for tap in inputs["points"]]
    distance, r, beta = rounded(parameters["viewer_distance"], dtype), dtype(radius), dtype(options["beta"])
    epsilon = dtype((options["epsilon"] * radius) * radius)
    scale = dtype(((2 * options["sigma"]) * radius) / len(taps))
    made, outside = np.zeros_like(depth), 0
    for j, i in np.argwhere(depth < np.inf).tolist():
        here, normal = positions[j, i], inputs["normals"][j, i]
        e, f = ([r * number for number in axis] for axis in axes_across(inputs["directions"][j, i]))
        sums = [affine_rows(kind, m, here), linear_rows(kind, m, e), linear_rows(kind, m, f)]
        bias = beta * max(affine_row(distance, 0, *here), dtype(0))
        cosine, sine = turn_at(inputs.get("turns"), j, i) if "turns" in inputs else (dtype(1), dtype(0))
        total = dtype(0)
        for t_x, t_y in taps:
            v_x, v_y = t_x * cosine - t_y * sine, t_x * sine + t_y * cosine
            image = to_image(kind, m, [a + (v_x * b + v_y * c) for a, b, c in zip(*sums, strict=True)])
            texel = texel_at(depth.shape, image)
            if texel is None:
                outside += 1
                continue
            away = positions[texel] - here
            above, square = dot(away, normal) - bias, dot(away, away) + epsilon
            if depth[texel] < np.inf and above > 0 and square > 0 and square < np.inf:
                total = total + above / square
        w = 1 - scale * total
        made[j, i] = 1 - dtype(power(float(w if w > 0 else 0), options["k"]))
    return made, outside
