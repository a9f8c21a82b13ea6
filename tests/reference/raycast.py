"""The ray caster by brute force: every triangle on every ray, float64, nothing left out.

NumPy only carries + - * / elementwise over (rays, triangles), in the order of operations that the kernels document; the
sign of a doubtful edge function is that of exact fractions.
"""

import math
from dataclasses import dataclass

import numpy as np

CROSSED_SLITS, MATRIX = 0, 1
AT_ONCE = 100_000  # pairs of ray and triangle: what a processor's cache holds


@dataclass
class Hits:
    """One value a ray: triangle or -1, depth in cast space, weights of the second and third corner, triangles met."""

    triangle: np.ndarray
    z: np.ndarray
    weights: np.ndarray
    met: np.ndarray


@np.errstate(all="ignore")
def rays_at(kind, lens, u, v):
    """Rays x = ox + dx z, y = oy + dy z through image points, and between which z they run: six arrays."""
    if kind == CROSSED_SLITS:
        m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 = lens.tolist()
        x, y = (u - u_0) / u_scale, (v - v_0) / v_scale
        return x, y, (m_x - x) / m_z, (y_o - y) / z_o, np.full_like(x, z_o), np.full_like(x, m_z)
    f_u, f_v, c_u, c_v, near, far, orthographic, _ = lens.tolist()
    x, y = (u - c_u) / f_u, (c_v - v) / f_v
    nothing, near, far = np.zeros_like(x), np.full_like(x, near), np.full_like(x, far)
    return (x, y, nothing, nothing, near, far) if orthographic else (nothing, nothing, x, y, near, far)


def texel_rays(kind, lens, width, height):
    """The rays of all texels' centres, row by row."""
    v, u = (n.ravel() + 0.5 for n in np.mgrid[:height, :width])
    return rays_at(kind, lens, u, v)


def affine(m, x, y, z):
    return [((row[0] * x + row[1] * y) + row[2] * z) + row[3] for row in np.asarray(m).tolist()]


def exact_sign(a, b, c, d):
    """Sign of a b - c d, exact: floats are whole numbers over powers of two. Fractions would look for divisors."""
    (a, e), (b, f), (c, g), (d, h) = (n.as_integer_ratio() for n in (a, b, c, d))
    p, q = (a * b) * (g * h), (c * d) * (e * f)
    return (p > q) - (p < q)


def two_sum(a, b):
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def two_product(a, b):
    def halves(n):
        t = 134217729.0 * n  # 2^27 + 1
        high = t - (t - n)
        return high, n - high

    p = a * b
    (a_high, a_low), (b_high, b_low) = halves(a), halves(b)
    return p, a_low * b_low - (((p - a_high * b_high) - a_low * b_high) - a_high * b_low)


def exact_difference(a, b, c, d):
    """Sum of the four parts of a b - c d, the smallest first (Shewchuk 1997, Two-Two-Diff)."""
    (p, p_rest), (q, q_rest) = two_product(a, b), two_product(c, d)
    i, x0 = two_sum(p_rest, -q_rest)
    j, other = two_sum(p, i)
    i, x1 = two_sum(other, -q)
    x3, x2 = two_sum(j, i)
    return ((x0 + x1) + x2) + x3


def edge_functions(a, b, c, d):
    """Numbers a b - c d and their signs, exact ones where 2^-50 (|a b| + |c d|) leaves a doubt."""
    a, b, c, d = np.broadcast_arrays(a, b, c, d)
    p, q = a * b, c * d
    value = p - q
    sign = np.sign(value).astype(int)
    doubtful = np.nonzero(~(np.abs(value) > 2.0**-50 * (np.abs(p) + np.abs(q))))
    if len(doubtful[0]):
        corners = [n[doubtful] for n in (a, b, c, d)]
        value[doubtful] = exact_difference(*corners)
        trivial = ((corners[0] == 0) | (corners[1] == 0)) & ((corners[2] == 0) | (corners[3] == 0))
        signs = np.zeros(len(trivial), int)
        lists = [n[~trivial].tolist() for n in corners]
        signs[~trivial] = [exact_sign(*four) for four in zip(*lists, strict=True)]
        sign[doubtful] = signs
    return value, sign


def edges_of(ox, oy, dx, dy, triangles):
    """The three edge functions of rays and triangles, their corners as arrays x, y, z, each with its sign."""
    (ap, aq), (bp, bq), (cp, cq) = ((x - (ox + dx * z), y - (oy + dy * z)) for x, y, z in triangles)
    return [edge_functions(*four) for four in ((bp, cq, bq, cp), (cp, aq, cq, ap), (ap, bq, aq, bp))]


