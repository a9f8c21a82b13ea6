"""The page of a work-precision run, Markdown made from its JSON alone."""

from collections.abc import Iterable, Sequence
from typing import Any

from lfssao.ao.estimators.registry import find_estimator
from lfssao.bench.work_precision import advise
from lfssao.bench.work_precision.advise import Point
from lfssao.bench.work_precision.figures import FIGURES
from lfssao.bench.work_precision.slopes import BEFORE_THE_LIMIT, THEORY, fitted_slope

_TIMES = (0.5, 1.0, 3.0, 10.0)  # limits, milliseconds, for which the page has a sentence


def as_text(result: dict[str, Any]) -> str:
    """Return the whole page: settings to take, null lines, all estimators, fronts by radii, slopes."""
    out = ["# Error against run time", "", _about(result), "", "## Which setting to take", ""]
    for error in advise.ERRORS:
        if advise.points_of(result, error):
            limit_of = {
                advise.advice(result, error, max_ms=limit): limit for limit in reversed(_TIMES)
            }  # each sentence once
            out += [*(f"- At most {limit:g} ms: {sentence}" for sentence, limit in reversed(limit_of.items())), ""]
    out += ["## Without work, and the truth's own error", "", *_nulls(result)]
    out += ["", "## At equal time", "", *_at_equal_time(result)]
    out += ["", "## All estimators", "", *_estimators(result)]
    for error, (title, _, _) in advise.ERRORS.items():
        out += ["", f"## {error}: {title}", "", f"![{title} over the time](work-precision-{error}.png)"]
        for radii in result["setup"]["grid"]["radii"]:
            out += ["", f"Pareto front, {advise.describe_radii(radii)}{_beside(result, radii, error)}:"]
            out += ["", *_front(advise.points_of(result, error, radii))]
    return "\n".join([*out, "", "## Slopes of the sampling error", "", *_slopes(result)])


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return a Markdown table whose columns are aligned; the first is text, the others are numbers."""
    lines = [head, *rows]
    first, *widths = (max(map(len, column)) for column in zip(*lines, strict=True))
    rule = ["-" * first, *("-" * (width - 1) + ":" for width in widths)]
    aligned = [[line[0].ljust(first), *map(str.rjust, line[1:], widths)] for line in lines]
    return ["| " + " | ".join(line) + " |" for line in (aligned[0], rule, *aligned[1:])]


def _about(result: dict[str, Any]) -> str:
    setup = result["setup"]
    machine = result["setup"]["machine"]
    grid = setup["grid"]
    scenes = ", ".join(scene["name"] for scene in setup["scenes"])
    return (
        f"{scenes}, each {grid['width']}x{grid['height']}, on {machine['processor']}, commit "
        f"{str(setup['commit'])[:10]}. Radii are fractions of a scene's diagonal. Errors are over all surface texels, "
        f"scenes and {grid['seeds']} seeds; times, of ao, merge and blur, are the least processor time of one thread, "
        f"and with it the wall time of {machine['threads']} threads. Samples turn as each estimator's do by default. "
        "No setting whose error is not below that of the best constant is on a front or advised."
    )


def _nulls(result: dict[str, Any]) -> list[str]:
    rows = []
    for integrand, lines in result["nulls"].items():
        for radii, line in zip(result["setup"]["grid"]["radii"], lines, strict=True):
            rows.append((f"{integrand}, {advise.describe_radii(radii)}", *(f"{line[k]:.4f}" for k in line)))
    return table(("integrand", "no AO", "best constant", "standard error of the truth"), rows)


def _at_equal_time(result: dict[str, Any]) -> list[str]:
    """Return the least visibility error of each estimator within a time, at the first radii."""
    radii = result["setup"]["grid"]["radii"][0]
    rows = []
    points = advise.points_of(result, "visibility", radii)
    for name in result["estimators"]:
        own = [point for point in points if point["estimator"] == name]
        within = ([p["error"] for p in own if p["ms"] <= limit] for limit in _TIMES)
        rows.append((name, *(f"{min(errors):.4f}" if errors else "-" for errors in within)))
    note = f"The least visibility error within a time, {advise.describe_radii(radii)}, of any sampler, number and blur."
    return [note, "", *table(("estimator", *(f"{limit:g} ms" for limit in _TIMES)), rows)]


def _estimators(result: dict[str, Any]) -> list[str]:
    """Each with the number of samples nearest to its own, at the first radii and with the most blur."""
    radii = result["setup"]["grid"]["radii"][0]
    blur = max(result["setup"]["grid"]["blurs"])
    blurred = [p for p in advise.points_of(result, "visibility", radii) if p["blur"] == blur]
    rows = []
    for name, each in result["estimators"].items():
        points = [p for p in blurred if p["estimator"] == name]
        estimator = find_estimator(name)
        own = estimator.count
        by = estimator.sampling
        point = min(points, key=lambda p: (abs((p["samples"] or own) - own), p["sampler"] != by, p["visibility"]))
        times = f"{point['ms']:.3f} (+{100 * point['spread']:.0f} %)", f"{point['wall_ms']:.3f}"
        for truth, text in ("visibility", "cosine constant"), ("own", " ".join(each["integrand"])):
            rows.append((advise.describe(point), *times, text, *(f"{value:.3f}" for value in point[truth])))
    head = "setting", "ms (spread)", "ms, all threads", "truth", *FIGURES
    note = f"{advise.describe_radii(radii)}; the truth is rays weighted uniformly or by the cosine, with that falloff."
    return [note, "", *table(head, rows)]


def _beside(result: dict[str, Any], radii: Sequence[float], error: str) -> str:
    """Return the null lines of a front; of own errors they differ, and each row has its best constant."""
    if not error.startswith("visibility"):
        return ""
    null = advise.points_of(result, error, radii)[0]["null"]
    return f" (no AO {null['none']}, the best constant {null['constant']}, the truth's own error {null['truth']})"


def _front(points: Sequence[Point]) -> list[str]:
    rows = [
        (advise.describe(p), f"{p['ms']:.3f}", f"{p['wall_ms']:.3f}", f"{p['error']:.5f}", advise.margin(p)[2:])
        for p in advise.pareto_front(points, advise.NOISE)
    ]
    head = "setting", "ms", "ms, all threads", "error", ""
    return table(head, rows) if rows else ["No setting is better than the best constant."]


def _slopes(result: dict[str, Any]) -> list[str]:
    """Return slopes at the first radii without blur; points that their reference does not serve are left out."""
    radii = result["setup"]["grid"]["radii"][0]
    rows = []
    served = [p for p in advise.points_of(result, "sampling", radii) if not p["blur"]]
    everything = advise.points_of(result, "visibility", radii)
    for estimator, sampler in dict.fromkeys((p["estimator"], p["sampler"]) for p in everything if p["sampler"]):
        own = [p for p in served if (p["estimator"], p["sampler"]) == (estimator, sampler)]
        fitted = fitted_slope([p["samples"] for p in own], [p["error"] for p in own])
        measured = "-" if fitted is None else f"{fitted[0]:.2f} +- {fitted[1]:.2f}"
        edge, smooth = (f"{s:g}" for s in THEORY[sampler]) if sampler in THEORY else ("-", "-")
        rows.append((estimator, sampler, measured, edge, smooth, BEFORE_THE_LIMIT.get(sampler, "")))
    note = (
        "Theory is of two dimensions and in the limit; texels and the spread of distances in the ball are in the "
        "measured ones. Errors below ten times their reference's own are in no slope and no front."
    )
    return [note, "", *table(("estimator", "sampler", "slope", "theory, edge", "smooth", ""), rows)]
