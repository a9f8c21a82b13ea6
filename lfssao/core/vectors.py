"""Affine maps of points, and right-angled axes around a direction."""

from lfssao.core.jit import kernel


@kernel
def transform_points(m, points, out):
    """Out = M (points, 1) for points, out: (n, 3) float64 and m: (12,) rows of four: ((m0 x + m1 y) + m2 z) + m3."""
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for row in range(3):
            k = 4 * row
            out[i, row] = ((m[k] * x + m[k + 1] * y) + m[k + 2] * z) + m[k + 3]


@kernel(inline=True)
def disk_axes(x, y, z):
    """Two unit vectors at right angles to the unit vector (x, y, z) and to each other (Duff et al. 2017)."""
    one = type(x)(1)
    sign = one if z >= 0 else -one
    a = -one / (sign + z)
    b = x * y * a
    return one + sign * x * x * a, sign * b, -sign * x, b, sign + y * y * a, -y
