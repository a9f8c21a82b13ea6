"""The exact test of a ray and a triangle: watertight, in float64, with the same answer on every machine.

After Woop, Benthin, Wald 2013 ("Watertight ray/triangle intersection", JCGT 2:1), with the signs made exact. A ray is
x = o_x + d_x z, y = o_y + d_y z. Each corner is moved along the ray into the plane z = 0, where the ray is the origin:

    p = x - (o_x + d_x z),  q = y - (o_y + d_y z)

A corner's p and q depend on the corner and the ray alone, so triangles that share corners share their numbers, and
the moved mesh is as closed as the mesh was. The ray hits where the origin lies in the moved triangle, its edges and
corners included: where no two of the three edge functions p_b q_c - q_b p_c differ in sign. Their signs are exact,
so no ray slips between two triangles, nor hits one that it does not touch. (Exact as long as no product falls below
the normal range, 2**-969 with its rest: corners 1e-150 of a unit away from a ray, say.)
"""

from typing import NamedTuple

from lfssao.core.jit import formula, kernel

# Twice the rounding error of a difference of two rounded products is below this share of their sizes' sum.
DOUBTFUL = 2.0**-50
_SPLITTER = 134217729.0  # 2**27 + 1


@formula
def two_sum(a, b):
    """Sum of a and b as its rounded value and the exact rest (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@formula
def two_product(a, b):
    """A product as its rounded value and the exact rest (Dekker; Veltkamp's splitting, as no fused product is used)."""
    p = a * b
    t = _SPLITTER * a
    a_high = t - (t - a)
    a_low = a - a_high
    t = _SPLITTER * b
    b_high = t - (t - b)
    b_low = b - b_high
    return p, a_low * b_low - (((p - a_high * b_high) - a_low * b_high) - a_high * b_low)


@kernel
def exact_difference(a, b, c, d):
    """The number a b - c d with its exact sign: the four parts of the exact difference, added from the smallest.

    The parts are Shewchuk's expansion (1997, Two-Two-Diff): they do not overlap, so the largest that is not zero
    gives the sign and adding the smaller ones cannot change it.
    """
    p, p_rest = two_product(a, b)
    q, q_rest = two_product(c, d)
    i, x0 = two_sum(p_rest, -q_rest)
    j, o = two_sum(p, i)
    i, x1 = two_sum(o, -q)
    x3, x2 = two_sum(j, i)
    return ((x0 + x1) + x2) + x3


@formula
def edge_function(a, b, c, d):
    """The number a b - c d: as it rounds where its sign is beyond doubt, exact_difference where it is not."""
    p, q = a * b, c * d
    difference = p - q
    if abs(difference) > DOUBTFUL * (abs(p) + abs(q)):
        return difference
    return exact_difference(a, b, c, d)


class Triangle(NamedTuple):
    """Corners a, b and c of a triangle, cast space, float64; scalars, as an array would have its references counted."""

    ax: float
    ay: float
    az: float
    bx: float
    by: float
    bz: float
    cx: float
    cy: float
    cz: float


@formula
def triangle_at(corners, p):
    """The triangle of a row of corners, (F, 9) float64."""
    return Triangle(
        corners[p, 0], corners[p, 1], corners[p, 2],
        corners[p, 3], corners[p, 4], corners[p, 5],
        corners[p, 6], corners[p, 7], corners[p, 8],
    )  # fmt: skip


@formula
def edge_functions(ox, oy, dx, dy, t):
    """The three edge functions of a triangle moved along the ray x = ox + dx z, y = oy + dy z."""
    ap, aq = t.ax - (ox + dx * t.az), t.ay - (oy + dy * t.az)
    bp, bq = t.bx - (ox + dx * t.bz), t.by - (oy + dy * t.bz)
    cp, cq = t.cx - (ox + dx * t.cz), t.cy - (oy + dy * t.cz)
    return edge_function(bp, cq, bq, cp), edge_function(cp, aq, cq, ap), edge_function(ap, bq, aq, bp)


@formula
def depth_on(t, u, v, w):
    """The z = ((u a_z + v b_z) + w c_z) / ((u + v) + w) of a triangle, held between its corners' z."""
    z = ((u * t.az + v * t.bz) + w * t.cz) / ((u + v) + w)
    return min(max(z, min(t.az, t.bz, t.cz)), max(t.az, t.bz, t.cz))


@formula
def hit_triangle(ox, oy, dx, dy, t):
    """Whether the ray x = ox + dx z, y = oy + dy z hits a triangle, not exactly edge on, and at what z."""
    u, v, w = edge_functions(ox, oy, dx, dy, t)
    if (u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0):
        return False, 0.0
    if (u + v) + w == 0.0:
        return False, 0.0
    return True, depth_on(t, u, v, w)


@formula
def point_on_triangle(ox, oy, dx, dy, t):
    """The point at which the ray hits a triangle: z, and the barycentric weights of b and c.

    Embree's float32 may name a triangle that the ray passes by. Edge functions of the wrong sign then count as 0, which
    gives a point of the triangle beside the ray; corner a stands for a triangle seen exactly edge on.
    """
    u, v, w = edge_functions(ox, oy, dx, dy, t)
    area = (u + v) + w
    if area == 0.0:
        return t.az, 0.0, 0.0
    u = 0.0 if u < 0.0 < area or area < 0.0 < u else u
    v = 0.0 if v < 0.0 < area or area < 0.0 < v else v
    w = 0.0 if w < 0.0 < area or area < 0.0 < w else w
    area = (u + v) + w
    return depth_on(t, u, v, w), v / area, w / area
