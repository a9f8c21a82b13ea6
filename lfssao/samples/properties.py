"""The promises of sampling methods, each as a check of anybody's points.

A check returns findings: a number that was counted or measured, and the most that it may be. Counts have the limit 0.
Statistics of independent points exceed their limits with a probability of at most ``ALARM`` for the whole check; those
of more even sets stay further below.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import log, pi, sqrt

import numpy as np

from lfssao.errors import InputError, check_choice
from lfssao.samples import statistics
from lfssao.samples.sets import DIMENSIONS, FloatArray
from lfssao.samples.square import grid

ALARM = 1e-6


@dataclass(frozen=True)
class Points:
    """A point set as a check takes it; the fields are the arguments of ``check_promise``."""

    points: FloatArray
    domain: str
    weights: FloatArray | None
    r_min: float
    r_max: float
    tolerance: float


@dataclass(frozen=True)
class Finding:
    """One result of a check."""

    what: str  # the thing that was counted or measured
    value: float
    limit: float  # the most that the value may be

    @property
    def holds(self) -> bool:
        """Whether the promise is kept as far as this goes."""
        return bool(self.value <= self.limit)


@dataclass(frozen=True)
class Promise:
    """A property that a method may promise."""

    title: str  # one line for lists
    domains: tuple[str, ...]  # the domains it has a meaning on
    check: Callable[[Points], list[Finding]]


def check_promise(
    name: str,
    points: FloatArray,
    domain: str,
    weights: FloatArray | None = None,
    r_min: float = 0.0,
    r_max: float = 1.0,
    tolerance: float = 1e-6,
) -> list[Finding]:
    """Check one of ``PROMISES`` on a point set; it is kept if all findings hold.

    Points are (n, d), in units of the radius of the domain, 'square', 'sphere', 'ball' or 'disk', weights (n,). r_min
    and r_max are the ball's shell, and the tolerance is the distance outside the domain that rounding may have put a
    point at; the default suits float32. InputError if there is no such promise or domain, the promise means nothing on
    that domain, or the arrays do not fit.
    """
    check_choice("promise", name, PROMISES)
    check_choice("domain", domain, DIMENSIONS)
    if domain not in PROMISES[name].domains:
        raise InputError(
            f"the promise {name} is one of the {' and '.join(PROMISES[name].domains)}, not of the {domain}"
        )
    table = np.asarray(points, np.float64)
    if table.ndim != 2 or table.shape[1] != DIMENSIONS[domain] or len(table) == 0:
        raise InputError(f"points of the {domain} have shape {table.shape}, expected (n, {DIMENSIONS[domain]}), n >= 1")
    if not np.isfinite(table).all():
        raise InputError(f"point {int(np.argmin(np.isfinite(table).all(axis=1)))} is not finite")
    if not (0 <= r_min <= r_max and 0 < r_max < np.inf):
        raise InputError(f"r_min and r_max are {r_min} and {r_max}, they must be 0 <= r_min <= r_max and above 0")
    weights = None if weights is None else np.asarray(weights, np.float64)
    if weights is not None and weights.shape != table.shape[:1]:
        raise InputError(f"there are {len(table)} points and weights of shape {weights.shape}")
    return PROMISES[name].check(Points(table, domain, weights, r_min, r_max, tolerance))


def _inside(of: Points) -> list[Finding]:
    p = of.points
    if of.domain == "square":
        return [Finding("how far a point lies outside", float(np.abs(p).max()) - 1, of.tolerance)]
    low, high = {"sphere": (1.0, 1.0), "disk": (0.0, 1.0), "ball": (of.r_min, of.r_max)}[of.domain]
    # In units of the radius, whose square neither vanishes nor overflows.
    r = np.sqrt(np.sum((p / high) ** 2, axis=1))
    outside = max(float(r.max()) - 1, low / high - float(r.min()))
    return [Finding("how far a point lies outside, in radii", outside, of.tolerance)]


def _distinct(of: Points) -> list[Finding]:
    repeated = len(of.points) - len(np.unique(of.points, axis=0))
    return [Finding("points that repeat another", repeated, 0)]


def _uniform(of: Points) -> list[Finding]:
    cube = statistics.unit_cube(of.points, of.domain, of.r_min, of.r_max)
    n, d = cube.shape
    names = {"square": ("xi_1", "xi_2"), "disk": ("r^2", "phi")}.get(of.domain, ("z", "phi", "r^3"))
    cells = int((n / 10) ** (1 / d)) if n >= 10 * 2**d else 0
    cells = min(cells, 16 if d == 2 else 8)
    round_body = of.domain in ("sphere", "ball")
    alarm = ALARM / (d + (cells > 1) + round_body)
    found = [
        Finding(f"Kolmogorov-Smirnov distance of {name}", statistics.ks_distance(column), statistics.ks_limit(n, alarm))
        for name, column in zip(names, cube.T, strict=False)
    ]
    if cells > 1:
        limit = statistics.chi_square_limit(cells**d - 1, alarm)
        found.append(Finding(f"chi-square over {cells}^{d} equal cells", statistics.chi_square(cube, cells), limit))
    if round_body:
        r = np.sqrt(np.sum(of.points**2, axis=1, keepdims=True))
        caps = statistics.cap_discrepancy(of.points / np.where(r > 0, r, 1))
        found.append(Finding("spherical cap discrepancy", caps, statistics.ks_limit(n, alarm / 128)))
    return found


def _cells(values: FloatArray, count: int) -> np.ndarray:
    """Cell number of coordinates on [-1, 1], of count equal cells."""
    return np.clip(np.floor((values + 1) / 2 * count).astype(np.int64), 0, count - 1)


def _not_one(place: np.ndarray, cells: int) -> int:
    """The number of cells that do not hold exactly one of the points at these places."""
    return int(np.sum(np.bincount(place, minlength=cells) != 1))


def _stratified(of: Points) -> list[Finding]:
    columns, rows = grid(len(of.points))
    place = _cells(of.points[:, 0], columns) + columns * _cells(of.points[:, 1], rows)
    return [Finding(f"cells of {columns} x {rows} without exactly one point", _not_one(place, columns * rows), 0)]


def _rows(of: Points) -> list[Finding]:
    n = len(of.points)
    axis = 2 if of.domain == "sphere" else 0
    wrong = _not_one(_cells(of.points[:, axis], n), n)
    return [Finding(f"bands of {n} along {'z' if axis else 'xi_1'} without exactly one point", wrong, 0)]


def _latin(of: Points) -> list[Finding]:
    n = len(of.points)
    wrong = [_not_one(_cells(coordinate, n), n) for coordinate in of.points.T]
    return [
        Finding(f"{what} without exactly one point", k, 0) for what, k in zip(("columns", "rows"), wrong, strict=True)
    ]


def _net(of: Points) -> list[Finding]:
    m = len(of.points).bit_length() - 1
    first = of.points[: 2**m]
    wrong = 0
    for j in range(m + 1):
        place = _cells(first[:, 0], 2**j) * 2 ** (m - j) + _cells(first[:, 1], 2 ** (m - j))
        wrong += _not_one(place, 2**m)
    return [Finding(f"elementary intervals of the first {2**m} points without exactly one", wrong, 0)]


def _low_discrepancy(of: Points) -> list[Finding]:
    n = len(of.points)
    value = statistics.star_discrepancy(statistics.unit_cube(of.points, "square"))
    return [Finding("L2 star discrepancy", value, 0.8 * (1 + log(n)) / n)]


def _poisson(of: Points) -> list[Finding]:
    n = len(of.points)
    least = 0.5 * sqrt(8 / (sqrt(3) * n))
    found = statistics.nearest_distance(of.points, wraps=True)
    return [Finding(f"how much nearer than {least:.3g} two points are on the cylinder", least - found, 0)]


def _apart(of: Points) -> list[Finding]:
    least = 0.7 * len(of.points) ** (-1 / DIMENSIONS[of.domain])
    found = statistics.nearest_distance(of.points)
    return [Finding(f"how much nearer than {least:.3g} two points are", least - found, 0)]


def _equal_area(of: Points) -> list[Finding]:
    caps = statistics.cap_discrepancy(of.points)
    return [*_rows(of), Finding("spherical cap discrepancy", caps, 2.2 * len(of.points) ** -0.75)]


def _radii(of: Points) -> list[Finding]:
    n = len(of.points)
    r = np.sort(np.sqrt(np.sum(of.points**2, axis=1)))
    away = float(np.abs(r - (np.arange(n) + 0.5) / n).max())
    return [Finding("how far a radius is from (i + 1/2) / n", away, of.tolerance)]


def _weights(of: Points) -> list[Finding]:
    if of.weights is None:
        return [Finding("points without a weight", len(of.points), 0)]
    volume = 4 / 3 * pi
    away = abs(float(np.sum(of.weights)) - volume)
    return [
        Finding("weights that are not positive", int(np.sum(~(of.weights > 0))), 0),
        Finding("how far the weights are from the ball's volume", away, volume * of.tolerance),
    ]


_ALL = tuple(DIMENSIONS)

PROMISES = {
    "inside": Promise("every point lies in the domain", _ALL, _inside),
    "distinct": Promise("no point is there twice", _ALL, _distinct),
    "uniform": Promise("points are as even as independent uniform ones, or more so", _ALL, _uniform),
    "unbiased": Promise("one point of each of many seeds is uniform", _ALL, _uniform),
    "stratified": Promise("one point in each cell of the squarest grid of n cells", ("square",), _stratified),
    "rows": Promise("one point in each of n rows along xi_1", ("square",), _rows),
    "latin": Promise("one point in each of n rows and of n columns", ("square",), _latin),
    "net": Promise("one in each elementary interval of base 2, of the first 2^m points", ("square",), _net),
    "low-discrepancy": Promise("L2 star discrepancy at most 0.8 (1 + ln n) / n", ("square",), _low_discrepancy),
    "poisson": Promise("half a triangular lattice's distance, wrapping in xi_2, or more", ("square",), _poisson),
    "apart": Promise("distances of at least 0.7 n^(-1/d)", ("ball", "disk"), _apart),
    "equal-area": Promise("one in each of n bands; cap discrepancy at most 2.2 n^(-3/4)", ("sphere",), _equal_area),
    "radii": Promise("radii in equal steps, (i + 1/2) / n", ("disk",), _radii),
    "weights": Promise("positive weights that sum to the ball's volume, 4/3 pi", ("ball", "disk"), _weights),
}  # fmt: skip
