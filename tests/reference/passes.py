"""Algorithms 1 and 2 and what follows them: sections 9 to 14 of the specification.

Textures are of np.float32 or np.float64, and so is the arithmetic; other numbers come rounded to it.
"""

import math

import numpy as np

from reference.elementary import exp, in_order
from reference.mapping import affine_row, images, linear_rows, texel_at

# Sections 9 and 10


@np.errstate(all="ignore")
def occlusion(depth, point_of, offsets, kind, m):
    """Occlusion, and how often each row of texels got each status, (H, 6): 5 for a sample outside the texture."""
    made, statuses = np.zeros_like(depth), np.zeros((len(depth), 6), np.int64)
    m, linear = list(m), [linear_rows(kind, m, offset) for offset in offsets]
    for j, i in np.argwhere(depth < np.inf).tolist():
        count = 0
        for image in images(kind, m, point_of(j, i), linear):
            texel = texel_at(depth.shape, image)
            statuses[j, 5 if texel is None and image[3] == 0 else image[3]] += 1
            count += texel is not None and depth[texel] < image[2]
        made[j, i] = made.dtype.type(count) / max(len(offsets), 1)
    return made, statuses


def algorithm1(depth, offsets, screen_to_world, m):
    back = list(screen_to_world)

    def point_of(j, i):
        place = depth.dtype.type(i) + 0.5, depth.dtype.type(j) + 0.5, depth[j, i]
        x, y, z, w = (affine_row(back, row, *place) for row in range(4))
        return x / w, y / w, z / w

    return occlusion(depth, point_of, offsets, "matrix", m)


def algorithm2(depth, positions, offsets, kind, m):
    return occlusion(depth, lambda j, i: positions[j, i], offsets, kind, m)


@np.errstate(all="ignore")
def algorithm2_with_neighbours(depth, positions, offsets, views):
    """Occluded is what no view shows: occlusion, and how many samples of each row fall outside of all views.

    A view is its depth, kind and numbers; the texture's own is the first.
    """
    made, outside = np.zeros_like(depth), np.zeros(len(depth), np.int64)
    tables = [(kind, m, [linear_rows(kind, m, offset) for offset in offsets]) for _, kind, m in views]
    for j, i in np.argwhere(depth < np.inf).tolist():
        hidden = 0
        for seen in zip(*(images(kind, m, positions[j, i], rows) for kind, m, rows in tables), strict=True):
            hits = []
            for (texture, _, _), image in zip(views, seen, strict=True):
                texel = texel_at(texture.shape, image)
                if texel is not None:
                    hits.append(texture[texel] < image[2])
            hidden += bool(hits) and all(hits)
            outside[j] += not hits
        made[j, i] = made.dtype.type(hidden) / max(len(offsets), 1)
    return made, outside


# Sections 11 to 14


def merge(layers):
    merged = layers[0].copy()
    for layer in layers[1:]:
        for place in np.ndindex(merged.shape):
            merged[place] = max(merged[place], layer[place])  # of equals the first
    return merged


def blur_weights(sigma, radius=None):
    """The kernel in binary64."""
    radius = math.ceil(3 * sigma) if radius is None else radius
    if radius == 0:
        return [1.0]
    gauss = [(tap - radius) / sigma for tap in range(2 * radius + 1)]
    weights = [exp(-0.5 * (g * g)) for g in gauss]
    total = in_order(weights)
    return [weight / total for weight in weights]


@np.errstate(all="ignore")
def blur_rows(source, weights):
    """One pass, with weights of the texture's precision."""
    height, width = source.shape
    made, radius = np.empty_like(source), len(weights) // 2
    for j, i in np.ndindex(height, width):
        total = source.dtype.type(0)
        for tap, weight in enumerate(weights):
            total = total + weight * source[j, min(max(i + tap - radius, 0), width - 1)]
        made[j, i] = total
    return made


def blur_columns(source, weights):
    return np.ascontiguousarray(blur_rows(source.T, weights).T)


@np.errstate(all="ignore")
def shade(image, occluded):
    out = np.empty_like(image)
    for j, i, k in np.ndindex(image.shape):
        out[j, i, k] = image[j, i, k] * (1 - occluded[j, i])
    return out


def frame(depth, positions, image, layer_offsets, kind, m, sigma, guard):
    """Sections 10 to 13 in a row; each layer has its offsets."""
    layers = [algorithm2(depth, positions, offsets, kind, m)[0] for offsets in layer_offsets]
    merged, weights = merge(layers), [depth.dtype.type(weight) for weight in blur_weights(sigma)]
    whole = blur_columns(blur_rows(merged, weights), weights)
    inner = tuple(slice(guard, n - guard) for n in depth.shape)
    made = {"shaded": shade(image[inner], whole[inner]), "merged": merged[inner], "blurred": whole[inner]}
    return made | {f"ao_{k + 1}": layer[inner] for k, layer in enumerate(layers)}
