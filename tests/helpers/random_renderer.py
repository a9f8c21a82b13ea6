"""Float32 renderers that round, fuse and order as they like within an error model, many at a time; nothing of lfssao.

Arrays have the renderers as first axis. Each operation draws for each renderer how it rounds: always down, always up,
to nearest, or by lot for each number. All numbers are held in float64 and are float32 numbers.
"""

from functools import partial

import numpy as np

CROSSED_SLITS = 0
MATRIX = 1
DISPLAY = 2
STILL = 0.0, 0.0, 0.0  # the offset of a point itself


def single(x):
    """A number as a renderer is given it."""
    return np.asarray(x, np.float64).astype(np.float32).astype(np.float64)


class Arithmetic:
    """Operations of some number of renderers.

    ``directed``: + - * give either neighbour of the exact result; else the nearest. ``quotient``, ``root``: ulp.
    """

    def __init__(self, rng, renderers, directed=True, quotient=2.5, root=2.0):
        self.rng, self.renderers, self.directed = rng, renderers, directed
        self.quotient_ulp, self.root_ulp = quotient, root
        self.flushes = self.lot(0.5)
        self.habit = rng.integers(0, 8, renderers)  # 0: always down, 1: always up, else anew for each operation

    def lot(self, chance):
        """By lot for each renderer, (R,) bool."""
        return self.rng.random(self.renderers) < chance

    def per_renderer(self, values, like):
        return values.reshape((self.renderers,) + (1,) * (np.ndim(like) - 1))

    def choose(self, chosen, a, b):
        """a for the renderers chosen, b for the others."""
        a, b = np.broadcast_arrays(a, b)
        return np.where(self.per_renderer(chosen, a), a, b)

    def align(self, *numbers):
        """Scalars, and arrays with the renderers as first axis and as many axes as the one with most."""
        arrays = [np.asarray(x, np.float64) if np.ndim(x) == 0 else self.full(x) for x in numbers]
        axes = max(x.ndim for x in arrays)
        return [x.reshape(x.shape + (1,) * (axes - x.ndim)) if x.ndim else x for x in arrays]

    def flush(self, x):
        return np.where(self.per_renderer(self.flushes, x) & (np.abs(x) < 2.0**-126), 0.0, x)

    def full(self, x):
        """An array with the renderers as first axis, of one that may have none."""
        x = np.asarray(x, np.float64)
        return x if x.ndim and x.shape[0] == self.renderers else np.broadcast_to(x, (self.renderers, *x.shape))

    def correctly(self, x):
        """A correct rounding of exact results: what is representable stays."""
        x = self.full(x)
        near = x.astype(np.float32)
        if self.directed:
            mode = np.where(self.habit < 2, self.habit, self.rng.integers(0, 4, self.renderers))
            mode = self.per_renderer(mode, x)
            coin = self.rng.random(x.shape) < 0.5
            down = (mode == 0) | ((mode == 3) & coin)
            away = (near != x) & (mode != 2) & ((near > x) == down)  # on the other side than it should be
            np.nextafter(near, np.where(down, np.float32(-np.inf), np.float32(np.inf)), out=near, where=away)
        return self.flush(near.astype(np.float64))

    def within(self, x, ulps):
        """A float32 number within a number of ulp of exact results; half an ulp: the nearest."""
        x = self.full(x)
        if np.ndim(ulps) == 0 and ulps <= 0.5:
            return self.flush(x.astype(np.float32).astype(np.float64))
        room = np.where(x == 0.0, 0.0, ulps * np.ldexp(1.0, np.frexp(x)[1] - 24))
        mode = self.per_renderer(self.rng.integers(0, 3, self.renderers), x)
        part = np.select([mode == 0, mode == 1], [-1.0, 1.0], self.rng.uniform(-1, 1, x.shape))
        near = (x + part * room).astype(np.float32)
        back = np.nextafter(near, np.where(near > x, np.float32(-np.inf), np.float32(np.inf)))
        return self.flush(np.where(np.abs(near - x) > room, back, near).astype(np.float64))

    def orders(self, n):
        """An order of n terms for each renderer, (R, n)."""
        return self.rng.permuted(np.tile(np.arange(n), (self.renderers, 1)), axis=1)

    def order(self, n):
        """An order of n terms, for all renderers."""
        return self.rng.permutation(n)

    def near(self, x, off):
        """Float32 numbers that are off by up to so much."""
        x = self.full(x)
        return single(x + self.rng.uniform(-1, 1, x.shape) * (off - 2.0**-24))

    def add(self, a, b):
        a, b = self.align(a, b)
        return self.correctly(a + b)

    def subtract(self, a, b):
        return self.add(a, np.negative(b))

    def multiply(self, a, b):
        a, b = self.align(a, b)
        return self.correctly(a * b)

    def fused(self, a, b, c):
        """a b + c, rounded once by some renderers and twice by others."""
        a, b, c = self.align(a, b, c)
        once = self.correctly(a * b + c)
        twice = self.add(self.multiply(a, b), c)
        return self.choose(self.lot(0.5), once, twice)

    def divide(self, a, b):
        """a / b, or a (1 / b)."""
        a, b = self.align(a, b)
        quotient = self.within(a / b, self.quotient_ulp)
        product = self.multiply(a, self.within(1.0 / b, self.quotient_ulp))
        return self.choose(self.lot(0.6), quotient, product)

    def root(self, x):
        if self.root_ulp <= 0.5:
            return self.within(np.sqrt(x), 0.5)
        return self.within(1.0 / self.within(1.0 / np.sqrt(x), self.root_ulp), self.quotient_ulp)

    def total(self, factors, values):
        """Sum of factors times values, in an order of each renderer's own, cut into two sums or not, fused or not."""
        terms = np.stack(np.broadcast_arrays(*self.align(*factors, *values)))
        factors, values = terms[: len(factors)], terms[len(factors) :]
        order = self.orders(len(values))
        of = np.arange(self.renderers)
        cut = int(self.rng.integers(1, len(values) + 1))
        sums = []
        for part in (range(cut), range(cut, len(values))):
            total = None
            for k in part:
                f = factors[order[:, k], of]
                v = values[order[:, k], of]
                total = self.multiply(f, v) if total is None else self.fused(f, v, total)
            if total is not None:
                sums.append(total)
        return sums[0] if len(sums) == 1 else self.add(*sums)


