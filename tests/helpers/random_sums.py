"""Float32 renderers, as those of ``random_renderer``, of estimators that sum terms of the surface around a point."""

import numpy as np
import random_renderer as rr
from random_renderer import STILL, row, single


def turn_of(ar, turns, off):
    """Cosine and sine of every texel, (R, H, W, 1), as they are or made anew."""
    return near_angle(ar, rr.turn_of(ar, turns), off)


def left_of(ar, total, strength, n):
    """The larger of 1 - strength / n total and 0."""
    scale = ar.choose(ar.lot(0.5), single(strength / n), ar.divide(single(strength), float(n)))
    scale = ar.per_renderer(ar.full(scale).reshape(ar.renderers, -1)[:, 0], total)
    left = ar.choose(ar.lot(0.5), ar.subtract(1.0, ar.multiply(scale, total)), ar.fused(-scale, total, 1.0))
    return np.maximum(left, 0)


def lacking(ar, light, k):
    """1 - light^k."""
    if k != 1:
        logarithm = ar.near(np.log2(light), 2.0**-21)
        light = ar.within(np.exp2(ar.multiply(k, logarithm)), 2) if k else np.ones_like(light)
    return ar.subtract(1.0, light)


def near_angle(ar, values, off):
    """Numbers off by up to so much, of some renderers not at all."""
    return [ar.choose(ar.lot(0.7), ar.near(k, off), ar.full(k)) for k in values]


def summed_angle(ar, options, t, shape):
    """Cosine and sine of the common hash and a tap's angle, each renderer's own, added in float32; (R, H, W)."""
    full = ar.multiply(2 * np.pi if options["full_turn"] == "exact" else 6.28, options["turns"])
    tap = ar.multiply(ar.divide(t + 0.5, float(options["taps"])), full)
    y, x = np.indices(shape)
    spin = (10 * ((3 * x) ^ (y + x * y))).astype(np.float32)
    both = (spin + tap.astype(np.float32).reshape(-1, 1, 1)).astype(np.float64)
    return np.cos(both), np.sin(both)


def ray_lines(ar, rays, shape):
    """Start and slope of x and of y of every texel's ray, (R, H, W); products may be multiplied out."""
    if rays.table is not None:
        return [ar.full(row.reshape(shape)) for row in rays.table.astype(float)]
    made = []
    m = rays.numbers.astype(float)
    for axis, k in ((1, 0), (0, 5)):
        at = np.indices(shape)[axis] + 0.5
        for a, b in ((m[k + 1], m[k + 2]), (m[k + 3], m[k + 4])):
            out = ar.fused(b, at, ar.subtract(a, ar.multiply(b, m[k])))
            made.append(ar.choose(ar.lot(0.5), ar.fused(b, ar.subtract(at, m[k]), a), out))
    return made


def points_of(ar, world, lines, z):
    """Points of rays at z: world coordinates, or cast space's where ``world`` is None."""
    a, b, c, d = lines
    place = [ar.fused(z, b, a), ar.fused(z, d, c), ar.full(z)]
    return place if world is None else [row(ar, world, k, place, STILL) for k in range(3)]


def linear_z(ar, given):
    depth = ar.full(given.depth)
    if given.view.screen_to_world is None:
        return depth
    near_plane, far = given.view.lens[4:6]
    if given.view.linear:  # as it is, or made of the reversed depth that it is of
        made = ar.fused(given.reversed, single(far - near_plane), single(near_plane))
        made = np.where(np.isfinite(depth), ar.divide(single(near_plane * far), made), np.inf)
        return ar.choose(ar.lot(0.5), depth, made)
    if given.view.lens[6]:
        return ar.fused(depth, single(far - near_plane), single(near_plane))
    out = ar.subtract(single(far), ar.multiply(depth, single(far - near_plane)))
    below = ar.choose(ar.lot(0.5), ar.fused(depth, single(near_plane - far), single(far)), out)
    return np.where(np.isfinite(depth), ar.divide(single(near_plane * far), below), np.inf)


