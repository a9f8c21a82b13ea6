"""The rays of ray-cast ambient occlusion and the values of their hits, however these are found."""

from math import sqrt
from typing import NamedTuple

import numpy as np

from lfssao.core.elementary import sincospi
from lfssao.core.jit import kernel
from lfssao.core.philox import philox4x32
from lfssao.core.vectors import disk_axes

COSINE, UNIFORM = 0, 1
CONSTANT, LINEAR, QUADRATIC, CUBIC, SHELL = 0, 1, 2, 3, 4
_WORD = 4294967296.0
_MASK = np.uint64(0xFFFFFFFF)
_32 = np.uint64(32)


class Cast(NamedTuple):
    """The numbers of a run of ray-cast ambient occlusion."""

    radius: float  # R, world units; it may be infinite
    step: float  # how far off the surface rays begin along the normal, world units
    weighting: int  # COSINE or UNIFORM
    falloff: int  # CONSTANT, LINEAR, QUADRATIC, CUBIC or SHELL
    strata: int  # a round has strata squared rays
    least: int  # rounds of a texel, 2 or more
    most: int
    tolerance: float  # a texel is done when its standard error is not above it
    seed: np.uint64  # key of the random numbers


@kernel(inline=True)
def begin_texel(place, normal, step, point, axes):
    """Write the point where a texel's rays begin, (3,), and its axes, two and the normal, (3, 3); False: no normal."""
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
def ray_direction(texel, number, cell, cast, axes):
    """Direction of one ray of a texel's round, which has one in each of strata x strata cells of (u, v), row by row.

    The ray of cell c of round number r has Philox words 0 and 1 of counter (r strata^2 + c, 0, texel, 0).
    """
    strata, seed = cast.strata, cast.seed
    a, b, _, _ = philox4x32(number * strata * strata + cell, 0, texel, 0, seed & _MASK, seed >> _32)
    u = (np.float64(cell % strata) + (np.float64(a) + 0.5) / _WORD) / np.float64(strata)
    v = (np.float64(cell // strata) + (np.float64(b) + 0.5) / _WORD) / np.float64(strata)
    x, y, z = local_direction(u, v, cast.weighting)
    dx = (axes[0, 0] * x + axes[1, 0] * y) + axes[2, 0] * z
    dy = (axes[0, 1] * x + axes[1, 1] * y) + axes[2, 1] * z
    dz = (axes[0, 2] * x + axes[1, 2] * y) + axes[2, 2] * z
    return dx, dy, dz


@kernel(inline=True)
def covered(t, far, falloff):
    """Value of a hit at distance t, 1 - rho, rho rising from 0 at 0 to 1 at far; 0 for no hit, t = infinity."""
    if not t <= far or t == np.inf:
        return 0.0
    if falloff == CONSTANT:
        return 1.0
    part = t / far
    if falloff == LINEAR:
        return 1.0 - part
    if falloff == QUADRATIC:
        return 1.0 - part * part
    if falloff == CUBIC:
        return 1.0 - part * part * part
    part = max(part, 0.8)
    return (1.0 - part * part * part) / 0.488  # 1 - 0.8^3


@kernel(inline=True)
def standard_error(total, squares, done):
    """Standard error of the mean of k = ``done`` rounds' means m: sqrt((sum m^2 - (sum m)^2 / k) / (k (k - 1)))."""
    rest = max(squares - total * total / done, 0.0)
    return sqrt(rest / (np.float64(done) * np.float64(done - 1)))
