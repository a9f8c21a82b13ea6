"""Whether a ray hits a triangle, and at what depth: float64, the same answer on every machine, no cracks.

After Woop, Benthin, Wald 2013 ("Watertight ray/triangle intersection", JCGT 2:1), with the signs made exact. A ray is
x = o_x + d_x z, y = o_y + d_y z. Each corner is moved along the ray into the plane z = 0, where the ray is the origin:

    p = x - (o_x + d_x z),  q = y - (o_y + d_y z)

A corner's p and q depend on the corner and the ray alone, so triangles that share corners share their numbers, and
the moved mesh is as closed as the mesh was. The ray hits where the origin lies in the moved triangle, its edges and
corners included: where no two of the three edge functions p_b q_c - q_b p_c differ in sign. Their signs are exact,
so no ray slips between two triangles, nor hits one that it does not touch. (Exact as long as no product falls below
the normal range, 2**-969 with its rest: corners 1e-150 of a unit away from a ray, say.)
"""

from lfssao.core.jit import kernel

# Twice the rounding error of a difference of two rounded products is below this share of their sizes' sum.
DOUBTFUL = 2.0**-50
_SPLITTER = 134217729.0  # 2**27 + 1


@kernel(inline=True)
def two_sum(a, b):
    """Sum of a and b as its rounded value and the exact rest (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@kernel(inline=True)
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


@kernel(inline=True)
def edge_function(a, b, c, d):
    """The number a b - c d: as it rounds where its sign is beyond doubt, exact_difference where it is not."""
    p, q = a * b, c * d
    difference = p - q
    if abs(difference) > DOUBTFUL * (abs(p) + abs(q)):
        return difference
    return exact_difference(a, b, c, d)


@kernel(inline=True)
def hit_triangle(ox, oy, dx, dy, ax, ay, az, bx, by, bz, cx, cy, cz):
    """Depth at which a ray hits a triangle.

    Parameters
    ----------
    ox, oy, dx, dy : float64
        The ray x = ox + dx z, y = oy + dy z.
    ax, ay, az, bx, by, bz, cx, cy, cz : float64
        The corners a, b, c (scalars, as each array handed over would have its references counted).

    Returns
    -------
    hit : bool
        Whether the ray meets the triangle; not where it is seen exactly edge on.
    z : float64
        ((u a_z + v b_z) + w c_z) / ((u + v) + w), held between the corners' z.
    weight_b, weight_c : float64
        Weights of b and c at that point, v and w over the same sum.
    """
    ap, aq = ax - (ox + dx * az), ay - (oy + dy * az)
    bp, bq = bx - (ox + dx * bz), by - (oy + dy * bz)
    cp, cq = cx - (ox + dx * cz), cy - (oy + dy * cz)
    u = edge_function(bp, cq, bq, cp)
    v = edge_function(cp, aq, cq, ap)
    w = edge_function(ap, bq, aq, bp)
    if (u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0):
        return False, 0.0, 0.0, 0.0
    area = (u + v) + w
    if area == 0.0:
        return False, 0.0, 0.0, 0.0
    z = ((u * az + v * bz) + w * cz) / area
    z = max(z, min(az, bz, cz))
    z = min(z, max(az, bz, cz))
    return True, z, v / area, w / area
