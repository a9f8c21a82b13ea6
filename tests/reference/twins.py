"""Every kernel a second time, as one reads the papers: one texel, one sample at a time, in plain scalars.

Nothing here comes from lfssao. Arithmetic is that of the scalars handed in (np.float32 or np.float64, or Python's
float where a kernel is float64 only), in the order of operations that the kernels document, so the bits must agree.
"""

import math
from decimal import Decimal, localcontext

import numpy as np

CROSSED_SLITS, MATRIX = 0, 1
FLAT_LINEAR, PERSPECTIVE, ORTHOGRAPHIC = 0, 1, 2


# World -> image


def linear_row(m, row, x, y, z):
    a, b, c, _ = m[4 * row : 4 * row + 4]
    return (a * x + b * y) + c * z


def affine_row(m, row, x, y, z):
    return linear_row(m, row, x, y, z) + m[4 * row + 3]


def project(kind, m, a, b, c, q):
    """Image coordinates, and whether the mapping is defined, from the four affine rows (three for CROSSED_SLITS)."""
    if kind == CROSSED_SLITS:
        z_module, z_observer, u_0, v_0 = m[12:]
        return u_0 + a / (z_module - c), v_0 + b / (z_observer - c), c, bool(z_observer < c < z_module)
    return a / q, b / q, c / q, bool(q > 0)


@np.errstate(all="ignore")
def world_to_image(kind, m, x, y, z):
    rows = [affine_row(m, row, x, y, z) if row < 3 or kind == MATRIX else None for row in range(4)]
    return project(kind, m, *rows)


# LF Algorithms 1 and 2


def sample_counts(depth, point, offsets, kind, m):
    """How many samples around one point are occluded, and how many lie outside; LF's numbers: Algorithm 2 (1)."""
    height, width = depth.shape
    rows = 3 if kind == CROSSED_SLITS else 4
    pnt = [affine_row(m, row, *point) for row in range(rows)]  # the mapping's affine half, of the point
    occluded = outside = 0
    for offset in offsets:  # lines 3 and 4 (4 and 5)
        # Lines 5 and 6 (6 and 7): the affine half of the offset is added to that of the point, then the divisions.
        smp = [pnt[row] + linear_row(m, row, *offset) for row in range(rows)]
        u, v, z, valid = project(kind, m, *smp, *[None] * (4 - rows))
        if not (valid and 0 <= u < width and 0 <= v < height):
            outside += 1
            continue
        sur_depth = depth[math.floor(v), math.floor(u)]  # line 7 (8)
        if sur_depth < z:  # line 8 (9)
            occluded += 1  # line 9 (10)
    return occluded, outside


def each_texel(depth, offsets, kind, m, point_of):
    dtype = depth.dtype.type
    height, width = depth.shape
    occlusion, outside = np.zeros((height, width), dtype), np.zeros(height, np.int64)
    for j in range(height):
        for i in range(width):
            if not depth[j, i] < np.inf:  # no surface
                continue
            occluded, beyond = sample_counts(depth, point_of(j, i), offsets, kind, m)
            occlusion[j, i] = dtype(occluded) / dtype(max(len(offsets), 1))
            outside[j] += beyond
    return occlusion, outside


@np.errstate(all="ignore")
def algorithm1(depth, offsets, screen_to_world, m):
    dtype = depth.dtype.type

    def point_of(j, i):
        u, v = dtype(i) + dtype(0.5), dtype(j) + dtype(0.5)  # line 1
        d = depth[j, i]  # line 2
        a, b, c, q = (affine_row(screen_to_world, row, u, v, d) for row in range(4))
        return a / q, b / q, c / q  # line 3

    return each_texel(depth, offsets, MATRIX, m, point_of)


@np.errstate(all="ignore")
def algorithm2(depth, positions, offsets, kind, m):
    return each_texel(depth, offsets, kind, m, lambda j, i: positions[j, i])  # lines 1 and 2


# Merge, blur, shade


