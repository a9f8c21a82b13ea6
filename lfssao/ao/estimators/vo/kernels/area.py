"""VO section 4.2: each line's depth becomes a distribution of depths over the area that the line stands for."""

import numpy as np
from numba import prange

from lfssao.ao.estimators.vo.kernels.local_frame import (
    CHUNK,
    E1,
    EDGE_ON,
    LOOK,
    PLACE,
    SLOPES,
    SLOTS,
    STEEP,
    TILE,
    TOTAL,
    chunk_span,
    place_on_disk,
    project,
    slot,
    start_frames,
    start_points,
    start_slopes,
)
from lfssao.ao.kernels.spans import ROWS_A_BLOCK
from lfssao.core.elementary import PI, log2
from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import hold_inside, last_below

FAR = 2.0**100  # boxes end here, in units of R, so that no width is infinite; a thickness of 4 FAR has no end

# The slots of the viewing direction are free once the slopes are known.
_LOD = LOOK  # log2 of the square root of the disk's area in texels
_CENTRE = LOOK + 1  # u and v of the disk's middle
_ACROSS = E1  # the image of e1' less that


@kernel(inline=True)
def look_up(numbers, starts, pitches, level, u, v):
    """Share and moments of one level at image point (u, v), linearly between the four texels around it.

    Columns first: a + f (b - a), then rows. numbers: the pyramid, flat.
    """
    scale = np.int64((np.int64(1023) - level) << np.int64(52)).view(np.float64)  # 2^-level
    x, y = np.float64(u) * scale + 0.5, np.float64(v) * scale + 0.5  # of texel centres, border included
    i, j = np.int64(x), np.int64(y)
    f, g = x - np.float64(i), y - np.float64(j)
    at = np.uint64(level)
    upper = np.uint64(3 * (starts[at] + j * pitches[at] + i))
    lower = upper + np.uint64(3 * pitches[at])
    one, two, three, four, five = np.uint64(1), np.uint64(2), np.uint64(3), np.uint64(4), np.uint64(5)
    a0 = numbers[upper] + f * (numbers[upper + three] - numbers[upper])
    a1 = numbers[upper + one] + f * (numbers[upper + four] - numbers[upper + one])
    a2 = numbers[upper + two] + f * (numbers[upper + five] - numbers[upper + two])
    b0 = numbers[lower] + f * (numbers[lower + three] - numbers[lower])
    b1 = numbers[lower + one] + f * (numbers[lower + four] - numbers[lower + one])
    b2 = numbers[lower + two] + f * (numbers[lower + five] - numbers[lower + two])
    return a0 + g * (b0 - a0), a1 + g * (b1 - a1), a2 + g * (b2 - a2)


@kernel(inline=True)
def depth_model(numbers, starts, pitches, level, u, v):
    """Share that sees a surface, and mean and standard deviation of its depth, float64, at a level and image point.

    The level is held between 0 and the coarsest; between two levels fine + part (coarse - fine). Means are moments
    over the share, and mean nothing where that is 0.
    """
    last = np.int64(starts.shape[0] - 1)
    coarsest = np.float64(last)
    level = level if level > 0.0 else 0.0
    level = level if level < coarsest else coarsest
    fine = np.int64(level)
    part = level - np.float64(fine)
    share, first, second = look_up(numbers, starts, pitches, fine, u, v)
    a, b, c = look_up(numbers, starts, pitches, fine + np.int64(1) if fine < last else last, u, v)
    between = part > 0.0
    share = share + part * (a - share) if between else share
    first = first + part * (b - first) if between else first
    second = second + part * (c - second) if between else second
    mean = first / share
    variance = second / share - mean * mean
    return share, mean, np.sqrt(variance if variance > 0.0 else 0.0)


@kernel(inline=True)
def start_detail(kind, lens, zero, one, n, scratch):
    """_LOD: half the log2 of pi |J|, J the area of the parallelogram that the images of e1' and e2' span.

    The images are those of the places (1, 0) and (0, 1), less that of (0, 0): the disk's own size, not a derivative.
    512, beyond every level, where one of them has no image.
    """
    place_on_disk(n, zero, zero, scratch)
    project(kind, lens, n, scratch)
    for i in range(n):
        scratch[slot(_CENTRE, i)] = scratch[slot(PLACE, i)]
        scratch[slot(_CENTRE + 1, i)] = scratch[slot(PLACE + 1, i)]
    place_on_disk(n, one, zero, scratch)
    project(kind, lens, n, scratch)
    for i in range(n):
        scratch[slot(_ACROSS, i)] = scratch[slot(PLACE, i)] - scratch[slot(_CENTRE, i)]
        scratch[slot(_ACROSS + 1, i)] = scratch[slot(PLACE + 1, i)] - scratch[slot(_CENTRE + 1, i)]
    place_on_disk(n, zero, one, scratch)
    project(kind, lens, n, scratch)
    for i in range(n):
        u, v = (
            scratch[slot(PLACE, i)] - scratch[slot(_CENTRE, i)],
            scratch[slot(PLACE + 1, i)] - scratch[slot(_CENTRE + 1, i)],
        )
        area = scratch[slot(_ACROSS, i)] * v - scratch[slot(_ACROSS + 1, i)] * u
        scratch[slot(_LOD, i)] = 0.5 * log2(PI * abs(np.float64(area)))