class Probe(Arithmetic):
    """Renderers of real numbers, each of which is off in one operation, by all that an error model allows.

    To first order the largest error of a result is the sum of what they are off the first, which is off in nothing.
    Sums are in the terms' order.
    """

    def __init__(self, rng, renderers, model):
        super().__init__(rng, renderers)
        self.model, self.operations, self.quotient_ulp = model, 0, model.quotient / model.operation / 1.4
        self.directed = False

    def lot(self, chance):
        return np.full(self.renderers, self.rng.random() < chance)

    def flush(self, x):
        return x

    def orders(self, n):
        return np.tile(np.arange(n), (self.renderers, 1))

    def order(self, n):
        return np.arange(n)

    def near(self, x, off, size=1.0):
        """Numbers of which a renderer's is off by so much."""
        x, self.operations = self.full(x).copy(), self.operations + 1
        x[self.operations : self.operations + 1] += off * size
        return x

    def off(self, x, relative):
        one = self.full(x)[self.operations + 1 : self.operations + 2]
        return self.near(x, relative, np.where(one == np.rint(one), 0.0, one))  # what is representable is exact

    def correctly(self, x):
        return self.off(x, self.model.operation)

    def within(self, x, ulps):
        return self.off(x, ulps * self.model.operation)

    def fused(self, a, b, c):
        a, b, c = self.align(a, b, c)
        return self.correctly(a * b + c) if self.rng.random() < 0.5 else self.add(self.multiply(a, b), c)

    def divide(self, a, b):
        a, b = self.align(a, b)
        return self.off(a / b, self.model.quotient)

    def root(self, x):
        return self.off(np.sqrt(x), self.model.root)


