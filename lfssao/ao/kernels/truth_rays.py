"""The rays of ray-cast ambient occlusion and what they count, whoever finds what they hit."""

from math import sqrt

import numpy as np

from lfssao.core.elementary import sincospi
from lfssao.core.jit import kernel
from lfssao.core.orthonormal import disk_axes
from lfssao.core.philox import philox4x32

COSINE, UNIFORM = 0, 1
CONSTANT, LINEAR, QUADRATIC = 0, 1, 2
_WORD = 4294967296.0
_MASK = np.uint64(0xFFFFFFFF)
_32 = np.uint64(32)


@kernel(inline=True)
def begin_texel(place, normal, step, point, axes):
    """Where a texel's rays begin and around what; whether it has a normal. place, normal: (3,) scalars' arrays."""
    x, y, z = np.float64(normal[0]), np.float64(normal[1]), np.float64(normal[2])
    length = sqrt((x * x + y * y) + z * z)
    if not length > 0.0:
        return False
    x, y, z = x / length, y / length, z / length
    axes[2, 0], axes[2, 1], axes[2, 2] = x, y, z
    axes[0, 0], axes[0, 1], axes[0, 2], axes[1, 0], axes[1, 1], axes[1, 2] = disk_axes(x, y, z)
    for axis in range(3):
        point[axis] = np.float64(place[axis]) + step * axes[2, axis]
    return True


@kernel(inline=True)
def local_direction(u, v, weighting):
    """A direction about (0, 0, 1) from (u, v) in (0, 1)^2: COSINE (density cos / pi) or UNIFORM (1 / 2 pi)."""
    sine, cosine = sincospi(2.0 * v)
    if weighting == COSINE:
        r, z = sqrt(u), sqrt(1.0 - u)
    else:
        r, z = sqrt(1.0 - u * u), u
    return r * cosine, r * sine, z


@kernel(inline=True)
def ray_direction(texel, number, cell, strata, seed, weighting, axes):
    """Direction of one ray of a texel's round, which has one in each of strata x strata cells of (u, v), row by row.

    The ray of cell c of round number r has Philox words 0 and 1 of counter (r strata^2 + c, 0, texel, 0). axes: (3, 3)
    float64 rows, two axes and the normal.
    """
    a, b, _, _ = philox4x32(number * strata * strata + cell, 0, texel, 0, seed & _MASK, seed >> _32)
    u = (np.float64(cell % strata) + (np.float64(a) + 0.5) / _WORD) / np.float64(strata)
    v = (np.float64(cell // strata) + (np.float64(b) + 0.5) / _WORD) / np.float64(strata)
    x, y, z = local_direction(u, v, weighting)
    dx = (axes[0, 0] * x + axes[1, 0] * y) + axes[2, 0] * z
    dy = (axes[0, 1] * x + axes[1, 1] * y) + axes[2, 1] * z
    dz = (axes[0, 2] * x + axes[1, 2] * y) + axes[2, 2] * z
    return dx, dy, dz


@kernel(inline=True)
def covered(t, far, falloff):
    """What a hit at distance t counts: 1 - rho, rho from 0 at 0 to 1 at far; 0 for no hit, t = infinity."""
    if not t <= far or t == np.inf:
        return 0.0
    if falloff == CONSTANT:
        return 1.0
    share = t / far
    return 1.0 - (share if falloff == LINEAR else share * share)


@kernel(inline=True)
def standard_error(total, squares, done):
    """Of the mean of ``done`` rounds' means m, 2 or more: sqrt((sum m^2 - (sum m)^2 / k) / (k (k - 1)))."""
    rest = max(squares - total * total / done, 0.0)
    return sqrt(rest / (np.float64(done) * np.float64(done - 1)))
