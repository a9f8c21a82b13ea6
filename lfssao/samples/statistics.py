"""Statistics of point sets, how probable a larger value of each is, and the smallest bias that each finds.

Most take points of the unit cube [0, 1]^d. ``unit_cube`` maps any domain there and keeps volumes, so that uniform
points stay uniform. A p-value is the probability that independent uniform points give the value or a larger one. The
last bits of all these may differ between machines.
"""

from bisect import bisect_left
from collections.abc import Callable
from functools import lru_cache
from math import ceil, pi, sqrt

import numpy as np
from scipy import special, stats
from scipy.spatial import KDTree

from lfssao.samples.sets import FloatArray


def unit_cube(points: FloatArray, domain: str, r_min: float = 0.0, r_max: float = 1.0) -> FloatArray:
    """Return points of a domain in the unit cube, volumes kept: (n, 2), or (n, 3) of a ball.

    The coordinates, each from 0 to 1, are (xi_1, xi_2) of the 'square', (z, phi) of the 'sphere', (z / r, phi, r^3) of
    the 'ball' and (r^2, phi) of the 'disk'; r^3 is left out where the ball's shell has equal radii.
    """
    points = np.asarray(points, np.float64)
    if domain == "square":
        return (points + 1) / 2
    turn = np.arctan2(points[:, 1], points[:, 0]) / (2 * pi) % 1.0
    if domain == "disk":
        return np.column_stack([np.sum(points**2, axis=1), turn])
    r = np.sqrt(np.sum(points**2, axis=1))
    z = points[:, 2] / np.where(r > 0, r, 1)
    directions = np.column_stack([(z + 1) / 2, turn])
    if domain == "sphere" or r_min == r_max:
        return directions
    inner = (r_min / r_max) ** 3
    return np.column_stack([directions, ((r / r_max) ** 3 - inner) / (1 - inner)])


def departures(values: FloatArray) -> FloatArray:
    """Return how far the fraction of n values below any place is above the place at most, and how far below: (2, ...).

    Values are (n, ...), on [0, 1]. The larger is Kolmogorov and Smirnov's distance from the uniform distribution. The
    sum is Kuiper's, for which [0, 1] is a circle that begins anywhere.
    """
    ordered = np.sort(np.asarray(values, np.float64), axis=0)
    steps = (np.arange(len(ordered) + 1) / len(ordered)).reshape(-1, *[1] * (ordered.ndim - 1))
    return np.array([np.max(steps[1:] - ordered, axis=0), np.max(ordered - steps[:-1], axis=0)])


def kuiper_p(distance: float, n: int) -> float:
    """The p-value of Kuiper's distance of n values (Stephens 1970; Press et al., Numerical Recipes, section 14.3)."""
    scaled = max((sqrt(n) + 0.155 + 0.24 / sqrt(n)) * distance, 0.4)  # below it is 1
    q = 2 * (np.arange(1, 30) * scaled) ** 2
    return float(np.clip(2 * np.sum((2 * q - 1) * np.exp(-q)), 0, 1))


def caps_p(distance: float, n: int) -> float:
    """Return the most that the p-value of ``cap_discrepancy`` can be: that of one axis as often as there are axes."""
    return float(min(1, len(_AXES) * stats.kstwo.sf(distance, n)))


def share_p(excess: float, n: int, fair: float = 0.5) -> float:
    """Return the p-value of a share of n points that is off by ``excess`` from the fair one, either way."""
    k = round((fair + excess) * n)
    return float(min(1, 2 * min(stats.binom.cdf(k, n, fair), stats.binom.sf(k - 1, n, fair))))


@lru_cache(maxsize=256)
def least_share(p_value: Callable[[float, int], float], n: int, alarm: float, fair: float) -> float:
    """Share of the points, in a part with the fair share, that a statistic finds with a probability of 0.9.

    The statistic is at least the excess of the share of n points over the fair one, and finds something where its
    p-value is below ``alarm``. The result is infinite if even all of the points would pass.
    """
    first = ceil(fair * n)
    k = first + bisect_left(range(first, n + 1), True, key=lambda k: p_value(k / n - fair, n) < alarm)
    return float(special.betaincinv(k, n - k + 1, 0.9)) if k <= n else np.inf