@np.errstate(all="ignore")
def first_hits(rays, corners):
    """First hit of every ray on triangles, corners (F, 3, 3) in cast space; ties go to the lower number."""
    size = len(rays[0])
    out = Hits(np.full(size, -1, np.int32), np.full(size, np.nan), np.full((size, 2), np.nan), np.zeros(size, int))
    triangles = [np.ascontiguousarray(corners[:, k].T) for k in range(3)]
    az, bz, cz = (corner[2] for corner in triangles)
    lowest = np.minimum(np.minimum(az, bz), cz)
    highest = np.maximum(np.maximum(az, bz), cz)
    step = max(1, AT_ONCE // len(corners))
    for start in range(0, size, step):
        part = slice(start, start + step)
        ox, oy, dx, dy, near, far = (n[part, None] for n in rays)
        (u, v, w), signs = map(np.stack, zip(*edges_of(ox, oy, dx, dy, triangles), strict=True))
        hit = (signs.min(axis=0) >= 0) ^ (signs.max(axis=0) <= 0)  # not where all three are zero
        area = (u + v) + w
        z = ((u * az + v * bz) + w * cz) / area
        z = np.where(lowest > z, lowest, z)
        z = np.where(highest < z, highest, z)
        hit &= (near < z) & (z < far)
        out.met[part] = hit.sum(axis=1)
        z[~hit] = np.inf
        first = z.argmin(axis=1)  # the lowest of equal ones
        row = np.arange(len(first))
        found = hit[row, first]
        row, first = row[found], first[found]
        out.triangle[part][found] = first
        out.z[part][found] = z[row, first]
        out.weights[part][found, 0] = v[row, first] / area[row, first]
        out.weights[part][found, 1] = w[row, first] / area[row, first]
    return out


@np.errstate(all="ignore")
def on_triangles(rays, corners, triangle):
    """Hits of each ray on one given triangle or none (-1): negative weights are set to 0, edge on it is corner a."""
    ox, oy, dx, dy, _, _ = rays
    triangles = [corners[triangle, k].T for k in range(3)]
    az, bz, cz = (corner[2] for corner in triangles)
    edges = [value for value, _ in edges_of(ox, oy, dx, dy, triangles)]
    whole = (edges[0] + edges[1]) + edges[2]
    u, v, w = (np.where((e < 0) & (whole > 0) | (e > 0) & (whole < 0), 0.0, e) for e in edges)
    area = (u + v) + w
    z = ((u * az + v * bz) + w * cz) / area
    z = np.clip(z, np.minimum(np.minimum(az, bz), cz), np.maximum(np.maximum(az, bz), cz))
    hit, edge_on = triangle >= 0, whole == 0
    z = np.where(edge_on, az, z)
    weights = np.where(hit, np.where(edge_on, 0.0, np.stack([v / area, w / area])), np.nan).T
    return Hits(np.where(hit, triangle, -1).astype(np.int32), np.where(hit, z, np.nan), weights, hit.astype(int))


@np.errstate(all="ignore")
def surface(kind, lens, rays, world_from_cast, hits):
    """Depth and positions of hits: float64, rounded once to float32; infinity where there is no surface."""
    ox, oy, dx, dy, near, far = rays
    z = hits.z
    positions = np.stack(affine(world_from_cast, ox + z * dx, oy + z * dy, z), axis=1).astype(np.float32)
    if kind != MATRIX:
        depth = z.astype(np.float32)
    elif lens[6]:
        depth = ((z - near) / (far - near)).astype(np.float32)
    else:
        depth = (far / (far - near) * (1.0 - near / z)).astype(np.float32)
    nothing = hits.triangle < 0
    depth[nothing], positions[nothing] = np.inf, np.inf
    return depth, positions


def period(t, wrap):
    """A texture coordinate within the first period: 1 for "repeat", 2 for "mirror"; "clamp" ends at 0 and 1."""
    if wrap == "clamp":
        return min(max(t, 0.0), 1.0)
    return t - math.floor(t) if wrap == "repeat" else t - 2.0 * math.floor(t / 2.0)


def wrapped(number, size, wrap):
    """The texel at a number along an axis; a mirrored axis has the texels 0, 1, ..., size - 1, size - 1, ..., 0."""
    if wrap == "mirror":
        return [*range(size), *range(size - 1, -1, -1)][number % (2 * size)]
    return number % size if wrap == "repeat" else [0, *range(size), size - 1][number + 1]


def sample_texture(texture, u, v, channel, wraps=("repeat", "repeat")):
    """Bilinear, v upwards."""
    high, wide, _ = texture.shape
    x = period(u, wraps[0]) * wide - 0.5
    y = (1.0 - period(v, wraps[1])) * high - 0.5
    i, j = math.floor(x), math.floor(y)

    def texel(column, row):
        return float(texture[wrapped(row, high, wraps[1]), wrapped(column, wide, wraps[0]), channel])

    upper = texel(i, j) + (texel(i + 1, j) - texel(i, j)) * (x - i)
    lower = texel(i, j + 1) + (texel(i + 1, j + 1) - texel(i, j + 1)) * (x - i)
    return upper + (lower - upper) * (y - j)


def colors(hits, faces, factors, face_material, vertex_colors, uv, textures, samplers):
    """Colour of hits: factor x vertex colour x texture."""
    rgb = np.zeros((len(hits.triangle), 3), np.float32)
    for k in np.flatnonzero(hits.triangle >= 0):
        face = hits.triangle[k]
        b, c = hits.weights[k].tolist()
        a = (1.0 - b) - c

        def mixed(values, a=a, b=b, c=c, corners=faces[face]):
            at_a, at_b, at_c = (float(values[n]) for n in corners)
            return (at_a * a + at_b * b) + at_c * c

        material = face_material[face]
        for channel in range(3):
            value = float(factors[material, channel])
            if vertex_colors is not None:
                value = value * mixed(vertex_colors[:, channel])
            if textures[material] is not None:
                at, wraps = (mixed(uv[:, 0]), mixed(uv[:, 1])), samplers[material][:2]
                value = value * sample_texture(textures[material], *at, channel, wraps)
            rgb[k, channel] = value
    return rgb