def levels_of(z, mip, last):
    """Levels of z that pick one of four, (R, h, w) each."""
    levels = [z]
    while len(levels) <= last and max(levels[-1].shape[1:]) > 1:
        source, (_, h, w) = levels[-1], levels[-1].shape
        y, x = np.mgrid[: (h + 1) // 2, : (w + 1) // 2]
        rows = np.minimum(2 * y + [[[0]], [[1]]], h - 1)
        columns = np.minimum(2 * x + [[[0]], [[1]]], w - 1)
        four = [source[:, r, c] for r in rows for c in columns]
        turned = source[:, np.minimum(2 * y + 1 - x % 2, h - 1), np.minimum(2 * x + 1 - y % 2, w - 1)]
        levels.append({"rotated": turned, "min": np.max(four, axis=0), "max": np.min(four, axis=0)}[mip])
    return levels


def face_normals(ar, z, places, way):
    """Unit normals towards the viewer by the differences within pairs."""
    seen, (j, i) = np.isfinite(z[0]), np.indices(z.shape[1:])
    differences = []
    for axis, at in ((1, i), (0, j)):
        to = at.copy()
        for side in (np.where(at % 2, 1, -1), np.where(at % 2, -1, 1)):  # the second is the pair's other one
            moved = at + side
            inside = np.clip(moved, 0, z.shape[1 + axis] - 1)
            there = seen[(j, inside) if axis else (inside, i)] & (inside == moved)
            to = np.where(there, moved, to)
        other = [p[(slice(None), j, to) if axis else (slice(None), to, i)] for p in places]
        differences.append([ar.subtract(q, p) for q, p in zip(other, places, strict=True)])
    normal = rr.across(ar, *differences)
    alone = np.all([n == 0 for n in normal], axis=0)
    normal = rr.normalized(ar, [np.where(alone, w, n) for n, w in zip(normal, way, strict=True)])
    side = np.where(ar.total(normal, way) > 0, -1.0, 1.0)
    return [side * n for n in normal]


@np.errstate(all="ignore")
def sao(ar, given, rays, radius, options, angle):
    """A after the sampling pass of SAO, of every renderer: (R, H, W), and z; rays are the view's in float32."""
    z = linear_z(ar, given)
    shape = given.depth.shape
    world = np.append(rays.world.astype(float), np.zeros(4))
    camera, seen, (j, i) = given.view.screen_to_world is not None, np.isfinite(given.depth), np.indices(shape)
    in_eye_space = camera and options["normals"] == "face" and ar.rng.random() < 0.5  # given normals are the world's
    lines = ray_lines(ar, rays, shape)
    world = None if in_eye_space else world
    places = points_of(ar, world, lines, z) if camera else [ar.full(given.positions[..., k]) for k in range(3)]
    slope = [lines[1], lines[3], np.ones_like(lines[1])]
    way = slope if world is None else [ar.total(world[4 * k : 4 * k + 3], slope) for k in range(3)]
    levels = levels_of(z, options["mip"], options["max_level"])
    normal = [ar.full(given.normals[..., k]) for k in range(3)]
    normal = face_normals(ar, z, places, way) if options["normals"] == "face" else normal
    texels = []
    n = options["taps"]
    falls = "intensity" in options
    for axis, k in ((1, 0), (0, 5)):
        if rays.table is not None:
            at = np.indices(shape)[axis]
            other = np.where(at + 1 < shape[axis], at + 1, np.maximum(at - 1, 0))
            there = (slice(None), j, other) if axis else (slice(None), other, i)
            a, b, c, d = (ar.subtract(line[there], line) for line in lines)
            gap = [ar.fused(z, b, a), ar.fused(z, d, c)]
            gap = [ar.total(world[4 * k : 4 * k + 2], gap) for k in range(3)]
            texels.append(ar.divide(single(radius), ar.root(ar.total(gap, gap))))
        else:
            length = np.abs(ar.fused(z, float(rays.numbers[k + 4]), float(rays.numbers[k + 2])))
            texels.append(ar.divide(single(radius / rays.units[1 - axis]), length))
    less = single(options["beta"])
    if not falls:
        less = ar.multiply(single(less * rays.units[2] / radius), ar.subtract(z, single(rays.origin)))
    total = np.zeros_like(z)
    of = np.arange(ar.renderers)[:, None, None]
    cosine, sine = turn_of(ar, given.turns, angle)
    for t in ar.order(n):
        phi = (np.pi if options["full_turn"] == "exact" else 3.14) * (2 * t + 1) * options["turns"] / n
        x, y = near_angle(ar, single([np.cos(phi), np.sin(phi)]), angle)
        u = ar.total([x, -y], [cosine[..., 0], sine[..., 0]])
        v = ar.total([x, y], [sine[..., 0], cosine[..., 0]])
        if options["angle_sum"] == "float32":
            u, v = (near_angle(ar, [ar.full(k)], angle)[0] for k in summed_angle(ar, options, t, shape))
        across, down = (ar.multiply(h, ar.divide(t + 0.5, float(n))) for h in texels)
        land = {"floor": lambda d: d, "truncate": np.trunc, "nearest": lambda d: np.floor(ar.add(d, 0.5))}
        off = [land[options["landing"]](ar.multiply(h, a)) for h, a in ((across, u), (down, v))]
        x = ar.add(i, off[0])
        y = ar.add(j, off[1])
        if options["sine"] == "up":
            y = ar.subtract(j, np.floor(off[1]))
        there, row_of, column_of = rr.inside(given.depth, x, y, True)
        level = np.floor(np.log2(np.maximum(np.floor(np.maximum(across, down)), 1))).astype(int) - options["log_q"]
        level = np.clip(level, 0, len(levels) - 1)
        depth = np.empty_like(z)
        for k, each in enumerate(levels):
            depth = np.where(level == k, each[of, np.minimum(row_of >> k, each.shape[1] - 1),
                                              np.minimum(column_of >> k, each.shape[2] - 1)], depth)  # fmt: skip
        tapped = points_of(ar, world, [line[of, row_of, column_of] for line in lines], depth)
        w = [ar.divide(ar.subtract(q, p), single(radius)) for q, p in zip(tapped, places, strict=True)]
        square = ar.total(w, w)
        above = ar.subtract(ar.total(w, normal), less)
        term = ar.divide(above, ar.add(square, single(options["epsilon"])))
        left = np.maximum(ar.subtract(1.0, square), 0)
        term = ar.multiply(term, ar.multiply(ar.multiply(left, left), left)) if falls else term
        shown = there & np.isfinite(depth) & (above > 0) & ((row_of != j) | (column_of != i))
        total = ar.add(total, np.where(shown, term, 0.0))
    strength = 5 * options["intensity"] if falls else 2 * options["sigma"]
    light = averaged(
        ar, np.where(seen, left_of(ar, total, strength, n), 1.0), z, options["quad_edge"] * radius / rays.units[2]
    )
    if options["gauss"] > 0:
        light = reconstructed(ar, light, ar.subtract(z, single(rays.origin)), options)
    return np.where(seen, lacking(ar, light, options.get("k", 1.0)), 0.0)


def averaged(ar, light, z, edge):
    for axis in (2, 1):
        one, two = (np.arange(k, light.shape[axis] // 2 * 2, 2) for k in (0, 1))
        a, b, p, q = (np.take(texture, half, axis) for texture in (light, z) for half in (one, two))
        near = np.abs(ar.subtract(p, q)) < single(edge)
        mean = 0.5 * ar.add(a, b)
        lines = np.moveaxis(light.copy(), axis, 0)
        lines[one], lines[two] = (np.moveaxis(np.where(near, mean, own), axis, 0) for own in (a, b))
        light = np.moveaxis(lines, 0, axis)
    return light


def reconstructed(ar, light, away, options):
    """The bilateral passes; away: distances from the viewers."""
    there = np.isfinite(away)
    weights = single(np.exp(-0.5 * (np.arange(-3, 4) / options["gauss"]) ** 2))
    far = np.max(np.where(there, away, 0), axis=(1, 2), keepdims=True)
    keys = ar.choose(ar.lot(0.5), ar.divide(away, far), ar.multiply(away, ar.divide(1.0, far)))
    keys = np.where(there, np.minimum(keys, 1.0), np.inf)
    for axis in (2, 1):
        if options["packed"]:
            light = ar.divide(np.floor(ar.fused(light, 255.0, 0.5)), 255.0)
            high = np.minimum(np.floor(256 * np.where(there, keys, 0)), 255)
            low = np.floor(ar.fused(ar.subtract(256 * keys, high), 255.0, 0.5))
            low = np.minimum(low, np.where(high == 255, 254, 255))
            keys = np.where(there, ar.fused(low, 1 / 255 / 256, high / 256), np.inf)
        total = np.zeros_like(light)
        weight = np.zeros_like(light)
        size = light.shape[axis]
        for tap in ar.order(7):
            at = np.arange(size) + 3 * (tap - 3)
            other = np.clip(at, 0, size - 1)
            inside = (at >= 0) & (at < size)
            apart = np.abs(ar.subtract(np.take(keys, other, axis), keys))
            near = np.maximum(ar.subtract(1.0, ar.multiply(single(options["sharpness"]), apart)), 0)
            near = np.nan_to_num(near) * (inside if axis == 2 else inside[:, None])
            w = ar.multiply(weights[tap], near)
            total = ar.fused(w, np.take(light, other, axis), total)
            weight = ar.add(weight, w)
        light = np.where(weight > 0, ar.divide(total, weight), 1.0)
    return light
