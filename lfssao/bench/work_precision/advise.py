"""Advice from the figures of a run: the setting to take for a given error or a given time."""

from collections.abc import Sequence
from math import isnan, nan
from pathlib import Path
from typing import Any

from lfssao.bench.work_precision.figures import FIGURES, MARGIN
from lfssao.core.files import read_json
from lfssao.errors import InputError, check_choice

Point = dict[str, Any]

FORMAT = 5
COMMITTED = Path(__file__).with_name("committed.json")  # the fronts of the run in benchmarks/results
COMMAND = "lfssao bench work-precision"
NOISE = 0.03  # of times and errors, in fronts that are shown

# Errors by name: their title, the entry of a point, and which of its figures.
ERRORS: dict[str, tuple[str, str, str]] = {
    "visibility": ("RMSE against cosine-weighted visibility within R", "visibility", "rmse"),
    "visibility-gain-free": ("the same after the best factor and offset", "visibility", "gain_free"),
    "own": ("RMSE against each estimator's own integrand", "own", "rmse"),
    "own-gain-free": ("the same after the best factor and offset", "own", "gain_free"),
    "sampling": ("RMSE against the same estimator with many samples", "sampling", ""),
}


def read_result(path: Path) -> dict[str, Any]:
    """Read the figures of ``lfssao bench work-precision``; InputError if the file cannot be read or holds others."""
    result = read_json(path)
    if not isinstance(result, dict) or result.get("work_precision") != FORMAT:
        raise InputError(f"{path}: it was not written by this version's '{COMMAND}'")
    return result


def points_of(result: dict[str, Any], radii: Sequence[float] | None = None) -> list[Point]:
    """All points of a run, or those of one set of radii."""
    found = [point for each in result["estimators"].values() for point in each["points"]]
    return [point for point in found if radii is None or point["radii"] == list(radii)]


def error_of(point: Point, error: str) -> float:
    """An error of a point; NaN where it has none, or one below ten times its reference's own."""
    _, entry, figure = ERRORS[error]
    if figure:
        return float(point[entry][FIGURES.index(figure)])
    return nan if point[entry] is None or point[entry] < MARGIN * point["reference"] else float(point[entry])


def known(points: Sequence[Point], error: str) -> list[Point]:
    """The points that have an error."""
    return [point for point in points if not isnan(error_of(point, error))]


def null_of(result: dict[str, Any], point: Point, error: str) -> dict[str, float] | None:
    """The null lines of a point's error; None of sampling errors."""
    if error == "sampling":
        return None
    own = result["estimators"][point["estimator"]]["integrand"]
    integrand = " ".join(own) if error.startswith("own") else "cosine constant"
    null: dict[str, float] = result["nulls"][integrand][result["setup"]["grid"]["radii"].index(point["radii"])]
    return null


def usable(result: dict[str, Any], points: Sequence[Point], error: str) -> list[Point]:
    """The points whose error is known and less than the best constant's."""
    out = []
    for point in known(points, error):
        null = null_of(result, point, error)
        if null is None or error_of(point, error) < null["constant"]:
            out.append(point)
    return out


def pareto_front(points: Sequence[Point], error: str, noise: float = 0.0) -> list[Point]:
    """The points that no other beats in time and error, fastest first; a share ``noise`` is no difference."""
    front: list[Point] = []
    for point in sorted(points, key=lambda p: (p["ms"], error_of(p, error))):
        if not front or error_of(point, error) < (1 - noise) * error_of(front[-1], error):
            while noise and front and point["ms"] <= (1 + noise) * front[-1]["ms"]:
                front.pop()
            front.append(point)
    return front


def describe(point: Point) -> str:
    """A setting in words."""
    samples = "" if point["samples"] is None else f", {point['samples']} sample{'s' * (point['samples'] != 1)}"
    by = "" if point["sampler"] is None else f" by {point['sampler']}"
    blur = f"blur {point['blur']:g}" if point["blur"] else "no blur"
    return f"{point['estimator']}{samples}{by}, {blur}"


def describe_radii(radii: Sequence[float]) -> str:
    """A set of radii in words."""
    return f"R {' and '.join(f'{100 * radius:g} %' for radius in radii)}{' merged' if len(radii) > 1 else ''}"


def margin(result: dict[str, Any], point: Point, error: str) -> str:
    """By how much a point's error is below the best constant's."""
    null = null_of(result, point, error)
    if null is None:
        return ""
    below = 100 * (1 - error_of(point, error) / null["constant"])
    return f", {below:.0f} % below the best constant's {null['constant']:.3g}"


def advice(
    result: dict[str, Any],
    error: str = "visibility",
    max_error: float | None = None,
    max_ms: float | None = None,
    radii: Sequence[float] | None = None,
) -> str:
    """Return one sentence: the fastest setting of at most an error, or that of least error in at most a time.

    The result is that of ``read_result``, the error one of ``ERRORS``, times are of one thread's work, and radii one of
    the run's sets, by default its first. Settings no better than the best constant are not advised. InputError if
    neither or both limits are given, or the run has no such error or radii.
    """
    check_choice("error", error, ERRORS)
    measured = result["setup"]["grid"]["radii"]
    radii = measured[0] if radii is None else list(radii)
    if radii not in measured:
        raise InputError(f"--radii: those measured are {', '.join(describe_radii(each) for each in measured)}")
    if (max_error is None) == (max_ms is None):
        raise InputError("give either --max-error or --max-ms")
    points = points_of(result, radii)
    if not known(points, error):
        raise InputError(f"the figures hold no {error} error")
    front = pareto_front(usable(result, points, error), error)
    where = f"{describe_radii(radii)}, {', '.join(scene['name'] for scene in result['setup']['scenes'])}"
    if not front:
        return f"No measured setting has a {error} error below that of the best constant ({where})."

    def found(point: Point) -> str:
        said = f"{describe(point)}: {point['ms']:.3g} ms, {error} error {error_of(point, error):.3g}"
        return f"{said}{margin(result, point, error)} ({where})."

    if max_error is not None:
        take, best = next((p for p in front if error_of(p, error) <= max_error), None), front[-1]
        limit = f"has a {error} error of at most {max_error:g}: the least is that of"
    else:
        take, best = next((p for p in reversed(front) if p["ms"] <= (max_ms or 0.0)), None), front[0]
        limit = f"that is better than a constant takes at most {max_ms:g} ms: the fastest is"
    return f"Take {found(take)}" if take is not None else f"No measured setting {limit} {found(best)}"
