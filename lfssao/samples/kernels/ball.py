"""LF Algorithms 3 and 4: points on the sphere and in the ball shell."""

from math import sqrt

from lfssao.core.elementary import cbrt, sincospi
from lfssao.core.jit import kernel


@kernel
def algorithm3(xi1, xi2):
    """LF Algorithm 3, lines 2 to 6: (xi1, xi2) in [-1, 1] squared to a point on the unit sphere, float64.

    The cylinder map keeps areas: uniform numbers give a uniform point.
    """
    z = xi1  # line 2
    sine, cosine = sincospi(xi2)  # line 3: phi = pi xi2
    r = sqrt(max(1.0 - z * z, 0.0))  # line 4
    return r * cosine, r * sine, z  # lines 5 and 6


@kernel
def algorithm4(x, y, z, t, r_min, r_max):
    """LF Algorithm 4, lines 3 to 5: a point of the unit sphere to the shell r_min <= r <= r_max, float64.

    t in [0, 1] stands for line 3's uniform number: r^3 = r_min^3 + t (r_max^3 - r_min^3). The cubes are taken of
    r_min / r_max, so that no radius overflows; r is held inside the shell where rounding would leave it.
    """
    if r_max == 0.0:
        return 0.0, 0.0, 0.0
    inner = r_min / r_max
    cube = inner * inner * inner
    r = cbrt(cube + t * (1.0 - cube)) * r_max  # lines 3 and 4
    r = min(max(r, r_min), r_max)
    return r * x, r * y, r * z  # line 5


@kernel
def ball_points(numbers, r_min, r_max, out):
    """Algorithms 3 and 4 for n triples xi_1, xi_2, t; numbers, out: (n, 3) float64."""
    for s in range(out.shape[0]):
        x, y, z = algorithm3(numbers[s, 0], numbers[s, 1])
        out[s, 0], out[s, 1], out[s, 2] = algorithm4(x, y, z, numbers[s, 2], r_min, r_max)
