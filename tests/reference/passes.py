"""Algorithms 1 and 2 and what follows them: sections 9 to 14 and 18 of the specification.

Textures are of np.float32 or np.float64, and so is the arithmetic; other numbers come rounded to it.
"""

import math

import numpy as np

from reference.elementary import exp, in_order
from reference.mapping import affine_row, images, linear_rows, texel_at, turn_at

# Sections 9 and 10


@np.errstate(all="ignore")
def in_views(depth, point_of, offsets, views, turns=None):
    """Occluded is what no view shows: occlusion, and how many samples of each row fall outside of all views.

    A view is its depth, kind and numbers; the texture's own is the first. Third comes how often each row of texels got
    each status in the first view, (H, 6): 5 for a sample outside the texture.
    """
    made, outside = np.zeros_like(depth), np.zeros(len(depth), np.int64)
    statuses = np.zeros((len(depth), 6), np.int64)

    def tables_of(turn):
        return [(kind, list(m), [linear_rows(kind, m, offset, turn) for offset in offsets]) for _, kind, m in views]

    tables = tables_of(None)
    for j, i in np.argwhere(depth < np.inf).tolist():
        point, hidden = point_of(j, i), 0
        tables = tables if turns is None else tables_of(turn_at(turns, j, i))
        for seen in zip(*(images(kind, m, point, rows) for kind, m, rows in tables), strict=True):
            texels = [texel_at(texture.shape, image) for (texture, _, _), image in zip(views, seen, strict=True)]
            hits = [texture[texel] < image[2] for (texture, _, _), texel, image in zip(views, texels, seen, strict=True)
                    if texel is not None]  # fmt: skip
            status = seen[0][3]
            statuses[j, 5 if texels[0] is None and status == 0 else status] += 1
            hidden += bool(hits) and all(hits)
            outside[j] += not hits
        made[j, i] = made.dtype.type(hidden) / max(len(offsets), 1)
    return made, outside, statuses


def algorithm1(depth, offsets, screen_to_world, m, turns=None):
    back = list(screen_to_world)

    def point_of(j, i):
        place = depth.dtype.type(i) + 0.5, depth.dtype.type(j) + 0.5, depth[j, i]
        x, y, z, w = (affine_row(back, row, *place) for row in range(4))
        return x / w, y / w, z / w

    made, _, statuses = in_views(depth, point_of, offsets, [(depth, "matrix", m)], turns)
    return made, statuses


def algorithm2(depth, positions, offsets, kind, m, turns=None):
    made, _, statuses = in_views(depth, lambda j, i: positions[j, i], offsets, [(depth, kind, m)], turns)
    return made, statuses


def algorithm2_with_neighbours(depth, positions, offsets, views):
    return in_views(depth, lambda j, i: positions[j, i], offsets, views)[:2]


# Sections 11 to 14


def merge(layers):
    merged = layers[0]
    for layer in layers[1:]:
        merged = np.where(layer > merged, layer, merged)  # of equals the first
    return merged


def blur_weights(sigma, radius=None):
    """The Gaussian in binary64, normalised."""
    radius = math.ceil(3 * sigma) if radius is None else radius
    if radius == 0:
        return [1.0]
    gauss = [(tap - radius) / sigma for tap in range(2 * radius + 1)]
    weights = [exp(-0.5 * (g * g)) for g in gauss]
    total = in_order(weights)
    return [weight / total for weight in weights]


def blur_table(sigma, dtype=np.float32):
    """The kernel, in whole multiples of a quantum; the centre makes up for what the others were rounded by."""
    one = 2 ** (24 if dtype == np.float32 else 53)
    quanta = [round(one * weight) for weight in blur_weights(sigma)]  # Python's round: ties to even
    centre = len(quanta) // 2
    quanta[centre] = one - sum(quanta[:centre]) - sum(quanta[centre + 1 :])
    return np.array([n / one for n in quanta], dtype)


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
    return image * (1 - occluded)[..., None]


@np.errstate(all="ignore")
def light(image, occluded, normals, direction, ambient, occlude):
    """Section 18; the numbers of the light are of binary64, and rounded to the textures' precision."""
    number = image.dtype.type
    length = math.sqrt(in_order([each * each for each in direction]))
    towards, share, one = [number(each / length) for each in direction], number(ambient), number(1)
    made = np.empty_like(image)
    for j, i in np.ndindex(occluded.shape):
        cosine = in_order([n * t for n, t in zip(normals[j, i], towards, strict=True)])
        direct = (one - share) * (number(0) if cosine < 0 else cosine)
        visible = one - occluded[j, i]
        factor = {"ambient": share * visible + direct, "all": (share + direct) * visible}[occlude]
        for k in range(3):
            made[j, i, k] = image[j, i, k] * factor
    return made


def frame(depth, positions, image, layer_offsets, kind, m, sigma, guard, turns=None):
    """Sections 10 to 13 in a row; each layer has its offsets."""
    layers = [algorithm2(depth, positions, offsets, kind, m, turns)[0] for offsets in layer_offsets]
    merged, weights = merge(layers), blur_table(sigma, depth.dtype)
    whole = blur_columns(blur_rows(merged, weights), weights)
    inner = tuple(slice(guard, n - guard) for n in depth.shape)
    made = {"shaded": shade(image[inner], whole[inner]), "merged": merged[inner], "blurred": whole[inner]}
    return made | {f"ao_{k + 1}": layer[inner] for k, layer in enumerate(layers)}
