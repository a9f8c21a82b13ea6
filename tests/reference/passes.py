"""The part of the kit's reader on Algorithms 1 and 2 and what follows them, by SPECIFICATION.md alone."""

import math

import numpy as np

from reference.elementary import F, binary32, exp
from reference.mapping import sum_a, sum_l, to_image
from reference.samples import offsets

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
