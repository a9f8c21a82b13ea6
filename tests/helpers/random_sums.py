"""Float32 renderers, as those of ``random_renderer``, of estimators that sum terms of the surface around a point."""

import numpy as np
import random_renderer as rr
from random_renderer import STILL, near, row, single, spread


def turn_of(ar, turns, off):
    """Cosine and sine of every texel, (R, H, W, 1), as they are or made anew."""
    given = rr.turn_of(ar, turns)
    made = [single(k + ar.rng.uniform(-off, off, k.shape) * (1 - 2.0**-10)) for k in given]
    own = ar.lot(0.7)
    return [ar.choose(own, a, b) for a, b in zip(made, given, strict=True)]


def duff(ar, w):
    """Two axes at right angles to w."""
    x, y, z = w
    sign = np.where(z >= 0, 1.0, -1.0)
    a = ar.divide(-1.0, ar.add(sign, z))
    b, gx = ar.multiply(ar.multiply(x, y), a), sign * x
    e = [ar.fused(ar.multiply(gx, x), a, 1.0), sign * b, -gx]
    return e, [b, ar.fused(ar.multiply(y, y), a, sign), -y]


def placed(ar, m, rows, point, x, y, r, axes):
    """Rows of M of P + r (x e + y f), by the world or row by row."""
    e, f = axes
    off = [ar.multiply(r, ar.total([x, y], of)) for of in zip(e, f, strict=True)]
    made = []
    for k in rows:
        along = [ar.multiply(r, ar.total(m[4 * k : 4 * k + 3], v)) for v in (e, f)]
        late = ar.fused(y, along[1], ar.fused(x, along[0], row(ar, m, k, point, STILL)))
        made.append(ar.choose(ar.lot(0.5), row(ar, m, k, point, off), late))
    return made


def summed(ar, terms):
    """The sum of terms, (R, H, W, n), in any order."""
    total = np.zeros(terms.shape[:-1])
    for s in ar.rng.permutation(terms.shape[-1]):
        total = ar.add(total, terms[..., s])
    return total


def lacking(ar, total, strength, n, k):
    """1 - max(0, 1 - strength / n total)^k."""
    scale = ar.choose(ar.lot(0.5), single(strength / n), ar.divide(single(strength), float(n)))
    scale = ar.per_renderer(ar.full(scale).reshape(ar.renderers, -1)[:, 0], total)
    left = ar.choose(ar.lot(0.5), ar.subtract(1.0, ar.multiply(scale, total)), ar.fused(-scale, total, 1.0))
    light = np.maximum(left, 0)
    if k != 1:
        logarithm = np.log2(light) + ar.rng.uniform(-(2.0**-21), 2.0**-21, light.shape)
        light = np.minimum(ar.within(np.exp2(ar.multiply(k, logarithm)), 2), 1.0) if k else np.ones_like(light)
    return ar.subtract(1.0, light)


@np.errstate(all="ignore")
def alchemy(ar, given, places, radius, options, angle):
    """Alchemy's occlusion, of every renderer: (R, H, W)."""
    (kind, m), depth, r, n = rr.mapping_of(given), given.depth, single(radius), len(places)
    point, normal, w = (spread(ar, texture) for texture in (given.positions, given.normals, given.directions))
    x, y = (ar.full(single(places)[None, None, :, k]) for k in range(2))
    if given.turns is not None:
        c, s = turn_of(ar, given.turns, angle)
        x, y = ar.total([c, -s], [x, y]), ar.total([s, c], [x, y])
    rows = placed(ar, m, range(4 if kind == rr.MATRIX else 3), point, x, y, r, duff(ar, near(ar, w, 2.0**-20)))
    u, v, _, valid = rr.project(ar, kind, m, *rows)
    there, j, i = rr.inside(depth, u, v, valid)
    of = np.arange(ar.renderers)[:, None, None, None]
    away = [ar.subtract(p[of, j, i, 0], p) for p in point]
    far = np.append(single(given.view.viewer_distance()), np.zeros(12))
    bias = ar.multiply(single(options["beta"]), np.maximum(row(ar, far, 0, point, STILL), 0))
    above = ar.choose(ar.lot(0.5), ar.subtract(ar.total(away, normal), bias), ar.total([*away, -1.0], [*normal, bias]))
    own = ar.multiply(ar.multiply(single(options["epsilon"]), r), r)
    epsilon = ar.per_renderer(ar.choose(ar.lot(0.5), own, single(options["epsilon"] * radius * radius)), above)
    square = ar.add(ar.total(away, away), epsilon)
    shown = there & np.isfinite(depth[j, i]) & (above > 0) & (square > 0)
    total = summed(ar, np.where(shown, ar.divide(above, square), 0.0))
    made = lacking(ar, total, 2 * options["sigma"] * radius, n, options["k"])
    return np.where(np.isfinite(depth), made, 0.0)