def row(ar, m, k, point, offset):
    """A row of M applied to point and offset, to their sum or to each."""
    a = m[4 * k : 4 * k + 4]
    together = [ar.add(p, o) for p, o in zip(point, offset, strict=True)]
    first = ar.total(a, [*together, 1.0])
    second = ar.total([*a[:3], *a], [*offset, *point, 1.0])
    return ar.choose(ar.lot(0.5), first, second)


def turned_row(ar, m, k, point, offset, turn):
    """A row of M applied to the point and to an offset that turns: offset or matrix first, or the terms by angle."""
    (c, s), (x, y, z), a = turn, offset, m[4 * k : 4 * k + 3]
    here = row(ar, m, k, point, STILL)
    by_offset = row(ar, m, k, point, turned(ar, offset, turn))
    matrix = [ar.total([c, s], [a[0], a[1]]), ar.total([c, -s], [a[1], a[0]]), a[2]]
    by_matrix = ar.add(here, ar.total(matrix, offset))
    parts = [ar.total([a[0], a[1]], [x, y]), ar.total([a[1], -a[0]], [x, y]), ar.multiply(a[2], z)]
    by_angle = ar.add(here, ar.total([c, s, 1.0], parts))
    return ar.choose(ar.lot(0.3), by_offset, ar.choose(ar.lot(0.5), by_matrix, by_angle))


def turned(ar, offset, turn):
    (c, s), (x, y, z) = turn, offset
    return [ar.total([c, -s], [x, y]), ar.total([s, c], [x, y]), z]


def turn_of(ar, turns):
    """Cosine and sine of every texel, (R, H, W, 1)."""
    return [ar.full(t.astype(np.float64)[..., None]) for t in turns]


def quotient_from(ar, start, a, b):
    """start + a / b, or a (1 / b) + start in one."""
    return ar.choose(ar.lot(0.7), ar.add(start, ar.divide(a, b)), ar.fused(a, ar.within(1 / b, ar.quotient_ulp), start))


@np.errstate(all="ignore")
def to_image(ar, kind, m, point, offset, turn=None):
    """World -> image of point + offset, which may turn: u, v, z, whether it is valid."""
    of_row = row if turn is None else partial(turned_row, turn=turn)
    rows = [of_row(ar, m, k, point, offset) for k in range(4 if kind == MATRIX else 3)]
    return project(ar, kind, m, *rows)


@np.errstate(all="ignore")
def project(ar, kind, m, a, b, c, q=None):
    """World -> image from the sums of the mapping's rows."""
    if kind == CROSSED_SLITS:
        u = quotient_from(ar, m[14], a, ar.subtract(m[12], c))
        v = quotient_from(ar, m[15], b, ar.subtract(m[13], c))
        return u, v, c, (c < m[12]) & (c > m[13])
    if kind == MATRIX:
        return ar.divide(a, q), ar.divide(b, q), ar.divide(c, q), q > 0
    u, v, valid = physical_to_image(ar, m[12:], a, b, c)
    return u, v, c, valid


def crossing(ar, curvature, x, z, dx, dz):
    """The place at which a line leaves a circle, and the discriminant."""
    a = ar.multiply(curvature, ar.fused(dx, dx, ar.multiply(dz, dz)))
    b = ar.subtract(ar.multiply(curvature, ar.fused(x, dx, ar.multiply(z, dz))), dz)
    c = ar.subtract(ar.multiply(curvature, ar.fused(x, x, ar.multiply(z, z))), ar.add(z, z))
    discriminant = ar.fused(b, b, -ar.multiply(a, c))
    root = np.where(discriminant > 0, ar.root(np.maximum(discriminant, 0)), 0.0)
    return ar.divide(-c, ar.add(b, root)), discriminant