def merge(layers):
    merged = layers[0].copy()
    for layer in layers[1:]:
        for place in np.ndindex(merged.shape):
            merged[place] = max(merged[place], layer[place])  # of equals the first
    return merged


@np.errstate(all="ignore")
def gaussian_weights(sigma, radius):
    distances = [np.float64(k) / np.float64(sigma) for k in range(-radius, radius + 1)]
    weights = [exp(float(np.float64(-0.5) * (d * d))) for d in distances]
    total = 0.0
    for weight in weights:
        total = total + weight
    return np.array([weight / total for weight in weights])


@np.errstate(all="ignore")
def blur_horizontal(source, weights):
    height, width = source.shape
    radius = len(weights) // 2
    target = np.empty_like(source)
    for j in range(height):
        for i in range(width):
            total = source.dtype.type(0)
            for k, weight in enumerate(weights):
                column = i + k - radius
                column = 0 if column < 0 else width - 1 if column >= width else column
                total = total + weight * source[j, column]
            target[j, i] = total
    return target


def blur_vertical(source, weights):
    return np.ascontiguousarray(blur_horizontal(source.T, weights).T)


@np.errstate(all="ignore")
def shade(rgb, occlusion):
    out = np.empty_like(rgb)
    for j, i, c in np.ndindex(rgb.shape):
        out[j, i, c] = rgb[j, i, c] * (rgb.dtype.type(1) - occlusion[j, i])
    return out


# Philox4x32-10, from Salmon et al. 2011, section 3.3 and table 2


def philox4x32(counter, key):
    x0, x1, x2, x3 = counter
    k0, k1 = key
    for _ in range(10):
        high0, low0 = divmod(0xD2511F53 * x0, 1 << 32)
        high1, low1 = divmod(0xCD9E8D57 * x2, 1 << 32)
        x0, x1, x2, x3 = high1 ^ x1 ^ k0, low1, high0 ^ x3 ^ k1, low0
        k0, k1 = (k0 + 0x9E3779B9) % (1 << 32), (k1 + 0xBB67AE85) % (1 << 32)
    return x0, x1, x2, x3


def random_word(seed, stream, index):
    return philox4x32((index, stream, 0, 0), (seed % (1 << 32), seed >> 32))[0]


def random_signed(seed, stream, index):
    return (random_word(seed, stream, index) + 0.5) / 2.0**31 - 1.0


def random_unit(seed, stream, index):
    return (random_word(seed, stream, index) + 0.5) / 2.0**32


def random_below(seed, stream, index, n):
    return random_word(seed, stream, index) * n // (1 << 32)


# Elementary functions: Taylor's polynomials by Horner's rule, Newton's iteration


def sincospi(x):
    quadrant = int(2.0 * abs(x) + 0.5) * (1 if x >= 0.0 else -1)  # half a quadrant rounds away from zero
    a = math.pi * (x - quadrant / 2)
    s = 1.0 / math.factorial(17)
    for n in range(15, 1, -2):
        s = s * (a * a) + (1.0 if n % 4 == 1 else -1.0) / math.factorial(n)
    s = s * (a * a) * a + a
    c = 1.0 / math.factorial(16)
    for n in range(14, -1, -2):
        c = c * (a * a) + (1.0 if n % 4 == 0 else -1.0) / math.factorial(n)
    return [(s, c), (c, -s), (-s, -c), (-c, s)][quadrant % 4]


def cbrt(t):
    if t == 0.0:
        return t
    power = (math.frexp(t)[1] - 1) // 3  # t / 8^power lies in [1, 8)
    t = math.ldexp(t, -3 * power)
    y = 0.9 + 0.15 * t
    for _ in range(6):
        y = y - (y * y * y - t) / (3.0 * y * y)
    return math.ldexp(y, power)


def ln2_parts():
    """Ln 2 with its last 21 bits cleared, the rest of it, and 1 / ln 2."""
    with localcontext() as context:
        context.prec = 60
        ln2 = Decimal(2).ln()
        bits = np.float64(float(ln2)).view(np.int64) >> 21 << 21
        high = float(bits.view(np.float64))
        return high, float(ln2 - Decimal(high)), float(1 / ln2)


