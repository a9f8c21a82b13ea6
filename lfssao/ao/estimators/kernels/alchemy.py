"""Alchemy AO: SAO equation 1 on points of the positions texture around each texel.

Texels are computed by tiles, so that the surface around them, on which the turned taps of neighbours land far apart,
stays in the nearest caches. The numbers of a texel are in slots (``kernels.spans``).
"""

from typing import NamedTuple

import numpy as np

from lfssao.ao.estimators.vo.kernels.local_frame import PLACE, project
from lfssao.ao.kernels.spans import CHUNK, load, next_span, slot
from lfssao.core.elementary import power
from lfssao.core.intrinsics import on_the_stack, scratch
from lfssao.core.jit import kernel
from lfssao.core.vectors import disk_axes
from lfssao.optics.kernels.projection import MATRIX, affine_row, hold_inside, last_below, linear_row, texel_number
from lfssao.samples.kernels.spiral import rotated

# Slots: four numbers k + 0 to k + 3 are the mapping's rows u, v, divisor (of MATRIX alone) and z; three are x, y and z.
_POINT = 0
_NORMAL = 3
_ROWS = 6  # of the point
_SINE = 10
_COSINE = 11
_BIAS = 12
_TOTAL = 13
_LOOK = PLACE  # the direction in which the texel looks, before PLACE has the rows of a tap
_ALONG = 20  # the linear rows of the disk's first axis, times R
_ACROSS = 24
_slots = on_the_stack(28 * CHUNK)

_TILE = 8  # rows of a tile


class Seen(NamedTuple):
    """A view's textures row by row, one dtype: image z, +infinity where it sees no surface; world vectors, (3 H W,)."""

    depth: np.ndarray
    positions: np.ndarray
    normals: np.ndarray
    directions: np.ndarray


class Strength(NamedTuple):
    """Numbers of equation 1 in the dtype, k in float64: R, beta, epsilon (world units, squared), 2 sigma / s, k."""

    radius: np.floating
    beta: np.floating
    epsilon: np.floating
    scale: np.floating
    k: float


@kernel(inline=True)
def start_texels(projection, turns, first, away, strength, n, slots, found):
    """Begin n texels from texel number ``first`` on, whose points and directions are in their slots."""
    (kind, m), radius = projection, strength.radius
    zero, divisor = type(radius)(0), 3 if kind == MATRIX else 2  # row 3 of M is a camera's
    for i in range(n):
        x, y, z = slots[slot(_POINT, i)], slots[slot(_POINT + 1, i)], slots[slot(_POINT + 2, i)]
        ax, ay, az, bx, by, bz = disk_axes(slots[slot(_LOOK, i)], slots[slot(_LOOK + 1, i)], slots[slot(_LOOK + 2, i)])
        ax, ay, az = radius * ax, radius * ay, radius * az
        bx, by, bz = radius * bx, radius * by, radius * bz
        for k, row in ((0, 0), (1, 1), (2, divisor), (3, 2)):
            slots[slot(_ROWS + k, i)] = affine_row(m, row, x, y, z)
            slots[slot(_ALONG + k, i)] = linear_row(m, row, ax, ay, az)
            slots[slot(_ACROSS + k, i)] = linear_row(m, row, bx, by, bz)
        far = ((away[0] * x + away[1] * y) + away[2] * z) + away[3]
        slots[slot(_BIAS, i)] = strength.beta * max(far, zero)
        slots[slot(_TOTAL, i)] = zero
        texel = np.uint64(first + i)
        slots[slot(_COSINE, i)], slots[slot(_SINE, i)] = turns[0, texel], turns[1, texel]
        found[i] = 0


@kernel(inline=True)
def move_taps(x, y, n, slots):
    """The mapping's affine half of the tap (x, y) of n texels, turned at each."""
    for i in range(n):
        u, v = rotated(x, y, slots[slot(_COSINE, i)], slots[slot(_SINE, i)])
        for k in range(4):
            moved = u * slots[slot(_ALONG + k, i)] + v * slots[slot(_ACROSS + k, i)]
            slots[slot(PLACE + k, i)] = slots[slot(_ROWS + k, i)] + moved


