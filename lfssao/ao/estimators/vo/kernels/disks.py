"""VO by the areas that lines along the viewing direction stand for (4.2): a distribution of depths each."""

import numpy as np

from lfssao.ao.estimators.vo.kernels import local_frame as frame
from lfssao.ao.estimators.vo.kernels.local_frame import E1, LOOK, PLACE, STEEP, TOTAL
from lfssao.ao.kernels.spans import CHUNK, slot
from lfssao.core.elementary import PI, log2
from lfssao.core.intrinsics import scratch
from lfssao.core.jit import kernel
from lfssao.optics.kernels.projection import hold_inside, last_below

FAR = 2.0**100  # boxes end here, in units of R, so that no width is infinite; a thickness of 4 FAR has no end

# The slots of the viewing direction are free once the slopes are known.
_LOD = LOOK  # log2 of the square root of the disk's area in texels
_CENTRE = LOOK + 1  # u and v of the disk's middle
_ACROSS = E1  # the image of e1' less that


@kernel(inline=True)
def look_up(pyramid, level, u, v):
    """Fraction and moments of a level at image point (u, v), linearly between four texels: columns first, then rows."""
    numbers, starts, pitches = pyramid.moments, pyramid.starts, pyramid.pitches
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
def depth_model(pyramid, level, u, v):
    """Fraction that sees a surface, and mean and standard deviation of its depth, float64, at a level and image point.

    The level is held between 0 and the coarsest; between two levels fine + part (coarse - fine). Means are moments
    over the fraction, and mean nothing where that is 0.
    """
    last = np.int64(pyramid.starts.shape[0] - 1)
    coarsest = np.float64(last)
    level = min(coarsest, max(0.0, level))
    fine = np.int64(level)
    part = level - np.float64(fine)
    seeing, first, second = look_up(pyramid, fine, u, v)
    a, b, c = look_up(pyramid, fine + np.int64(1) if fine < last else last, u, v)
    between = part > 0.0
    seeing = seeing + part * (a - seeing) if between else seeing
    first = first + part * (b - first) if between else first
    second = second + part * (c - second) if between else second
    mean = first / seeing
    variance = second / seeing - mean * mean
    return seeing, mean, np.sqrt(variance if variance > 0.0 else 0.0)


@kernel(inline=True)
def start_detail(seen, n, slots):
    """_LOD: half the log2 of pi |J|, J the area of the parallelogram that the images of e1' and e2' span.

    The images are those of the places (1, 0) and (0, 1), less that of (0, 0): the disk's own size, not a derivative.
    512, beyond every level, where one of them has no image.
    """
    zero, one = slots.dtype.type(0), slots.dtype.type(1)
    frame.place_on_disk(n, zero, zero, slots)
    frame.project(seen.kind, seen.lens, n, slots)
    for i in range(n):
        slots[slot(_CENTRE, i)] = slots[slot(PLACE, i)]
        slots[slot(_CENTRE + 1, i)] = slots[slot(PLACE + 1, i)]
    frame.place_on_disk(n, one, zero, slots)
    frame.project(seen.kind, seen.lens, n, slots)
    for i in range(n):
        slots[slot(_ACROSS, i)] = slots[slot(PLACE, i)] - slots[slot(_CENTRE, i)]
        slots[slot(_ACROSS + 1, i)] = slots[slot(PLACE + 1, i)] - slots[slot(_CENTRE + 1, i)]
    frame.place_on_disk(n, zero, one, slots)
    frame.project(seen.kind, seen.lens, n, slots)
    for i in range(n):
        u, v = slots[slot(PLACE, i)] - slots[slot(_CENTRE, i)], slots[slot(PLACE + 1, i)] - slots[slot(_CENTRE + 1, i)]
        area = slots[slot(_ACROSS, i)] * v - slots[slot(_ACROSS + 1, i)] * u
        slots[slot(_LOD, i)] = 0.5 * log2(PI * abs(np.float64(area)))