@kernel(inline=True)
def hidden_by_box(low, high, bottom, top):
    """Length of [bottom, top] that lies behind a surface whose depth is spread evenly over [low, high].

    The share hidden at t, F(t) = (t - low) / (high - low) held between 0 and 1, integrated: its constant part and its
    linear one, as VO's V_c(z_min, z_max) and V_c(z_0, z_1, a, b), with the sign turned (hidden, not visible) and
    written so that nothing cancels: (top - t_1) + (t_1 - t_0) (F(t_0) + F(t_1)) / 2. A box of no width is a step.
    """
    zero, one, half = type(low)(0), type(low)(1), type(low)(0.5)
    start = bottom if low < bottom else low
    start = start if start < top else top
    end = bottom if high < bottom else high
    end = end if end < top else top
    width = high - low
    first = zero if start <= low else (start - low) / width if start < high else one
    last = zero if end <= low else (end - low) / width if end < high else one
    return (top - end) + (end - start) * (half * (first + last))


@kernel(parallel=True)
def area_occlusion(
    depth, positions, directions, normals, tangent, kind, rows, lens, right, radius, turns, disk, half, weights, finer,
    moments, starts, pitches, half_width, thickness, occlusion, outside,
):  # fmt: skip
    """Occlusion of every texel by areas of its disk (VO section 4.2, with 4.3 to 4.5).

    A sample at (x, y) reads share, M1 and M2 of depth from the pyramid, at the level whose texels have its area:
    linearly between the four nearest texels, then between the two nearest levels (the coarser less the finer times
    the rest of the level, plus the finer). With the mean mu = M1 and sigma = sqrt(max(M2 - M1^2, 0)), both taken to
    the unit ball, the surface is a box of half-width ``half_width`` sigma about mu, which hides, of the line from
    -z_s to min(z_s, p), ``hidden_by_box``, less the same of the box moved back by the thickness (4.3); times the share
    that sees a surface at all.

    Parameters
    ----------
    depth, positions, directions, normals, tangent, kind, rows, lens, right, radius, turns, disk, half, weights
        As for ``line_occlusion``.
    finer : (n,) float64
        Half the log2 of each sample's share of the disk's area, at most 0.
    moments, starts, pitches : (N, 3) float64, (levels,) and (levels,) int64
        The pyramid (``lfssao.ao.estimators.vo.kernels.moments``), where its levels start and how long their rows are.
    half_width : float
        Half-width of the box in units of sigma.
    thickness, occlusion, outside
        As for ``line_occlusion``.
    """
    height, width = depth.shape
    size = height * width
    surface, shares, numbers = depth.reshape(size), occlusion.reshape(size), moments.reshape(-1)
    places, looks, upright = positions.reshape(3 * size), directions.reshape(3 * size), normals.reshape(3 * size)
    dtype = type(radius)
    zero, one, edge_on = dtype(0), dtype(1), dtype(EDGE_ON)
    right_edge, bottom_edge = dtype(last_below(dtype(width))), dtype(last_below(dtype(height)))
    blocks = (height + ROWS_A_BLOCK - 1) // ROWS_A_BLOCK
    for block in prange(blocks):
        scratch, missed = np.empty(SLOTS * CHUNK, depth.dtype), np.empty(CHUNK, np.int32)
        for j in range(block * ROWS_A_BLOCK, min(height, (block + 1) * ROWS_A_BLOCK)):
            lost = 0
            for chunk in range(0, width, CHUNK):
                skipped, n = chunk_span(surface, np.uint64(j * width + chunk), min(CHUNK, width - chunk), shares)
                if n == 0:
                    continue
                first = np.uint64(j * width + chunk + skipped)
                start_frames(rows, right, radius, turns, np.uint64(j % TILE), surface, looks, first, n, scratch)
                start_slopes(tangent, upright, first, n, scratch, edge_on)
                start_points(rows, places, first, n, scratch)
                start_detail(kind, lens, zero, one, n, scratch)
                for i in range(n):
                    scratch[slot(TOTAL, i)] = zero
                    missed[i] = 0
                for s in range(disk.shape[0]):
                    x, y, z_s, weight, less = disk[s, 0], disk[s, 1], half[s], weights[s], finer[s]
                    place_on_disk(n, x, y, scratch)
                    project(kind, lens, n, scratch)
                    for i in range(n):
                        u, v = scratch[slot(PLACE, i)], scratch[slot(PLACE + 1, i)]
                        column_at, row_at = hold_inside(u, right_edge), hold_inside(v, bottom_edge)
                        inside = (column_at == u) & (row_at == v)
                        missed[i] += np.int32(not inside)
                        steep = np.float64(scratch[slot(STEEP, i)])
                        plane = (x * scratch[slot(SLOPES, i)] + y * scratch[slot(SLOPES + 1, i)]) + scratch[
                            slot(SLOPES + 2, i)
                        ]
                        top = plane if plane < z_s else z_s
                        level = np.float64(scratch[slot(_LOD, i)]) + less
                        share, mean, sigma = depth_model(numbers, starts, pitches, level, column_at, row_at)
                        middle = (mean - np.float64(scratch[slot(PLACE + 3, i)])) * steep
                        reach = (half_width * sigma) * steep
                        low = dtype(min(max(middle - reach, -FAR), FAR))
                        high = dtype(min(max(middle + reach, -FAR), FAR))
                        length = hidden_by_box(low, high, -z_s, top) - hidden_by_box(
                            low + thickness, high + thickness, -z_s, top
                        )
                        # No surface, no line, or a depth that is not a number count for nothing.
                        counts = inside & (not np.isnan(steep)) & (share > 0.0) & (top > -z_s) & (low <= high)
                        scratch[slot(TOTAL, i)] += (weight * dtype(share)) * length if counts else zero
                for i in range(n):
                    total, seen = scratch[slot(TOTAL, i)], scratch[slot(STEEP, i)] == scratch[slot(STEEP, i)]
                    total = total if total > zero else zero
                    total = total if total < one else one
                    shares[first + np.uint64(i)] = total if seen else zero
                    lost += missed[i] if seen else 0
            outside[j] = lost
