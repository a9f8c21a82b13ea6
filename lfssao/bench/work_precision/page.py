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
    """The whole page: settings to take, null lines, all estimators, fronts by radii, slopes."""
    out = ["# Error against run time", "", _about(result), "", "## Which setting to take", ""]
    for error in advise.ERRORS:
        if advise.known(advise.points_of(result), error):
            said = {advise.advice(result, error, max_ms=limit): limit for limit in reversed(_TIMES)}  # each once
            out += [*(f"- At most {limit:g} ms: {sentence}" for sentence, limit in reversed(said.items())), ""]
    out += ["## Without work, and the truth's own error", "", *_nulls(result)]
    out += ["", "## All estimators", "", *_estimators(result)]
    for error, (title, _, _) in advise.ERRORS.items():
        out += ["", f"## {error}: {title}", "", f"![{title} over the time](work-precision-{error}.png)"]
        for radii in result["setup"]["grid"]["radii"]:
            out += ["", f"Pareto front, {advise.describe_radii(radii)}{_beside(result, radii, error)}:"]
            out += ["", *_front(result, radii, error)]
    return "\n".join([*out, "", "## Slopes of the sampling error", "", *_slopes(result)])


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """A Markdown table whose columns are aligned; the first is text, the others are numbers."""
    lines = [list(head), *map(list, rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(head))]
    aligned = [[cell.rjust(width) for cell, width in zip(line, widths, strict=True)] for line in lines]
    for line in aligned:
        line[0] = line[0].strip().ljust(widths[0])
    rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    return ["| " + " | ".join(line) + " |" for line in (aligned[0], rule, *aligned[1:])]


def _about(result: dict[str, Any]) -> str:
    setup, machine = result["setup"], result["setup"]["machine"]
    grid, scenes = setup["grid"], ", ".join(scene["name"] for scene in setup["scenes"])
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


def _estimators(result: dict[str, Any]) -> list[str]:
    """Each with the number of samples nearest to its own, at the first radii and with the most blur."""
    radii, blur = result["setup"]["grid"]["radii"][0], max(result["setup"]["grid"]["blurs"])
    rows = []
    for name, each in result["estimators"].items():
        points = [p for p in advise.points_of(result, radii) if p["estimator"] == name and p["blur"] == blur]
        estimator = find_estimator(name)
        own, by = estimator.count, estimator.sampling
        point = min(points, key=lambda p: (abs((p["samples"] or own) - own), p["sampler"] != by, p["visibility"]))
        times = f"{point['ms']:.3f} (+{100 * point['spread']:.0f} %)", f"{point['wall_ms']:.3f}"
        for truth, text in ("visibility", "cosine constant"), ("own", " ".join(each["integrand"])):
            found = [f"{value:.3f}" for value in point[truth]]
            rows.append((advise.describe(point), *times, text, *found))
    head = "setting", "ms (spread)", "ms, all threads", "truth", *FIGURES
    note = f"{advise.describe_radii(radii)}; the truth is rays weighted uniformly or by the cosine, with that falloff."
    return [note, "", *table(head, rows)]


def _beside(result: dict[str, Any], radii: Sequence[float], error: str) -> str:
    """The null lines of a front; of own errors they differ, and each row has its best constant."""
    null = advise.null_of(result, advise.points_of(result, radii)[0], error)
    if null is None or error.startswith("own"):
        return ""
    return f" (no AO {null['none']}, the best constant {null['constant']}, the truth's own error {null['truth']})"


def _front(result: dict[str, Any], radii: Sequence[float], error: str) -> list[str]:
    front = advise.pareto_front(advise.usable(result, advise.points_of(result, radii), error), error, advise.NOISE)
    if not front:
        return ["No setting is better than the best constant."]
    rows = [
        (
            advise.describe(p),
            f"{p['ms']:.3f}",
            f"{p['wall_ms']:.3f}",
            f"{advise.error_of(p, error):.5f}",
            advise.margin(result, p, error)[2:],
        )
        for p in front
    ]
    return table(("setting", "ms", "ms, all threads", "error", ""), rows)


def _slopes(result: dict[str, Any]) -> list[str]:
    """Slopes at the first radii without blur; points that their reference does not serve are left out."""
    groups: dict[tuple[str, str], list[Point]] = {}
    for point in advise.points_of(result, result["setup"]["grid"]["radii"][0]):
        if point["sampler"] is not None and not point["blur"]:
            groups.setdefault((point["estimator"], point["sampler"]), []).append(point)
    rows = []
    for (estimator, sampler), group in groups.items():
        own = advise.known(group, "sampling")
        fitted = fitted_slope([p["samples"] for p in own], [p["sampling"] for p in own])
        measured = "-" if fitted is None else f"{fitted[0]:.2f} +- {fitted[1]:.2f}"
        edge, smooth = (f"{s:g}" for s in THEORY[sampler]) if sampler in THEORY else ("-", "-")
        rows.append((estimator, sampler, measured, edge, smooth, BEFORE_THE_LIMIT.get(sampler, "")))
    note = (
        "Theory is of two dimensions and in the limit; texels and the spread of distances in the ball are in the "
        "measured ones. Errors below ten times their reference's own are in no slope and no front."
    )
    return [note, "", *table(("estimator", "sampler", "slope", "theory, edge", "smooth", ""), rows)]