def physical_to_image(ar, d, x, y, z):
    """The mapping of any display, as it is written in ``lfssao.optics.kernels.display``."""
    m_x, m_y, m_z, y_o, z_o = d[:5]
    dx = ar.subtract(x, m_x)
    dz = ar.subtract(z, m_z)
    t_s, meets_screen = crossing(ar, d[5], m_x, m_z, dx, dz)
    t_v, meets_observers = crossing(ar, d[6], m_x, ar.subtract(m_z, z_o), dx, dz)
    valid = (z < m_z) & (meets_observers >= 0) & (t_v > 1) & (meets_screen >= 0) & (t_s > 0) & (t_s < t_v)
    part = ar.divide(ar.subtract(t_v, t_s), ar.subtract(t_v, 1.0))
    s_y = ar.fused(ar.subtract(y, y_o), part, y_o)
    if d[7] == 0:
        s_x = ar.fused(t_s, dx, m_x)
        if d[5] != 0:
            s_z = ar.fused(t_s, dz, m_z)
            scale = ar.divide(m_z, ar.subtract(m_z, s_z))
            s_x = ar.fused(ar.subtract(s_x, m_x), scale, m_x)
            s_y = ar.fused(ar.subtract(s_y, m_y), scale, m_y)
            valid = valid & (scale > 0)
    else:
        a = ar.subtract(s_y, m_y)
        b = ar.subtract(s_y, y_o)
        h_m = ar.root(ar.fused(a, a, ar.multiply(m_z, m_z)))
        h_e = ar.root(ar.fused(b, b, ar.multiply(z_o, z_o)))
        kappa = ar.multiply(ar.divide(z, z_o), ar.divide(h_e, h_m))
        room = ar.add(1.0, kappa)
        valid = valid & (room > 0)
        s_x = ar.divide(ar.fused(m_x, kappa, x), room)
    w = ar.total(d[14:17], [s_x, s_y, 1.0])
    valid = valid & (w > 0)
    u, v = (ar.divide(ar.total(d[8 + 3 * k : 11 + 3 * k], [s_x, s_y, 1.0]), w) for k in range(2))
    if d[20] != 0 or d[21] != 0:
        a = ar.divide(ar.subtract(u, d[17]), d[19])
        b = ar.divide(ar.subtract(v, d[18]), d[19])
        r2 = ar.fused(a, a, ar.multiply(b, b))
        factor = ar.fused(r2, ar.fused(r2, d[21], d[20]), 1.0)
        u = ar.fused(d[19], ar.multiply(a, factor), d[17])
        v = ar.fused(d[19], ar.multiply(b, factor), d[18])
        valid = valid & (r2 < d[22])
    return u, v, valid


def unproject(ar, back, depth):
    """LF Algorithm 1, lines 1 to 3, of every texel: three arrays (R, H, W)."""
    height, width = depth.shape
    v, u = np.mgrid[:height, :width] + 0.5
    rows = [ar.total(back[4 * k : 4 * k + 4], [u, v, depth, 1.0]) for k in range(4)]
    return [ar.divide(a, rows[3]) for a in rows[:3]]


def offsets_of(ar, samples, radius):
    """The samples' offsets, three arrays (R, 1, 1, n): radius times sample, rounded after or before."""
    offsets = ar.choose(ar.lot(0.5), single(radius * samples), ar.multiply(single(radius), single(samples)))
    return [offsets[:, None, None, :, k] for k in range(3)]


def spread(ar, texture):
    """A texture's channels as arrays (R, H, W, 1), 0 where there is no surface."""
    values = np.where(np.isfinite(texture), texture, 0.0).astype(np.float64)
    return [ar.full(values[..., None, k]) for k in range(texture.shape[-1])]


def texel_points(ar, depth, positions, back):
    """World coordinates of the texels, three arrays (R, H, W, 1): given, or with back made of depth."""
    if back is None:
        return spread(ar, positions)
    return [p[..., None] for p in unproject(ar, single(back), np.where(np.isfinite(depth), depth, 0.0))]


