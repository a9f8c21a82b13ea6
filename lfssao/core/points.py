"""Affine maps of many points."""

from lfssao.core.jit import kernel


@kernel
def transform_points(m, points, out):
    """Out = M (points, 1) for points, out: (n, 3) float64 and m: (12,) rows of four: ((m0 x + m1 y) + m2 z) + m3."""
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for row in range(3):
            k = 4 * row
            out[i, row] = ((m[k] * x + m[k + 1] * y) + m[k + 2] * z) + m[k + 3]
