"""Maps from the square to the sphere, the ball and the disk, and rejection.

All maps keep volumes: uniform numbers give uniform points.
"""

from math import sqrt

from lfssao.core.elementary import sincospi
from lfssao.core.jit import kernel
from lfssao.core.philox import random_signed
from lfssao.samples.kernels.ball import algorithm3, algorithm4


@kernel
def sphere_points(square, out):
    """Algorithm 3 for n points; square: (n, 2), xi_1 and xi_2; out: (n, 3)."""
    for k in range(out.shape[0]):
        out[k, 0], out[k, 1], out[k, 2] = algorithm3(square[k, 0], square[k, 1])


@kernel
def disk_points(square, out):
    """Points of the unit disk, (n, 2): r^2 = (1 + xi_1) / 2, phi = pi xi_2."""
    for k in range(out.shape[0]):
        sine, cosine = sincospi(square[k, 1])
        r = sqrt(0.5 + 0.5 * square[k, 0])
        out[k, 0], out[k, 1] = r * cosine, r * sine


@kernel
def shell_points(ball, r_min, r_max, out):
    """Points of the unit ball moved along their radius into the shell: r^3 becomes Algorithm 4's t.

    ball, out: (n, 3). With r_min = 0 that is a multiplication by r_max. The centre goes to the top of the inner sphere.
    """
    for k in range(out.shape[0]):
        x, y, z = ball[k, 0], ball[k, 1], ball[k, 2]
        r = sqrt((x * x + y * y) + z * z)
        if r_min == 0.0:
            out[k, 0], out[k, 1], out[k, 2] = r_max * x, r_max * y, r_max * z
        elif r == 0.0:
            out[k, 0], out[k, 1], out[k, 2] = algorithm4(0.0, 0.0, 1.0, 0.0, r_min, r_max)
        else:
            t = min(r * r * r, 1.0)
            out[k, 0], out[k, 1], out[k, 2] = algorithm4(x / r, y / r, z / r, t, r_min, r_max)


@kernel
def rejection(seed, out):
    """Uniform points of the unit ball, (n, 3), or disk, (n, 2): those of the cube or square that lie in it.

    Try k's coordinate a is number k of stream a; no try is the centre.
    """
    n, d = out.shape
    count = k = 0
    while count < n:
        square = 0.0
        for a in range(d):
            out[count, a] = random_signed(seed, a, k)
            square += out[count, a] * out[count, a]
        k += 1
        if square <= 1.0:
            count += 1