@np.errstate(all="ignore")
def image_points(ar, depth, positions, kind, m, samples, radius, back=None, turns=None):
    """Image points of all samples, four arrays (R, H, W, n): u, v, z, whether valid; LF Algorithm 2, or 1 with back."""
    point = texel_points(ar, depth, positions, back)
    turn = None if turns is None else turn_of(ar, turns)
    return to_image(ar, kind, single(m), point, offsets_of(ar, samples, radius), turn)


WAYS = "window", "far - d", "1 / (a d + b)", "gl", "inverse of gl", "a - d", "share of far"


def distance(ar, way, planes, d):
    """Distance along a perspective camera's axis, of a window depth d, as shaders write it; d itself for 'window'."""
    (n, f), span = planes, planes[1] - planes[0]

    def inverse(constants, terms):
        return ar.divide(1.0, ar.total(list(single(constants)), terms))

    def share():
        return ar.divide(single(n), ar.subtract(1.0, ar.multiply(d, single(1 - n / f))))

    ndc = ar.fused(2.0, d, -1.0) if "gl" in way else None
    made = {
        "window": lambda: ar.full(d),
        "far - d": lambda: ar.divide(single(n * f), ar.fused(-single(span), d, single(f))),
        "1 / (a d + b)": lambda: inverse([-span / (n * f), 1 / n], [d, 1.0]),
        "gl": lambda: ar.divide(single(2 * n * f), ar.total([1.0, 1.0, -single(span)], [single(f), single(n), ndc])),
        "inverse of gl": lambda: inverse([0, 0, -span / (2 * n * f), (f + n) / (2 * n * f)], [3.0, 7.0, ndc, 1.0]),
        "a - d": lambda: ar.divide(single(n * f / span), ar.subtract(single(f / span), d)),
        "share of far": lambda: ar.divide(share(), single(f)),
    }
    return made[way]()


@np.errstate(all="ignore")
def occlusion(ar, depth, u, v, z, valid, way="window", planes=None, eye=None):
    """AO of every renderer, (R, H, W), from the image points of its samples.

    A way makes distances of both depths, or of the surface's alone, which is compared with the samples' in eye space.
    """
    depth = depth.astype(np.float64)
    there, j, i = inside(depth, u, v, valid)
    surface = ar.flush(ar.full(depth[j, i]))
    z = np.where(valid, z, 0.0)
    if way != "window":
        there &= np.isfinite(surface)
        surface = distance(ar, way, planes, np.where(np.isfinite(surface), surface, 0.5))
        z = distance(ar, way, planes, z) if eye is None else eye
    count = np.count_nonzero(there & (surface < ar.flush(z)), axis=-1)
    return np.where(np.isfinite(depth), fraction(ar, count, u.shape[-1]), 0.0)


def inside(depth, u, v, valid):
    """Whether image points lie in the texture, and the row and column that they read."""
    height, width = depth.shape
    there = valid & (u >= 0) & (u < width) & (v >= 0) & (v < height)
    return there, *(np.where(there, np.floor(c), 0).astype(int) for c in (v, u))


