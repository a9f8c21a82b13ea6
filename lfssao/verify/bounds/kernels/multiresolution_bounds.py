"""The least and the largest occlusion of levels of resolution, and of what is carried from level to level, by balls.

Which texel stands for another, and which are read, no arithmetic decides: levels are those of the kernels
(``ao.estimators.kernels.multiresolution``), whose formulas are run here.
"""

import numpy as np

from lfssao.ao.estimators.kernels.multiresolution import obscured, upsampling_weight
from lfssao.core.balls import SAFETY, UNKNOWN, Ball, ball_between
from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import rounded
from lfssao.verify.bounds.kernels.images import certain, certain_vector

_ORDERS = 12  # roundings of a weighted mean of four, in any order, of weights that are normalised or not


@formula
def _difference(texture, one, other, by):
    """The difference of the vectors of two texels of a texture (N, 3)."""
    return certain_vector(texture[one], by) - certain_vector(texture[other], by)


@kernel(rows="level")
def bound_level(begin, stop, level, places, facing, reach, radius, squared, by, sums):
    """Write the least and the largest sum of the taps of every texel of a level, (2, h, w) float64.

    level, places, facing, reach, radius, squared: as of ``level_occlusion``.
    """
    height, width = level.shape
    like = certain(0.0, by)
    far, farther = certain(radius, by), rounded(squared, 3, like)
    for j in range(begin, stop):
        for i in range(width):
            low, high, texel = 0.0, 0.0, level[j, i]
            if texel >= 0:
                n = certain_vector(facing[texel], by)
                for line in range(max(j - reach, 0), min(j + reach, height - 1) + 1):
                    for column in range(max(i - reach, 0), min(i + reach, width - 1) + 1):
                        tap = level[line, column]
                        if tap >= 0 and tap != texel:
                            term = obscured(_difference(places, tap, texel, by), n, far, farther)
                            error = term.error * SAFETY
                            low, high = low + max(term.value - error, 0.0), high + max(term.value + error, 0.0)
            sums[0, j, i], sums[1, j, i] = low, high


@formula
def _coarse_texel(coarse, j, i, k):
    """Row and column of the k-th coarse texel around a fine one, its weight, and the texel it stands for, -1 for none.

    The weight is 9 of its own coarse texel, 3 and 1 of those on the side on which it lies.
    """
    down, across = k // 2, k % 2
    row, column = j // 2 + down * (2 * (j % 2) - 1), i // 2 + across * (2 * (i % 2) - 1)
    inside = 0 <= row < coarse.shape[0] and 0 <= column < coarse.shape[1]
    return row, column, (3 - 2 * down) * (3 - 2 * across), coarse[row, column] if inside else np.int32(-1)


@formula
def _carry(coarse, weights, coarser, j, i, by):
    """The least and the largest weighted mean of what the coarse texels around a fine one carry; coarser: (2, h, w).

    weights: (4, 2), values and errors.
    Let w be the weights that a renderer has, and c what they carry. Their mean is b + sum of w (c - b) over the sum of
    w, for any b: b is the least of c, so that errors of w count for what c differ by. It lies between those of c.
    """
    like = certain(0.0, by)
    base, top, total, carried = np.inf, 0.0, like, like
    for k in range(4):
        row, column, _, texel = _coarse_texel(coarse, j, i, k)
        if texel >= 0:
            base, top = min(base, coarser[0, row, column]), max(top, coarser[1, row, column])
    for k in range(4):
        row, column, _, texel = _coarse_texel(coarse, j, i, k)
        if texel >= 0:
            above = ball_between(coarser[0, row, column] - base, coarser[1, row, column] - base, like)
            w = Ball(weights[k, 0], weights[k, 1], like)
            total, carried = total + w, carried + w * above
    part = carried / total
    mean = rounded(Ball(base + part.value, part.error, like), _ORDERS, like, 1)
    room, error = 1.0 + 2.0 * (_ORDERS * by.operation + by.quotient), mean.error * SAFETY
    low, high = base / room, top * room
    if error < UNKNOWN:
        low, high = max(low, mean.value - error), min(high, mean.value + error)
    return low if (total > 0).must else 0.0, high


@kernel(rows="fine")
def bound_refined(begin, stop, fine, coarse, places, facing, radius, by, coarser, finer, undecided):
    """Add what a coarse level carries to the next finer one: to its maximum and to its sum over levels.

    fine, coarse, places, facing, radius: as of ``refine``. coarser, finer: (2, 2, h, w) float64, the least and the
    largest maximum, and sum; those of the fine level are its own occlusion before. undecided: (h, w) int32 of the fine
    level, gains 1 where it is in doubt whether any weight is above 0.
    """
    like, weights = certain(0.0, by), np.zeros((4, 2))
    for j in range(begin, stop):
        for i in range(fine.shape[1]):
            texel, total = fine[j, i], like
            if texel < 0:
                continue
            n = certain_vector(facing[texel], by)
            for k in range(4):
                _, _, near, other = _coarse_texel(coarse, j, i, k)
                if other >= 0:
                    v, m = _difference(places, other, texel, by), certain_vector(facing[other], by)
                    w = near * upsampling_weight(v, n, m, certain(radius, by))
                    total, weights[k, 0], weights[k, 1] = total + w, w.value, w.error
            if (total > 0).may:
                undecided[j, i] += np.int32(not (total > 0).must)
                low, high = _carry(coarse, weights, coarser[0], j, i, by)
                finer[0, 0, j, i], finer[0, 1, j, i] = max(finer[0, 0, j, i], low), max(finer[0, 1, j, i], high)
                low, high = _carry(coarse, weights, coarser[1], j, i, by)
                own = ball_between(finer[1, 0, j, i], finer[1, 1, j, i], like)
                all_levels = own + ball_between(low, high, like)
                finer[1, 0, j, i] = max(all_levels.value - all_levels.error * SAFETY, 0.0)
                finer[1, 1, j, i] = all_levels.value + all_levels.error * SAFETY
