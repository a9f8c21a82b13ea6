"""Statistics of point sets, and the limits that a uniform one exceeds with a stated probability.

Most take points of the unit cube [0, 1]^d. ``unit_cube`` maps any domain there and keeps volumes, so that uniform
points stay uniform. The last bit of a statistic may differ between machines.
"""

from math import log, pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

FloatArray = NDArray[np.float64]


def unit_cube(points: FloatArray, domain: str, r_min: float = 0.0, r_max: float = 1.0) -> FloatArray:
    """Points of a domain in the unit cube, volumes kept: (n, 2), or (n, 3) of a ball.

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


def ks_distance(values: FloatArray) -> float:
    """Kolmogorov and Smirnov's distance of n values from the uniform distribution on [0, 1]."""
    ordered = np.sort(np.asarray(values, np.float64))
    steps = np.arange(len(ordered) + 1) / len(ordered)
    return float(max(np.max(steps[1:] - ordered), np.max(ordered - steps[:-1])))


def ks_limit(n: int, alarm: float) -> float:
    """Limit that n independent values exceed with a probability of at most ``alarm``, for every n (Massart 1990)."""
    return sqrt(log(2 / alarm) / (2 * n))


def chi_square(cube: FloatArray, cells: int) -> float:
    """Chi-square of points of the unit cube over cells^d equal cells."""
    d = cube.shape[1]
    place = np.clip((cube * cells).astype(np.int64), 0, cells - 1)
    count = np.bincount(place @ cells ** np.arange(d), minlength=cells**d)
    expected = len(cube) / cells**d
    return float(np.sum((count - expected) ** 2) / expected)


def chi_square_limit(freedom: int, alarm: float) -> float:
    """Limit that chi-square exceeds with a probability of at most ``alarm`` (Laurent and Massart 2000)."""
    x = log(1 / alarm)
    return freedom + 2 * sqrt(freedom * x) + 2 * x


def _axes(count: int) -> FloatArray:
    """Directions spread over the sphere, (count, 3): a Fibonacci sphere."""
    k = np.arange(count) + 0.5
    z, phi = 1 - 2 * k / count, pi * (1 + sqrt(5)) * k
    r = np.sqrt(1 - z * z)
    return np.column_stack([r * np.cos(phi), r * np.sin(phi), z])


def cap_discrepancy(points: FloatArray) -> float:
    """Largest difference between the fraction of points in a spherical cap and the cap's fraction of the sphere.

    Points are (n, 3) on the unit sphere; caps of all sizes have 128 centres, and those opposite.
    """
    heights = np.asarray(points) @ _axes(128).T
    return max(ks_distance((column + 1) / 2) for column in heights.T)


def star_discrepancy(cube: FloatArray) -> float:
    """The L2 star discrepancy of points of the unit cube, (n, d) (Warnock 1972)."""
    n, d = cube.shape
    single = 2 ** (1 - d) / n * np.sum(np.prod(1 - cube**2, axis=1))
    pairs = sum(float(np.sum(np.prod(1 - np.maximum(point, cube), axis=1))) for point in cube)
    return sqrt(max(3.0**-d - single + pairs / n**2, 0.0))


def nearest_distance(points: FloatArray, wraps: bool = False) -> float:
    """The least distance of two points, infinite for one point; with ``wraps`` on LF's square as a cylinder."""
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