@np.errstate(all="ignore")
def points_behind(ar, given, samples, radius, options):
    """The estimators point and, with normals, hemisphere, of every renderer: (R, H, W)."""
    (kind, m), n = mapping_of(given), len(samples)
    depth = given.depth
    normals = given.normals
    point = spread(ar, given.positions)
    offset = offsets_of(ar, samples, radius)
    turn = None if given.turns is None else turn_of(ar, given.turns)
    if normals is not None:
        above = offset if turn is None else turned(ar, offset, turn)
        side = np.where(ar.total(above, spread(ar, normals)) < 0, -1.0, 1.0)
        offset = [side * o for o in offset]
    u, v, z, valid = to_image(ar, kind, m, point, offset, turn)
    there, j, i = inside(depth, u, v, valid)
    surface = ar.full(depth.astype(np.float64))
    if options["surface"] == "positions":
        *_, again, sighted = to_image(ar, kind, m, point, STILL)
        again = np.where(sighted, again, np.inf) if kind == MATRIX else again
        surface = np.where(np.isfinite(surface), again[..., 0], np.inf)
    of = np.arange(ar.renderers)[:, None, None, None]
    hidden = there & (ar.flush(surface[of, j, i]) < ar.flush(z)) & np.isfinite(depth[j, i])
    if options.get("background") == "occludes" and not options["range_check"]:
        hidden |= there & ~np.isfinite(depth[j, i])
    if options["range_check"]:
        away = [ar.subtract(p[of, j, i, 0], p) for p in point]
        square = ar.total(away, away)
        reach = ar.choose(ar.lot(0.5), single(radius * radius), ar.multiply(single(radius), single(radius)))
        near = ar.choose(ar.lot(0.5), square <= ar.per_renderer(ar.full(reach).reshape(ar.renderers, -1)[:, 0], square),
                         ar.root(square) <= single(radius))  # fmt: skip
        hidden &= near.astype(bool)
    made = fraction(ar, np.count_nonzero(hidden, axis=-1), n)
    if options.get("remap"):
        made = ar.choose(ar.lot(0.5), 2 * np.maximum(ar.subtract(made, 0.5), 0),
                         np.maximum(ar.subtract(2 * made, 1.0), 0))  # fmt: skip
    return np.where(np.isfinite(depth), made, 0.0)


def mapping_of(given):
    return given.view.world_to_image.kind, single(given.view.world_to_image.numbers)


def across(ar, a, b):
    """Cross product a x b."""
    return [ar.fused(a[k - 2], b[k - 1], -ar.multiply(a[k - 1], b[k - 2])) for k in range(3)]


def normalized(ar, a):
    length = ar.root(ar.total(a, a))
    scale = ar.divide(1.0, length)
    return [ar.choose(ar.lot(0.5), ar.multiply(b, scale), ar.divide(b, length)) for b in a]


def fraction(ar, count, n):
    """count / n, or count (1 / n), or 1 / n added so often."""
    once = ar.within(np.full((ar.renderers, 1, 1), 1 / n), ar.quotient_ulp)
    sums = [np.zeros_like(once)]
    for _ in range(n):
        sums.append(ar.add(sums[-1], once))
    added = np.take_along_axis(np.concatenate(sums, axis=1)[..., 0], count.reshape(ar.renderers, -1), axis=1)
    return ar.choose(ar.lot(0.6), ar.divide(count.astype(float), float(n)), added.reshape(count.shape))


def weights(ar, sigma, radius, table):
    """Weights of the blur and what the sum is divided by: the table, or made anew, normalised before or after."""
    k = np.arange(-radius, radius + 1, dtype=float)
    t = ar.divide(k, single(sigma))
    x = ar.multiply(-0.5, ar.multiply(t, t))
    raw = ar.within(np.exp(x), 3 + 2 * np.abs(x) if ar.directed else 0.5)
    total = ar.total([1.0] * len(k), list(np.moveaxis(raw, 1, 0)))
    before = ar.divide(raw, total[:, None])
    table = ar.full(single(table))
    own = ar.lot(0.5)
    late = ar.lot(0.3)
    made = ar.choose(own, ar.choose(late, raw, before), table)
    return made, np.where(own & late, total, 1.0)