def chi_square_share(cells: int, n: int, alarm: float) -> float:
    """As ``least_share``: the share in a half, made of whole cells, that chi-square over all the cells finds."""
    noncentrality = special.chndtrinc(stats.chi2.isf(alarm, cells - 1), cells - 1, 0.1)
    share = 0.5 + 0.5 * sqrt(noncentrality / n)
    return share if share <= 1 else np.inf


def _axes(count: int) -> FloatArray:
    """Return directions spread over the sphere, (count, 3): a Fibonacci sphere."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    phi = pi * (1 + sqrt(5)) * k
    r = np.sqrt(1 - z * z)
    return np.column_stack([r * np.cos(phi), r * np.sin(phi), z])


_AXES = _axes(128)


def cap_discrepancy(points: FloatArray) -> float:
    """Largest difference between the fraction of points in a spherical cap and the cap's fraction of the sphere.

    Points are (n, 3) on the unit sphere; caps of all sizes have 128 centres, and those opposite.
    """
    return float(departures((np.asarray(points) @ _AXES.T + 1) / 2).max())


def nearest_distance(points: FloatArray, wraps: bool = False) -> float:
    """Return the least distance of two points, infinite for one point; with ``wraps`` on LF's square as a cylinder."""
    x = np.array(points, np.float64)
    if len(x) < 2:
        return np.inf
    if wraps:
        x[:, 1] %= 2.0
    tree = KDTree(x, boxsize=(0.0, 2.0) if wraps else None)
    return float(tree.query(x, k=2)[0][:, 1].min())


def pair_correlation(cube: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return 40 distances up to 4 / sqrt(n), in units of 1 / sqrt(n), and the frequency of pairs at each.

    The frequency of pairs of independent points of the unit square, (n, 2), is 1. Distances wrap both ways, so that no
    edge thins them out; they end at half the square.
    """
    n = len(cube)
    edges = np.linspace(0, min(4.0, 0.5 * sqrt(n)), 41)
    tree = KDTree(cube[:, :2] % 1.0, boxsize=1.0)
    count = np.diff(tree.count_neighbors(tree, edges / sqrt(n))) / 2  # each pair is found from both ends
    rings = pi * (edges[1:] ** 2 - edges[:-1] ** 2) / n
    return (edges[1:] + edges[:-1]) / 2, count / np.maximum(0.5 * n * (n - 1) * rings, 1e-300)


def periodogram(cube: FloatArray, most: int = 32) -> FloatArray:
    """Power abs(sum_k exp(-2 pi i f . x_k))^2 / n at whole frequencies f from -most to most each way; 0 at f = 0.

    Points are (n, 2) of the unit square; every power of independent ones but that at 0 has the mean 1. The rows of the
    result, (2 most + 1, 2 most + 1), are frequencies of the second coordinate.
    """
    f = np.arange(-most, most + 1)
    first, second = (np.exp(-2j * pi * np.outer(f, cube[:, a])) for a in (0, 1))
    power = np.abs(second @ first.T) ** 2 / len(cube)
    power[most, most] = 0
    return np.asarray(power, np.float64)


def radial_mean(power: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return whole frequencies 1 to most, the mean of a ``periodogram`` over the ring at each, and its sigma.

    The sigma is that of independent points, whose powers are exponential of mean 1, and equal at f and -f.
    """
    most = len(power) // 2
    f = np.arange(-most, most + 1)
    ring = np.rint(np.hypot(*np.meshgrid(f, f))).astype(np.int64).ravel()
    count = np.bincount(ring)[1 : most + 1]
    return f[most + 1 :].astype(np.float64), np.bincount(ring, power.ravel())[1 : most + 1] / count, np.sqrt(2 / count)