@kernel(inline=True)
def hidden_by_box(low, high, bottom, top):
    """Length of [bottom, top] that lies behind a surface whose depth is spread evenly over [low, high].

    The fraction hidden at t, F(t) = (t - low) / (high - low) held between 0 and 1, integrated: its constant part and
    its linear one, as VO's V_c(z_min, z_max) and V_c(z_0, z_1, a, b), with the sign turned (hidden, not visible) and
    written so that nothing cancels: (top - t_1) + (t_1 - t_0) (F(t_0) + F(t_1)) / 2. A box of no width is a step.
    """
    zero, one, half = type(low)(0), type(low)(1), type(low)(0.5)
    start, end = min(top, max(low, bottom)), min(top, max(high, bottom))
    width = high - low
    first = zero if start <= low else (start - low) / width if start < high else one
    last = zero if end <= low else (end - low) / width if end < high else one
    return (top - end) + (end - start) * (half * (first + last))


@kernel(inline=True)
def add_area(pyramid, half_width, size, disk, s, thickness, n, missed, slots):
    """Add what area s of n texels hides, times its weight; size: (height, width) of the texture."""
    x, y, z_s, weight, less = disk.places[s, 0], disk.places[s, 1], disk.half[s], disk.weights[s], disk.finer[s]
    dtype = type(thickness)
    zero, right_edge, bottom_edge = dtype(0), last_below(dtype(size[1])), last_below(dtype(size[0]))
    for i in range(n):
        u, v = slots[slot(PLACE, i)], slots[slot(PLACE + 1, i)]
        column, row = hold_inside(u, right_edge), hold_inside(v, bottom_edge)
        inside = (column == u) & (row == v)
        missed[i] += np.int32(not inside)
        steep = np.float64(slots[slot(STEEP, i)])
        top = frame.line_top(x, y, z_s, i, slots)
        level = np.float64(slots[slot(_LOD, i)]) + less
        seeing, mean, sigma = depth_model(pyramid, level, column, row)
        middle = (mean - np.float64(slots[slot(PLACE + 3, i)])) * steep
        reach = (half_width * sigma) * steep
        low = dtype(min(max(middle - reach, -FAR), FAR))
        high = dtype(min(max(middle + reach, -FAR), FAR))
        near = hidden_by_box(low, high, -z_s, top)
        length = near - hidden_by_box(low + thickness, high + thickness, -z_s, top)
        # No surface, no line, or a depth that is not a number count for nothing.
        counts = inside & (not np.isnan(steep)) & (seeing > 0.0) & (top > -z_s) & (low <= high)
        slots[slot(TOTAL, i)] += (weight * dtype(seeing)) * length if counts else zero


@kernel(rows="occlusion")
def area_occlusion(begin, stop, seen, disk, pyramid, half_width, turns, radius, thickness, occlusion, outside):
    """Occlusion of every texel by areas of its disk (VO section 4.2, with 4.3 to 4.5).

    A sample at (x, y) reads the fraction that sees a surface, M1 and M2 of depth from the pyramid, at the level whose
    texels have its area: linearly between the four nearest texels, then between the two nearest levels (the coarser
    less the finer times the rest of the level, plus the finer). With the mean mu = M1 and sigma = sqrt(max(M2 - M1^2,
    0)), both taken to the unit ball, the surface is a box of half-width ``half_width`` sigma about mu, which hides, of
    the line from -z_s to min(z_s, p), ``hidden_by_box``, less the same of the box moved back by the thickness (4.3);
    times the fraction that sees a surface at all.

    turns: (2, H * W), cosine and sine by which each texel's samples are turned. radius: R, world units. thickness: T,
    in units of R, 4 FAR where surfaces hide all that is behind them. occlusion: (H, W), out. outside: (H,), out: areas
    of each row that have no image or lie outside the texture; they are open.
    """
    size, fractions = occlusion.shape, occlusion.reshape(-1)
    width = size[1]
    slots, missed = frame.frame_slots(fractions.dtype), scratch(np.int32)
    for j in range(begin, stop):
        outside[j] = 0
        for chunk in range(0, width, CHUNK):
            first, n = frame.chunk_span(seen.depth, j * width + chunk, min(CHUNK, width - chunk), fractions)
            frame.start_disks(seen, radius, disk.mirrors, disk.tangent, turns, j, first, n, missed, slots)
            start_detail(seen, n, slots)
            for s in range(disk.half.shape[0]):
                frame.place_on_disk(n, disk.places[s, 0], disk.places[s, 1], slots)
                frame.project(seen.kind, seen.lens, n, slots)
                add_area(pyramid, half_width, size, disk, s, thickness, n, missed, slots)
            outside[j] += frame.finish_chunk(first, n, 1, missed, slots, fractions)
