"""Advice from the figures of a run: the setting to take for a given error or a given time."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lfssao.bench.work_precision.figures import FIGURES, MARGIN
from lfssao.errors import InputError
from lfssao.files.whole import read_json

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


def points_of(result: dict[str, Any], error: str, radii: Sequence[float] | None = None) -> list[Point]:
    """Return the points of a run, or of one set of radii, that have an error, with two more entries.

    ``error`` is the error, and ``null`` has its null lines, None of a sampling error. A sampling error below ten times
    its reference's own is none.
    """
    _, entry, figure = ERRORS[error]
    grid = result["setup"]["grid"]
    out = []
    for each in result["estimators"].values():
        integrand = " ".join(each["integrand"]) if entry == "own" else "cosine constant"
        for point in each["points"]:
            found = point[entry]
            null = None
            if radii is not None and point["radii"] != list(radii):
                continue
            if figure:
                found = found[FIGURES.index(figure)]
                null = result["nulls"][integrand][grid["radii"].index(point["radii"])]
            elif found is None or found < MARGIN * point["reference"]:
                continue
            out.append({**point, "error": found, "null": null})
    return out


def pareto_front(points: Sequence[Point], noise: float = 0.0) -> list[Point]:
    """Return the points that neither the best constant nor another point beats, fastest first.

    A share ``noise`` of times and errors is no difference.
    """
    front: list[Point] = []
    better = [point for point in points if point["null"] is None or point["error"] < point["null"]["constant"]]
    for point in sorted(better, key=lambda p: (p["ms"], p["error"])):
        if not front or point["error"] < (1 - noise) * front[-1]["error"]:
            while noise and front and point["ms"] <= (1 + noise) * front[-1]["ms"]:
                front.pop()
            front.append(point)
    return front


def describe(point: Point) -> str:
    """Return a setting in words."""
    samples = "" if point["samples"] is None else f", {point['samples']} sample{'s' * (point['samples'] != 1)}"
    by = "" if point["sampler"] is None else f" by {point['sampler']}"
    blur = f"blur {point['blur']:g}" if point["blur"] else "no blur"
    return f"{point['estimator']}{samples}{by}, {blur}"


def describe_radii(radii: Sequence[float]) -> str:
    """Return a set of radii in words."""
    return f"R {' and '.join(f'{100 * radius:g} %' for radius in radii)}{' merged' if len(radii) > 1 else ''}"


def margin(point: Point) -> str:
    """By how much a point's error is below the best constant's."""
    if point["null"] is None:
        return ""
    constant = point["null"]["constant"]
    return f", {100 * (1 - point['error'] / constant):.0f} % below the best constant's {constant:.3g}"


def advice(
    result: dict[str, Any],
    error: str = "visibility",
    max_error: float | None = None,
    max_ms: float | None = None,
    radii: Sequence[float] | None = None,
) -> str:
    """Return one sentence: the fastest setting of at most an error, or that of least error in at most a time.

    The result is that of ``read_result``, the error one of ``ERRORS``, times are of one thread's work, and radii one of
    the run's sets, by default its first. One of the two limits is given. Settings no better than the best constant are
    not advised. InputError if the run has no such error or radii.
    """
    measured = result["setup"]["grid"]["radii"]
    radii = measured[0] if radii is None else list(radii)
    if radii not in measured:
        raise InputError(f"--radii: those measured are {', '.join(describe_radii(each) for each in measured)}")
    points = points_of(result, error, radii)
    if not points:
        raise InputError(f"the figures hold no {error} error")
    front = pareto_front(points)
    where = f"{describe_radii(radii)}, {', '.join(scene['name'] for scene in result['setup']['scenes'])}"
    if not front:
        return f"No measured setting has a {error} error below that of the best constant ({where})."
    if max_error is not None:
        within = [p for p in front if p["error"] <= max_error]
        nearest = front[-1]
        limit = f"has a {error} error of at most {max_error:g}: the least is that of"
    else:
        within = [p for p in front[::-1] if p["ms"] <= (max_ms or 0.0)]
        nearest = front[0]
        limit = f"that is better than a constant takes at most {max_ms:g} ms: the fastest is"
    verb, p = ("Take", within[0]) if within else (f"No measured setting {limit}", nearest)
    return f"{verb} {describe(p)}: {p['ms']:.3g} ms, {error} error {p['error']:.3g}{margin(p)} ({where})."
