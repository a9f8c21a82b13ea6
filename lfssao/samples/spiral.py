"""SAO's spiral: how good a number of turns is, and the best one for each number of taps (SAO section 2.3).

Taps i = 0 .. s - 1 stand at radius alpha_i = (i + 1/2) / s and at the angle alpha_i tau turns. SAO chooses tau "to
ensure equal angular distribution" and prints no criterion. Ours: the mean square, over all sectors (radii up to a, an
arc of the circle), of the difference between the fraction of taps in the sector and the fraction it ought to hold,
a times the arc. tau and s - tau are mirror images; the table has the smallest of equals.
"""

from math import gcd, sqrt

import numpy as np

from lfssao.core.arguments import check_whole

# For s = 1, 2, ..., 99.
BEST_TURNS = (
    1, 1, 1, 1, 2, 1, 2, 3, 2, 3, 3, 5, 5, 3, 4, 7, 5, 5, 7, 9, 8, 5, 7, 7, 7, 7, 8, 5, 12, 11, 12, 7, 10,
    13, 8, 11, 10, 9, 16, 11, 12, 13, 12, 13, 19, 17, 13, 11, 18, 19, 11, 11, 23, 17, 21, 17, 13, 17, 18, 13, 17, 23,
    17, 19, 19, 25, 18, 19, 19, 29, 21, 19, 27, 31, 29, 21, 18, 17, 29, 31, 31, 23, 30, 19, 23, 25, 19, 19, 34, 17,
    27, 21, 25, 39, 39, 29, 35, 27, 29,
)  # fmt: skip


def best_turns(s: int) -> int:
    """Return the number of turns tau, 1 <= tau <= s, for which s taps are spread most evenly; InputError if s < 1.

    SAO's tau = 7 for s = 9 is as good as the table's 2, its mirror image; the worst (3, 6) scores 1.47 times as much.
    1 to 99 taps are looked up. For more it is the number without a common divisor with s that is nearest to s over the
    square of the golden ratio: up to 200 its discrepancy is up to 1.9 times the best.

    >>> lfssao.samples.best_turns(9)
    2
    """
    s = check_whole("the number of taps", s, 1)
    if s <= len(BEST_TURNS):
        return BEST_TURNS[s - 1]
    golden = round(s * 0.3819660112501051)
    return min((tau for tau in range(1, s) if gcd(tau, s) == 1), key=lambda tau: abs(tau - golden))


def spiral_discrepancy(s: int, tau: int) -> float:
    """Root mean square over all sectors of the fraction of taps minus radius times arc: 0 is perfect.

    Over radii a in [0, 1], arcs of every start and length in [0, 1] turns: the square is
    1/9 - 2/s sum_i (1 - alpha_i^2) / 6 + 1/s^2 sum_ij (1 - max(alpha_i, alpha_j)) (1/2 - d (1 - d)), d the turns
    between taps i and j. InputError if s is not 1 or more, or tau no whole number.

    >>> round(lfssao.samples.spiral_discrepancy(9, 7), 3)
    0.06
    """
    s = check_whole("the number of taps", s, 1)
    tau = check_whole("the number of turns", tau, 0)
    # Summed up, in whole numbers: the square is (9 P - 4 s^5 - s^3) / (36 s^5), P / (4 s^5) its last term.
    i = np.arange(s)
    further = np.maximum.outer(i, i)
    gap = np.subtract.outer(i, i) * tau % s
    pairs = int(np.sum((2 * s - (2 * further + 1)) * (s * s - 2 * gap * (s - gap))))
    return sqrt((9 * pairs - 4 * s**5 - s**3) / (36 * s**5))
