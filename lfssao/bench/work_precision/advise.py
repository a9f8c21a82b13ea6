"""Advice from the figures of a run: the setting to take for a given error or a given time."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lfssao.core.files import read_json
from lfssao.errors import InputError

Point = dict[str, Any]

ERRORS = ("model", "sampling")
FORMAT = 4


def read_result(path: Path) -> dict[str, Any]:
    """Read the figures of ``lfssao bench work-precision``; InputError if the file cannot be read or holds others."""
    result = read_json(path)
    if not isinstance(result, dict) or result.get("work_precision") != FORMAT:
        raise InputError(f"{path}: it was not written by 'lfssao bench work-precision'")
    return result


def points_of(result: dict[str, Any]) -> list[Point]:
    """All points of a run."""
    return [point for name in result["estimators"] for point in result["estimators"][name]["points"]]


def load_warning(result: dict[str, Any]) -> str:
    """A sentence if other work kept the machine busy during a run and its times are too long; else nothing."""
    parts = [part for part in result["estimators"].values() if "load_average" in part]
    load = max((part["load_average"] for part in parts), default=0.0)
    if load <= result["setup"]["machine"]["threads"] + 0.5:
        return ""
    return f"The machine was loaded, up to {load:.1f}: times are no good."


def usable(points: Sequence[Point], error: str) -> list[Point]:
    """The points whose error of a kind is known."""
    return [p for p in points if p[error] is not None and (error != "sampling" or p["reference_serves"])]


def pareto_front(points: Sequence[Point], error: str) -> list[Point]:
    """The points that no other beats in both time and error of a kind; fastest first."""
    front: list[Point] = []
    for point in sorted(usable(points, error), key=lambda p: (p["ms"], p[error])):
        if not front or point[error] < front[-1][error]:
            front.append(point)
    return front


def describe(point: Point) -> str:
    """A setting in words."""
    samples = "" if point["samples"] is None else f", {point['samples']} sample{'s' * (point['samples'] != 1)}"
    by = "" if point["sampler"] is None else f" by {point['sampler']}"
    radii = f"{point['radii']} {'radius' if point['radii'] == 1 else 'radii'}"
    blur = "blur" if point["blur"] else "no blur"
    return f"{point['estimator']}{samples}{by}, {radii}, {blur}, {point['dtype']}"


def advice(result: dict[str, Any], error: str, max_error: float | None = None, max_ms: float | None = None) -> str:
    """Return one sentence: the fastest setting of at most an error, or that of least error in at most a time.

    The result is that of ``read_result``; the error, an RMSE, is 'model' or 'sampling'. InputError if neither or both
    limits are given, or no point has such an error.
    """
    if (max_error is None) == (max_ms is None):
        raise InputError("give either --max-error or --max-ms")
    front = pareto_front(points_of(result), error)
    if not front:
        raise InputError(f"the figures hold no {error} error")
    where = f"in {result['setup']['width']}x{result['setup']['height']} on {result['setup']['scene']}"
    if max_error is not None:
        take, best = next((p for p in front if p[error] <= max_error), None), front[-1]
        said = f"has a {error} error of at most {max_error:g} {where}: the least is that of"
    else:
        take, best = next((p for p in reversed(front) if p["ms"] <= max_ms), None), front[0]
        said = f"takes at most {max_ms:g} ms {where}: the fastest is"
    if take is None:
        return f"No measured setting {said} {describe(best)}, {best['ms']:.3g} ms, {error} error {best[error]:.3g}."
    return f"Take {describe(take)}: {take['ms']:.3g} ms, {error} error {take[error]:.3g} {where}."