@kernel(inline=True)
def add_terms(seen, size, epsilon, n, slots, found):
    """Add equation 1's term of one tap of n texels, max(0, v . n + z_C beta) / (v . v + epsilon), whose image is known.

    0 where the tap is outside or sees background, where numerator or denominator is no number, and where the
    denominator is 0 (the tap's point is the texel's own) or overflows (it is too far away to occlude). size: (height,
    width) of the texture. found: how many taps are in the texture, in and out.
    """
    dtype, places = type(epsilon), seen.positions
    zero, right_edge, bottom_edge = dtype(0), last_below(dtype(size[1])), last_below(dtype(size[0]))
    for i in range(n):
        u, v = slots[slot(PLACE, i)], slots[slot(PLACE + 1, i)]
        column, row = hold_inside(u, right_edge), hold_inside(v, bottom_edge)
        inside = (column == u) & (row == v)
        texel = texel_number(column, row, size[1])
        t = np.uint64(3) * np.uint64(texel)
        x = places[t] - slots[slot(_POINT, i)]
        y = places[t + np.uint64(1)] - slots[slot(_POINT + 1, i)]
        z = places[t + np.uint64(2)] - slots[slot(_POINT + 2, i)]
        nx, ny, nz = slots[slot(_NORMAL, i)], slots[slot(_NORMAL + 1, i)], slots[slot(_NORMAL + 2, i)]
        above = ((x * nx + y * ny) + z * nz) - slots[slot(_BIAS, i)]
        square = ((x * x + y * y) + z * z) + epsilon
        there = inside & (seen.depth[texel] < np.inf) & (above > zero) & (square > zero) & (square < np.inf)
        slots[slot(_TOTAL, i)] += above / square if there else zero
        found[i] += np.int32(inside)


@kernel
def finish_alchemy(depth, at, start, n, strength, slots, occlusion):
    """Write 0 from texel number ``at`` to the run's start and 1 - max(0, 1 - scale total)^k of the n in the run."""
    zero, one = depth.dtype.type(0), depth.dtype.type(1)
    for texel in range(np.uint64(at), np.uint64(start)):
        occlusion[texel] = zero
    for i in range(n):
        texel = np.uint64(start + i)
        a = max(zero, one - strength.scale * slots[slot(_TOTAL, i)])
        there = depth[texel] < np.inf
        occlusion[texel] = one - depth.dtype.type(power(np.float64(a), strength.k)) if there else zero


@kernel(rows="occlusion")
def alchemy(begin, stop, seen, taps, turns, projection, away, strength, occlusion, outside):
    """Alchemy AO of every texel, 1 - A, into occlusion (H, W), as ``alchemy.alchemy`` describes it.

    taps: (s, 2), points of the unit disk. turns: (2, H W), cosine and sine by which each texel's taps are turned. away:
    (4,), -z_C as an affine function of the point: ((a x + b y) + c z) + d, 0 where that is below 0.
    outside: (H,), out: taps of each row outside the texture or the mapping's domain; they add nothing.
    """
    size, samples, dtype = occlusion.shape, taps.shape[0], occlusion.dtype
    width, fractions, lens = size[1], occlusion.reshape(-1), projection.numbers[12:]
    slots, found = _slots(dtype), scratch(np.int32)
    for top in range(begin, stop, _TILE):
        bottom = min(stop, top + _TILE)
        for j in range(top, bottom):
            outside[j] = 0
        for column in range(0, width, CHUNK):
            for j in range(top, bottom):
                at = j * width + column
                end = min(at + CHUNK, (j + 1) * width)
                while at < end:
                    start, n = next_span(seen.depth, at, end, CHUNK)
                    load(seen.positions, start, n, slots, _POINT)
                    load(seen.normals, start, n, slots, _NORMAL)
                    load(seen.directions, start, n, slots, _LOOK)
                    start_texels(projection, turns, start, away, strength, n, slots, found)
                    for s in range(samples):
                        move_taps(taps[s, 0], taps[s, 1], n, slots)
                        project(projection.kind, lens, n, slots)
                        add_terms(seen, size, strength.epsilon, n, slots, found)
                    finish_alchemy(seen.depth, at, start, n, strength, slots, fractions)
                    for i in range(n):
                        there = seen.depth[np.uint64(start + i)] < np.inf
                        outside[j] += samples - found[i] if there else 0
                    at = start + n