LN2_HIGH, LN2_LOW, INVERSE_LN2 = ln2_parts()


def exp(x):
    if x < -745.0:
        return 0.0
    if x > 710.0:
        return math.inf
    k = int(abs(x) * INVERSE_LN2 + 0.5) * (1 if x >= 0.0 else -1)
    r = (x - k * LN2_HIGH) - k * LN2_LOW
    y = 1.0
    for n in range(13, 0, -1):
        y = y * r / n + 1.0
    for _ in range(abs(k)):
        y = y * 2.0 if k > 0 else y / 2.0
    return y


# LF Algorithms 3 and 4, and the distributions of LF section 6


def square_points(method, n, seed):
    xi1, xi2, _, shuffle = range(4)  # the streams of the generator

    def place(cell, cells, stream, k):
        return 2.0 * ((cell + random_unit(seed, stream, k)) / cells) - 1.0

    if method == "random":
        return [(random_signed(seed, xi1, k), random_signed(seed, xi2, k)) for k in range(n)]
    if method == "jittered":
        rows = max(r for r in range(1, n + 1) if n % r == 0 and r * r <= n)
        columns = n // rows
        return [(place(k % columns, columns, xi1, k), place(k // columns, rows, xi2, k)) for k in range(n)]
    assert method == "latin"
    order = list(range(n))
    for k in reversed(range(1, n)):  # Fisher and Yates
        other = random_below(seed, shuffle, k, k + 1)
        order[k], order[other] = order[other], order[k]
    return [(place(order[k], n, xi1, k), place(k, n, xi2, k)) for k in range(n)]


def algorithm3(xi1, xi2):
    z = xi1  # line 2
    sine, cosine = sincospi(xi2)  # line 3
    r = math.sqrt(max(1.0 - z * z, 0.0))  # line 4
    return r * cosine, r * sine, z  # lines 5 and 6


def algorithm4(x, y, z, share, r_min, r_max):
    if r_max == 0.0:
        return 0.0, 0.0, 0.0
    cube = (r_min / r_max) * (r_min / r_max) * (r_min / r_max)
    t = cube + share * (1.0 - cube)  # line 3, in units of r_max cubed
    r = min(max(cbrt(t) * r_max, r_min), r_max)  # line 4
    return r * x, r * y, r * z  # line 5


def make_samples(method, n, seed, r_min, r_max):
    out = []
    for k, (xi1, xi2) in enumerate(square_points(method, n, seed)):
        out.append(algorithm4(*algorithm3(xi1, xi2), random_unit(seed, 2, k), r_min, r_max))
    return np.array(out)


# Rays and textures (triangles: raycast_twin.py)


@np.errstate(all="ignore")
def texel_ray(kind, lens, u, v):
    if kind == FLAT_LINEAR:
        m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 = lens
        s_x, s_y = (u - u_0) / u_scale, (v - v_0) / v_scale
        return s_x, s_y, 0.0, (m_x - s_x) / m_z, (y_o - s_y) / z_o, 1.0, z_o, m_z
    f_u, f_v, c_u, c_v, near, far = lens[:6]
    x, y = (u - c_u) / f_u, (c_v - v) / f_v
    return (0.0, 0.0, 0.0, x, y, 1.0, near, far) if kind == PERSPECTIVE else (x, y, 0.0, 0.0, 0.0, 1.0, near, far)


def sample_texture(texels, first, wide, high, u, v, channel):
    x = (u - math.floor(u)) * wide - 0.5
    y = (1.0 - (v - math.floor(v))) * high - 0.5
    i, j = math.floor(x), math.floor(y)

    def texel(column, row):
        return float(texels[first + (row % high) * wide + column % wide, channel])

    upper = texel(i, j) + (texel(i + 1, j) - texel(i, j)) * (x - i)
    lower = texel(i, j + 1) + (texel(i + 1, j + 1) - texel(i, j + 1)) * (x - i)
    return upper + (lower - upper) * (y - j)
