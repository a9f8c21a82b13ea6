"""Statistics of the promises that are judged on all sets of a sampler at once: blue, progressive and projections.

Every function takes sets of n points of the unit cube, all of one size, the names of their coordinates and the alarm of
``check_promise``. It returns rows: the words of a statistic, its value, its limit, a p-value or None, and the verdict
if the promise is not broken. The verdict says whether independent points, which keep none of these promises, would be
found so surely that the promise tells.
"""

from math import floor, lgamma, log, sinh, sqrt

import numpy as np
from scipy import optimize, stats

from lfssao.samples.sets import FloatArray
from lfssao.samples.statistics import periodogram

Row = tuple[str, float, float, float | None, str]

LOW, PEAK = 0.5, 1.1  # powers of blue sets, those of independent points being 1: most in the gap, least on the ring
_GAP, _RING = 0.5, (0.9, 1.2)  # frequencies of both, in units of sqrt(n)
_APART = 2.0  # of the mean squared distance from the middles of n equal intervals, in units of one point in each
_NOTICED = 0.9  # probability with which independent points are found where a statistic tells


def _verdict(tells: bool, n: int, sets: int) -> str:
    words = "independent points are found" if tells else "independent points may pass"
    return f"{'holds' if tells else 'cannot tell'} at n = {n}, {sets} set{'s' * (sets != 1)}: {words}"


def blue(cubes: list[FloatArray], names: tuple[str, ...], alarm: float) -> list[Row]:
    """Mean power of a ``periodogram`` below sqrt(n) / 2, at most a half, and about sqrt(n), at least 1.1.

    A power is exponential, so the mean of m of them has a gamma distribution: sets whose power is at a limit are found
    with a probability of at most half the alarm each. Lattices have the powers of blue sets as well.
    """
    n = len(cubes[0])
    root = sqrt(n)
    most = max(floor(_RING[1] * root), 2)
    f = np.arange(-most, most + 1)
    radius = np.hypot(*np.meshgrid(f, f))
    power = np.mean([periodogram(cube, most) for cube in cubes], axis=0)
    rows: list[Row] = []
    for words, low, high, limit, side in (
        ("mean power below sqrt(n) / 2, of independent points 1", 0.5, max(_GAP * root, 1.0), LOW, 1),
        ("mean power about sqrt(n), of independent points 1", _RING[0] * root, _RING[1] * root, PEAK, -1),
    ):
        at = (radius >= low) & (radius <= high)
        count = at.sum() / 2 * len(cubes)  # f and -f have one power
        of_mean = stats.gamma(count, scale=1 / count)
        value = float(power[at].mean()) if count else 1.0
        p = float((of_mean.sf if side > 0 else of_mean.cdf)(value / limit)) if count else 1.0
        # The mean at which the alarm begins, and whether that of independent points is beyond it nearly always.
        first = limit * (of_mean.isf if side > 0 else of_mean.ppf)(alarm / 2)
        usual = (of_mean.isf if side > 0 else of_mean.ppf)(_NOTICED)
        tells = bool(count and side * (usual - first) > 0)
        end = f"{'at most' if side > 0 else 'at least'} {limit:g}"
        rows.append((f"{words}, {end}", value, alarm / 2, p, _verdict(tells, n, len(cubes))))
    return rows


def progressive(cubes: list[FloatArray], names: tuple[str, ...], alarm: float) -> list[Row]:
    """Cells of 2^k x 2^k without exactly one of the first 4^k points, for all k and sets; 0 for sets that keep it."""
    n = len(cubes[0])
    wrong = 0
    k = 0
    while 4 ** (k + 1) <= n:
        k += 1
        for cube in cubes:
            cells = np.minimum(np.floor(cube[: 4**k] * 2**k).astype(np.int64), 2**k - 1)
            wrong += int(np.sum(np.bincount(cells[:, 0] * 2**k + cells[:, 1], minlength=4**k) != 1))
    last = 4**k
    tells = len(cubes) * (lgamma(last + 1) - last * log(last)) <= log(alarm)
    words = f"cells of 2^k x 2^k without exactly one of the first 4^k points, k to {k}"
    return [(words, wrong, 0, None, _verdict(tells, n, len(cubes)))]


def projections(cubes: list[FloatArray], names: tuple[str, ...], alarm: float) -> list[Row]:
    """Unevenness of each coordinate alone, the mean of 6 n W^2 by Cramer and von Mises, at most 2.

    It is 1 on average for one random point in each of n equal intervals, never above 2 for any such points, and n for
    independent ones.
    """
    n = len(cubes[0])
    sets = len(cubes)
    middles = ((np.arange(n) + 0.5) / n)[:, None]
    found = np.mean([np.sum((np.sort(cube, axis=0) - middles) ** 2, axis=0) for cube in cubes], axis=0) + 1 / (12 * n)
    tells = _chance_of_even(_APART / (6 * n), sets) <= alarm / len(names)
    return [
        (f"unevenness of {name}, 6 n W^2", float(6 * n * value), _APART, None, _verdict(tells, n, sets))
        for name, value in zip(names, found, strict=False)
    ]


def _chance_of_even(most: float, sets: int) -> float:
    """The most that the probability can be that the mean W^2 of independent points is below a value (Chernoff).

    The distribution is that of many points, whose E[exp(-s^2 W^2 / 2)] is sqrt(s / sinh(s)) (Anderson, Darling 1952).
    """

    def exponent(s: float) -> float:
        return 0.5 * (log(s / sinh(s)) if s < 500 else log(2 * s) - s) + 0.5 * s * s * most

    best = optimize.minimize_scalar(exponent, bounds=(1e-3, 2 / most), method="bounded")
    return float(np.exp(max(min(sets * best.fun, 0.0), -700.0)))
