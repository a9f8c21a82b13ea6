"""Float32 renderers, as those of ``random_renderer``, of the normal-oriented hemisphere."""

import numpy as np
import random_renderer as rr
from random_renderer import MATRIX, STILL, row, single, spread
from random_sums import summed


def placed(ar, m, rows, point, table, r, axes):
    """Rows of M of P + r (x t + y b + z n), by the world, of points times r or not, or row by row."""
    of = list(zip(*axes, strict=True))
    late = [ar.multiply(r, ar.total(table, numbers)) for numbers in of]
    early = [ar.total([ar.multiply(r, x) for x in table], numbers) for numbers in of]
    off, made = [ar.choose(ar.lot(0.5), a, b) for a, b in zip(late, early, strict=True)], []
    for k in rows:
        by_row = row(ar, m, k, point, STILL)
        for x, axis in zip(table, axes, strict=True):
            by_row = ar.fused(x, ar.multiply(r, ar.total(m[4 * k : 4 * k + 3], axis)), by_row)
        made.append(ar.choose(ar.lot(0.5), row(ar, m, k, point, off), by_row))
    return made


def weights(ar, check, reach, far):
    """The weight of what is hidden, by its distance along the axis."""
    if check == "none":
        return np.ones_like(far)
    if check == "distance":
        return (far < reach).astype(float)
    part = np.where(far > 0, np.minimum(ar.divide(reach, np.where(far > 0, far, 1.0)), 1.0), 1.0)
    square = ar.multiply(part, part)
    return ar.choose(ar.lot(0.5), ar.multiply(square, ar.fused(-2.0, part, 3.0)),
                     ar.fused(3.0, square, -ar.multiply(2 * square, part)))  # fmt: skip


@np.errstate(all="ignore")
def hidden_weights(ar, given, points, radius, options):
    """The occlusion of every renderer, (R, H, W)."""
    (kind, m), view, r = rr.mapping_of(given), given.view, single(radius)
    axis = np.append(single(view.cast_from_world[2]), np.zeros(12))
    long = radius * np.sqrt((view.cast_from_world[2, :3] ** 2).sum())
    reach = single(long)
    bias = ar.choose(ar.lot(0.5), single(options["bias"] * long), ar.multiply(single(options["bias"]), reach))
    bias = bias.reshape(ar.renderers, 1, 1, 1)
    point, normal = spread(ar, given.positions), spread(ar, given.normals)
    still = [ar.full(np.full((1, 1, 1), k)) for k in (1.0, 0.0)]
    c, s = still if given.turns is None else rr.turn_of(ar, given.turns)
    side = [ar.total([c, s], both) for both in zip(*single(view.world_from_cast[:, :2]).T, strict=True)]
    t = rr.right_of(ar, side, normal)
    axes = t, rr.across(ar, normal, t), normal
    table = [ar.full(single(k)[None, None, :]) for k in (points[:, 0], points[:, 1], abs(points[:, 2]))]
    sums = placed(ar, m, range(4 if kind == MATRIX else 3), point, table, r, axes)
    u, v, image_z, valid = rr.project(ar, kind, m, *sums)
    z = placed(ar, axis, [0], point, table, r, axes)[0]
    z = z if kind == MATRIX else ar.choose(ar.lot(0.5), z, image_z)
    there, _, _, surface = rr.cast_depths(ar, given, point, axis, u, v, valid)
    inside, _, _ = rr.inside(given.depth, u, v, valid)
    nearer = ar.choose(ar.lot(0.5), z >= ar.add(surface, bias), ar.subtract(z, bias) >= surface)
    nearer = ar.choose(ar.lot(0.5), ar.subtract(z, surface) >= bias, nearer).astype(bool)
    far = np.abs(ar.subtract(row(ar, axis, 0, point, STILL), surface))
    weight = np.where(nearer, weights(ar, options["range_check"], reach, far), 0.0)
    behind = float(options["background"] == "occludes" and options["range_check"] == "none")
    made = summed(ar, np.where(there, weight, np.where(inside, behind, 0.0)))
    return np.where(np.isfinite(given.depth), np.minimum(ar.divide(made, float(len(points))), 1.0), 0.0)
