"""Horizon-based AO (Bavoil, Sainz and Dimitrov 2008): how far the horizon rises above the tangent plane, all around."""

from typing import NamedTuple

import numpy as np

from lfssao.ao.estimators.vo.kernels import local_frame as frame
from lfssao.ao.estimators.vo.kernels.local_frame import E1, LOOK, PLACE, SLOPES, SLOTS, TOTAL
from lfssao.ao.kernels.spans import CHUNK, load, slot
from lfssao.core.intrinsics import on_the_stack, scratch
from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import hold_inside, last_below, texel_number

_WHERE = E1  # P, in place of the frame's vectors, which are done with
_HORIZON = E1 + 3  # sine of the horizon's elevation so far
_AWAY = SLOTS  # D
_NEAR = SLOTS + 3  # 1 where the step's end lies in the texture, else 0
_slots = on_the_stack((SLOTS + 4) * CHUNK)
_WAY = E1 + 4  # from the texel's centre to the image of P + R (x e1' + y e2'), texels


class Horizons(NamedTuple):
    """Directions and attenuation, scalars of the arithmetic's dtype.

    around: (n, 2), x and y of the directions, unit length. mirrors: as of ``local_frame.Disk``. steps: how many along
    each. sine_bias, cosine_bias: of the angle by which the horizon must exceed the tangent plane. linear, quadratic:
    W = 1 - (linear r + quadratic r^2).
    """

    around: np.ndarray
    mirrors: np.ndarray
    steps: int
    sine_bias: np.floating
    cosine_bias: np.floating
    linear: np.floating
    quadratic: np.floating


@kernel(inline=True)
def start_direction(fan, s, column, row, n, slots):
    """_HORIZON and _WAY of direction s of the disk, whose end has just been projected.

    The tangent plane rises in this direction by the angle t with sin t = -tau / sqrt(1 + tau^2), tau = x slope_1 + y
    slope_2, towards the viewer. The horizon starts at sin(t + bias), or at 1 where t + bias passes the zenith.
    """
    dtype = slots.dtype.type
    x, y, zero, one, half = fan.around[s, 0], fan.around[s, 1], dtype(0), dtype(1), dtype(0.5)
    for i in range(n):
        tau = x * slots[slot(SLOPES, i)] + y * slots[slot(SLOPES + 1, i)]
        cosine = one / np.sqrt(one + tau * tau)
        sine = -tau * cosine
        risen = sine * fan.cosine_bias + cosine * fan.sine_bias
        slots[slot(_HORIZON, i)] = risen if cosine * fan.cosine_bias - sine * fan.sine_bias > zero else one
        slots[slot(_WAY, i)] = slots[slot(PLACE, i)] - (dtype(column + i) + half)
        slots[slot(_WAY + 1, i)] = slots[slot(PLACE + 1, i)] - (dtype(row) + half)


@kernel(inline=True)
def look_up(places, size, part, column, row, n, texels, missed, slots):
    """_AWAY and _NEAR of the surface at a part of the way, of n texels of a row from ``column`` on; places: flat."""
    dtype = slots.dtype.type
    zero, one, half = dtype(0), dtype(1), dtype(0.5)
    right_edge, bottom_edge = last_below(dtype(size[1])), last_below(dtype(size[0]))
    for i in range(n):
        u = (dtype(column + i) + half) + part * slots[slot(_WAY, i)]
        v = (dtype(row) + half) + part * slots[slot(_WAY + 1, i)]
        column_at, row_at = hold_inside(u, right_edge), hold_inside(v, bottom_edge)
        inside = (column_at == u) & (row_at == v)
        texels[i] = texel_number(column_at, row_at, size[1])
        slots[slot(_NEAR, i)] = one if inside else zero
        missed[i] += np.int32(not inside)
    for i in range(n):
        t = np.uint64(3) * np.uint64(texels[i])
        slots[slot(_AWAY, i)] = places[t] - slots[slot(_WHERE, i)]
        slots[slot(_AWAY + 1, i)] = places[t + np.uint64(1)] - slots[slot(_WHERE + 1, i)]
        slots[slot(_AWAY + 2, i)] = places[t + np.uint64(2)] - slots[slot(_WHERE + 2, i)]


@kernel(inline=True)
def raise_horizons(fan, radius, n, slots):
    """One step of one direction: where _AWAY lies above _HORIZON, that rises, and TOTAL gains the attenuated rise."""
    zero, one = type(radius)(0), type(radius)(1)
    for i in range(n):
        dx, dy = slots[slot(_AWAY, i)], slots[slot(_AWAY + 1, i)]
        dz, near = slots[slot(_AWAY + 2, i)], slots[slot(_NEAR, i)]
        length = np.sqrt((dx * dx + dy * dy) + dz * dz)
        towards = (dx * slots[slot(LOOK, i)] + dy * slots[slot(LOOK + 1, i)]) + dz * slots[slot(LOOK + 2, i)]
        sine, r, horizon = -towards / length, length / radius, slots[slot(_HORIZON, i)]
        weight = one - (fan.linear * r + fan.quadratic * (r * r))
        # Not a number where the point itself is met or nothing is: then the horizon stays.
        sine = sine if (near > zero) & (r < one) else horizon
        higher = sine if sine > horizon else horizon
        gain = weight * (higher - horizon)
        slots[slot(TOTAL, i)] += gain if higher > horizon else zero
        slots[slot(_HORIZON, i)] = higher


@kernel(rows="occlusion")
def horizon_occlusion(begin, stop, seen, fan, turns, radius, occlusion, outside):
    """Occlusion of every texel by the horizons in directions of its disk.

    A = (1 / 2 pi) integral over theta of (sin h - sin t) W, elevations above the plane through P at right angles to
    the viewing direction, by the mean over the directions. Along each, the image of P + R (x e1' + y e2') is neared in
    equal steps from the texel's centre. The surface at Q, D = Q - P, has sin = -(D . w) / |D| and r = |D| / R. If
    it lies above the horizon so far and r < 1, W (sin - horizon) is added, and it becomes the horizon. Each direction's
    sum is divided by their number at the end. outside: (H,), out: steps of each row that lie outside the texture, or in
    a direction whose end has no image; they are open.
    """
    size, fractions = occlusion.shape, occlusion.reshape(-1)
    width = size[1]
    slots, missed = _slots(fractions.dtype), scratch(np.int32)
    texels, dtype = np.empty(CHUNK, np.uint32), fractions.dtype.type
    for j in range(begin, stop):
        outside[j] = 0
        for chunk in range(0, width, CHUNK):
            first, n = frame.chunk_span(seen.depth, j * width + chunk, min(CHUNK, width - chunk), fractions)
            column = np.int64(first) - j * width
            frame.start_disks(seen, radius, fan.mirrors, True, turns, j, first, n, missed, slots)
            load(seen.positions, first, n, slots, _WHERE)
            for s in range(fan.around.shape[0]):
                frame.place_on_disk(n, fan.around[s, 0], fan.around[s, 1], slots)
                frame.project(seen.kind, seen.lens, n, slots)
                start_direction(fan, s, column, j, n, slots)
                for step in range(1, fan.steps + 1):
                    part = dtype(step) / dtype(fan.steps)
                    look_up(seen.positions, size, part, column, j, n, texels, missed, slots)
                    raise_horizons(fan, radius, n, slots)
            outside[j] += frame.finish_chunk(first, n, fan.around.shape[0], missed, slots, fractions)
