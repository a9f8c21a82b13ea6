"""The promises of sampling methods, each as a check of points.

A check returns findings: a number that was counted or measured, and the most that it may be. Counts have the limit 0.
Statistics have a p-value in place of a limit, and say which bias they would not find. They find one in independent
uniform points with a probability of at most the alarm for the whole check; in sets that are more even, more rarely.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import log2, pi, sqrt
from typing import Any

import numpy as np
from scipy import stats
from scipy.stats import qmc

from lfssao.core.arguments import as_number, as_numbers
from lfssao.errors import InputError, check_choice, shown
from lfssao.samples import evenness, statistics
from lfssao.samples.sets import DIMENSIONS, FloatArray
from lfssao.samples.square import grid

ALARM = 1e-6

# Coordinates of ``statistics.unit_cube``.
_COORDINATES = {"square": ("xi_1", "xi_2"), "disk": ("r^2", "phi"), "sphere": ("z", "phi"), "ball": ("z", "phi", "r^3")}


@dataclass(frozen=True)
class Points:
    """A point set as a check takes it; the fields are arguments of ``check_promise``."""

    points: FloatArray
    domain: str
    weights: FloatArray | None
    r_min: float
    r_max: float
    tolerance: float
    alarm: float


@dataclass(frozen=True)
class Finding:
    """One result of a check; as a string it is a sentence with the verdict: holds, BROKEN, or cannot tell.

    It is true where the verdict is holds.

    >>> print(lfssao.testing.check_promise("latin", [[-0.5, 0.5], [0.5, -0.5]], "square")[0])
    columns without exactly one point: 0, at most 0: holds
    """

    what: str  # the thing that was counted or measured
    value: float
    limit: float  # the most that the value may be; of a statistic, the least that p may be
    p: float | None = None  # the probability that independent uniform points give this value or a larger one
    power: str = "holds"  # the verdict if it is not broken; of a statistic, with the bias that would pass
    worst: int | None = None  # the index of the set that it is of, where many were checked one by one

    @property
    def tells(self) -> bool:
        """Whether a statistic would find a quarter of the points too many in one part; True for counts."""
        return self.power.startswith("holds")

    @property
    def holds(self) -> bool:
        """Whether the promise is kept as far as this goes."""
        return bool(self.value <= self.limit if self.p is None else self.p >= self.limit)

    def __bool__(self) -> bool:
        return self.holds and self.tells

    def __str__(self) -> str:
        rule = f"at most {self.limit:.6g}" if self.p is None else f"p = {self.p:.3g}, alarm below {self.limit:.2g}"
        place = "" if self.worst is None else f", worst in set {self.worst}"
        return f"{self.what}{place}: {self.value:.6g}, {rule}: {self.power if self.holds else 'BROKEN'}"


class Findings(tuple[Finding, ...]):
    """All results of a check; as a string they are a sentence a line. They are true where each one's verdict is holds.

    ``hint`` is a sentence on what may be meant where points lie in [0, 1] and break a promise, else empty.

    >>> bool(lfssao.testing.check_promise("latin", [[-0.5, 0.5], [0.5, 0.5]], "square"))
    False
    """

    hint: str = ""

    @property
    def tells(self) -> bool:
        """Whether each of them tells (``Finding.tells``)."""
        return all(finding.tells for finding in self)

    @property
    def holds(self) -> bool:
        """Whether each promise is kept as far as this goes (``Finding.holds``)."""
        return all(finding.holds for finding in self)

    def __bool__(self) -> bool:
        return all(map(bool, self))

    def __str__(self) -> str:
        return "\n".join([*map(str, self), *([self.hint] if self.hint else [])])


@dataclass(frozen=True)
class Promise:
    """A property that a method may promise.

    >>> lfssao.testing.PROMISES["latin"].domains
    ('square',)
    """

    title: str  # one line for lists
    domains: tuple[str, ...]  # the domains it has a meaning on
    check: Callable[[Any], list[Finding]]  # of the ``Points`` of one set, or of a list of all sets
    of_all: bool = False  # whether it is of all sets of a sampler at once


def check_promise(
    name: str,
    points: Any,
    domain: str,
    weights: Any = None,
    r_min: float = 0.0,
    r_max: float = 1.0,
    tolerance: float = 1e-6,
    bounds: tuple[float, float] = (-1.0, 1.0),
    alarm: float = ALARM,
) -> Findings:
    """Check one of ``PROMISES`` on a point set, or on those of many seeds; findings that are true have found it kept.

    Points are (n, d), in units of the radius of the domain, 'square', 'sphere', 'ball' or 'disk', weights (n,); or
    sequences of them, or an array (seeds, n, d). Many sets are pooled for 'uniform', whose p-values are those of
    independent points: more even sets alarm more rarely. 'unbiased' takes one point of each set, at random; other
    findings are the worst set's, but for 'blue', 'progressive' and 'projections', which are of all sets together.

    r_min and r_max are the ball's shell, and the tolerance is the distance outside the domain that rounding may have
    put a point at; the default suits float32. Bounds are the coordinates at the domain's ends: (0, 1) for the points of
    ``scipy.stats.qmc``. The alarm, above 0 and below 1, is the probability that independent uniform points break
    'uniform', and that sets at the limits of 'blue' break it. Independent points keep 'projections' and 'progressive',
    where these tell, with at most that probability. InputError if there is no such promise or domain, the promise means
    nothing on that domain, a number is out of range, or the arrays do not fit.

    >>> print(check_promise("latin", [[-0.5, 0.5], [0.5, -0.5]], "square")[0])
    columns without exactly one point: 0, at most 0: holds
    """
    check_choice("promise", name, PROMISES)
    many = isinstance(points, Sequence | np.ndarray) and len(points) > 0 and _dimensions(points[0]) == 2
    tables = [as_table(each, domain, bounds) for each in (points if many else [points])]
    loads = weights if many and weights is not None else [weights] * len(tables)
    if not isinstance(loads, Sequence | np.ndarray) or len(loads) != len(tables):
        raise InputError(f"there are {len(tables)} sets of points, and weights are {shown(weights)}")
    if domain not in PROMISES[name].domains:
        raise InputError(
            f"the promise {name} is one of the {' and '.join(PROMISES[name].domains)}, not of the {domain}"
        )
    if not (0 <= as_number(r_min) <= as_number(r_max) and 0 < as_number(r_max) < np.inf):
        inside = f"r_min and r_max are {shown(r_min)} and {shown(r_max)}"
        raise InputError(f"{inside}, they must be 0 <= r_min <= r_max and above 0")
    if not 0 < as_number(alarm) < 1:
        raise InputError(f"alarm is {shown(alarm)}, it must be a probability above 0 and below 1")
    if not 0 <= as_number(tolerance) < np.inf:
        raise InputError(f"tolerance is {shown(tolerance)}, it must be a finite number of at least 0")
    sets = []
    for table, load in zip(tables, loads, strict=True):
        weighs = None if load is None else as_numbers("weights", load).astype(np.float64)
        if weighs is not None and weighs.shape != table.shape[:1]:
            raise InputError(f"there are {len(table)} points and weights of shape {weighs.shape}")
        if weighs is not None and not np.isfinite(weighs).all():
            raise InputError("a weight is not finite")
        sets.append(Points(table, domain, weighs, r_min, r_max, tolerance, alarm))
    one = len(sets) == 1 and not PROMISES[name].of_all
    found = Findings(PROMISES[name].check(sets[0]) if one else _of_many(name, sets))
    if not found.holds and tuple(bounds) == (-1, 1) and all(((table >= 0) & (table <= 1)).all() for table in tables):
        found.hint = "all points lie in [0, 1], and the domain reaches from -1 to 1: bounds=(0, 1), if they fill that"
    return found


def _dimensions(points: Any) -> int:
    """Number of dimensions of an array or of lists; 0 of lists that are none."""
    try:
        return np.ndim(points)
    except ValueError:  # of different lengths
        return 0


def as_table(points: Any, domain: str, bounds: tuple[float, float] = (-1.0, 1.0)) -> FloatArray:
    """Points of a domain, (n, d) float64, moved from the bounds to -1 to 1; InputError as of ``check_promise``."""
    check_choice("domain", domain, DIMENSIONS)
    table = as_numbers("points", points).astype(np.float64, copy=False)
    if table.ndim != 2 or table.shape[1] != DIMENSIONS[domain] or len(table) == 0:
        raise InputError(f"points of the {domain} have shape {table.shape}, expected (n, {DIMENSIONS[domain]}), n >= 1")
    if not np.isfinite(table).all():
        raise InputError(f"point {int(np.argmin(np.isfinite(table).all(axis=1)))} is not finite")
    if not isinstance(bounds, tuple | list) or len(bounds) != 2:
        raise InputError(f"bounds is {shown(bounds)}, it must be two numbers")
    low, high = map(as_number, bounds)
    if not -np.inf < low < high < np.inf:
        raise InputError(f"the range is {bounds[0]} to {bounds[1]}, it must be from a number to a larger one")
    return table if (low, high) == (-1, 1) else (2 * table - low - high) / (high - low)


def _of_many(name: str, sets: list[Points]) -> list[Finding]:
    check = PROMISES[name].check
    if PROMISES[name].of_all:
        if len({len(each.points) for each in sets}) > 1:
            raise InputError(f"{name} is judged on all sets at once: they must have one number of points")
        return check(sets)
    if name not in ("uniform", "unbiased"):
        found = [check(each) for each in sets]
        worst = max(range(len(sets)), key=lambda k: max(finding.value - finding.limit for finding in found[k]))
        return [replace(finding, worst=worst) for finding in found[worst]]
    different = list({each.points.tobytes(): each.points for each in sets}.values())
    pooled = f"repeated sets of {len(sets)} (limits are those of independent points, safe for more even sets)"
    repeated = Finding(pooled, len(sets) - len(different), 0)
    if name == "unbiased":
        pick = np.random.default_rng(0)
        different = [points[pick.integers(len(points))][None] for points in different]
    return [repeated, *check(replace(sets[0], points=np.concatenate(different)))]


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


_poles_p = partial(statistics.share_p, fair=0.1)


def _uniform(of: Points) -> list[Finding]:
    cube = statistics.unit_cube(of.points, of.domain, of.r_min, of.r_max)
    n, d = cube.shape
    names = _COORDINATES[of.domain]
    round_body = of.domain in ("sphere", "ball")
    cells = min(2 * int((n / 10) ** (1 / d) / 2), 16 if d == 2 else 8)  # even: a half is made of whole ones
    alarm = of.alarm / (d + 3 * round_body + (cells > 0))
    judged = partial(_judged, n, alarm)
    found = [
        judged("Kuiper distance of phi", above + below, "one half of phi", statistics.kuiper_p)
        if name == "phi"
        else judged(f"Kolmogorov-Smirnov distance of {name}", max(above, below), f"one half of {name}", stats.kstwo.sf)
        for name, (above, below) in zip(names, statistics.departures(cube).T, strict=False)
    ]
    if round_body:
        z = 2 * cube[:, 0] - 1
        r = np.sqrt(np.sum(of.points**2, axis=1, keepdims=True))
        caps = statistics.cap_discrepancy(of.points / np.where(r > 0, r, 1))
        poles = np.mean(abs(z) > 0.9) - 0.1
        found += [
            judged("share of z > 0, less 1/2", np.mean(z > 0) - 0.5, "the upper half", statistics.share_p),
            judged("share of abs(z) > 0.9, less 1/10", poles, "a pair of poles", _poles_p, 0.1),
            judged("spherical cap discrepancy", caps, "one half of space", statistics.caps_p),
        ]
    if cells:
        counts = np.histogramdd(np.clip(cube, 0, 1), cells, [(0, 1)] * d)[0]
        value, p = stats.chisquare(counts.ravel())
        power = _power(n, "one half of a coordinate", 0.5, statistics.chi_square_share(cells**d, n, alarm))
        found.append(Finding(f"chi-square over {cells}^{d} equal cells", float(value), alarm, float(p), power))
    return found


def _judged(n: int, alarm: float, what: str, value: Any, part: str, p_value: Any, fair: float = 0.5) -> Finding:
    """Return the finding of a statistic that is at least the excess of the points in a part over its fair share."""
    least = statistics.least_share(p_value, n, alarm, fair)
    return Finding(what, float(value), alarm, float(p_value(value, n)), _power(n, part, fair, least))


def _power(n: int, part: str, fair: float, least: float) -> str:
    passes = f"{least:.1%} of the points passes 1 time in 10" if least <= 1 else "all of the points may pass"
    return f"{'holds' if least <= fair + 0.25 else 'cannot tell'} at n = {n}: {part} with {passes}"


def _cells(values: FloatArray, count: int) -> np.ndarray:
    """Cell number of coordinates on [-1, 1], of count equal cells."""
    return np.clip(np.floor((values + 1) / 2 * count).astype(np.int64), 0, count - 1)


def _not_one(what: str, place: np.ndarray, cells: int) -> Finding:
    """Return the number of cells that do not hold exactly one of the points at these places."""
    wrong = int(np.sum(np.bincount(place, minlength=cells) != 1))
    return Finding(f"{what} without exactly one point", wrong, 0)


def _stratified(of: Points) -> list[Finding]:
    columns, rows = grid(len(of.points))
    place = _cells(of.points[:, 0], columns) + columns * _cells(of.points[:, 1], rows)
    return [_not_one(f"cells of {columns} x {rows}", place, columns * rows)]


def _rows(of: Points) -> list[Finding]:
    n = len(of.points)
    axis = 2 if of.domain == "sphere" else 0
    return [_not_one(f"bands of {n} along {'z' if axis else 'xi_1'}", _cells(of.points[:, axis], n), n)]


def _latin(of: Points) -> list[Finding]:
    n = len(of.points)
    return [_not_one(what, _cells(x, n), n) for what, x in zip(("columns", "rows"), of.points.T, strict=True)]


def _net(of: Points) -> list[Finding]:
    m = len(of.points).bit_length() - 1
    x, y = of.points[: 2**m].T
    places = [_cells(x, 2**j) * 2 ** (m - j) + _cells(y, 2 ** (m - j)) for j in range(m + 1)]
    wrong = sum(_not_one("", place, 2**m).value for place in places)
    return [Finding(f"elementary intervals of the first {2**m} points without exactly one", wrong, 0)]


def _low_discrepancy(of: Points) -> list[Finding]:
    """At most 2.4 times the discrepancy of Hammersley's set in base 2, which has a closed form (Halton, Zaremba 1969).

    The L2 star discrepancy of that set is of the least order that any set can have. R2 comes up to 2.32 times as far by
    its worst shift (n = 120), Halton's set in bases 2 and 3 to 1.35; bases 17 and 19 to 2.5 and more at n = 2^m.
    """
    n = len(of.points)
    value = float(qmc.discrepancy(np.clip(statistics.unit_cube(of.points, "square"), 0, 1), method="L2-star"))
    m = log2(n)
    hammersley = sqrt(m * m / 64 + 29 * m / 192 + 3 / 8 - m / (16 * n) + 1 / (4 * n) - 1 / (72 * n * n)) / n
    return [Finding("L2 star discrepancy", value, 2.4 * hammersley)]


def _spaced(of: Points, least: float, where: str = "", wraps: bool = False) -> list[Finding]:
    found = statistics.nearest_distance(of.points, wraps)
    return [Finding(f"how much nearer than {least:.3g} two points are{where}", least - found, 0)]


def _poisson(of: Points) -> list[Finding]:
    return _spaced(of, 0.5 * sqrt(8 / (sqrt(3) * len(of.points))), " on the cylinder", wraps=True)


def _apart(of: Points) -> list[Finding]:
    return _spaced(of, 0.7 * len(of.points) ** (-1 / DIMENSIONS[of.domain]))


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


def _of_all(judged: Callable[..., list[evenness.Row]], sets: list[Points]) -> list[Finding]:
    cubes = [np.clip(statistics.unit_cube(of.points, of.domain, of.r_min, of.r_max), 0, 1) for of in sets]
    names = _COORDINATES[sets[0].domain]
    return [Finding(*row) for row in judged(cubes, names, sets[0].alarm)]


_blue = partial(_of_all, evenness.blue)
_progressive = partial(_of_all, evenness.progressive)
_projections = partial(_of_all, evenness.projections)
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
    "low-discrepancy": Promise("L2 star discrepancy at most 2.4 times Hammersley's", ("square",), _low_discrepancy),
    "progressive": Promise("one of the first 4^k points in each cell of 2^k x 2^k", ("square",), _progressive, True),
    "projections": Promise("each coordinate alone as even as one in each of n intervals", _ALL, _projections, True),
    "blue": Promise("little power at low frequencies, and a ring of it about sqrt(n)", ("square",), _blue, True),
    "poisson": Promise("half a triangular lattice's distance, wrapping in xi_2, or more", ("square",), _poisson),
    "apart": Promise("distances of at least 0.7 n^(-1/d)", ("ball", "disk"), _apart),
    "equal-area": Promise("one in each of n bands; cap discrepancy at most 2.2 n^(-3/4)", ("sphere",), _equal_area),
    "radii": Promise("radii in equal steps, (i + 1/2) / n", ("disk",), _radii),
    "weights": Promise("positive weights that sum to the ball's volume, 4/3 pi", ("ball", "disk"), _weights),
}  # fmt: skip