def blur(ar, occlusion, sigma, radius, table):
    """Gaussian blur of every renderer, (R, H, W), and the light, 1 - blur, that each shades by; some blur light."""
    made, divisor = weights(ar, sigma, radius, table)
    as_light = ar.lot(0.3)
    occlusion = ar.choose(as_light, ar.subtract(1.0, occlusion), ar.full(occlusion))
    for axis in (2, 1):
        pad = [(0, 0)] * 3
        pad[axis] = (radius, radius)
        padded = np.pad(occlusion, pad, mode="edge")
        n = occlusion.shape[axis]
        taps = [np.take(padded, range(k, k + n), axis=axis) for k in range(2 * radius + 1)]
        total = ar.total(list(np.moveaxis(made, 1, 0)), taps)
        divided = ar.divide(total, ar.per_renderer(divisor, total))
        occlusion = ar.choose(divisor == 1.0, total, divided)
    turned = ar.subtract(1.0, occlusion)
    return ar.choose(as_light, turned, occlusion), ar.choose(as_light, occlusion, turned)


def shade(ar, rgb, occlusion, light=None):
    rgb = rgb.astype(np.float64)
    ao = occlusion[..., None]
    first = ar.multiply(rgb, ar.subtract(1.0, ao) if light is None else light[..., None])
    second = ar.fused(-rgb, ao, rgb)
    return ar.choose(ar.lot(0.5), first, second)


def unit_or_not(ar, vector, again):
    """Three coordinates, divided by the length by the renderers of ``again``, unless that is 0."""
    square = ar.total(vector, vector)
    length = ar.root(np.where(square > 0, square, 1.0))
    return [ar.choose(again, np.where(square > 0, ar.divide(x, length), x), x) for x in vector]


def lit(ar, rgb, occlusion, normals, direction, ambient, on_all):
    """The image lit, in every order of sums and products that a renderer is likely to have; arrays as of ``shade``."""
    rgb = rgb.astype(np.float64)
    ao = ar.full(occlusion)[..., None]
    share = single(ambient)
    given = np.array(direction, np.float64)
    own = unit_or_not(ar, [ar.full(np.full((1, 1), x)) for x in single(given)], ar.lot(1.0))
    ready = single(given / np.sqrt((given * given).sum()))
    towards = [ar.choose(ar.lot(0.5), a, ar.full(np.full((1, 1), b))) for a, b in zip(own, ready, strict=True)]
    facing = unit_or_not(ar, list(np.moveaxis(ar.full(normals), -1, 0)), ar.lot(0.5))
    f = np.maximum(ar.total(facing, towards), 0.0)[..., None]
    rest = ar.choose(ar.lot(0.5), ar.subtract(1.0, share), ar.full(single(1 - ambient)))
    direct = ar.multiply(rest, f)
    visible = ar.subtract(1.0, ao)
    shaded = ar.multiply(rgb, share)
    if on_all:
        whole = ar.choose(ar.lot(0.5), ar.add(share, direct), ar.fused(share, ar.subtract(1.0, f), f))
        ways = [
            ar.multiply(rgb, ar.multiply(whole, visible)), ar.multiply(ar.multiply(rgb, whole), visible),
            ar.multiply(rgb, ar.fused(-whole, ao, whole)),
        ]  # fmt: skip
        colored = ar.multiply(rgb, f)
        terms = [(shaded, 1.0), (colored, 1.0), (-shaded, f), (-shaded, ao), (-colored, ao),
                 (ar.multiply(shaded, f), ao)]  # fmt: skip
    else:
        ways = [
            ar.multiply(rgb, ar.fused(share, visible, direct)), ar.fused(shaded, visible, ar.multiply(rgb, direct)),
            ar.multiply(rgb, ar.fused(share, ar.subtract(visible, f), f)),
            ar.multiply(rgb, ar.add(ar.fused(-share, ao, share), direct)),
        ]  # fmt: skip
        terms = [(shaded, 1.0), (-shaded, ao), (rgb, f), (-shaded, f)]
    terms = [[np.broadcast_to(ar.align(x, shaded)[0], np.shape(ways[0])) for x in term] for term in terms]
    ways.append(ar.total(*map(list, zip(*terms, strict=True))))
    chosen = ar.rng.integers(0, len(ways), ar.renderers)
    return np.stack(ways)[chosen, np.arange(ar.renderers)]
